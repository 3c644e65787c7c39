"""Search for an optimum in the unit cube of the keys' ranges and lists, and the best points with their margins to the
limits.

COBYQA (Ragonneau 2022, in scipy) interpolates the measures by quadratic models in a trust region: no derivatives, few
evaluations, constraints handled as such; the search is deterministic: repeated, it runs the same scenes in order.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.pictures.drawing import try_draw
from impact.quantities import brief, finite_or_none
from seatfem.fields import read_written
from seatfem.readings import BAR
from seatfem.study.impacts.contact import RunError
from seatfem.study.impacts.landings import LANDED, STATUS, counts, left_out_in_words, needs_landing
from seatfem.study.scene import SceneError
from seatfem.study.sweep import charts, runner
from seatfem.study.sweep.cases import Case, Cases, Changes
from seatfem.study.sweep.limits import LOOSE
from seatfem.study.sweep.runner import Outcome
from seatfem.study.sweep.study import CONFIRMED, Optimise, Study
from seatfem.study.sweep.table import StudyTable, table_of

DIGITS: Final = 6  # decimals of a position, so that round-off of linear algebra changes no scene
NEAREST: Final = 1e-3  # radius of the trust region, over the ranges, at which a search ends
RADIUS: Final = 0.2  # radius of the first trust region, as a fraction of the ranges
AGAIN: Final = 0.05  # initial radius of later trust regions, as a fraction of the ranges
CHOICES: Final = 4  # largest number of values of a list that are tried beside one
Point = tuple[float, ...]
"""Positions (0..1) in the ranges of the keys, in their order."""
Shift = Mapping[str, float]
"""Correction of measures: value at the scene's own target minus that at the accuracy of the search; initially empty."""


@dataclass(frozen=True)
class Found:
    """A point of the search with its case and outcome."""

    point: Point
    case: Case
    outcome: Outcome

    def value(self, measure: str) -> float:
        """Return a measure; nan if it is not known, or if it needs a landing and the scene has none."""
        counting = self.outcome.has_numbers and counts(self.outcome.summary, measure)
        number = self.outcome.summary.get(measure) if counting else None
        return float(number) if isinstance(number, int | float) else math.nan


@dataclass
class SearchStage:
    """Points that a search has run at one accuracy.

    Attributes:
        study: the study whose keys are varied.
        cases: builder of the cases of this stage, which share a seat that does not vary.
        accuracy: changes of scene keys that set the accuracy of this stage.
        carry_out: function that runs cases and returns their outcomes by key.
        found: results at all points so far, in their order.
    """

    study: Study
    cases: Cases
    accuracy: Changes
    carry_out: Callable[[Sequence[Case]], Mapping[str, Outcome]]
    found: dict[Point, Found] = field(default_factory=dict)

    def evaluate(self, points: Sequence[Point]) -> list[Found]:
        """Return the results at points, running new ones; a scene that fails has an outcome, too."""
        new: dict[Point, Case] = {}
        for point in dict.fromkeys(points):
            if point in self.found:
                continue
            number, changed = len(self.found) + len(new) + 1, changes_at(self.study, point) | dict(self.accuracy)
            try:
                new[point] = self.cases.case(number, changed)
            except (SceneError, RunError) as error:
                case = Case(number, changed, f"no scene {number}")
                self.found[point] = Found(point, case, Outcome("failed", str(error), 0.0))
        if new:
            outcomes = self.carry_out(list(new.values()))
            self.found |= {point: Found(point, case, outcomes[case.key]) for point, case in new.items()}
        return [self.found[point] for point in points]


class _SpentError(Exception):
    """Signal that the number of evaluations is used up."""


def changes_at(study: Study, point: Point) -> dict[str, object]:
    """Return the values of the keys at a point."""
    return {key: each.quantile(share) for (key, each), share in zip(study.vary.items(), point, strict=True)}


def first_points(study: Study, most: int) -> list[Point]:
    """Return the points with which a search of ``most`` scenes begins: all, if there are no more and every key has a
    list of values, otherwise the centre of the cube and a Latin hypercube, a third of them."""
    places, keys = [each.places for each in study.vary.values()], len(study.vary)
    if all(places) and math.prod(map(len, places)) <= most:
        return list(product(*places))
    count = max(1, min(most // 3, most - model_size(study)))
    rng = np.random.default_rng(study.seed)
    drawn = scipy.stats.qmc.LatinHypercube(keys, rng=rng).random(count - 1) if count > 1 else ()
    return [nearest_point(study, np.asarray(shares)) for shares in ((0.5,) * keys, *drawn)]


def model_size(study: Study) -> int:
    """Return the number of points of a first quadratic model in the keys with ranges."""
    return 2 * len(free_keys(study)) + 1


def free_keys(study: Study) -> list[int]:
    """Return the places of the keys that may have any value in a range."""
    return [place for place, each in enumerate(study.vary.values()) if not each.places]


def nearest_point(study: Study, shares: NDArray[np.float64]) -> Point:
    """Return the point nearest to the positions of all keys: those of lists at one of their values."""
    pairs = zip(study.vary.values(), shares, strict=True)
    return tuple(min(each.places or (_rounded(share),), key=lambda at: abs(at - share)) for each, share in pairs)


def rank(point: Found, goal: Optimise, shift: Shift) -> tuple[float, float]:
    """Return the rank, lower is better: relative violation of the limits, then the measure. Infinite if unknown."""
    violation = 0.0
    for each in goal.subject_to:
        margin, slack = each.margin(point.value(each.measure) + shift.get(each.measure, 0.0)), LOOSE * abs(each.limit)
        violation += math.inf if math.isnan(margin) else max(0.0, -margin - slack) / (abs(each.limit) or 1.0)
    value = goal.sign * (point.value(goal.measure) + shift.get(goal.measure, 0.0))
    return (math.inf, math.inf) if math.isnan(value) else (violation, value)


def search_best(search: SearchStage, target: SearchStage, goal: Optimise) -> None:
    """Search at one accuracy in `CONFIRMED` turns, after each of which the best new point is run at that of ``target``
    and the measures of the search are shifted by the difference. Raises `StudyError` if no scene has results."""
    model = model_size(search.study)
    search.evaluate(first_points(search.study, goal.most))
    shift: Shift = {}
    for turns in range(CONFIRMED, 0, -1):
        spare = goal.most - len(search.found)
        part = max(model, 2 * spare // 3 if turns == CONFIRMED else spare // turns)
        if spare >= model:
            improve(search, goal, shift, RADIUS if turns == CONFIRMED else AGAIN, len(search.found) + min(part, spare))
        ranked = sorted(search.found.values(), key=lambda each: rank(each, goal, shift))
        if math.isinf(rank(ranked[0], goal, shift)[0]):
            first = ranked[0].outcome
            statuses = [each.outcome.summary.get(STATUS, LANDED) for each in search.found.values()]
            message = first.message or left_out_in_words(statuses) or f"{', '.join(goal.measures)}: not known"
            words = f"none of {len(ranked)} scenes has the numbers that are asked for; the first: {message}"
            raise runner.StudyError(f"optimise: {words}")
        others = [np.array(other.point) for other in target.found.values()]
        distinct = (each for each in ranked if all(np.abs(other - each.point).max() >= NEAREST for other in others))
        if (best := next(distinct, None)) is not None and math.isfinite(rank(best, goal, shift)[0]):
            [fine] = target.evaluate([best.point])
            moved = {name: fine.value(name) - best.value(name) for name in goal.measures}
            shift = moved if all(map(math.isfinite, moved.values())) else shift


def improve(stage: SearchStage, goal: Optimise, shift: Shift, radius: float, most: int) -> None:
    """Search from the best point of the stage, first among the values of lists, then in the ranges of the other keys,
    until nothing improves or the stage has ``most`` points."""
    choose_values(stage, goal, shift, most)
    if free_keys(stage.study):
        descend(stage, goal, shift, radius, most)


def choose_values(stage: SearchStage, goal: Optimise, shift: Shift, most: int) -> None:
    """Run the points that differ from the best one in a single key with a list, as long as one of them is better."""

    def best() -> Found:
        return min(stage.found.values(), key=lambda each: rank(each, goal, shift))

    start, has_improved = best(), True
    while has_improved:
        new = [point for point in neighbours(stage.study, start.point) if point not in stage.found]
        stage.evaluate(new[: max(0, most - len(stage.found))])
        has_improved, start = best() is not start, best()


def neighbours(study: Study, point: Point) -> list[Point]:
    """Return the points with another value of one list, of each the `CHOICES` next to that of ``point``."""
    points: list[Point] = []
    for key, each in enumerate(study.vary.values()):
        others = sorted((at for at in each.places if at != point[key]), key=lambda at: abs(at - point[key]))
        points += [(*point[:key], at, *point[key + 1 :]) for at in others[:CHOICES]]
    return points


def descend(stage: SearchStage, goal: Optimise, shift: Shift, radius: float, most: int) -> None:
    """Search in the ranges from the best point of the stage, with its values of lists, until the trust region has
    shrunk from ``radius`` to `NEAREST`, or the stage has ``most`` points.

    Measures are scaled by their range so far. A scene without results or without landing has the worst values so far.
    """
    start, free = min(stage.found.values(), key=lambda each: rank(each, goal, shift)), free_keys(stage.study)

    def raw(found: Found) -> NDArray[np.float64]:
        """Return the measure with the sign for minimisation, then the negative margins."""
        margins = [each.margin(found.value(each.measure) + shift.get(each.measure, 0.0)) for each in goal.subject_to]
        return np.array([goal.sign * found.value(goal.measure), *(-margin for margin in margins)])

    def known() -> NDArray[np.float64]:
        rows = [raw(each) for each in stage.found.values()]
        return np.array([row for row in rows if np.isfinite(row).all()])

    if not len(rows := known()):
        return
    spread = np.ptp(rows, axis=0)
    scale = np.where(spread > 0, spread, np.maximum(np.abs(rows).max(axis=0), 1e-300))

    def scaled(x: NDArray[np.float64]) -> NDArray[np.float64]:
        shares = np.array(start.point)
        shares[free] = x
        point = nearest_point(stage.study, shares)
        if point not in stage.found and len(stage.found) >= most:
            raise _SpentError
        values = raw(stage.evaluate([point])[0])
        return np.asarray((values if np.isfinite(values).all() else known().max(axis=0)) / scale)

    limits = [scipy.optimize.NonlinearConstraint(lambda x: scaled(x)[1:], -np.inf, 0.0)] if goal.subject_to else []
    try:
        scipy.optimize.minimize(
            lambda x: float(scaled(x)[0]), [start.point[key] for key in free], method="cobyqa",
            bounds=[(0.0, 1.0)] * len(free), constraints=limits,
            options={"initial_tr_radius": radius, "final_tr_radius": NEAREST},
        )  # type: ignore[call-overload]  # fmt: skip
    except _SpentError:
        return


def _rounded(share: float) -> float:
    return round(min(max(float(share), 0.0), 1.0), DIGITS)


@dataclass(frozen=True)
class Optimum:
    """Result of an optimisation.

    Attributes:
        study: the study.
        searched: points of the search, in their order.
        confirmed: points run at the scene's own target, the best first.
    """

    study: Study
    searched: tuple[Found, ...]
    confirmed: tuple[Found, ...]

    __repr__ = brief

    @property
    def goal(self) -> Optimise:
        """Return the table [optimise] of the study."""
        return goal_of(self.study)

    @property
    def best(self) -> Found:
        """Return the best point at the scene's own target."""
        return self.confirmed[0]

    @property
    def has_numbers(self) -> bool:
        """Return whether the best point has a value of the optimised measure."""
        return math.isfinite(self.best.value(self.goal.measure))

    @property
    def is_met(self) -> bool:
        """Return whether the best point meets all limits within their error bars."""
        return self.has_numbers and violation(self.best, self.goal) == 0

    @cached_property
    def is_told_apart(self) -> bool:
        """Return whether the best two, both within all limits, differ by more than their error bars."""
        measure = self.goal.measure
        met = [each for each in self.confirmed if violation(each, self.goal) == 0][:2]
        bars = [bar for each in met if math.isfinite(bar := _bar(each, measure))]
        return len(met) < 2 or not abs(met[0].value(measure) - met[1].value(measure)) <= sum(bars)

    def left_out_in_words(self) -> str:
        """Return as text how many scenes of the search are ignored, as they did not land or were cut off, else ""."""
        if not any(map(needs_landing, self.goal.measures)):
            return ""
        return left_out_in_words(each.outcome.summary.get(STATUS, LANDED) for each in self.searched)

    def table(self, points: Sequence[Found]) -> StudyTable:
        """Return a table with a row for each point: values, measures, error bars, margins to limits, and state."""
        measures = tuple(dict.fromkeys((*self.goal.measures, *self.study.outputs.asked())))
        outcomes = {each.case.key: each.outcome for each in points}
        results = table_of(self.study, [each.case for each in points], outcomes, measures)
        margins = {
            f"margin of {limit}": [
                None if math.isnan(m := limit.margin(each.value(limit.measure))) else m for each in points
            ]
            for limit in self.goal.subject_to
        }
        return replace(results, columns={**results.columns, **margins})

    def as_json(self) -> dict[str, Any]:
        """Return the best point, its margins to the limits, and data of the search."""
        best, limits = self.best, []
        bars = {name: _bar(best, name) for name in self.goal.measures}
        for limit in self.goal.subject_to:
            margin, bar = limit.margin(best.value(limit.measure)), bars[limit.measure]
            found = {
                "margin": finite_or_none(margin),
                "error_bar": finite_or_none(bar),
                "holds": bool(limit.holds(margin, bar)),
            }
            limits.append({"constraint": str(limit), **found})
        return {
            "words": self.in_words(),
            "met": self.is_met,
            "keys": changes_at(self.study, best.point),
            "measures": {
                name: {"value": finite_or_none(best.value(name)), "error_bar": finite_or_none(bar)}
                for name, bar in bars.items()
            },
            "constraints": limits,
            "told_apart": self.is_told_apart,
            "searched": len(self.searched),
            "failed": sum(not each.outcome.has_numbers for each in self.searched),
            "left_out": self.left_out_in_words(),
            "confirmed": len(self.confirmed),
        }

    def sentences(self) -> list[str]:
        """Return what a search says: its scenes, those left out and those that failed, and the optimum."""
        failed = sum(not each.outcome.has_numbers for each in self.searched)
        counts = f"{len(self.searched)} scenes searched, {failed} failed, {len(self.confirmed)} confirmed"
        first = [f"{self.study.heading}: {counts}", *filter(None, [self.left_out_in_words()])]
        return [*first, *self.table(self.searched).failures(), self.in_words()]

    def in_words(self) -> str:
        """Return the optimum in one sentence, with its reservations."""
        if not self.has_numbers:
            outcome = self.best.outcome
            why = outcome.message or f"landing_status is {outcome.summary.get(STATUS, LANDED)!r} at the target"
            return f"no optimum: the best points could not be confirmed: {why}"
        goal, best = self.goal, self.best
        where = ", ".join(f"{key} = {_short(value)}" for key, value in changes_at(self.study, best.point).items())
        limits = [f"{name} = {_with_bar(best, name)} ({each})" for each in goal.subject_to for name in (each.measure,)]
        extreme = "least" if goal.minimise else "greatest"
        words = f"{extreme} {goal.measure} = {_with_bar(best, goal.measure)} at {where}"
        words += f", with {', '.join(limits)}" if limits else ""
        if not self.is_met:
            words = f"no point within all limits was found; the nearest has {words.split(' ', 1)[1]}"
        elif any(each.margin(best.value(each.measure)) < 0 for each in goal.subject_to):
            words += "; a limit is exceeded, but by less than its error bar"
        if not self.is_told_apart:
            words += "; the second best differs by less than the error bars"
        return words


def draw_search(result: Optimum, path: Path) -> str:
    """Draw the best value so far over the evaluations; return the reason if it could not be drawn, else ""."""
    goal = result.goal
    numbers = {each.point: each.case.number for each in result.searched}
    confirmed = [(numbers[each.point], each.value(goal.measure), _bar(each, goal.measure)) for each in result.confirmed]
    within = [rank(each, goal, {})[0] == 0 for each in result.searched]
    return try_draw(partial(charts.draw_history, result.table(result.searched), goal, within, confirmed), path)


def goal_of(study: Study) -> Optimise:
    """Return the table [optimise] with all limits of the study. Raises `StudyError` for a study without it."""
    if study.optimise is None:
        words = "required table is missing: minimise or maximise = a key of summary.json, subject_to"
        raise runner.StudyError(f"optimise: {words}")
    return study.optimise.model_copy(update={"subject_to": study.limits})


def violation(point: Found, goal: Optimise) -> float:
    """Return the sum of relative violations of limits beyond error bars; infinite without results."""
    total = 0.0
    for each in goal.subject_to:
        margin = each.margin(point.value(each.measure))
        if not each.holds(margin, _bar(point, each.measure)):
            total += math.inf if math.isnan(margin) else -margin / (abs(each.limit) or 1.0)
    return total if math.isfinite(point.value(goal.measure)) else math.inf


def _bar(point: Found, measure: str) -> float:
    return point.value(BAR + measure)


def _with_bar(point: Found, measure: str) -> str:
    bar = _bar(point, measure)
    return f"{point.value(measure):.5g}" + (f" ± {bar:.2g}" if math.isfinite(bar) else "")


def _short(value: object) -> str:
    try:
        number, unit = read_written(value)
    except ValueError:
        return str(value)
    return f"{number:.6g} {unit}".rstrip()
