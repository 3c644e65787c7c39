"""Limits of computed sequences: by mesh, by thickness; and what they depend on, recomputed on the coarsest level."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from seatfem.verification.case import Estimate, richardson

Solve = Callable[[int, float], Sequence[float]]
"""Level n (1, 2, 4, ... times the coarsest) and the factor on a physical input -> all quantities of a problem."""


def converged(solve: Solve, steps: int, order: int) -> Callable[[int], Callable[[float], Estimate]]:
    """``compute`` of the i-th quantity as the limit of the meshes n = steps, 2 steps, 4 steps, error ~ n^-order.

    All quantities share the three solutions. A factor other than 1 is computed on the coarsest mesh, and the limit
    takes part in its relative change: the error of the mesh is nearly the same with it and without.
    """
    shared = cache(solve)

    def quantity(i: int) -> Callable[[float], Estimate]:
        return recomputed(
            lambda k: float(shared(steps, k)[i]), lambda: richardson(lambda n: shared(n, 1.0)[i], steps, order)
        )

    return quantity


def small_limit(solve: Solve, levels: int = 4) -> Callable[[int], Callable[[float], Estimate]]:
    """The same as a small parameter h ~ 1/n goes to zero, n = 1, 2, 4, ...: the error is a series in h, h^2, h^3.

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
    """Limit of at least three values whose errors are series in h = 1, 1/2, 1/4, ..., see `small_limit`."""
    columns = [np.asarray(values, dtype=np.float64)]
    for power in range(1, len(values)):
        last = columns[-1]
        columns.append(last[1:] + np.diff(last) / (2**power - 1))
    first = np.diff(columns[1])
    ratio = abs(first[-2] / first[-1]) if len(first) > 1 and first[-1] != 0 else math.nan
    order = math.log2(ratio) if math.isfinite(ratio) and ratio > 0 else None
    return Estimate(float(columns[-1][0]), abs(float(columns[-1][0] - columns[-2][-1])), order, 2 if order else None)


def recomputed(coarse: Callable[[float], float], limit: Callable[[], Estimate]) -> Callable[[float], Estimate]:
    """``compute`` of a case from its limit and, for a factor other than 1, the coarse value's relative change."""
    once = cache(limit)

    def compute(coefficient: float) -> Estimate:
        found = once()
        if coefficient == 1.0:
            return found
        factor = coarse(coefficient) / coarse(1.0)
        return replace(found, value=found.value * factor, uncertainty=found.uncertainty * abs(factor))

    return compute
