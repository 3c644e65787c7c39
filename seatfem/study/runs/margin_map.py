"""The margin of fatigue of every point of a seat's surface and of a plate's faces: pictures, and files for ParaView."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from impact.life.critical_plane import on_planes
from impact.life.places import Demand, judged
from seatfem.pictures.apart import Picture
from seatfem.pictures.frame_pictures import plot_margin_map
from seatfem.pictures.frames import Frames, margin_frames
from seatfem.pictures.moving import write_surface
from seatfem.pictures.skin import skin_of, skin_of_plate, skin_of_section
from seatfem.structures.fields.around import AnyField, RingField
from seatfem.structures.fields.recovery import mises_range, tensor_histories
from seatfem.structures.fields.solids import elements_of
from seatfem.study.impacts.life import block_from
from seatfem.study.runs.lip_pictures import raising
from seatfem.study.runs.lives import Stressed
from seatfem.study.runs.reed_stress import plate_pushes
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_fields import force_by_port
from seatfem.study.runs.stress_wave import rows_of

PICTURE: Final = "margin_map.png"
SHARE: Final = 0.3
"""Of the largest range of von Mises stress: points below it, with some three times the least margin, are not judged."""


def margin_pictures(done: Round, stressed: Stressed | None) -> list[Picture]:
    """Return margin_map.png, seat_margin.vtu and reed_margin.vtu, of what has a strength and stress in finite elements,
    where [stress] is asked for, too."""
    life = done.plan.scene.life
    if stressed is None or life is None or done.plan.scene.stress is None:
        return []
    try:
        maps = [one for one in (_of_seat(done, stressed), _of_reed(done, stressed)) if one is not None]
    except Exception as problem:  # numbers are known already, as in `gap_of`
        return [(PICTURE, partial(raising, problem))]
    if not maps:
        return []
    several = f" ({life.multiaxial})" if life.multiaxial else f" ({life.criterion}, critical plane)"
    title = f"{done.plan.scene.title or 'Fatigue'}: margin on stress{several}\n"
    files: list[Picture] = [
        (f"{each.title}_margin.vtu", partial(write_surface, each, {"margin": each.colours[0]})) for each in maps
    ]
    return [(PICTURE, partial(plot_margin_map, maps, title=title)), *files]


def margins(field: AnyField, force: Array, dt: float, demand: Demand, *, since: int = 0, faces: bool = False) -> Array:
    """Return factors (P,) on all stresses at which each point of a field uses up its design life, or reaches the limit
    of the criterion of several axes where one is asked for; nan where the range is below `SHARE` of the largest.

    Args:
        field, force, dt: as in `seatfem.structures.fields.recovery.histories`.
        demand: what has to be endured.
        since: step from which on the block repeats.
        faces: of both faces of a plate the smaller.

    Raises:
        LifeError: as `impact.life.places.judged`.
    """
    ranges = mises_range(field, force, dt, since=since)
    near = np.flatnonzero(ranges >= SHARE * ranges.max())
    factors = np.full(len(ranges), np.nan)
    for number, history in zip(near, tensor_histories(field.at(near), force, dt), strict=True):
        block = history[since:]
        factors[number] = min(_margin([each], demand) for each in ((block, -block) if faces else (block,)))
    return factors


def _margin(blocks: Iterable[Array], demand: Demand) -> float:
    named = (("", block) for block in blocks)
    if demand.several_axes is not None:
        return judged(named, demand).tensor_margin or 0.0
    life = judged(on_planes(named), demand).life
    return math.inf if life is None else life.margin


def _of_seat(done: Round, stressed: Stressed) -> Frames | None:
    life, seat = done.plan.scene.life, stressed.seat
    demand = None if life is None else life.demand("seat")
    if seat is None or demand is None:
        return None
    first, force = block_from(done.plan.scene, done.touches), force_by_port(done, done.touches)
    factors = margins(seat.field, force, done.result.dt, demand, since=first)
    nodes = elements_of(seat.mesh).nodes
    if isinstance(seat.field, RingField):
        return _of_ring(seat.field, factors, seat.mesh, nodes)
    assert seat.model is not None
    skin = skin_of(seat.model)
    values = np.full(len(skin.nodes), np.nan)
    values[rows_of(seat.field.points, nodes.T[skin.nodes])] = factors
    return margin_frames("seat", skin, values)


def _of_ring(field: RingField, found: Array, mesh: Any, nodes: Array) -> Frames:
    """Return the map of margins (P,) at a field's points: all around, as what fails first may be anywhere."""
    around = field.angles[0]
    skin = skin_of_section(mesh, nodes[0], nodes[1], np.append(around, around[0] + 2 * np.pi)).spread()
    assert skin.angles is not None
    values = np.full((nodes.shape[1], len(around)), np.nan)
    values[rows_of(field.section, nodes.T)] = found.reshape(field.angles.shape)
    turns = np.round((skin.angles - around[0]) / (2 * np.pi) * len(around)).astype(np.int64) % len(around)
    return margin_frames("seat", skin, values[skin.nodes, turns])


def _of_reed(done: Round, stressed: Stressed) -> Frames | None:
    life, field, reed = done.plan.scene.life, stressed.reed, done.plan.scene.reed.thin_plate
    demand = None if life is None else life.demand()
    if field is None or demand is None or reed is None:
        return None
    mesh, first = reed.plate(done.striker.greens).mesh, block_from(done.plan.scene, done.touches)
    force = plate_pushes(done, done.touches)
    factors = margins(field, force, done.result.dt, demand, since=first, faces=True)
    skin = skin_of_plate(mesh)
    values = np.full(len(skin.nodes), np.nan)
    values[rows_of(field.points, mesh.points[skin.nodes])] = factors
    return margin_frames("reed", skin, values)
