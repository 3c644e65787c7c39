"""Ladders of the bodies that are known by their own modes: how many of them are kept."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from impact.runs.variations import Terms, Variation
from seatfem.structures.rings import Division
from seatfem.study.impacts.contact import problem_of, striker_of
from seatfem.study.ladders.ladder import ComputedRun, Ladder, Neighbour, Option, Role
from seatfem.study.method import MODES, SEAT_MODES, RunMethod, is_given
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.other_modes import other_modes
from seatfem.study.prerun.sensitivity import Rung, no_better_than_finer
from seatfem.study.safety import FEWER
from seatfem.study.scene import Scene

MOST_MODES: Final = 1000
IN_A_TRADE: Final = (10, 20, 80)


@dataclass(frozen=True)
class ModeCount(Ladder):
    """The number of modes of a beam; runs with fewer of them, and of few ones with many, are the neighbours."""

    role: Role = "seat"

    def finer(self, value: int, factor: float, scene: Scene) -> int | None:
        """Return more modes."""
        if self.role == "stopper":
            return None
        return min(MOST_MODES, math.ceil(value * FEWER ** math.ceil(math.log2(factor))))

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the body is a beam, of a stopper one that is met as a whole."""
        if self.role == "stopper" and (run.solved("stopper") is not None or _in_parts(run.scene)):
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
        """Yield numbers of the reed's modes from few to many; of a seat that is a beam its own number."""
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

    def beside(self, scene: Scene, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield other numbers of modes of a reed that is a beam."""
        if self.role == "reed" and scene.reed.slender is not None:
            for number in IN_A_TRADE:
                yield Neighbour(f"reed modes {number}", "reed modes", {MODES: number})


def _reed_modes(context: PlanningContext) -> Iterator[Rung | None]:
    """Yield the numbers of the reed's modes that may be chosen; ``None`` of other reeds."""
    stated = context.stated.reed.n_modes
    if stated is None:
        yield None
    elif is_given(context.scene, MODES):
        yield Rung(stated, context.sensitivity.of_modes(stated))
    else:
        yield from no_better_than_finer(context.sensitivity.modes)


def _in_parts(scene: Scene) -> bool:
    return scene.stopper is not None and scene.stopper.parts != Division()
