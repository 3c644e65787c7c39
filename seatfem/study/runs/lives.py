"""Fatigue life of both bodies after a run, and curves of the margin over one quantity, from further runs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.after.histories import ReedStress
from impact.files.csv_table import write_csv
from impact.life.places import margin_error
from impact.notices import Progress, Tell, silent
from impact.quantities import finite_or_none, in_time
from seatfem.pictures import stress_plot
from seatfem.structures.fields import peaks, recovery
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.life import (
    STRESS,
    Histories,
    LifeResult,
    as_json,
    asked_keys,
    beam_histories,
    block_from,
    body_of,
    from_json,
    lasting,
    life_keys,
)
from seatfem.study.impacts.plate_stress import PlatePeaks, PlateReedStress
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs import kept, seat_fields, stresses
from seatfem.study.runs.round import Round
from seatfem.study.scene.life import OF_A_CURVE, UNITS, varied

if TYPE_CHECKING:
    from seatfem.pictures.rendering import Picture
    from seatfem.structures.fields.recovery import StressField
    from seatfem.study.runs.seat_stress import SeatStress

OF_SEAT = 12  # hot spots of the seat's surface whose life is computed


@dataclass(frozen=True)
class Stressed:
    """Stress fields in the bodies of a round, for the forces of any run.

    Attributes:
        reed: stress in one face of a plate; ``None`` for other reeds.
        seat: stress in the seat; ``None`` if its life is not computed.
        reed_bar: relative error bar of the stress in a plate; nan if unknown.
    """

    reed: StressField | None
    seat: SeatStress | None
    reed_bar: float = math.nan

    @classmethod
    def from_round(
        cls, done: Round, seat: SeatStress | None, plate: PlatePeaks | None, plate_stress: PlateReedStress | None = None
    ) -> Stressed:
        """Return the stress fields of those bodies of a round whose life the scene asks for."""
        life = done.plan.scene.life
        reed = None if life is None or life.demand() is None or plate is None else plate.field
        after = None if plate_stress is None else plate_stress.found.after_contact
        bar = math.nan if plate_stress is None or after is None else plate_stress.bar / after.value
        return cls(reed, None if life is None or life.demand("seat") is None else seat, bar)


def lives(
    done: Round,
    stressed: Stressed,
    touches: Touches,
    stress: ReedStress | None,
    progress: Progress = silent,
    *,
    with_seat: bool = True,
) -> LifeResult:
    """Return the fatigue life under the forces of one run: the round's own, or that on a spring (``with_seat=False``).

    It is cached for runs with the same forces.
    """
    what = "life of reed and seat" if with_seat and stressed.seat is not None else "life of the reed"

    def compute() -> Mapping[str, Any]:
        return as_json(_compute_life(done, stressed, touches, stress, progress, with_seat=with_seat))

    return from_json(done.plan.scene.life, kept.cached_numbers(done, touches, what, compute))


def _compute_life(
    done: Round,
    stressed: Stressed,
    touches: Touches,
    stress: ReedStress | None,
    progress: Progress,
    *,
    with_seat: bool,
) -> LifeResult:
    scene = done.plan.scene
    progress("life", 0.0)
    plate, first = stressed.reed, block_from(scene.life, scene.turn, touches)
    without_rim = "reed" not in bars_of(done, stressed)
    reed = (
        _beam_histories(done, touches, stress)
        if plate is None
        else _plate_histories(done, plate, touches, first, without_rim=without_rim)
    )
    seat = () if stressed.seat is None or not with_seat else _seat_histories(done, stressed.seat, touches, first)
    life = lasting(scene.life, touches, first, reed, seat, scene.contact.law.of_a_sphere or 0.0)
    progress("life", 1.0)
    return life


def run_keys(done: Round, stressed: Stressed, life: LifeResult, on_spring: LifeResult) -> dict[str, object]:
    """Return for summary.json the life of a run and of its spring baseline, what the scene demands, and error bars."""
    spring_keys = {f"spring_{key}": value for key, value in life_keys(on_spring).items()}
    return life_keys(life) | spring_keys | asked_keys(done.plan.scene.life, life, bars_of(done, stressed))


def bars_of(done: Round, stressed: Stressed) -> dict[str, float]:
    """Return the relative error bars of the stress in reed and seat, where they are known."""
    bars = {}
    if done.left.values.get(STRESS, 0.0) > 0:
        bars["reed"] = done.left.relative(STRESS)
    if math.isfinite(stressed.reed_bar):
        bars["reed"] = stressed.reed_bar
    if (seat := stressed.seat) is not None and math.isfinite(seat.bar):
        bars["seat"] = seat.bar / float(seat.peak.von_mises.max())
    return bars


def _beam_histories(done: Round, touches: Touches, stress: ReedStress | None) -> Histories:
    """Yield the stress histories of a beam reed, if its life is asked for and its bending stress is known."""
    scene = done.plan.scene
    if scene.life is not None and scene.life.demand() is not None:
        for name, history in beam_histories(scene.geometry, done.striker, touches, stress):
            yield f"reed, {name}", history


def _plate_histories(done: Round, field: StressField, touches: Touches, first: int, *, without_rim: bool) -> Histories:
    """Yield the stress histories in both faces at the points of each part of the plate with the largest range, all
    parts or those ``without_rim``: the rim of an averaged patch, whose stress is a model's, counts with a bar only."""
    (field, force), dt = stresses.struck_in(field, done, touches), touches.seat.dt
    regions = stresses.parts_of_plate(done, field.points)
    ranges = peaks.mises_range(field, force, dt, since=first)
    spots = peaks.hottest(ranges, regions)
    spots = spots[regions[spots] != stresses.RIM] if without_rim else spots
    chosen = field.at(spots)
    histories = recovery.tensor_histories(chosen, force, dt)
    for point, part, stress in zip(chosen.points, regions[spots], histories, strict=True):
        place = f"reed, {part}, {_millimetres(point)}"
        yield f"{place}, face away from the seat", stress
        yield f"{place}, face towards the seat", -stress


def _seat_histories(done: Round, seat: SeatStress, touches: Touches, first: int) -> Histories:
    """Yield the stress histories at the surface points with the largest range, and at the points the scene names."""
    force, dt = seat_fields.force_by_port(done, touches), touches.seat.dt
    ranges = peaks.mises_range(seat.field, force, dt, since=first)
    surface = seat.field.at(peaks.hottest(ranges, np.full(len(ranges), "surface"), OF_SEAT))
    for field in (surface, seat.of_points):
        for point, stress in zip(field.points, recovery.tensor_histories(field, force, dt), strict=True):
            yield f"seat, {_millimetres(point)}", stress


def _millimetres(point: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{1e3 * x:.3g}" for x in point) + ") mm"


MARGIN: Final = "life_margin"
NEAR: Final = 1e-3  # relative accuracy of the allowed value, at which the margin is 1
MOST: Final = 20  # most runs of the search for the allowed value
FARTHEST: Final = 20.0  # limit of |log margin|, for margins of zero and infinity


@dataclass(frozen=True)
class MarginCurve:
    """Margins over values of one key, which rise.

    Attributes:
        key, unit: dotted key, and the unit of its values ("" for pure numbers).
        values: values of the key in that unit.
        margins: factors on stress up to failure, ``inf`` where nothing fails.
        bars: error bars of the margins; ``None`` if unknown.
        allowed: first value at which the margin is 1; ``None`` where no two values enclose one.
        margin: key of the margin in summary.json.
    """

    key: str
    unit: str
    values: tuple[float, ...]
    margins: tuple[float, ...]
    bars: tuple[float | None, ...]
    allowed: float | None
    margin: str = MARGIN

    @property
    def label(self) -> str:
        """Return key and unit as the label of an axis."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key


def traced(
    key: str,
    unit: str,
    values: Sequence[float],
    run: Callable[[float], tuple[float, float | None]],
    *,
    margin: str = MARGIN,
    most: int = MOST,
) -> MarginCurve:
    """Compute the margin at rising values, and where two of them enclose a margin of 1, find the value there.

    Brent's method searches to the accuracy `NEAR` or for ``most`` runs, which are added to the curve; at last
    log(margin) is interpolated linearly between the two nearest values.

    Args:
        run: returns margin and error bar at a value.
    """
    known: dict[float, tuple[float, float | None]] = {}

    def excess(value: float) -> float:
        """Return log(margin)."""
        if value not in known:
            known[value] = run(value)
        factor = known[value][0]
        return min(max(math.log(factor), -FARTHEST), FARTHEST) if factor > 0 else -FARTHEST

    for low, high in pairwise(values):
        if excess(low) * excess(high) < 0:
            tolerance = NEAR * max(abs(low), abs(high)) / 2
            scipy.optimize.brentq(excess, low, high, xtol=tolerance, rtol=NEAR / 2, maxiter=most, disp=False)
            break
    points = sorted(known)
    margins, bars = zip(*(known[value] for value in points), strict=True)
    brackets = ((low, high) for low, high in pairwise(points) if excess(low) * excess(high) <= 0)
    allowed = next((low + (high - low) * _zero_between(excess(low), excess(high)) for low, high in brackets), None)
    return MarginCurve(key, unit, tuple(points), margins, bars, allowed, margin)


def _zero_between(low: float, high: float) -> float:
    """Return where a line from ``low`` at 0 to ``high`` at 1 is zero."""
    return low / (low - high) if low != high else 0.0


def life_curves(done: Round, stressed: Stressed, *, price: float, tell: Tell) -> tuple[MarginCurve, ...]:
    """Return the margin curves that [life] asks for; each point is a contact computed by the run's method.

    Args:
        done, stressed: round and stress fields of the run.
        price: time of one contact and its life in the run [s].
        tell: receives the expected time, then a line for each value.
    """
    life = done.plan.scene.life
    if life is None or life.curves is None:
        return ()
    count = life.curves.runs[0]
    least, most = (price * number for number in life.curves.runs)
    tell(f"life.curves: {count} contacts and their lives, more where 1 is crossed: {least:.2g} to {in_time(most)}")
    curves = []
    for name, values in life.curves.asked():
        unit, factor = UNITS[name]
        run = partial(_margin_at, done, stressed, tell, name)
        curves.append(traced(name, unit, [factor * value for value in values], run, most=OF_A_CURVE))
    return tuple(curves)


def again(done: Round, name: str, value: float) -> Round:
    """Return a round computed by the same method at another speed [m/s], tilt [rad] or lift [m]; it keeps the errors
    of ``done``.

    Raises:
        KeyProblem: the scene cannot have this value.
    """
    scene = done.plan.scene.with_geometry(varied(done.plan.scene.geometry, name, value))
    reed = None if done.reed is None else done.reed.greens
    striker = striker_of(scene, done.plan.method.reed.n_modes, reed)
    touches = contact.run_contacts(scene, striker, done.seat.greens, done.result.dt)
    stress = contact.stress_in_run(scene.geometry, striker, touches, coarsely=True)
    return replace(done, plan=replace(done.plan, scene=scene), striker=striker, touches=touches, stress=stress)


def _margin_at(done: Round, stressed: Stressed, tell: Tell, name: str, value: float) -> tuple[float, float | None]:
    start, (unit, factor) = time.perf_counter(), UNITS[name]
    other = again(done, name, value / factor)
    worst = lives(other, stressed, other.touches, other.stress).of_one_axis
    margin, bar, at = math.inf, math.inf, "no place"
    if worst is not None:
        margin, at = worst[0].life.margin, worst[0].at
        bar = margin_error(margin, bars_of(done, stressed).get(body_of(at), math.inf))
    seconds = time.perf_counter() - start
    tell(f"{name} = {value:.4g} {unit}: margin {margin:.4g}, {at}; {in_time(seconds)}")
    return margin, finite_or_none(bar)


def curve_keys(curves: Sequence[MarginCurve]) -> Mapping[str, object]:
    """Return for summary.json the allowed value of each curve; ``None`` where no margin of 1 is enclosed."""
    named = {"speed": ("speed_m_per_s", 1.0), "tilt": ("tilt_deg", 1.0), "lift": ("lift_m", 1e-3)}
    limits = ((*named[curve.key], curve.allowed) for curve in curves)
    return {f"life_allowed_{name}": None if value is None else scale * value for name, scale, value in limits}


def write_curves(curves: Sequence[MarginCurve], folder: Path) -> tuple[Path, ...]:
    """Write margin_over_speed.csv, ...; return the files."""
    return tuple(write_curve(curve, folder / f"margin_over_{curve.key}.csv") for curve in curves)


def curve_pictures(curves: Sequence[MarginCurve]) -> Iterator[Picture]:
    """Yield margin_over_speed.png, ..."""
    for curve in curves:
        draw = partial(_draw, curve)
        yield f"margin_over_{curve.key}.png", draw


def _draw(curve: MarginCurve, path: Path) -> None:
    stress_plot.plot_margins(
        curve.values,
        curve.margins,
        curve.bars,
        path,
        label=curve.label,
        allowed=curve.allowed,
        title=f"Margin on stress over {curve.key}",
    )


def write_curve(curve: MarginCurve, path: Path) -> Path:
    """Write a curve as CSV: value, margin, error bar."""
    rows = zip(curve.values, curve.margins, curve.bars, strict=True)
    return write_csv(path, (curve.label, curve.margin, "error_bar"), rows, digits=9)
