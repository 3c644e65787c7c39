"""The next round of a run whose target is missed: a finer plan within the limits, and its predicted time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.quantities import in_time
from impact.runs.variations import safety
from seatfem.machine.resources import available_memory
from seatfem.study.impacts.contact import MAX_STEPS, RunError
from seatfem.study.impacts.touches import RECORD, STOPPER, STRIKER
from seatfem.study.planning import costs, planner
from seatfem.study.planning.plan import Plan
from seatfem.study.runs import converge
from seatfem.study.runs.round import Round
from seatfem.study.safety import (
    LEAST_FINER,
    LONGEST,
    MEMORY,
    MOST_FINER,
    MOST_OFF,
    MOST_ROUNDS,
    RESERVE,
    TELLING,
    source_in_words,
)
from seatfem.study.scene.measures import key_of
from seatfem.units import write_quantity

STAGES: Final[Mapping[str, tuple[str, ...]]] = {
    "seat": costs.OF_THE_SEAT,
    "contact": ("contact", "reed stress", "error budget"),
}
"""Stages of a round by kind: one factor of measured over predicted time is fitted to each kind."""
LEAST_PRICE: Final = 1e-3  # floor of the predicted time [s] of a further round
STATED: Final = "is its key stated in the file?"
AT_ITS_END: Final[Mapping[str, str]] = {
    STRIKER: "the reed's bandwidth is stated, or at the limit of plate theory",
    STOPPER: "it is computed as its own keys state",
    RECORD: "it is given by the measurement",
}
CUT_OFF: Final = "the run ends during the judged landing; a longer run.duration includes all of it"
AFTER: Final = ("spring baseline", "files")  # last stages of a round, whose times scale like that of its contact


@dataclass(frozen=True)
class Limits:
    """Limits on the rounds and the time of a run.

    Attributes:
        rounds: largest number of rounds.
        seconds: wall time of the whole run [s]. A round predicted to exceed it is not begun; one that exceeds it is
            stopped, and the round before is the answer. The first round always ends. Infinite: `LONGEST` each round.
        steady: whether predicted times are used uncorrected, so that results do not depend on the clock.
        stress: whether the reed's largest stresses are computed although the scene does not ask for them.

    Raises:
        RunError: ``rounds`` below 1, ``seconds`` not positive.
    """

    rounds: int = MOST_ROUNDS
    seconds: float = math.inf
    steady: bool = False
    stress: bool = True

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise RunError(f"--rounds = {self.rounds} must be at least 1")
        if not self.seconds > 0:
            raise RunError(f"--max-time = {write_quantity(self.seconds, 'time')} must be positive")


def time_ratios(spent: Mapping[str, float], plan: Plan, before: Mapping[str, float]) -> Mapping[str, float]:
    """Return measured over predicted time of seat and contact; of one that this round reused, the ratio ``before``."""
    ratios = dict(before)
    for kind, stages in STAGES.items():
        predicted = sum(plan.cost.parts.get(stage, 0.0) for stage in stages)
        measured = sum(spent.get(stage, 0.0) for stage in stages)
        if predicted >= TELLING and measured > 0:
            ratios[kind] = min(max(measured / predicted, 1 / MOST_OFF), MOST_OFF)
    return ratios


def price(done: Round, plan: Plan) -> float:
    """Return the predicted wall time [s] of a further round by ``plan``, corrected by the rounds so far."""
    if plan.by_rule:
        return _price_by_work(done, plan)
    stages = {**STAGES, "contact": (*STAGES["contact"], *AFTER)}
    return sum(
        done.time_ratios.get(kind, 1.0) * sum(plan.cost.parts.get(stage, 0.0) for stage in names)
        for kind, names in stages.items()
    )


def _price_by_work(done: Round, plan: Plan) -> float:
    """Return the predicted wall time [s] of a further round of the loop, from that of the round before and known
    exponents of the work: unknowns, ports and band of the seat, steps, ports and modes of the contact."""
    before, after = done.plan.method, plan.method
    of_seat, of_contact = converge.work_ratio(before, after, done.plan.scene)
    of_reed = converge.ratio_of(after.reed.bandwidth, before.reed.bandwidth)
    groups = (
        (of_seat if before.seat != after.seat else 0.0, (*STAGES["seat"], "patch error")),
        (of_reed if before.reed != after.reed else 0.0, (STRIKER,)),
        (of_contact, (*STAGES["contact"], *AFTER)),
    )
    return sum(ratio * sum(done.spent.get(stage, 0.0) for stage in stages) for ratio, stages in groups)


def changed(done: Round, plan: Plan) -> str:
    """Return the choices in which ``plan`` differs, in words."""
    before = {choice.key: choice.value for choice in done.plan.choices}
    return ", ".join(
        f"{choice.key} {before[choice.key]} -> {choice.value}"
        for choice in plan.choices
        if choice.key in before and before[choice.key] != choice.value
    )


def next_plan(done: Round, limits: Limits, time_left: float) -> tuple[Plan | None, str]:
    """Return the refined plan, or ``None`` and the reason in words; ``time_left``: remaining time of the run [s]."""
    if limits.steady:
        done = replace(done, time_ratios={})
    if done.number >= limits.rounds:
        return None, f"{limits.rounds} round{'s'[: limits.rounds > 1]} at most"
    accuracy, budget, landings = done.plan.scene.accuracy, done.left, done.touches.landings
    if accuracy.landing != "run" and landings is not None and landings.status == "cut off":
        return None, CUT_OFF
    if done.plan.by_rule:
        finer, why = converge.refine_plan(done)
        why = why if finer is None else _exceeded_limit(done, finer, time_left)
        return (None, why) if why else (finer, "")
    missed = [name for name in done.judged if budget.relative(name) > accuracy.target]
    reasons = []
    for measure in sorted(missed, key=lambda name: -budget.relative(name)):
        further, why = _refined_for(done, measure, time_left)
        if further is not None:
            return further, ""
        reasons.append(why)
    return None, reasons[0]


def _refined_for(done: Round, measure: str, time_left: float) -> tuple[Plan | None, str]:
    """Return a plan whose error of one measure is predicted within the target, or ``None`` and the reason in words.

    Sources of error are refined one by one, at most by `MOST_FINER`: the cheapest that suffices by itself, else that
    with the largest reduction per predicted time. Sources whose keys are stated or at their limit are not refined.
    """
    allowed = done.plan.scene.accuracy.target * abs(done.left.values[measure]) / safety(measure)
    if allowed == 0.0:
        return None, f"{key_of(measure)} is zero, so that a relative error has no meaning"
    plan, whole = done.plan, abs(done.left.values[measure])
    shares = {source: part[measure] for source, part in done.left.parts.items()}
    before = {source: share if math.isfinite(share) else whole for source, share in shares.items()}
    remaining = dict(before)
    while sum(remaining.values()) > allowed:
        steps = _steps(plan, measure, remaining, before, allowed)
        if plan.method.ports is not None:  # a wider band needs a finer mesh: other sources are refined before
            steps = [step for step in steps if step.source != "reduction"] or (steps if plan == done.plan else [])
        if not steps:
            break
        enough = [step for step in steps if sum(remaining.values()) - remaining[step.source] + step.leaves <= allowed]
        cost = {step.source: max(price(done, step.plan), LEAST_PRICE) for step in steps}
        if enough:
            step = min(enough, key=lambda step: cost[step.source])
        else:
            step = max(steps, key=lambda step: (remaining[step.source] - step.leaves) / cost[step.source])
        plan, remaining[step.source] = step.plan, step.leaves
        if plan.without != done.plan.without:  # the level of the model has changed: its other keys are planned anew
            break
    if plan == done.plan:
        return None, _stuck(done, remaining, allowed)
    kept = plan.method.seat == done.plan.method.seat
    plan = replace(plan, cost=costs.predict_cost(plan.scene, plan.method, kept=kept), kept=kept)
    why = _exceeded_limit(done, plan, time_left)
    return (None, why) if why else (plan, "")


def _stuck(done: Round, left: Mapping[str, float], allowed: float) -> str:
    """Return in words why no source can be refined: one too large by itself is at its limit, or all that count are."""
    order = sorted((source for source in left if left[source] > RESERVE * allowed), key=lambda s: -left[s])
    alone = [source for source in order if left[source] > allowed and planner.refine(done.plan, source) is None]
    if alone:
        why = AT_ITS_END.get(alone[0], STATED)
        return f"{source_in_words(alone[0])}: this error alone is above the target and cannot be reduced ({why})"
    return f"these errors cannot be reduced: {', '.join(map(source_in_words, order))} ({STATED})"


@dataclass(frozen=True)
class _Step:
    """The refinement of one source of error: its name, the refined plan, and the source's error after it."""

    source: str
    plan: Plan
    leaves: float


def _steps(
    plan: Plan, measure: str, left: Mapping[str, float], before: Mapping[str, float], allowed: float
) -> list[_Step]:
    """Return refinements of the sources that count, largest first; none if one too large alone cannot be refined."""
    steps: list[_Step] = []
    for source in sorted(left, key=lambda source: -left[source]):
        if left[source] <= RESERVE / 2 * allowed:
            break
        room = max((1 - RESERVE) * allowed - (sum(left.values()) - left[source]), RESERVE * allowed)
        most = MOST_FINER * left[source] / before[source]
        if most < LEAST_FINER:
            continue
        finer = planner.refine(plan, source, min(max(left[source] / room, LEAST_FINER), most))
        if finer is not None:
            steps.append(_Step(source, finer, left[source] * _reduction_factor(plan, finer, source, measure)))
        elif left[source] > allowed:
            return []
    return steps


def _reduction_factor(plan: Plan, finer: Plan, source: str, measure: str) -> float:
    """Return the predicted error of a source with the ``finer`` plan over that with ``plan``."""
    shares = [{str(name): part[measure] for name, part in each.shares.items()} for each in (plan, finer)]
    now, then = (share.get(source, 0.0) for share in shares)
    return then / now if now > 0 else 1 / LEAST_FINER


def _exceeded_limit(done: Round, plan: Plan, time_left: float) -> str:
    """Return in words which limit a further round would exceed; "" if none."""
    cost, available = plan.cost, available_memory()
    if cost.memory > MEMORY * available:
        return f"the next round would take {cost.memory / 1e9:.2g} GB, {available / 1e9:.2g} GB are available"
    seconds = price(done, plan)
    if seconds > time_left:
        return (
            f"the next round would take about {in_time(seconds)}, {in_time(max(time_left, 0.0))} of --max-time are left"
        )
    if math.isinf(time_left) and seconds > LONGEST:
        return f"the next round would take about {in_time(seconds)}; --max-time, or a finer seat.mesh or step, insists"
    dt = plan.method.time_step
    if dt is not None and plan.scene.run.duration / dt > MAX_STEPS:
        return f"the next round would take {plan.scene.run.duration / dt:.2g} steps, at most {MAX_STEPS:.0e} are stored"
    return ""
