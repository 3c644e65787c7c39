"""Refinement of a plan whose run missed the target, and the number of rounds that a plan expects."""

import math
from dataclasses import dataclass, replace
from typing import Final

from impact.quantities import in_digits
from impact.runs.variations import safety, times
from seatfem.machine.resources import Machine
from seatfem.structures.rings import ACROSS, MOST_PORTS, Division
from seatfem.study.impacts import touches, validity
from seatfem.study.ladders.table import described, ladders
from seatfem.study.method import BAND, CONTACT_SIZE, MODEL, PORTS, REED_BAND, RINGS, SIZE, chooses_one_port
from seatfem.study.planning import costs, planner
from seatfem.study.planning.plan import Plan
from seatfem.study.prerun.lips import rings_refused
from seatfem.study.safety import LEAST_FINER, LONGEST, MOST_FINER, MOST_ROUNDS, in_words

LEAST_WIDER: Final = 1.1  # least factor by which the band of a plate is widened
AGAIN: Final = (*costs.OF_THE_SEAT, "contact", "reed stress", "error budget")
"""Stages that every round repeats; the others happen once a run."""


def refine(plan: Plan, source: str, factor: float = 2.0, machine: Machine | None = None) -> Plan | None:
    """Return ``plan`` refined such that the error of one ``source`` shrinks by about ``factor``.

    A simpler level (spring, rod) is replaced by the next one, and one contact point by arcs; otherwise the keys of the
    source get finer values.

    Args:
        plan: plan whose run missed the target.
        source: source of error: mesh, reduction, time_step, model, patch, striker or lip.
        factor: ratio of its error to the allowed one, clipped to `LEAST_FINER` ... `MOST_FINER`.

    Returns:
        ``None`` if the file states the keys of the source, or there are none.
    """
    if source in (touches.LIP, "patch") and chooses_one_port(plan.scene.contact, plan.method):
        return planner.plan_scene(plan.scene, machine, without=(*plan.without, validity.ONE_PORT))
    if source == "model" and plan.level in ("spring", "rod") and not plan.is_given(MODEL):
        return planner.plan_scene(plan.scene, machine, without=(*plan.without, plan.level))
    return _finer_keys(plan, source, factor, machine)


def _finer_keys(plan: Plan, source: str, factor: float, machine: Machine | None) -> Plan | None:
    """Return ``plan`` with finer values of the keys of ``source``; ``None`` if all are stated or at their limit."""
    factor = min(max(factor, LEAST_FINER), MOST_FINER)
    values = {
        ladder.key: finer
        for ladder in ladders()
        if ladder.source == source and plan.is_open(ladder.key) and (value := plan.method.value(ladder.key))
        if not (ladder.key == RINGS and plan.method.ports is not None)
        if (finer := ladder.finer(value, factor, plan.scene.run, plan.scene.reed)) is not None
    }
    if values.get(REED_BAND, math.inf) < LEAST_WIDER * (plan.method.reed.bandwidth or 0.0):
        return None
    if PORTS in values or (source == "patch" and plan.method.seat.in_arcs):
        return _in_more_parts(plan, factor, machine)
    if BAND in values and plan.method.ports is not None:  # solved by modes: those of a wider band are shorter waves
        narrower = (plan.method.seat.bandwidth or 0.0) / values[BAND]
        values |= {
            key: float(f"{narrower * plan.method.value(key):.2g}")
            for key in (SIZE, CONTACT_SIZE)
            if plan.is_open(key) and plan.method.value(key)
        }
    if CONTACT_SIZE not in values and SIZE in values:
        values[SIZE] = max(values[SIZE], plan.method.seat.contact_size or 0.0)
    method = plan.method.replaced(values)
    if method == plan.method:
        return None
    reason = f"made finer: the error from {in_words(source)} was {in_digits(factor, 2)} times too large"
    choices = tuple(
        replace(choice, value=described(choice.key, values[choice.key]), reason=reason)
        if choice.key in values
        else choice
        for choice in plan.choices
    )
    shares = {
        s: {name: value / (factor if s == source else 1.0) for name, value in share.items()}
        for s, share in plan.shares.items()
    }
    whole = {name: sum(share.get(name, 0.0) for share in plan.shares.values()) for name in plan.error}
    reduced = {name: sum(share.get(name, 0.0) for share in shares.values()) for name in plan.error}
    error = {name: bar * reduced[name] / whole[name] if whole[name] else bar for name, bar in plan.error.items()}
    same_seat = source in ("time_step", "model")  # the seat of the round before is reused
    cost = costs.predict_cost(plan.scene, method, machine, kept=same_seat)
    return replace(plan, method=method, choices=choices, shares=shares, error=error, cost=cost, kept=same_seat)


def _in_more_parts(plan: Plan, factor: float, machine: Machine | None) -> Plan | None:
    """Return ``plan`` with more rings across the arcs of the lip, or twice as many arcs, whichever has the larger
    predicted error; ``None`` if its number is stated or at its limit."""
    division, measures = plan.method.seat.division, plan.scene.accuracy.judged
    more = {PORTS: Division(2 * division.arcs, division.rings)}
    if division.arcs > 1 and not rings_refused(plan.scene.seat, plan.scene.life):
        rings = next((number for number in ACROSS if number > division.rings), None)
        more |= {} if rings is None else {RINGS: Division(division.arcs, rings)}

    def error_by(key: str) -> float:
        return max((safety(name) * plan.parts.get(key, {}).get(name, 0.0) for name in measures), default=0.0)

    open_keys = [key for key, division in more.items() if plan.is_open(key) and division.count <= MOST_PORTS]
    key = max((PORTS, RINGS), key=error_by) if plan.parts else next(iter(open_keys), PORTS)
    if key not in open_keys:
        return None
    method = plan.method.along(plan.scene.geometry, more[key].arcs, more[key].rings)
    reason = f"made finer: the error from the contact face was {in_digits(factor, 2)} times too large"
    choices = tuple(
        replace(choice, value=described(key, method.value(key)), reason=reason) if choice.key == key else choice
        for choice in plan.choices
    )
    smaller = 0.5 if key == PORTS else (division.rings / more[key].rings) ** 2
    parts = {**plan.parts, key: times(smaller, plan.parts[key])} if key in plan.parts else plan.parts
    patch = times(0.5, plan.shares.get("patch", {}))
    if key in plan.parts:
        gain = {name: (1 - smaller) * value for name, value in plan.parts[key].items()}
        patch = {name: max(value - gain.get(name, 0.0), 0.0) for name, value in plan.shares["patch"].items()}
    cost = costs.predict_cost(plan.scene, method, machine)
    shares = {**plan.shares, "patch": patch}
    return replace(plan, method=method, choices=choices, shares=shares, parts=parts, cost=cost, kept=False)


@dataclass(frozen=True)
class RoundsAhead:
    """Attributes:
    number: expected number of rounds.
    seconds: predicted wall time of the run with all of these rounds [s].
    further: predicted wall time of one more round [s]; ``None`` if nothing can be refined."""

    number: int
    seconds: float
    further: float | None


def rounds_ahead(plan: Plan, machine: Machine | None = None) -> RoundsAhead:
    """Return the rounds expected: one if the predicted error meets the target, else as needed or allowed."""
    number, seconds, further = 1, plan.cost.seconds, _next(plan, machine)
    while not plan.meets_target and further is not None and number < MOST_ROUNDS and _again(further) <= LONGEST:
        plan, number, seconds = further, number + 1, seconds + _again(further)
        further = _next(plan, machine)
    return RoundsAhead(number, seconds, None if further is None else _again(further))


def _next(plan: Plan, machine: Machine | None) -> Plan | None:
    """Return ``plan`` with the largest source of the largest error refined that can be; ``None`` if a source that
    cannot exceeds the target by itself."""
    worst = max(plan.error, key=lambda name: plan.error[name], default=None)
    if worst is None:
        return None
    contributions = {source: safety(worst) * share.get(worst, 0.0) for source, share in plan.shares.items()}
    order = sorted(contributions, key=lambda source: -contributions[source])
    finer = {source: _finer_keys(plan, source, LEAST_FINER, machine) for source in order}
    if any(finer[source] is None and contributions[source] > plan.scene.accuracy.target for source in order):
        return None
    return next((option for option in finer.values() if option is not None), None)


def _again(plan: Plan) -> float:
    return sum(seconds for stage, seconds in plan.cost.parts.items() if stage in AGAIN)
