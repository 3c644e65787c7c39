"""The search for an optimum: points in the unit cube of the keys' ranges, each a scene, moved by COBYQA.

COBYQA (Ragonneau 2022, in scipy) interpolates the measures by quadratic models in a trust region: no derivatives, few
evaluations, limits as limits, no chance; a search that is repeated asks for the same scenes in the same order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from seatfem.study.impacts.contact import RunError
from seatfem.study.impacts.landed import counts
from seatfem.study.scene import SceneError
from seatfem.study.sweep.cases import Case, Cases
from seatfem.study.sweep.design import Changes
from seatfem.study.sweep.goal import LOOSE, Optimise
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.sweep.study import Study

DIGITS: Final = 6  # of a share, so that round-off of a linear algebra library changes no scene
NEAREST: Final = 1e-3  # of the ranges: the trust region at which a search ends
Point = tuple[float, ...]
"""Shares (0..1) of the ranges of the keys, in their order."""
Shift = Mapping[str, float]
"""What is added to measures of the search: their difference at a scene's own target, where that is known."""


@dataclass(frozen=True)
class Found:
    """A point that was carried out."""

    point: Point
    case: Case
    outcome: Outcome

    def value(self, measure: str) -> float:
        """Return a measure; nan where it is not known, or the scene does not count for it: it did not land."""
        counting = self.outcome.has_numbers and counts(self.outcome.summary, measure)
        known = self.outcome.summary.get(measure) if counting else None
        return float(known) if isinstance(known, int | float) else math.nan


@dataclass
class Level:
    """The points carried out at one accuracy.

    Attributes:
        study: whose keys are varied.
        cases: of this level; they share a seat that does not vary.
        accuracy: the changes that make the level.
        carry_out: of cases the outcomes by key.
        found: all of them, in their order.
    """

    study: Study
    cases: Cases
    accuracy: Changes
    carry_out: Callable[[Sequence[Case]], Mapping[str, Outcome]]
    found: dict[Point, Found] = field(default_factory=dict)

    def evaluate(self, points: Sequence[Point]) -> list[Found]:
        """Return what was found at points; new ones are carried out. A scene that cannot be is an outcome, too."""
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
    """No evaluation is left."""


def changes_at(study: Study, point: Point) -> dict[str, object]:
    """Return the values of the keys at a point."""
    return {key: each.quantile(share) for (key, each), share in zip(study.vary.items(), point, strict=True)}


def first_points(keys: int, count: int, seed: int) -> list[Point]:
    """Return the middle, and a Latin hypercube."""
    from scipy.stats import qmc  # takes long to load

    drawn = qmc.LatinHypercube(keys, rng=np.random.default_rng(seed)).random(count - 1) if count > 1 else ()
    return [(0.5,) * keys, *map(_rounded, drawn)]


def rank(found: Found, goal: Optimise, shift: Shift) -> tuple[float, float]:
    """Return the rank, lower is better: relative violation of the limits, then the measure. Infinite if unknown."""
    violation = 0.0
    for each in goal.subject_to:
        margin, slack = each.margin(found.value(each.measure) + shift.get(each.measure, 0.0)), LOOSE * abs(each.limit)
        violation += math.inf if math.isnan(margin) else max(0.0, -margin - slack) / (abs(each.limit) or 1.0)
    value = goal.sign * (found.value(goal.measure) + shift.get(goal.measure, 0.0))
    return (math.inf, math.inf) if math.isnan(value) else (violation, value)


def improve(level: Level, goal: Optimise, shift: Shift, radius: float, most: int) -> None:
    """Search from the best point of the level on, until the trust region, of ``radius`` [shares] at first, is
    `NEAREST`, or the level holds ``most`` points.

    Measures are scaled by what they have differed by so far. A scene without numbers, or that did not land,
    counts as the worst one so far.
    """
    from scipy.optimize import NonlinearConstraint, minimize  # takes long to load

    start = min(level.found.values(), key=lambda each: rank(each, goal, shift))

    def raw(found: Found) -> NDArray[np.float64]:
        """Return the measure, less is better, then the margins."""
        margins = [each.margin(found.value(each.measure) + shift.get(each.measure, 0.0)) for each in goal.subject_to]
        return np.array([goal.sign * found.value(goal.measure), *(-margin for margin in margins)])

    def known() -> NDArray[np.float64]:
        rows = [raw(each) for each in level.found.values()]
        return np.array([row for row in rows if np.isfinite(row).all()])

    if not len(rows := known()):
        return
    spread = np.ptp(rows, axis=0)
    scale = np.where(spread > 0, spread, np.maximum(np.abs(rows).max(axis=0), 1e-300))

    def scaled(x: NDArray[np.float64]) -> NDArray[np.float64]:
        point = _rounded(x)
        if point not in level.found and len(level.found) >= most:
            raise _SpentError
        values = raw(level.evaluate([point])[0])
        return np.asarray((values if np.isfinite(values).all() else known().max(axis=0)) / scale)

    limits = [NonlinearConstraint(lambda x: scaled(x)[1:], -np.inf, 0.0)] if goal.subject_to else []
    try:
        minimize(
            lambda x: float(scaled(x)[0]), start.point, method="cobyqa", bounds=[(0.0, 1.0)] * len(start.point),
            constraints=limits, options={"initial_tr_radius": radius, "final_tr_radius": NEAREST},
        )  # type: ignore[call-overload]  # fmt: skip
    except _SpentError:
        return


def _rounded(shares: NDArray[np.float64]) -> Point:
    return tuple(round(min(max(float(share), 0.0), 1.0), DIGITS) for share in shares)
