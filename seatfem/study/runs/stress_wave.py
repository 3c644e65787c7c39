"""The stress wave of a run, on the seat and in the faces of a plate: pictures, and series for ParaView."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import numpy as np

from impact.after import measures
from impact.bodies.springs import own_coordinates
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from seatfem.pictures.apart import Picture
from seatfem.pictures.frame_pictures import animate_frames, plot_frames
from seatfem.pictures.frames import Frames, wave_frames
from seatfem.pictures.moving import save_moving, write_moving
from seatfem.pictures.skin import Skin, skin_of, skin_of_plate, skin_of_section
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.fields.around import turned
from seatfem.structures.fields.corners import near
from seatfem.structures.fields.recovery import in_frames, response_in_frames, von_mises
from seatfem.structures.fields.response import Response
from seatfem.structures.fields.sites import at_nodes
from seatfem.structures.fields.solids import elements_of
from seatfem.study.runs.lip_pictures import AFTER, BEFORE, raising
from seatfem.study.runs.reed_stress import plate_field, plate_pushes
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_fields import force_by_port
from seatfem.study.runs.seat_stress import SeatStress

PASSES: Final = 2  # of shear waves along the seat, that are shown
UNKNOWN: Final = "\ngrey: beside the contact and sharp corners"


def wave_pictures(done: Round, stress: SeatStress | None) -> list[Picture]:
    """Return stress_wave.gif, .png and .h5, seat_stress.pvd, and the same of a plate that strikes; none where no frames
    are asked for, or nothing touches and no time is stated."""
    settings, title = done.plan.scene.stress, done.plan.scene.title or "Stress wave"
    if stress is None or settings is None or not settings.frames:
        return []
    pictures: list[Picture] = []
    for stem, file, make in (
        ("stress_wave", "seat_stress", partial(seat_wave, done, stress)),
        ("reed_stress_wave", "reed_stress", partial(reed_wave, done)),
    ):
        try:
            wave = make()
        except Exception as problem:  # numbers are known already, as in `gap_of`
            pictures.append((f"{stem}.gif", partial(raising, problem)))
            continue
        if wave is not None:
            pictures.append((f"{stem}.gif", partial(animate_frames, wave, title=title)))
            pictures.append((f"{stem}.png", partial(plot_frames, wave, title=title)))
            pictures.append((f"{file}.pvd", partial(write_moving, wave)))
            pictures.append((f"{stem}.h5", partial(save_moving, wave)))
    return pictures


def seat_wave(done: Round, stress: SeatStress) -> Frames | None:
    """Return the stress wave in the seat, on the mesh of its stress."""
    scene, body, model = done.plan.scene, done.plan.scene.seat.elastic, stress.model
    assert body is not None
    assert scene.stress is not None
    extent, touch = float(np.ptp(stress.mesh.p, axis=1).max()), touch_of(done)
    steps = _steps(done, touch, touch + PASSES * extent / body.slowest)
    if not steps:
        return None
    force, dt, elements, time = (
        force_by_port(done, done.touches),
        done.result.dt,
        elements_of(stress.mesh),
        done.result.time,
    )
    if model is None:
        skin = skin_of_section(elements.mesh, *elements.nodes).spread()
        mises, moved = _around(done, stress, skin, force, steps)
        points = elements.nodes.T[skin.nodes]
        known = ~near(points, stress.drawn.singular, scene.stress.distance)
        return wave_frames("Stress wave in the seat", skin, mises, moved, time[list(steps)], touch, known)
    skin = skin_of(model)
    sites = at_nodes(elements, skin.nodes)
    bandwidth = done.plan.method.seat.bandwidth or 1 / scene.run.filter_width
    unknowns = response_in_frames(
        Response.of(model, dt=dt, bandwidth=bandwidth, damping_ratio=body.damping_ratio), force, dt, steps
    )
    functional = stress.drawn.stress_of(model, sites)
    mises = von_mises(np.moveaxis((functional @ unknowns.T).reshape(len(sites), 6, -1), 2, 0))
    known = ~near(sites.points, stress.drawn.singular, scene.stress.distance)
    moved = np.array([model.expand(each)[:, skin.nodes].T for each in unknowns])
    return wave_frames("Stress wave in the seat", skin, mises, moved, time[list(steps)], touch, known)


def _around(done: Round, stress: SeatStress, skin: Skin, force: Array, steps: range) -> tuple[Array, Array]:
    """Return von Mises stress (F, S) and displacements (F, S, 3) u_r, u_th, u_z of a body of revolution that is struck
    in arcs, at each point of its skin: harmonic by harmonic, so that memory holds their sums at the times shown."""
    assert stress.waves is not None
    assert skin.angles is not None
    nodes, which = np.unique(skin.nodes, return_inverse=True)
    sites = at_nodes(elements_of(stress.mesh), nodes)
    tensors, moved = np.zeros((len(steps), len(skin.nodes), 6)), np.zeros((len(steps), len(skin.nodes), 3))
    for n, model, response, mixing in stress.drawn.harmonics(done, stress.waves):
        functional = stress.drawn.stress_of(model, sites, n)
        for by_sin in (False, True)[: 2 if n else 1]:
            pushes = force @ mixing[:, :, int(by_sin)]
            frames = response_in_frames(response, pushes, done.result.dt, steps)
            stressed = np.asarray(functional @ frames.T).reshape(len(sites), 6, -1)
            for frame, unknowns in enumerate(frames):
                tensors[frame] += turned(stressed[which, :, frame], skin.angles, n, by_sin=by_sin)
                shape = model.expand(unknowns)[:, skin.nodes].T
                moved[frame] += turned(shape, skin.angles, n, by_sin=by_sin)
    return np.asarray(von_mises(tensors)), moved


def reed_wave(done: Round) -> Frames | None:
    """Return the stress wave in the plate that strikes; ``None`` for other reeds."""
    reed = done.plan.scene.reed.thin_plate
    if reed is None or done.striker.greens.modal is None:
        return None
    groups = measures.contact_groups(done.result)
    start, end = groups[0] if len(groups) else (math.nan, math.nan)
    steps = _steps(done, start - BEFORE * (end - start), end + AFTER * (end - start))
    plate = reed.plate(done.striker.greens)
    dofs, shapes = plate.model.dofs, plate.modes.shapes
    if not steps or dofs is None or not isinstance(dofs.mesh, PlateMesh):
        return None
    field, skin = plate_field(done), skin_of_plate(dofs.mesh)
    force, dt = plate_pushes(done, done.touches), done.result.dt
    mises = np.full((len(steps), len(skin.nodes)), np.nan)
    mises[:, rows_of(field.points, dofs.mesh.points[skin.nodes])] = von_mises(in_frames(field, force, dt, steps))
    rows = modal_coordinates(done.striker, force[1 : steps[-1] + 1].T, dt, steps.step)[steps.start // steps.step :]
    rows = own_coordinates(done.striker, rows)
    moved = np.zeros((len(steps), len(skin.nodes), 3))
    bends = np.flatnonzero(plate.modes.omega[: rows.shape[1]])  # a free plate's rigid motion would hide how it bends
    moved[..., 2] = [dofs.expand(shapes[:, bends] @ q[bends])[2][skin.nodes] for q in rows]
    known = np.isfinite(mises).all(axis=0)
    return wave_frames(
        "Stress wave in the faces of the reed", skin, mises, moved, done.result.time[list(steps)], float(start), known,
        UNKNOWN,
    )  # fmt: skip


def touch_of(done: Round) -> float:
    """Time of the first touch of the seat [s]; nan without one."""
    groups = measures.contact_groups(done.result)
    return float(groups[0][0]) if len(groups) else math.nan


def after_touch(done: Round) -> tuple[float, float]:
    """Return the span [s] from the first touch on, as long as the filter, in which stress depends on the step."""
    touch = touch_of(done)
    return touch, touch + done.plan.scene.run.filter_width


def _steps(done: Round, first: float, last: float) -> range:
    """Return the numbers of the steps that are shown, each a multiple of the range's own step; none without a time."""
    settings, dt = done.plan.scene.stress, done.result.dt
    assert settings is not None
    first, last = settings.frames_from or first, settings.frames_until or last
    if math.isnan(first) or math.isnan(last) or first >= last:
        return range(0)
    count, end = len(done.result.time), min(last, float(done.result.time[-1]))
    stride = max(1, round((end - max(first, 0.0)) / dt / max(1, settings.frames - 1)))
    begin = min(max(0, int(first / dt / stride)), (count - 1) // stride)
    return range(begin * stride, min((begin + settings.frames) * stride, count), stride)


def rows_of(points: Array, among: Array) -> Array:
    """Return the rows of ``among`` (n, d) that are the same as points (P, d)."""
    place = {tuple(each): k for k, each in enumerate(among.tolist())}
    return np.array([place[tuple(each)] for each in points.tolist()])
