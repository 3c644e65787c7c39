"""Pictures over time: forces along a lip, the landing plate, stress waves in both bodies, series for ParaView; the
largest stress of a seat."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from impact.after import histories, measures, result
from impact.bodies.loads import find_own_coordinates
from impact.march.motion import modal_coordinates
from impact.pictures.lip_plots import landing_marks, plot_lip
from impact.quantities import text
from seatfem.pictures import moving
from seatfem.pictures.frames import Frames, landing_frames, peak_frames
from seatfem.pictures.rendering import Picture
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.rings import Division
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.body_stress import BodyStress
from seatfem.study.runs.pictures import raising
from seatfem.study.runs.reed_stress import AFTER, BEFORE
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_stress import SeatStress
from seatfem.study.scene.lips import closed_line
from seatfem.units import place_words

LANDING: Final = "landing.gif"
FEWEST: Final = 3  # fewest arcs of a lip for which its pictures are drawn
FRAMES: Final = 40  # frames of the landing
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
    lip = join_rings(touches, division)
    springs = None if baseline.line is None else join_rings(baseline, division)
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


def join_rings(touches: Touches, division: Division) -> result.ImpactResult:
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
    forces = done.strike.pushes[1:].T
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


def peak_pictures(stress: SeatStress, title: str) -> list[Picture]:
    """Return seat_stress.png and seat_stress.vtu, the largest von Mises stress at each place of the surface and its
    time; none where the scene asks for named points alone."""
    if not stress.known.asked.surface:
        return []
    peak, where = stress.peak, stress.where
    try:
        skin, largest = stress.map_to_skin(peak.von_mises)
        times = stress.map_to_skin(peak.von_mises_time)[1]
    except Exception as problem:  # all numbers are on file: the missing picture is reported instead
        return [("seat_stress.png", partial(raising, problem))]
    time, value = float(peak.von_mises_time[where]), float(peak.von_mises[where])
    words = f"{text(value, 'Pa')} at {place_words(stress.sites[where], 'seat')}, t = {text(time, 's', 4)}"
    body = peak_frames(skin, largest, words)
    fields = {"largest von Mises [Pa]": largest[skin.which], "its time [s]": times[skin.which]}
    return [
        ("seat_stress.png", partial(moving.plot_frames, body, title=title)),
        ("seat_stress.vtu", partial(moving.write_surface, body, fields)),
    ]


WAVES: Final = {"seat": ("stress_wave", "seat_stress"), "reed": ("reed_stress_wave", "reed_stress")}
"""Beginnings of the names of pictures, and of the files for ParaView."""


def wave_pictures(done: Round, bodies: Sequence[BodyStress]) -> list[Picture]:
    """Return stress_wave.gif, .png and .h5, seat_stress.pvd, and likewise for a plate that strikes; none if the scene
    asks for no frames, or if nothing touches and no times are stated."""
    settings, title = done.plan.scene.stress, done.plan.scene.title or "Stress wave"
    if settings is None or not settings.frames:
        return []
    pictures: list[Picture] = []
    for body in bodies:
        stem, file = WAVES[body.role]
        try:
            wave = wave_of(done, body)
        except Exception as problem:  # all numbers are on file: the missing picture is reported instead
            pictures.append((f"{stem}.gif", partial(raising, problem)))
            continue
        if wave is not None:
            pictures.append((f"{stem}.gif", partial(moving.animate_frames, wave, title=title)))
            pictures.append((f"{stem}.png", partial(moving.plot_frames, wave, title=title)))
            pictures.append((f"{file}.pvd", partial(moving.write_moving, wave)))
            pictures.append((f"{stem}.h5", partial(moving.save_moving, wave)))
    return pictures


def wave_of(done: Round, body: BodyStress) -> Frames | None:
    """Return frames of the stress wave in a body; ``None`` in closed form, and without times to show."""
    steps = _steps(done, *body.wave_span)
    return body.wave(steps) if steps else None


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
