"""What follows a round that misses its target: a finer plan within the limits, and its price."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from impact.runs.budget import Budget, safety
from seatfem.machine.memory import available_memory
from seatfem.study.impacts.contact import MAX_STEPS, RunError
from seatfem.study.planning.costs import OF_THE_SEAT
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.refining import refine
from seatfem.study.runs.round import Round
from seatfem.study.safety import LONGEST, MEMORY, MOST_OFF, MOST_ROUNDS, RESERVE, TELLING
from seatfem.study.scene.measures import key_of

STAGES: Final[Mapping[str, tuple[str, ...]]] = {
    "seat": OF_THE_SEAT,
    "contact": ("contact", "reed stress", "error budget"),
}
"""Stages of a round whose predicted times are off alike."""
AFTER: Final = ("spring baseline", "files")  # of a round, as far off as its contact


@dataclass(frozen=True)
class Limits:
    """How far rounds may go.

    Attributes:
        rounds: at most so many.
        seconds: wall time of the whole run [s], by prediction of each further round; a round that outlasts it is
            stopped, and the one before is the answer. The first round is always finished. Infinite: `LONGEST` for
            each round.

    Raises:
        RunError: no round, no time.
    """

    rounds: int = MOST_ROUNDS
    seconds: float = math.inf

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise RunError(f"--rounds = {self.rounds} must be at least 1")
        if not self.seconds > 0:
            raise RunError(f"--max-time = {self.seconds:g} s must be positive")


def paces(spent: Mapping[str, float], plan: Plan, before: Mapping[str, float]) -> Mapping[str, float]:
    """Measured over predicted time of seat and contact; where this round has not computed one, as ``before``."""
    found = dict(before)
    for kind, stages in STAGES.items():
        predicted = sum(plan.cost.parts.get(stage, 0.0) for stage in stages)
        measured = sum(spent.get(stage, 0.0) for stage in stages)
        if predicted >= TELLING and measured > 0:
            found[kind] = min(max(measured / predicted, 1 / MOST_OFF), MOST_OFF)
    return found


def price(done: Round, plan: Plan) -> float:
    """Predicted wall time [s] of one more round by ``plan``, as much off as the rounds so far were."""
    of = {**STAGES, "contact": (*STAGES["contact"], *AFTER)}
    return sum(done.paces.get(kind, 1.0) * sum(plan.cost.parts.get(stage, 0.0) for stage in of[kind]) for kind in of)


def changed(done: Round, plan: Plan) -> str:
    """What ``plan`` makes otherwise, in words."""
    before = {choice.key: choice.value for choice in done.plan.choices}
    return ", ".join(
        f"{choice.key} {before[choice.key]} -> {choice.value}"
        for choice in plan.choices
        if choice.key in before and before[choice.key] != choice.value
    )


def next_plan(done: Round, limits: Limits, time_left: float) -> tuple[Plan | None, str]:
    """The refined plan, or why there is none; ``time_left``: of the time allowed [s]."""
    if done.number >= limits.rounds:
        return None, f"{limits.rounds} round{'s'[: limits.rounds > 1]} at most"
    accuracy, left = done.plan.scene.accuracy, done.left
    missing = [name for name in accuracy.measures if left.relative(name) > accuracy.target]
    reasons = []
    for measure in sorted(missing, key=lambda name: -left.relative(name)):
        further, why = _finer_in(done, measure, time_left)
        if further is not None:
            return further, ""
        reasons.append(why)
    return None, reasons[0]


def _finer_in(done: Round, measure: str, time_left: float) -> tuple[Plan | None, str]:
    """For the sake of one measure."""
    left = done.left
    allowed = done.plan.scene.accuracy.target * abs(left.values[measure]) / safety(measure)
    if allowed == 0.0:
        return None, f"{key_of(measure)} is zero, a relative error means nothing"
    stated = []
    for source in sorted(left.parts, key=lambda s: -left.parts[s][measure]):
        share = left.parts[source][measure]
        if share <= RESERVE * allowed:
            break
        plan = refine(done.plan, source, _too_large(left, source, measure, allowed))
        if plan is not None:
            why = _too_much(done, plan, time_left)
            return (None, why) if why else (plan, "")
        stated.append(source.replace("_", " "))
        if share > allowed:  # by itself: nothing else can help
            break
    return None, f"nothing finer is left to choose for the {' and the '.join(stated)} (stated in the file?)"


def _too_large(left: Budget, source: str, measure: str, allowed: float) -> float:
    """By which factor one source is too large, the others left as they are and a fifth kept in reserve."""
    here = left.parts[source][measure]
    others = sum(part[measure] for part in left.parts.values()) - here
    return here / max((1 - RESERVE) * allowed - others, RESERVE * allowed)


def _too_much(done: Round, plan: Plan, time_left: float) -> str:
    """What of a further round would be too much; "" if nothing."""
    cost, there = plan.cost, available_memory()
    if cost.memory > MEMORY * there:
        return f"the next round would take {cost.memory / 1e9:.2g} GB, {there / 1e9:.2g} GB are available"
    seconds = price(done, plan)
    if seconds > time_left:
        return f"the next round would take about {seconds:.2g} s, {max(time_left, 0.0):.2g} s of --max-time are left"
    if math.isinf(time_left) and seconds > LONGEST:
        return f"the next round would take about {seconds:.2g} s; --max-time, or a finer seat.mesh or step, insists"
    dt = plan.method.time_step
    if dt is not None and plan.scene.run.duration / dt > MAX_STEPS:
        return f"the next round would take {plan.scene.run.duration / dt:.2g} steps, at most {MAX_STEPS:.0e} are stored"
    return ""
