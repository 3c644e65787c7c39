"""The life of the bodies of a run: beams, plates and finite elements give histories of stress in the same form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.after.stresses import ReedStress
from impact.progress import Progress, silent
from seatfem.structures.fields.recovery import StressField, hottest, mises_range, tensor_histories
from seatfem.study.impacts.life import STRESS, Histories, Lasting, asked_keys, block_from, lasting, life_keys, of_beam
from seatfem.study.impacts.life_json import as_json, from_json
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.ended import UNSOUND
from seatfem.study.runs.kept import kept_numbers
from seatfem.study.runs.reed_stress import PlatePeaks, PlateReedStress, parts_of_plate, plate_pushes, struck_in
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_fields import force_by_port
from seatfem.study.runs.seat_stress import SeatStress

OF_SEAT = 12  # points of its surface that are judged


@dataclass(frozen=True)
class Stressed:
    """Fields of stress in the bodies of a round, whatever they are touched by.

    Attributes:
        reed: of a plate, in one of its faces; ``None`` of others.
        seat: ``None`` where its stress is not looked for.
        reed_bar: relative error bar of the stress in a plate; nan where it is not known.
    """

    reed: StressField | None
    seat: SeatStress | None
    reed_bar: float = math.nan

    @classmethod
    def of(
        cls, done: Round, seat: SeatStress | None, plate: PlatePeaks | None, of_reed: PlateReedStress | None = None
    ) -> Stressed:
        """Return the stressed bodies of a round, as far as its life is asked for."""
        life = done.plan.scene.life
        reed = None if life is None or life.demand() is None or plate is None else plate.field
        after = None if of_reed is None else of_reed.found.after_contact
        bar = math.nan if of_reed is None or after is None else of_reed.bar / after.value
        return cls(reed, None if life is None or life.demand("seat") is None else seat, bar)


def lives(
    done: Round,
    stressed: Stressed,
    touches: Touches,
    stress: ReedStress | None,
    progress: Progress = silent,
    *,
    with_seat: bool = True,
) -> Lasting:
    """Return the life under the forces of one run: the round's own, or one on a spring, ``with_seat=False``.

    It is on file where the same run was judged before. ``progress``: hears of the places that are judged.
    """
    what = "life of reed and seat" if with_seat and stressed.seat is not None else "life of the reed"

    def judge() -> Mapping[str, Any]:
        return as_json(_judged(done, stressed, touches, stress, progress, with_seat=with_seat))

    numbers = kept_numbers(done, touches, what, judge)
    with suppress(*UNSOUND):
        return from_json(done.plan.scene, numbers)
    return _judged(done, stressed, touches, stress, progress, with_seat=with_seat)


def _judged(
    done: Round,
    stressed: Stressed,
    touches: Touches,
    stress: ReedStress | None,
    progress: Progress,
    *,
    with_seat: bool,
) -> Lasting:
    scene = done.plan.scene
    progress("life", 0.0)
    beam, plate = of_beam(scene, done.striker, touches, stress), stressed.reed
    reed = beam if plate is None else _of_plate(done, plate, touches)
    seat = () if stressed.seat is None or not with_seat else _of_seat(done, stressed.seat, touches)
    life = lasting(scene, touches, reed, seat)
    progress("life", 1.0)
    return life


def run_keys(done: Round, stressed: Stressed, here: Lasting, there: Lasting) -> dict[str, object]:
    """Return all keys of a run's life: the seat's, the spring's in its place, what was asked, and the error bar."""
    beside = {f"spring_{key}": value for key, value in life_keys(there).items()}
    return life_keys(here) | beside | asked_keys(done.plan.scene, here, bars_of(done, stressed))


def bars_of(done: Round, stressed: Stressed) -> dict[str, float]:
    """Return the relative error bars of the stress in reed and seat, where they are known."""
    bars = {}
    if done.left.values.get(STRESS, 0.0) > 0 and STRESS not in done.without_bar:
        bars["reed"] = done.left.relative(STRESS)
    if math.isfinite(stressed.reed_bar):
        bars["reed"] = stressed.reed_bar
    if (seat := stressed.seat) is not None and math.isfinite(seat.bar):
        bars["seat"] = seat.bar / float(seat.peak.von_mises.max())
    return bars


def _of_plate(done: Round, field: StressField, touches: Touches) -> Histories:
    """Yield the histories in both faces where stress changes most in each part of the plate."""
    force, dt = plate_pushes(done, touches), touches.seat.dt
    field = struck_in(field, done, touches)
    regions = parts_of_plate(done, field.points)
    ranges = mises_range(field, force, dt, since=block_from(done.plan.scene, touches))
    spots = hottest(ranges, regions)
    chosen = field.at(spots)
    for point, part, stress in zip(chosen.points, regions[spots], tensor_histories(chosen, force, dt), strict=True):
        place = f"reed, {part}, {_millimetres(point)}"
        yield f"{place}, face away from the seat", stress
        yield f"{place}, face towards the seat", -stress


def _of_seat(done: Round, seat: SeatStress, touches: Touches) -> Histories:
    """Yield the histories where stress changes most on the surface, and at the points that the scene names."""
    force, dt = force_by_port(done, touches), touches.seat.dt
    ranges = mises_range(seat.field, force, dt, since=block_from(done.plan.scene, touches))
    surface = seat.field.at(hottest(ranges, np.full(len(ranges), "surface"), OF_SEAT))
    for field in (surface, seat.of_points):
        for point, stress in zip(field.points, tensor_histories(field, force, dt), strict=True):
            yield f"seat, {_millimetres(point)}", stress


def _millimetres(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{1e3 * x:.3g}" for x in point) + ") mm"
