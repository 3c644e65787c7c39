"""The ladder of the time step: twice and four times the step, half of it through the impact that is judged, and one
that waves do not cross a rod within."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from impact.march.problem import ContactProblem
from impact.runs.variations import Values, changes, times
from seatfem.study.impacts.contact import MAX_STEPS, gas_step, stopper_of
from seatfem.study.impacts.touches import Touches
from seatfem.study.ladders.ladder import ComputedRun, Ladder, Neighbour, Option
from seatfem.study.method import STEP, RunMethod
from seatfem.study.prerun.bench import Bench, window_of
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.sensitivity import Rung, no_better_than_finer
from seatfem.study.safety import SHORT
from seatfem.study.scene import Scene
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.study.impacts.plate_stress import PlateLook

STEPS_A_TRANSIT: Final = 16  # of a rod: 1/16 of a step is left
MOST_STEPS: Final = 1_000_000  # of a run that is compared with
PER_FILTER: Final = (2, 8, 32)  # steps in the width of the filter, in a trade


def fitted(dt: float, duration: float) -> float:
    """Return a step that ends with the run, as do its double and fourfold [s]: a record of g may end there, too."""
    return duration / (4 * math.ceil(duration / (4 * dt) * (1 - 1e-9)))


@dataclass(frozen=True)
class TimeStep(Ladder):
    """The time step, whose neighbours `impact.runs.variations.budget_of` marches with every budget."""

    falls: bool = True
    of_seat: bool = False

    def describe(self, value: float) -> str:
        """Return a step with its unit."""
        return write_quantity(value, "time", 3)

    def finer(self, value: float, factor: float, scene: Scene) -> float:
        """Return a shorter step."""
        return fitted(value / factor, scene.run.duration)

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield the steps that may be chosen, with what they leave: of a duration no less than a step."""
        for rung in _steps(context):
            errors = context.sensitivity.known_to(rung.value, rung.changes)
            method = replace(option.method, time_step=rung.value)
            yield replace(option, method=method, changes={**option.changes, STEP: errors})

    def beside(self, scene: Scene, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield steps over the filter's width, as long as the run has several."""
        for number in PER_FILTER:
            step = scene.run.filter_width / number
            if step <= scene.run.duration / 8:
                yield Neighbour(f"{number} steps per filter", "time step", {STEP: step})


def _steps(context: PlanningContext) -> tuple[Rung, ...]:
    """Return the steps that may be chosen: the stated one alone, else those that can be stored and that a gas bears."""
    stated, duration, sensitivity = context.stated.time_step, context.scene.run.duration, context.sensitivity
    if stated is not None:
        return (Rung(stated, sensitivity.of_stated_step(stated)),)
    stored = [rung for rung in sensitivity.steps if duration <= MAX_STEPS * rung.value]
    if stored and (most := gas_step(context.scene)) < math.inf:
        finest = min(stored, key=lambda rung: rung.value)
        stored = [rung for rung in stored if rung.value <= most] or [Rung(most, finest.changes)]
    rungs = (Rung(fitted(rung.value, duration), rung.changes) for rung in stored or sensitivity.steps[:1])
    return no_better_than_finer(tuple(rungs))


def step_of_waves(problem: ContactProblem, dt: float, duration: float) -> float | None:
    """Return a step that resolves how waves cross the rods of a problem [s], as far as `MOST_STEPS` allow.

    ``None`` where that of the run does.
    """
    crossed = min((body.greens.rod.transit for body in problem.bodies if body.greens.rod is not None), default=math.inf)
    if dt < crossed:
        return None
    shorter = max(crossed / STEPS_A_TRANSIT, duration / MOST_STEPS)
    return shorter if shorter < dt / 2 else None


def left_by_half_step(run: ComputedRun, touches: Touches, look: PlateLook | None = None) -> Values | None:
    """Return twice what half the step changes in the impact of a striker with waves, marched from shortly before it.

    A spike of the force is as wide as a step: whether the filter holds it together with another one, no longer step
    tells. ``None``: the impact takes so much of the run that all of it may be marched.
    """
    scene, striker, result = run.scene, run.problem.striker, touches.seat
    if striker.greens.highest_rate == 0:
        return {}
    landings = () if touches.landings is None else touches.landings.seat
    window = window_of(scene, striker, result.force[1:], result.dt, touches.stopper_force, landings)
    if not window.touches:
        return {}
    if window.duration > SHORT * scene.run.duration:
        return None
    bench = Bench(scene, run.seat.greens, window, None, stopper_of(scene), striker, look)
    own, finer = (bench.measures(dt=dt) for dt in (result.dt, result.dt / 2))
    return times(2.0, changes(own, finer))
