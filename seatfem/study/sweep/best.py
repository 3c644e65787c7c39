"""Results of a search: the best points at the scene's own target, how they stand to the limits, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from impact.brief import brief
from impact.pictures.drawing import gap_of
from seatfem.study.impacts.landed import BAR, LANDED, STATUS, left_out_in_words, needs_landing
from seatfem.study.sweep.charts import draw_history
from seatfem.study.sweep.goal import Optimise
from seatfem.study.sweep.runner import StudyError
from seatfem.study.sweep.search import Found, changes_at, rank
from seatfem.study.sweep.study import Study
from seatfem.study.sweep.table import StudyTable, table_of


@dataclass(frozen=True)
class Optimum:
    """Best points that a search has found.

    Attributes:
        study: what was asked.
        searched: points of the search, in their order.
        confirmed: points carried out at the scene's own target, the best first.
    """

    study: Study
    searched: tuple[Found, ...]
    confirmed: tuple[Found, ...]

    __repr__ = brief

    @property
    def goal(self) -> Optimise:
        """Return what was sought."""
        return goal_of(self.study)

    @property
    def best(self) -> Found:
        """Return the best point at the scene's own target."""
        return self.confirmed[0]

    @property
    def has_numbers(self) -> bool:
        """Return whether the best was carried out."""
        return math.isfinite(self.best.value(self.goal.measure))

    @property
    def is_met(self) -> bool:
        """Return whether the best keeps all limits, up to their error bars."""
        return self.has_numbers and violation(self.best, self.goal) == 0

    @cached_property
    def is_told_apart(self) -> bool:
        """Return whether the best two, both within all limits, differ by more than their error bars."""
        measure = self.goal.measure
        met = [each for each in self.confirmed if violation(each, self.goal) == 0][:2]
        bars = [bar for each in met if math.isfinite(bar := _bar(each, measure))]
        return len(met) < 2 or not abs(met[0].value(measure) - met[1].value(measure)) <= sum(bars)

    def left_out_in_words(self) -> str:
        """Return how many scenes of the search did not land or were cut off, and so are no optimum; "" of none."""
        if not any(map(needs_landing, self.goal.measures)):
            return ""
        return left_out_in_words(each.outcome.summary.get(STATUS, LANDED) for each in self.searched)

    def table(self, of: Sequence[Found]) -> StudyTable:
        """Return a row for each point: values, measures, error bars, the margin of each limit, what became of it."""
        measures = tuple(dict.fromkeys((*self.goal.measures, *self.study.outputs.asked())))
        outcomes = {each.case.key: each.outcome for each in of}
        results = table_of(self.study, [each.case for each in of], outcomes, measures)
        margins = {
            f"margin of {limit}": [
                None if math.isnan(m := limit.margin(each.value(limit.measure))) else m for each in of
            ]
            for limit in self.goal.subject_to
        }
        return replace(results, columns={**results.columns, **margins})

    def as_json(self) -> dict[str, Any]:
        """Return the best point, how it stands to the limits, and how it was found."""
        best, limits = self.best, []
        bars = {name: _bar(best, name) for name in self.goal.measures}
        for limit in self.goal.subject_to:
            margin, bar = limit.margin(best.value(limit.measure)), bars[limit.measure]
            found = {"margin": _known(margin), "error_bar": _known(bar), "holds": bool(limit.holds(margin, bar))}
            limits.append({"constraint": str(limit), **found})
        return {
            "words": self.in_words(),
            "met": self.is_met,
            "keys": changes_at(self.study, best.point),
            "measures": {
                name: {"value": _known(best.value(name)), "error_bar": _known(bar)} for name, bar in bars.items()
            },
            "constraints": limits,
            "told_apart": self.is_told_apart,
            "searched": len(self.searched),
            "failed": sum(not each.outcome.has_numbers for each in self.searched),
            "left_out": self.left_out_in_words(),
            "confirmed": len(self.confirmed),
        }

    def in_words(self) -> str:
        """Return one sentence, with what has to be known of it."""
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


def draw_search(found: Optimum, path: Path) -> str:
    """Draw the best so far over the evaluations; return in words what kept it from being drawn, "" if nothing did."""
    goal = found.goal
    numbers = {each.point: each.case.number for each in found.searched}
    confirmed = [(numbers[each.point], each.value(goal.measure), _bar(each, goal.measure)) for each in found.confirmed]
    within = [rank(each, goal, {})[0] == 0 for each in found.searched]
    return gap_of(partial(draw_history, found.table(found.searched), goal, within, confirmed), path)


def goal_of(study: Study) -> Optimise:
    """Return what is sought. Raises `StudyError` for a study without [optimise]."""
    if study.optimise is None:
        words = "required table is missing: minimise or maximise = a key of summary.json, subject_to"
        raise StudyError(f"optimise: {words}")
    return study.optimise


def violation(found: Found, goal: Optimise) -> float:
    """Return the relative violation of the limits not kept up to the error bars; infinite without numbers."""
    total = 0.0
    for each in goal.subject_to:
        margin = each.margin(found.value(each.measure))
        if not each.holds(margin, _bar(found, each.measure)):
            total += math.inf if math.isnan(margin) else -margin / (abs(each.limit) or 1.0)
    return total if math.isfinite(found.value(goal.measure)) else math.inf


def _bar(found: Found, measure: str) -> float:
    return found.value(BAR + measure)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _with_bar(found: Found, measure: str) -> str:
    bar = _bar(found, measure)
    return f"{found.value(measure):.5g}" + (f" ± {bar:.2g}" if math.isfinite(bar) else "")


def _short(value: object) -> str:
    number, space, unit = str(value).partition(" ")
    return f"{float(number):.6g}{space}{unit}"
