"""The ladder of the time step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from impact.march.problem import ContactProblem
from impact.runs.variations import FINE, Values, changes, times
from seatfem.study.impacts.bodies import stopper_of
from seatfem.study.impacts.contact import MAX_STEPS
from seatfem.study.impacts.touches import Touches
from seatfem.study.impacts.window import Excerpt, window_of
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder
from seatfem.study.method import STEP, RunMethod
from seatfem.study.plan import Plan
from seatfem.study.scene.wings import longest_step

if TYPE_CHECKING:
    from seatfem.study.impacts.plate_stress import PlateLook

MOST_STEPS: Final = 1_000_000  # most steps of a run that resolves the travel of waves through a rod
SHORT: Final = 0.3  # largest part of the run that a hard impact lasts and is marched alone for the error of the step
FIRST: Final = 32  # steps in the width of the filter with which a run begins: coarser ones hide each other's error


def fitted(dt: float, duration: float) -> float:
    """Return a step at most ``dt`` [s] of which the duration is a multiple, also of its double and fourfold."""
    return duration / (4 * math.ceil(duration / (4 * dt) * (1 - 1e-9)))


@dataclass(frozen=True)
class TimeStep(Ladder):
    """The time step, whose neighbours `impact.runs.variations.budget_of` runs in every budget."""

    rule: str = f"{FIRST} steps in the width of the filter"
    dimension: str = "time"
    remedy: str = "shorten {key}"

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with `FIRST` steps in the width of the filter, or as many as a drive needs."""
        run = known.scene.run
        if STEP in method.given:
            return method
        step = max(min(run.filter_width / FIRST, longest_step(known.scene.driven_by)), run.duration / MAX_STEPS)
        return replace(method, time_step=fitted(step, run.duration))

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with a shorter step."""
        method = plan.method
        if STEP in method.given or method.time_step is None:
            return method
        return replace(method, time_step=fitted(method.time_step / factor, plan.scene.run.duration))


def step_of_waves(problem: ContactProblem, dt: float, duration: float) -> float:
    """Return a step that resolves the travel of waves through the rods of a problem [s], as far as `MOST_STEPS` allow;
    0 if the step of the run does."""
    crossed = min((body.greens.rod.transit for body in problem.bodies if body.greens.rod is not None), default=math.inf)
    if dt < crossed:
        return 0.0
    shorter = max(crossed / FINE, duration / MOST_STEPS)
    return shorter if shorter < dt / 2 else 0.0


def left_by_half_step(run: ComputedRun, touches: Touches, look: PlateLook | None = None) -> Values | None:
    """Return twice the changes by half the time step in the impact of a striker with waves, from shortly before it;
    nothing for a striker without waves, or a run without contact.

    Spikes of the force are as wide as a step, and longer steps do not show whether two of them fall into one filter
    width. ``None``: the impact is so long that the whole run may as well be repeated.
    """
    scene, striker, result = run.scene, run.problem.striker, touches.seat
    if striker.greens.highest_rate == 0:
        return {}
    window = window_of(scene, striker, result.force[1:], result.dt, touches.stopper_force, touches.landings.seat)
    if not window.touches:
        return {}
    if window.duration > SHORT * scene.run.duration:
        return None
    excerpt = Excerpt(scene, window, run.seat.greens, striker, stopper_of(scene), look)
    own, finer = excerpt.measures((result.dt, result.dt / 2))
    return times(2.0, changes(own, finer))
