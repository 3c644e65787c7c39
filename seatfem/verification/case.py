"""What a verification case is, and how its numbers carry their own tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A computed number, its absolute numerical uncertainty, observed and theoretical order of convergence if any."""

    value: float
    uncertainty: float = 0.0
    order: float | None = None
    theory: int | None = None


@dataclass(frozen=True)
class Case:
    """A problem with a known answer.

    Attributes:
        case, quantity: what is solved, what is compared (with its unit; none: dimensionless).
        exact: the known value.
        rtol: relative accuracy claimed beyond the numerical uncertainty: of the known value, or of a fixed model.
        source: of the known value.
        compute: our value when one physical input is multiplied by the given coefficient; 1 is the case itself.
    """

    case: str
    quantity: str
    exact: float
    rtol: float
    source: str
    compute: Callable[[float], Estimate]


@dataclass(frozen=True)
class Row:
    """A case, carried out. ``error`` and ``tolerance`` are relative to ``exact``; ``order`` is the observed one.

    ``theory`` is the order that it tends to.
    """

    case: str
    quantity: str
    exact: float
    ours: float
    error: float
    tolerance: float
    verdict: bool
    source: str
    order: float | None = None
    theory: int | None = None


def carry_out(case: Case, coefficient: float = 1.0) -> Row:
    """Compute the case; ``verdict``: |error| <= tolerance = rtol + numerical uncertainty."""
    ours = case.compute(coefficient)
    scale = abs(case.exact)
    error, tolerance = (ours.value - case.exact) / scale, case.rtol + ours.uncertainty / scale
    verdict = abs(error) <= tolerance
    return Row(
        case.case,
        case.quantity,
        case.exact,
        ours.value,
        error,
        tolerance,
        verdict,
        case.source,
        ours.order,
        ours.theory,
    )


def richardson(solve: Callable[[int], float], steps: int, order: int) -> Estimate:
    """Limit of ``solve(n)`` for n = steps, 2 steps, 4 steps, converging smoothly like n^-order.

    Value: extrapolated from the two finest; uncertainty: what the last refinement changed in the extrapolated value,
    which is one order higher and thus falls at least twofold from there; order: observed on the three.
    """
    coarse, middle, fine = (solve(n) for n in (steps, 2 * steps, 4 * steps))
    gain = 2**order - 1
    before, after = middle + (middle - coarse) / gain, fine + (fine - middle) / gain
    ratio = abs((middle - coarse) / (fine - middle)) if fine != middle else math.inf
    return Estimate(after, abs(after - before), math.log2(ratio) if 0 < ratio < math.inf else None, order)


def refined(solve: Callable[[int], float], steps: int) -> Estimate:
    """Finest of ``solve(n)`` for n = steps, 2 steps, 4 steps, where the error falls at least like 1/n but not smoothly.

    The end of contact falls anywhere in a step, so that the constant of the order differs from step to step.
    Uncertainty: the larger of the last change and half the one before.
    """
    coarse, middle, fine = (solve(n) for n in (steps, 2 * steps, 4 * steps))
    return Estimate(fine, max(abs(fine - middle), abs(middle - coarse) / 2))
