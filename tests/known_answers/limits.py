"""The limits of computed sequences, and the tolerance that they carry."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np

from seatfem.verify import Case, Estimate

Solve = Callable[[int, float], Sequence[float]]
"""Level n (1, 2, 4, ... times the coarsest) and the factor on a physical input -> all quantities of a problem."""


def richardson(solve: Callable[[int], float], steps: int, order: int) -> Estimate:
    """Return the limit of ``solve(n)`` for n = steps, 2 steps, 4 steps, converging smoothly like n^-order.

    Value: extrapolated from the two finest; uncertainty: what the last refinement changed in the extrapolated value,
    which is one order higher and thus falls at least twofold from there; order: observed on the three.
    """
    coarse, middle, fine = (solve(n) for n in (steps, 2 * steps, 4 * steps))
    gain = 2**order - 1
    before, after = middle + (middle - coarse) / gain, fine + (fine - middle) / gain
    ratio = abs((middle - coarse) / (fine - middle)) if fine != middle else math.inf
    return Estimate(after, abs(after - before), math.log2(ratio) if 0 < ratio < math.inf else None, order)


def stepped(solve: Callable[[float, int], float], steps: int, order: int | None = None) -> Callable[[float], Estimate]:
    """Return a case's ``compute`` from ``solve(coefficient, n)``: as `richardson` with an order, else as `refined`."""

    def compute(coefficient: float) -> Estimate:
        of_steps = partial(solve, coefficient)
        return refined(of_steps, steps) if order is None else richardson(of_steps, steps, order)

    return compute


def refined(solve: Callable[[int], float], steps: int) -> Estimate:
    """Return the finest of ``solve(n)``, n = steps, 2 steps, 4 steps; errors fall at least like 1/n, not smoothly.

    The end of contact falls anywhere in a step, so that the constant of the order differs from step to step.
    Uncertainty: the larger of the last change and half the one before.
    """
    coarse, middle, fine = (solve(n) for n in (steps, 2 * steps, 4 * steps))
    return Estimate(fine, max(abs(fine - middle), abs(middle - coarse) / 2))


def converged(solve: Solve, steps: int, order: int) -> Callable[[int], Callable[[float], Estimate]]:
    """Return ``compute`` of the i-th quantity as the limit of the meshes n = steps, 2 steps, 4 steps, error ~ n^-order.

    All quantities share the three solutions. A factor other than 1 is computed on the coarsest mesh, and the limit
    takes part in its relative change: the error of the mesh is nearly the same with it and without.
    """
    shared = cache(solve)

    def quantity(i: int) -> Callable[[float], Estimate]:
        return recomputed(
            lambda k: float(shared(steps, k)[i]), lambda: richardson(lambda n: shared(n, 1.0)[i], steps, order)
        )

    return quantity


def limit_cases(
    name: str, exact: Mapping[str, float], rtol: float, source: str, limit: Callable[[int], Callable[[float], Estimate]]
) -> tuple[Case, ...]:
    """Return a case for each quantity of a problem, of which ``limit(i)`` computes the i-th."""
    quantities = enumerate(exact.items())
    return tuple(Case(name, quantity, value, rtol, source, limit(i)) for i, (quantity, value) in quantities)


def small_limit(solve: Solve, levels: int = 4) -> Callable[[int], Callable[[float], Estimate]]:
    """Return the same as a small parameter h ~ 1/n goes to 0, n = 1, 2, 4, ...: the error is a series in h.

    Romberg's table; its last entry, with what the last elimination changed as uncertainty. The order is that of the
    column from which the term in h is gone: 2.
    """
    shared = cache(solve)

    def quantity(i: int) -> Callable[[float], Estimate]:
        return recomputed(
            lambda k: float(shared(1, k)[i]), lambda: romberg([float(shared(2**m, 1.0)[i]) for m in range(levels)])
        )

    return quantity


def romberg(values: Sequence[float]) -> Estimate:
    """Return the limit of at least three values whose errors are series in h = 1, 1/2, 1/4, ..., see `small_limit`."""
    columns = [np.asarray(values, dtype=np.float64)]
    for power in range(1, len(values)):
        last = columns[-1]
        columns.append(last[1:] + np.diff(last) / (2**power - 1))
    first = np.diff(columns[1])
    ratio = abs(first[-2] / first[-1]) if len(first) > 1 and first[-1] != 0 else math.nan
    order = math.log2(ratio) if math.isfinite(ratio) and ratio > 0 else None
    return Estimate(float(columns[-1][0]), abs(float(columns[-1][0] - columns[-2][-1])), order, 2 if order else None)


def recomputed(coarse: Callable[[float], float], limit: Callable[[], Estimate]) -> Callable[[float], Estimate]:
    """Return a case's ``compute`` from its limit and, for a factor other than 1, the coarse relative change."""
    once = cache(limit)

    def compute(coefficient: float) -> Estimate:
        estimate = once()
        if coefficient == 1.0:
            return estimate
        factor = coarse(coefficient) / coarse(1.0)
        return replace(estimate, value=estimate.value * factor, uncertainty=estimate.uncertainty * abs(factor))

    return compute
