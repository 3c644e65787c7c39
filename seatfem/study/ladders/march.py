"""Ladders of the time integration: the time step, and the numbers of modes of beams."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from impact.march.problem import ContactProblem
from impact.runs.variations import Terms, Values, Variation, changes, times
from seatfem.structures.kinds import Structure
from seatfem.structures.rings import Division
from seatfem.study.impacts.bodies import problem_of, stopper_of, striker_of
from seatfem.study.impacts.contact import MAX_STEPS, gas_step
from seatfem.study.impacts.touches import Touches
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder, Neighbour, Option, Role
from seatfem.study.method import MODES, SEAT_MODES, STEP, RunMethod
from seatfem.study.prerun.bench import Bench, window_of
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.sensitivity import Rung, no_better_than_finer, other_modes
from seatfem.study.safety import FEWER, SHORT
from seatfem.study.scene import Run
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.study.impacts.plate_stress import PlateLook

STEPS_A_TRANSIT: Final = 16  # steps in the time that a wave takes through a rod, of the run that resolves it
MOST_STEPS: Final = 1_000_000  # most steps of that run
FIRST: Final = 32  # steps in the width of the filter with which a run begins: coarser ones hide each other's error
PER_FILTER: Final = (2, 8, 32)  # steps in the width of the filter, in a trade


def fitted(dt: float, duration: float) -> float:
    """Return a step at most ``dt`` [s] of which the duration is a multiple, also of its double and fourfold."""
    return duration / (4 * math.ceil(duration / (4 * dt) * (1 - 1e-9)))


@dataclass(frozen=True)
class TimeStep(Ladder):
    """The time step, whose neighbours `impact.runs.variations.budget_of` runs in every budget."""

    effort: float = 1.0
    rule: str = f"{FIRST} steps in the width of the filter"
    falls: bool = True
    of_seat: bool = False

    def describe(self, value: float) -> str:
        """Return a step with its unit."""
        return write_quantity(value, "time", 3)

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with `FIRST` steps in the width of the filter, or as many as a gas needs."""
        run = known.scene.run
        if STEP in method.given:
            return method
        step = max(min(run.filter_width / FIRST, gas_step(known.scene.gas)), run.duration / MAX_STEPS)
        return replace(method, time_step=fitted(step, run.duration))

    def finer(self, value: float, factor: float, run: Run, reed: Structure) -> float:
        """Return a shorter step."""
        return fitted(value / factor, run.duration)

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield the steps to choose from, with their errors, which for contact durations are at least a step."""
        for rung in _steps(context):
            errors = context.sensitivity.known_to(rung.value, rung.changes)
            method = replace(option.method, time_step=rung.value)
            yield replace(option, method=method, changes={**option.changes, STEP: errors})

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield fractions of the filter's width that are at most an eighth of the run."""
        for number in PER_FILTER:
            step = run.filter_width / number
            if step <= run.duration / 8:
                yield Neighbour(f"{number} steps per filter", "time step", {STEP: step})


def _steps(context: PlanningContext) -> tuple[Rung, ...]:
    """Return the steps to choose from: the stated one only, or else those that can be stored and resolve a gas."""
    stated, duration, sensitivity = context.stated.time_step, context.scene.run.duration, context.sensitivity
    if stated is not None:
        return (Rung(stated, sensitivity.of_stated_step(stated)),)
    stored = [rung for rung in sensitivity.steps if duration <= MAX_STEPS * rung.value]
    if stored and (most := gas_step(context.scene.gas)) < math.inf:
        finest = min(stored, key=lambda rung: rung.value)
        stored = [rung for rung in stored if rung.value <= most] or [Rung(most, finest.changes)]
    rungs = (Rung(fitted(rung.value, duration), rung.changes) for rung in stored or sensitivity.steps[:1])
    return no_better_than_finer(tuple(rungs))


def step_of_waves(problem: ContactProblem, dt: float, duration: float) -> float | None:
    """Return a step that resolves the travel of waves through the rods of a problem [s], as far as `MOST_STEPS` allow;
    ``None`` if the step of the run does."""
    crossed = min((body.greens.rod.transit for body in problem.bodies if body.greens.rod is not None), default=math.inf)
    if dt < crossed:
        return None
    shorter = max(crossed / STEPS_A_TRANSIT, duration / MOST_STEPS)
    return shorter if shorter < dt / 2 else None


def left_by_half_step(run: ComputedRun, touches: Touches, look: PlateLook | None = None) -> Values | None:
    """Return twice the changes by half the time step in the impact of a striker with waves, from shortly before it;
    nothing for a striker without waves, or a run without contact.

    Spikes of the force are as wide as a step, and longer steps do not show whether two of them fall into one filter
    width. ``None``: the impact is so long that the whole run may as well be repeated.
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


MOST_MODES: Final = 1000  # most modes of a beam in further rounds
FEW_MODES: Final = 20  # modes of a beam with which a run begins
IN_A_TRADE: Final = (10, 20, 80)  # reed modes in a trade


@dataclass(frozen=True)
class ModeCount(Ladder):
    """The number of modes of a beam; its neighbours are runs with fewer modes and, if it is small, one with many."""

    effort: float = 0.7
    rule: str = f"{FEW_MODES} modes"
    role: Role = "seat"

    def finer(self, value: int, factor: float, run: Run, reed: Structure) -> int | None:
        """Return more modes."""
        if self.role == "stopper":
            return None
        return min(MOST_MODES, math.ceil(value * FEWER ** math.ceil(math.log2(factor))))

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with `FEW_MODES` modes of a reed that is a beam."""
        is_open = self.role == "reed" and method.reed.n_modes is not None and MODES not in method.given
        return method.replaced({MODES: FEW_MODES}) if is_open else method

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the body is a beam; a stopper must also have one contact only."""
        stopper = run.scene.stopper if self.role == "stopper" else None
        if stopper is not None and (run.solved("stopper") is not None or stopper.parts != Division()):
            return False
        return self._number(run) is not None

    def _number(self, run: ComputedRun) -> int | None:
        if self.role != "stopper":
            return run.method.seat.n_modes if self.role == "seat" else run.method.reed.n_modes
        return None if run.scene.stopper is None else run.scene.stopper.body.stated().n_modes

    def neighbours(self, run: ComputedRun) -> Terms | None:
        """Return the run with other numbers of modes."""
        number = self._number(run)
        assert number is not None
        return (tuple(self._with(run, other, weight) for other, weight in other_modes(number)),)

    def _with(self, run: ComputedRun, number: int, weight: float) -> Variation:
        scene = run.scene
        if self.role == "reed":
            striker = striker_of(scene, number)
            return Variation(problem_of(scene, striker, run.problem.target, run.body("stopper")), weight)
        kind = scene.seat if self.role == "seat" or scene.stopper is None else scene.stopper.body
        return run.with_greens(self.role, kind.body(None, number).greens, weight)

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield numbers of the reed's modes from few to many; for a seat that is a beam its stated number."""
        if self.role == "reed":
            for rung in _reed_modes(context):
                reed = replace(option.method.reed, n_modes=None if rung is None else round(rung.value))
                changes = {} if rung is None else {MODES: rung.changes}
                method = replace(option.method, reed=reed)
                yield replace(option, method=method, changes={**option.changes, **changes})
            return
        number = context.stated.seat.n_modes
        if self.role != "seat" or context.reduced or number is None:
            yield option
            return
        seat, sensitivity = context.scene.seat, context.sensitivity
        own, errors = seat.body(None, number).greens, dict.fromkeys(sensitivity.base, 0.0)
        for other, weight in other_modes(number):
            change = sensitivity.between(own, seat.body(None, other).greens)
            errors = {name: max(value, weight * change[name]) for name, value in errors.items()}
        yield option.with_seat({SEAT_MODES: errors}, {})

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield other numbers of modes of a reed that is a beam."""
        if self.role == "reed" and reed.slender is not None:
            for number in IN_A_TRADE:
                yield Neighbour(f"reed modes {number}", "reed modes", {MODES: number})


def _reed_modes(context: PlanningContext) -> Iterator[Rung | None]:
    """Yield the numbers of the reed's modes to choose from; ``None`` for a reed that is no beam."""
    stated = context.stated.reed.n_modes
    if stated is None:
        yield None
    elif MODES in context.stated.given:
        yield Rung(stated, context.sensitivity.of_modes(stated))
    else:
        yield from no_better_than_finer(context.sensitivity.modes)
