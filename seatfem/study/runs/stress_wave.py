"""Pictures over time: forces along a lip, the landing plate, stress waves in both bodies, series for ParaView."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from impact.after import histories, measures, result
from impact.bodies.loads import find_own_coordinates
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from impact.pictures.lip_plots import landing_marks, plot_lip
from seatfem.pictures import cell_grid, moving
from seatfem.pictures.frames import Frames, landing_frames, wave_frames
from seatfem.pictures.rendering import Picture
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.fields import sites, solids
from seatfem.structures.fields.recovery import Response, in_frames, response_in_frames, von_mises
from seatfem.structures.fields.sites import at_nodes
from seatfem.structures.rings import Division
from seatfem.study.impacts.touches import Touches, on_the_ports
from seatfem.study.runs import seat_fields, seat_stress, stresses
from seatfem.study.runs.pictures import raising
from seatfem.study.runs.round import Round
from seatfem.study.scene.lips import closed_line

LANDING: Final = "landing.gif"
FEWEST: Final = 3  # fewest arcs of a lip for which its pictures are drawn
FRAMES: Final = 40  # frames of the landing
BEFORE: Final = 0.15  # time shown before the contact, in its durations
AFTER: Final = 0.35  # time shown after the contact, in its durations
AROUND: Final = 120  # fewest quadrilaterals around a lip


def lip_pictures(done: Round, baseline: Touches, landings: Sequence[Mapping[str, object]] = ()) -> list[Picture]:
    """Return lip.png and, for a plate, landing.gif and landing.h5; none if the contact is not along a lip.

    They show the hardest of the ``landings`` on the seat (as in summary.json) or, without any, the hardest contact.
    """
    scene, touches = done.plan.scene, done.touches
    division = Division.from_greens(done.seat.greens)
    if touches.parts is None or touches.line is None or division.arcs < FEWEST:
        return []
    shape = scene.geometry.struck(division.arcs)
    assert shape is not None
    lip = by_arc(touches, division)
    springs = None if baseline.line is None else by_arc(baseline, division)
    title, width = scene.title or "Contact along the lip", scene.run.filter_width
    draw = partial(
        plot_lip,
        radius=closed_line(shape),
        share=touches.line.share,
        filter_width=width,
        title=title,
        landings=landings,
    )
    pictures: list[Picture] = [("lip.png", partial(draw, lip, springs))]
    try:
        landing = landing_of(done, lip, landings)
    except Exception as problem:  # all numbers are on file: the missing picture is reported instead
        return [*pictures, (LANDING, partial(raising, problem))]
    if landing is not None:
        pictures.append((LANDING, partial(moving.animate_frames, landing, title=title)))
        pictures.append(("landing.h5", partial(moving.save_moving, landing)))
    return pictures


def by_arc(touches: Touches, division: Division) -> result.ImpactResult:
    """Return a lip's contacts with the rings of each arc joined: sums of forces, means of gaps, without displacements;
    without gaps where the parts are not known."""
    rows, line, parts = touches.seat.rows, touches.line, touches.parts
    assert line is not None
    gap = np.zeros((len(rows.ends), 0))
    if parts is not None:
        shares = division.shares.reshape(division.arcs, division.rings) * division.arcs
        gap = np.einsum("nar,ar->na", parts.rows.gap.reshape(-1, *shares.shape), shares)
    rows = replace(rows, force=line.force, gap=gap, film=line.film, striker_displacement=None, target_displacement=None)
    return replace(touches.seat, rows=rows)


def landing_of(done: Round, lip: result.ImpactResult, landings: Sequence[Mapping[str, object]] = ()) -> Frames | None:
    """Return frames of the plate over the lip during its hardest landing, or without ``landings`` its hardest contact.

    ``None`` if the reed is no plate, its modes are not at hand, a load depends on the lift, or there is a preload or no
    contact.
    """
    scene, reed, touches = done.plan.scene, done.reed, done.touches
    shape = scene.geometry.struck(lip.force.shape[1])
    _, (start, end) = measures.hardest_group(touches.seat, scene.run.filter_width)
    if marks := landing_marks(landings):
        start, end = marks[0].start, marks[0].end
    if (plate_reed := scene.reed.thin_plate) is None or reed is None:
        return None
    if shape is None or math.isnan(start) or scene.is_blown_by_lift or scene.contact.preload:
        return None
    plate, modal, dt = plate_reed.plate(reed.greens), done.striker.greens.modal, touches.seat.dt
    dofs, shapes = plate.model.dofs, plate.modes.shapes
    if dofs is None or not isinstance(dofs.mesh, PlateMesh) or modal is None or len(modal.omega) != shapes.shape[1]:
        return None
    last = len(touches.seat.time) - 1
    first = max(0.0, start - BEFORE * (end - start))
    stride = max(1, math.ceil((min(end + AFTER * (end - start), last * dt) - first) / dt / (FRAMES - 1)))
    begin = min(int(first / dt / stride), last // stride)
    rows = slice(begin, begin + FRAMES)
    forces = on_the_ports(scene.geometry, done.striker.greens, done.seat.greens, touches)[1:].T
    coordinates = find_own_coordinates(done.striker, modal_coordinates(done.striker, forces, dt, stride)[rows])
    deflection = np.array([dofs.expand(shapes @ q)[2] for q in coordinates])
    centre = np.asarray(plate_reed.geometry().centre) + scene.contact.offset
    inner, outer = shape.edge_lines(shape.arcs * math.ceil(AROUND / shape.arcs))
    steps, width = stride * np.arange(begin, begin + len(deflection)), scene.run.filter_width
    total = histories.averaged(touches.seat.force[1:], dt, width, histories.MOVING_AVERAGE)
    return landing_frames(
        dofs.mesh,
        deflection,
        touches.seat.time[steps],
        (centre + inner, centre + outer),
        -lip.gap[0],
        histories.per_length(lip.force, dt, width, shape.lengths)[steps],
        total[steps],
        averaged=f"forces mean over {1e6 * width:g} µs and each of {lip.force.shape[1]} lip segments",
        pieces=shape.pieces,
    )


PASSES: Final = 2  # duration of the frames, in travel times of a shear wave along the seat
UNKNOWN: Final = "\ngrey: beside the contact and sharp corners"


def wave_pictures(done: Round, stress: seat_stress.SeatStress) -> list[Picture]:
    """Return stress_wave.gif, .png and .h5, seat_stress.pvd, and likewise for a plate that strikes; none if the scene
    asks for no frames, or if nothing touches and no times are stated."""
    settings, title = done.plan.scene.stress, done.plan.scene.title or "Stress wave"
    if settings is None or not settings.frames:
        return []
    pictures: list[Picture] = []
    for stem, file, make in (
        ("stress_wave", "seat_stress", partial(seat_wave, done, stress)),
        ("reed_stress_wave", "reed_stress", partial(reed_wave, done)),
    ):
        try:
            wave = make()
        except Exception as problem:  # all numbers are on file: the missing picture is reported instead
            pictures.append((f"{stem}.gif", partial(raising, problem)))
            continue
        if wave is not None:
            pictures.append((f"{stem}.gif", partial(moving.animate_frames, wave, title=title)))
            pictures.append((f"{stem}.png", partial(moving.plot_frames, wave, title=title)))
            pictures.append((f"{file}.pvd", partial(moving.write_moving, wave)))
            pictures.append((f"{stem}.h5", partial(moving.save_moving, wave)))
    return pictures


def seat_wave(done: Round, stress: seat_stress.SeatStress) -> Frames | None:
    """Return frames of the stress wave in the seat, on the mesh of its stress; ``None`` without times to show."""
    scene, body, model = done.plan.scene, done.plan.scene.seat.elastic, stress.model
    assert body is not None
    assert scene.stress is not None
    extent, touch = float(np.ptp(stress.mesh.p, axis=1).max()), done.touch
    steps = _steps(done, touch, touch + PASSES * extent / body.slowest)
    if not steps:
        return None
    force, dt, elements, time = (
        seat_fields.force_by_port(done, done.touches),
        done.result.dt,
        solids.elements_of(stress.mesh),
        done.result.time,
    )
    if model is None:
        skin = cell_grid.skin_of_section(elements.mesh, *elements.nodes).spread()
        mises, moved = _around(done, stress, skin, force, steps)
        points = elements.nodes.T[skin.nodes]
        known = ~sites.near(points, stress.drawn.singular, scene.stress.distance)
        return wave_frames("Stress wave in the seat", skin, mises, moved, time[list(steps)], touch, known)
    skin = cell_grid.skin_of(model)
    nodal = at_nodes(elements, skin.nodes)
    response = Response.from_model(model, bandwidth=stress.drawn.bandwidth, damping_ratio=body.damping_ratio)
    unknowns = response_in_frames(response, force, dt, steps)
    functional = stress.drawn.stress_of(model, nodal)
    mises = von_mises(np.moveaxis((functional @ unknowns.T).reshape(len(nodal), 6, -1), 2, 0))
    known = ~sites.near(nodal.points, stress.drawn.singular, scene.stress.distance)
    moved = np.array([model.expand(each)[:, skin.nodes].T for each in unknowns])
    return wave_frames("Stress wave in the seat", skin, mises, moved, time[list(steps)], touch, known)


def _around(
    done: Round, stress: seat_stress.SeatStress, skin: cell_grid.Skin, force: Array, steps: range
) -> tuple[Array, Array]:
    """Return von Mises stress (F, S) and displacements (F, S, 3) u_r, u_th, u_z of a body of revolution struck on arcs,
    in F frames at S points of its skin: harmonics are summed one by one to save memory."""
    assert stress.waves is not None
    assert skin.angles is not None
    nodes, which = np.unique(skin.nodes, return_inverse=True)
    sites = at_nodes(solids.elements_of(stress.mesh), nodes)
    tensors, moved = np.zeros((len(steps), len(skin.nodes), 6)), np.zeros((len(steps), len(skin.nodes), 3))
    for n, model, response, mixing in stress.drawn.harmonics(stress.waves):
        functional = stress.drawn.stress_of(model, sites, n)
        for by_sin in (False, True)[: 2 if n else 1]:
            pushes = force @ mixing[:, :, int(by_sin)]
            frames = response_in_frames(response, pushes, done.result.dt, steps)
            stressed = np.asarray(functional @ frames.T).reshape(len(sites), 6, -1)
            for frame, unknowns in enumerate(frames):
                tensors[frame] += solids.turned(stressed[which, :, frame], skin.angles, n, by_sin=by_sin)
                shape = model.expand(unknowns)[:, skin.nodes].T
                moved[frame] += solids.turned(shape, skin.angles, n, by_sin=by_sin)
    return np.asarray(von_mises(tensors)), moved


def reed_wave(done: Round) -> Frames | None:
    """Return frames of the stress wave in the plate that strikes; ``None`` for other reeds."""
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
    field, skin = stresses.plate_field(done), cell_grid.skin_of_plate(dofs.mesh)
    force, dt = stresses.plate_pushes(done, done.touches), done.result.dt
    mises = np.full((len(steps), len(skin.nodes)), np.nan)
    mises[:, rows_of(field.points, dofs.mesh.points[skin.nodes])] = von_mises(in_frames(field, force, dt, steps))
    rows = modal_coordinates(done.striker, force[1 : steps[-1] + 1].T, dt, steps.step)[steps.start // steps.step :]
    rows = find_own_coordinates(done.striker, rows)
    moved = np.zeros((len(steps), len(skin.nodes), 3))
    bends = np.flatnonzero(plate.modes.omega[: rows.shape[1]])  # without rigid-body modes, which would hide the bending
    moved[..., 2] = [dofs.expand(shapes[:, bends] @ q[bends])[2][skin.nodes] for q in rows]
    known = np.isfinite(mises).all(axis=0)
    return wave_frames(
        "Stress wave in the faces of the reed", skin, mises, moved, done.result.time[list(steps)], float(start), known,
        UNKNOWN,
    )  # fmt: skip


def after_touch(done: Round) -> tuple[float, float]:
    """Return start and end [s] of one filter width after the first touch, in which stress depends on the time step."""
    return done.touch, done.touch + done.plan.scene.run.filter_width


def _steps(done: Round, first: float, last: float) -> range:
    """Return the step numbers of the frames, multiples of the range's step; an empty range without times to show."""
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
    """Return for each of the points (P, d) the number of the identical row of ``among`` (n, d)."""
    place = {tuple(each): k for k, each in enumerate(among.tolist())}
    return np.array([place[tuple(each)] for each in points.tolist()])
