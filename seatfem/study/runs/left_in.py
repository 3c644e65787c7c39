"""The error that is left in what is made of a run's contact, by the runs of its error budget."""

from __future__ import annotations

from collections.abc import Callable

import impact
from impact.march.problem import ContactProblem
from impact.runs.budget import Values, changes, times
from impact.runs.variations import budget_of
from seatfem.study.accuracy.error_budget import sources_of
from seatfem.study.impacts.contact import marched, problem_of
from seatfem.study.runs.round import Round


def left_in(done: Round, look: Callable[[impact.ContactStepper], Values], also: Values | None = None) -> Values:
    """The error bars of ``look``, as those of the measures are found, with twice what half the step changes.

    ``also``: values known better at half the step than from its forces.
    """
    scene, dt = done.plan.scene, done.result.dt
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))

    def run(varied: ContactProblem, step: float) -> Values:
        return look(marched(scene, varied, step))

    values, half = run(problem, dt), {**run(problem, dt / 2), **(also or {})}
    sources = sources_of(scene, done.plan.method, done.seat, problem, done.reed)
    left = budget_of(run, problem, values, dt, sources, finer=times(2.0, changes(values, half)))
    return {name: left.bar(name) for name in values}
