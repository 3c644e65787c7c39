"""Pictures of a contact along a lip: its forces over place and time, and the plate that lands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from impact.after import measures
from impact.after.along import per_length
from impact.after.result import ImpactResult
from impact.after.spectrum import MOVING_AVERAGE, averaged
from impact.bodies.springs import own_coordinates
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from impact.pictures.landing_marks import landing_marks
from impact.pictures.lip_plots import plot_lip
from seatfem.pictures.apart import Picture
from seatfem.pictures.frame_pictures import animate_frames
from seatfem.pictures.frames import Frames, landing_frames
from seatfem.pictures.moving import save_moving
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.rings import Division
from seatfem.study.impacts.touches import Touches, on_the_ports
from seatfem.study.runs.round import Round
from seatfem.study.scene.lips import closed_line

LANDING: Final = "landing.gif"
FEWEST: Final = 3  # arcs that tell a tilt
FRAMES: Final = 40
BEFORE: Final = 0.15  # of the contact's duration, shown before it
AFTER: Final = 0.35  # and after it
AROUND: Final = 120  # quadrilaterals of a lip, at least


def lip_pictures(done: Round, baseline: Touches, landings: Sequence[Mapping[str, object]] = ()) -> list[Picture]:
    """Return lip.png and, of a plate that was computed, landing.gif and .h5; none where the contact is not along a lip.

    They show the hardest of the ``landings`` on the seat, records as in summary.json; of none, the hardest contact.
    """
    scene, touches = done.plan.scene, done.touches
    division = Division.of(done.seat.greens)
    if touches.parts is None or touches.line is None or division.arcs < FEWEST:
        return []
    shape = scene.seat.lip(division.arcs)
    assert shape is not None
    lip = by_arc(touches.parts, division)
    springs = None if baseline.parts is None else by_arc(baseline.parts, division)
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
    except Exception as problem:  # numbers are known already, as in `gap_of`
        return [*pictures, (LANDING, partial(raising, problem))]
    if landing is not None:
        pictures.append((LANDING, partial(animate_frames, landing, title=title)))
        pictures.append(("landing.h5", partial(save_moving, landing)))
    return pictures


def raising(problem: Exception, path: Path) -> None:
    """Raise, in place of a picture that cannot be made, what kept it."""
    raise problem


def by_arc(parts: ImpactResult, division: Division) -> ImpactResult:
    """Return a lip's parts with the rings of each arc as one: sums of forces, means of displacements and gaps."""
    shares = division.shares.reshape(division.arcs, division.rings) * division.arcs

    def joined(values: Array, weights: Array) -> Array:
        return np.asarray((values.reshape(len(values), division.arcs, division.rings) * weights).sum(axis=2))

    return replace(
        parts,
        force=joined(parts.force, np.ones_like(shares)),
        gap=joined(parts.gap, shares),
        striker_displacement=joined(parts.striker_displacement, shares),
        target_displacement=joined(parts.target_displacement, shares),
    )


def landing_of(done: Round, lip: ImpactResult, landings: Sequence[Mapping[str, object]] = ()) -> Frames | None:
    """Return the plate over the lip during its hardest landing, without ``landings`` during its hardest contact.

    ``None`` of what is no plate with its modes, of loads that the march alone knows, under a preload, and without
    contact.
    """
    scene, reed, touches = done.plan.scene, done.reed, done.touches
    shape = scene.seat.lip(lip.force.shape[1])
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
    forces = on_the_ports(scene, done.striker.greens, done.seat.greens, touches)[1:].T
    coordinates = own_coordinates(done.striker, modal_coordinates(done.striker, forces, dt, stride)[rows])
    deflection = np.array([dofs.expand(shapes @ q)[2] for q in coordinates])
    centre = np.asarray(plate_reed.geometry().centre) + scene.contact.offset
    inner, outer = shape.edge_lines(shape.arcs * math.ceil(AROUND / shape.arcs))
    steps, width = stride * np.arange(begin, begin + len(deflection)), scene.run.filter_width
    total = averaged(touches.seat.force[1:], dt, width, MOVING_AVERAGE)
    return landing_frames(
        dofs.mesh,
        deflection,
        touches.seat.time[steps],
        (centre + inner, centre + outer),
        -lip.gap[0],
        per_length(lip.force, dt, width, shape.lengths)[steps],
        total[steps],
        averaged=f"forces mean over {1e6 * width:g} µs and each of {lip.force.shape[1]} lip segments",
        pieces=shape.pieces,
    )
