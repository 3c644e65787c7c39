"""The error that is left in what is made of a run's contact, by the runs of its error budget."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import impact
from impact.life.places import left_of
from impact.march.problem import ContactProblem
from impact.progress import Progress, silent
from impact.runs.budget import Values, changes, times
from impact.runs.variations import budget_of
from seatfem.study.accuracy.error_budget import sources_of
from seatfem.study.impacts.contact import marched, problem_of
from seatfem.study.impacts.touches import force_of
from seatfem.study.runs.round import Round

STAGE: Final = "runs for the error bar of stress"


def left_in(
    done: Round,
    look: Callable[[impact.ContactStepper], Values],
    also: Values | None = None,
    progress: Progress = silent,
) -> Values:
    """Return the error bars of ``look``, as those of the measures are found, with twice what half the step changes.

    ``also``: values known better at half the step than from its forces; ``progress``: hears of each run.
    """
    scene, dt = done.plan.scene, done.result.dt
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))

    sources, _ = sources_of(scene, done.plan.method, done.seat, problem, done.reed)
    runs, count = 2 + sum(len(term) for terms in sources.values() for term in terms or ()), 0

    def run(varied: ContactProblem, step: float) -> Values:
        nonlocal count
        count += 1
        progress(STAGE, min(count / runs, 1.0))
        return look(marched(scene, varied, step))

    values, half = run(problem, dt), {**run(problem, dt / 2), **(also or {})}
    left = budget_of(run, problem, values, dt, sources, finer=times(2.0, changes(values, half)))
    return {name: left.bar(name) for name in values}


def contact_margin_bar(done: Round, margin: float) -> float:
    """Error bar of a margin below a contact of Hertz, whose stress is as the cube root of its largest force, by what is
    left in that; ``inf`` where that is all of it."""
    left = left_in(done, lambda stepper: {"force": float(force_of(stepper).max())})
    share = left["force"] / float(done.result.force.max())
    return left_of(margin, 1 - (1 - share) ** (1 / 3) if share < 1 else 1.0)
