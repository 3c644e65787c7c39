"""How many rounds of refinement a plan expects, what they take in all, and the price of one more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from seatfem.machine.rates import Machine
from seatfem.study.planning.means import LONGEST, OF_THE_SEAT
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.refining import LEAST, finer_keys

MOST: Final = 4  # rounds of a run, unless it is told otherwise
AGAIN: Final = (*OF_THE_SEAT, "contact", "reed stress", "error budget")
"""Stages of every round; the others are the run's."""


@dataclass(frozen=True)
class RoundsAhead:
    """Attributes:
    number: rounds expected.
    seconds: predicted wall time of the run with all of them [s].
    further: of one more round, should the measured error ask for it [s]; ``None`` where nothing can be made finer.
    """

    number: int
    seconds: float
    further: float | None


def rounds_ahead(plan: Plan, machine: Machine | None = None) -> RoundsAhead:
    """One where the predicted error meets the target; else as many as make it finer until it does, or time is up."""
    number, seconds, further = 1, plan.cost.seconds, _finer(plan, machine)
    while not plan.meets_target and further is not None and number < MOST and _again(further) <= LONGEST:
        plan, number, seconds = further, number + 1, seconds + _again(further)
        further = _finer(plan, machine)
    return RoundsAhead(number, seconds, None if further is None else _again(further))


def _finer(plan: Plan, machine: Machine | None) -> Plan | None:
    """With the largest source of the largest error made smaller, or the next one that can be."""
    worst = max(plan.error, key=lambda name: plan.error[name], default=None)
    if worst is None:
        return None
    for source in sorted(plan.shares, key=lambda source: -plan.shares[source].get(worst, 0.0)):
        finer = finer_keys(plan, source, LEAST, machine)
        if finer is not None:
            return finer
    return None


def _again(plan: Plan) -> float:
    return sum(seconds for stage, seconds in plan.cost.parts.items() if stage in AGAIN)
