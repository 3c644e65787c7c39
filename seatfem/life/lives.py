"""Fatigue life of both bodies after a run, the error bar of its margin, and curves of the margin over one
quantity, from further runs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import scipy

from impact.files.csv_table import write_csv
from impact.greens.base import Array
from impact.life.places import Demand, judged, margin_error, resolve_on_planes, thin_history
from impact.notices import Progress, Tell, ignore, silent
from impact.quantities import finite_or_none, in_time
from impact.runs.variations import SAFETY
from seatfem.life.assess import (
    LifeResult,
    asked_keys,
    assess_life,
    block_from,
    body_of,
    from_json,
    life_keys,
    life_notes,
)
from seatfem.life.maps import margin_pictures, plot_margins
from seatfem.life.table import OF_A_CURVE, UNITS, LifeTable, varied
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.contact import RunError
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.touches import force_of
from seatfem.study.runs import kept
from seatfem.study.runs.afterwards import FinishedRun
from seatfem.study.runs.body_stress import BodyStress
from seatfem.study.runs.error_bars import error_bars_of
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.round import Round
from seatfem.study.scene import load_scene
from seatfem.study.scene.wings import Assessed
from seatfem.units import UnitError, number_and_unit

if TYPE_CHECKING:
    from seatfem.pictures.rendering import Picture


BELOW_CONTACT: Final = (
    "The stress below the Hertzian contact was not judged; it may be many times the one that was: state "
    "life.contact_criterion and life.contact_modulus."
)


def assess(life: LifeTable, run: FinishedRun) -> Assessed:
    """Return the fatigue life of the bodies of a run, and the curves of its margin that [life] asks for."""
    done = run.done
    with run.watch("life"):
        result = lives(life, done, run.bodies, done.strike, run.progress)
        on_spring = lives(life, done, run.bodies[:1], run.on_spring, run.progress)
        keys = run_keys(life, run.bodies, result, on_spring)
        bar = margin_bar(life, done, run.bodies[0], result, run.progress)
        keys |= {f"error_bar_{MARGIN}": bar} if math.isfinite(bar) else {}
    if result.below is None and done.plan.scene.contact.law.sphere_stiffness:
        keys |= {"life_not_judged": BELOW_CONTACT}
    if result.below is not None and result.below.worst.tensor_at:
        bar = contact_margin_bar(done, result.below.worst.tensor_margin)
        keys |= {"error_bar_life_contact_margin": finite_or_none(bar)}
    run.keep(keys)
    with run.watch("life curves"):
        price = done.spent.get("contact", 0.0) + run.watch.stages["life"] / 2
        bars = margin_bars_of(run.bodies, result, keys.get(f"error_bar_{MARGIN}"))
        curves = life_curves(life, done, run.bodies, bars, price=price, tell=run.tell)
        files = tuple(write_curve(curve, run.folder / f"margin_over_{curve.key}.csv") for curve in curves)

    def pictures() -> list[Picture]:
        return [*margin_pictures(life, done, run.bodies), *curve_pictures(curves)]

    return Assessed({**keys, **curve_keys(curves)}, files, life_notes(life, result), pictures)


def contact_margin_bar(done: Round, margin: float) -> float:
    """Return the error bar of the ``margin`` below a Hertzian contact from that of its largest force F, as the stress
    varies as F^(1/3); ``inf`` where the force's error is as large as the force."""
    errors, _ = error_bars_of(done, lambda run: {"force": float(force_of(run).max())})
    share = errors.bar("force") / float(done.result.force.max())
    return margin_error(margin, 1 - (1 - share) ** (1 / 3) if share < 1 else 1.0)


def lives(
    life: LifeTable, done: Round, bodies: Sequence[BodyStress], strike: Strike, progress: Progress = silent
) -> LifeResult:
    """Return the fatigue life of bodies under the forces of one run: the round's own, or that on another seat.

    It is cached for runs with the same forces.
    """
    with_seat = life.demand("seat") is not None and any(each.role == "seat" for each in bodies)

    def compute() -> Mapping[str, Any]:
        progress("life", 0.0)
        first = block_from(life, done.plan.scene.turn, strike.touches)
        histories = {each.role: each.under(strike).histories(first) for each in bodies}
        sphere = done.plan.scene.contact.law.sphere_stiffness
        result = assess_life(life, strike.touches, first, histories["reed"], histories.get("seat", ()), sphere)
        progress("life", 1.0)
        return asdict(result)

    what = "life of reed and seat" if with_seat else "life of the reed"
    return from_json(kept.cached_numbers(done, strike.touches, what, compute))


def run_keys(
    life: LifeTable, bodies: Sequence[BodyStress], result: LifeResult, on_spring: LifeResult
) -> dict[str, object]:
    """Return for summary.json the life of a run and of its spring baseline, what the scene demands, and error bars."""
    spring_keys = {f"spring_{key}": value for key, value in life_keys(on_spring).items()}
    return life_keys(result) | spring_keys | asked_keys(life, result, bars_of(bodies))


def bars_of(bodies: Sequence[BodyStress]) -> dict[str, float]:
    """Return the relative error bars of the stress in bodies, where they are known."""
    return {body.role: body.relative_bar for body in bodies if not math.isnan(body.relative_bar)}


def margin_bars_of(bodies: Sequence[BodyStress], result: LifeResult, bar: object) -> dict[str, float]:
    """Return the relative error bars of the margins of bodies: ``bar`` over the least margin in the body that has it,
    in others that at a stress lower by its bar."""
    bars = {role: margin_error(1.0, relative) for role, relative in bars_of(bodies).items()}
    if (worst := result.of_one_axis) is not None and isinstance(bar, float) and worst.worst.life.margin > 0:
        bars[body_of(worst.worst.at)] = bar / worst.worst.life.margin
    return bars


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
        bars: error bars of the margins; nan if unknown.
        allowed: first value at which the margin is 1; nan where no two values enclose one.
        margin: key of the margin in summary.json.
    """

    key: str
    unit: str
    values: tuple[float, ...]
    margins: tuple[float, ...]
    bars: tuple[float, ...]
    allowed: float
    margin: str = MARGIN

    @property
    def label(self) -> str:
        """Return key and unit as the label of an axis."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key


def traced(
    key: str,
    unit: str,
    values: Sequence[float],
    run: Callable[[float], tuple[float, float]],
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
    known: dict[float, tuple[float, float]] = {}

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
    allowed = next((low + (high - low) * _zero_between(excess(low), excess(high)) for low, high in brackets), math.nan)
    return MarginCurve(key, unit, tuple(points), margins, bars, allowed, margin)


def _zero_between(low: float, high: float) -> float:
    """Return where a line from ``low`` at 0 to ``high`` at 1 is zero."""
    return low / (low - high) if low != high else 0.0


def life_curves(
    life: LifeTable, done: Round, bodies: Sequence[BodyStress], bars: Mapping[str, float], *, price: float, tell: Tell
) -> tuple[MarginCurve, ...]:
    """Return the margin curves that [life] asks for; each point is a contact computed by the run's method, with the
    relative error of the run's own margin.

    Args:
        done, bodies: round and stress of the run.
        bars: `margin_bars_of` these bodies.
        price: time of one contact and its life in the run [s].
        tell: receives the expected time, then a line for each value.
    """
    if life.curves is None:
        return ()
    count = life.curves.runs[0]
    least, most = (price * number for number in life.curves.runs)
    tell(f"life.curves: {count} contacts and their lives, more where 1 is crossed: {least:.2g} to {in_time(most)}")
    curves = []
    for name, values in life.curves.asked():
        unit, factor = UNITS[name]
        run = partial(_margin_at, life, done, bodies, bars, tell, name)
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
    other = replace(done, plan=replace(done.plan, scene=scene), striker=striker, touches=touches)
    return replace(other, stress=other.strike.largest_stress(coarsely=True))


def _margin_at(
    life: LifeTable,
    done: Round,
    bodies: Sequence[BodyStress],
    bars: Mapping[str, float],
    tell: Tell,
    name: str,
    value: float,
) -> tuple[float, float]:
    start, (unit, factor) = time.perf_counter(), UNITS[name]
    other = again(done, name, value / factor)
    worst = lives(life, other, bodies, other.strike).of_one_axis
    margin, bar, at = math.inf, math.inf, "no place"
    if worst is not None:
        margin, at = worst.worst.life.margin, worst.worst.at
        bar = margin * bars.get(body_of(at), math.inf)
    seconds = time.perf_counter() - start
    tell(f"{name} = {value:.4g} {unit}: margin {margin:.4g}, {at}; {in_time(seconds)}")
    return margin, bar if math.isfinite(bar) else math.nan


def curve_keys(curves: Sequence[MarginCurve]) -> Mapping[str, object]:
    """Return for summary.json the allowed value of each curve; ``None`` where no margin of 1 is enclosed."""
    named = {"speed": ("speed_m_per_s", 1.0), "tilt": ("tilt_deg", 1.0), "lift": ("lift_m", 1e-3)}
    limits = ((*named[curve.key], curve.allowed) for curve in curves)
    return {f"life_allowed_{name}": finite_or_none(scale * value) for name, scale, value in limits}


def curve_pictures(curves: Sequence[MarginCurve]) -> Iterator[Picture]:
    """Yield margin_over_speed.png, ..."""
    for curve in curves:
        numbers, title = (curve.values, curve.margins, curve.bars), f"Margin on stress over {curve.key}"
        draw = partial(plot_margins, *numbers, label=curve.label, allowed=curve.allowed, title=title)
        yield f"margin_over_{curve.key}.png", draw


def write_curve(curve: MarginCurve, path: Path) -> Path:
    """Write a curve as CSV: value, margin, error bar."""
    rows = zip(curve.values, curve.margins, curve.bars, strict=True)
    return write_csv(path, (curve.label, curve.margin, "error_bar"), rows, digits=9)


def margin_curve(
    scene: Path | str,
    key: str,
    values: Sequence[str | float],
    folder: Path | str,
    *,
    margin: str = "life_margin",
    tell: Tell = ignore,
) -> MarginCurve:
    """Run a scene over values of one key, and where two of them enclose a margin of 1, find the value there.

    Each value is a complete run with error bars, without pictures, in its own folder; the runs of the search for the
    allowed value (Brent's method, to `NEAR`) are added to the curve. The table is written to margin.csv.

    Args:
        scene: file with [life].
        key: dotted key, such as "reed.release.velocity" or "load.0.gravity".
        values: at least two, written as in the file and in one unit, such as "2 m/s" or, for a ratio, 0.1.
        folder: parent of the runs' folders.
        margin: "life_margin", or "life_speed_margin".
        tell: receives a line for each run.

    Raises:
        RunError: fewer than two values, several units, or a scene without this margin.
        SceneError: the scene cannot have the key or the value. Also what runs raise.
    """
    numbers, unit = _convert_to_one_unit(key, values)

    def run(value: float) -> tuple[float, float]:
        written: object = f"{value!r} {unit}" if unit else value
        result = _one_run(scene, key, written, Path(folder) / f"{value:.9g}", margin)
        tell(f"{key} = {written}: {margin} {result[0]:.4g}")
        return result

    curve = traced(key, unit, numbers, run, margin=margin)
    write_curve(curve, Path(folder) / "margin.csv")
    return curve


def _one_run(scene: Path | str, key: str, value: object, folder: Path, margin: str) -> tuple[float, float]:
    summary = run_scene(load_scene(scene, {key: value}), folder, pictures=False).summary
    if margin not in summary:
        raise RunError(f"{scene}: a run with {key} = {value} has no {margin}; ask for it in [life]")
    result, bar = summary[margin], summary.get(f"error_bar_{margin}")
    return math.inf if result is None else float(str(result)), math.nan if bar is None else float(str(bar))


def _convert_to_one_unit(key: str, values: Sequence[str | float]) -> tuple[list[float], str]:
    """Return the sorted numbers without repetitions, and their unit. Raises `RunError` as `margin_curve`."""
    try:
        quantities = [number_and_unit(value) for value in values]
    except UnitError as error:
        raise RunError(f"{key}: {error}") from error
    units = list(dict.fromkeys(unit for _, unit in quantities))
    numbers = sorted({number for number, _ in quantities})
    if len(units) > 1:
        raise RunError(f"{key}: values in {' and '.join(units)}; give all of them in one unit")
    if len(numbers) < 2:
        raise RunError(f"{key}: a curve needs two values or more, not {len(numbers)}")
    return numbers, units[0]


def margin_bar(
    life: LifeTable, done: Round, reed: BodyStress, result: LifeResult, progress: Progress = silent
) -> float:
    """Return the error bar of the least margin of the reed: `SAFETY` times the combined `BodyStress.errors_of_value`;
    nan where that is not known, where another body has the least margin, and in a run without contact."""
    worst = result.of_one_axis
    if worst is None or body_of(worst.worst.at) != reed.role or math.isnan(done.touch):
        return math.nan
    demand, turn = life.demand(), done.plan.scene.turn
    assert demand is not None
    cycle = turn if life.block == "last cycle" else math.inf
    first = block_from(life, turn, done.touches)
    margin_of = partial(least_margin, replace(demand, several_axes=None))
    compute = partial(reed.errors_of_value, done, margin_of, first, cycle, progress)
    errors = kept.cached_numbers(done, done.touches, "errors of the margin", compute)
    return SAFETY * math.hypot(*errors.values()) if errors else math.nan


def least_margin(demand: Demand, blocks: Iterable[Array]) -> float:
    """Return the least margin under stress histories (m, 6) of several places, in both faces of a plate."""
    histories = resolve_on_planes(("", sign * thin_history(block)) for block in blocks for sign in (1.0, -1.0))
    return judged(histories, demand).life.margin
