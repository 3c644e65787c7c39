"""Errors of values that are read off the runs of the error budget, beside its measures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.notices import Progress, silent
from impact.runs.variations import Budget, Terms, Values, budget_of, changes, times
from seatfem.study.error_budget import varied_problems
from seatfem.study.impacts.contact import Flights, marched
from seatfem.study.runs.round import Round

STAGE: Final = "runs for the error bar of stress"


def runs_of_budget(done: Round, progress: Progress = silent) -> tuple[ContactProblem, dict[str, Terms], Flights]:
    """Return the contact problem of a round, its neighbours by key, and what their marches share."""
    scene = done.plan.scene
    flights = done.flights or Flights(done.striker, scene.run.duration, scene.contact.preload, keeps_runs=True)
    computed, terms, _ = varied_problems(done.build_computed_run(progress), flights)
    return computed.problem, terms, flights


def error_bars_of(
    done: Round,
    look: Callable[[MarchRun], Values],
    at_half: Callable[[MarchRun], Values] | None = None,
    progress: Progress = silent,
    is_judged: Callable[[Values], bool] = lambda half: True,
) -> tuple[Budget, Values]:
    """Return the errors of the values that ``look`` returns for a run, as of the measures, but with twice the change by
    half the time step; and the values at half the step.

    ``at_half``: replaces ``look`` for the run at half the step; ``progress``: receives the progress of the runs;
    ``is_judged``: whether the values at half the step are worth an error bar: otherwise no further run is made, and
    there are no errors.
    """
    dt, duration = done.result.dt, done.plan.scene.run.duration
    problem, terms, flights = runs_of_budget(done, progress)
    runs, count = 2 + sum(len(term) for each in terms.values() for term in each), 0

    def march_varied(varied: ContactProblem, step: float, look: Callable[[MarchRun], Values] = look) -> Values:
        nonlocal count
        count += 1
        progress(STAGE, min(count / runs, 1.0))
        return look(marched(varied, step, duration, flights))

    half = march_varied(problem, dt / 2, at_half or look)
    if not is_judged(half):
        return Budget(half), half
    values = march_varied(problem, dt)
    finer = [times(2.0, changes(values, half))]
    return budget_of(march_varied, problem, values, dt, terms, finer=finer), half
