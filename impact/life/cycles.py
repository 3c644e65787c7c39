"""Cycles of a stress history by rainflow counting, after ASTM E1049-85 (2017)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from rainflow import extract_cycles

from impact.brief import brief
from impact.greens.base import Array
from impact.life.curves import LifeError


@dataclass(frozen=True, repr=False)
class Cycles:
    """(m,) cycles of one block: ``ranges`` smax - smin and ``means`` (smax + smin)/2 [Pa], and how many, ``counts``."""

    ranges: Array
    means: Array
    counts: Array

    __repr__ = brief


def reversals(history: ArrayLike) -> Array:
    """Return the (r,) turning points of an (n,) history [Pa], its ends among them; equal neighbours count once.

    Raises:
        LifeError: no values, or some that are not finite.
    """
    values = np.asarray(history, dtype=float)
    if values.ndim != 1 or not values.size:
        raise LifeError(f"a stress history is one row of values, at least one, not an array {values.shape}")
    if not np.isfinite(values).all():
        raise LifeError(f"the stress history must be finite, {np.sum(~np.isfinite(values))} values are not")
    steps = np.diff(values)
    moving = steps != 0
    if not moving.all():
        values, steps = values[np.append(True, moving)], steps[moving]
    rising = steps > 0
    turns = np.ones(len(values), dtype=bool)
    np.not_equal(rising[1:], rising[:-1], out=turns[1:-1])
    return values[turns]


def from_peak(history: ArrayLike) -> Array:
    """Return the (r,) turning points of the history repeated for ever, one period from its highest peak to the next
    one.

    Raises:
        LifeError: as `reversals`.
    """
    points = reversals(history)
    top = int(points.argmax())
    return reversals(np.concatenate([points[top:], points[: top + 1]]))


def rainflow(history: ArrayLike, *, repeated: bool = True) -> Cycles:
    """Count cycles.

    Three consecutive turning points with ranges Y, X: Y is a cycle where X >= Y. A ``repeated`` history begins at its
    highest peak, so that nothing but whole cycles is left; the residue of the four-point method, taken twice, gives
    the same. Otherwise ranges that hold the beginning, and those left at the end, are half cycles, in their order.

    Args:
        history: (n,) stress, one block [Pa].
        repeated: the block repeats without end, as revolutions do.

    Raises:
        LifeError: as `reversals`.

    Source: ASTM E1049-85, 5.4.4 (simple) and 5.4.5 (repeating histories), by the package `rainflow`.
    """
    if repeated:
        return Cycles(*counted(from_peak(history)))
    cycles = [cycle[:3] for cycle in extract_cycles(reversals(history))]
    ranges, means, counts = np.array(cycles, dtype=float).reshape(-1, 3).T
    return Cycles(ranges, means, counts)


def counted(points: Array) -> tuple[Array, Array, Array]:
    """Return the ranges, means and counts of turning points that begin and end at the highest one.

    The package's rule in a compiled loop, some hundred times as fast: maps count millions of turning points.
    """
    ranges, means = _whole_cycles(points)
    return ranges, means, np.ones(len(ranges))


@njit(cache=True)
def _whole_cycles(points):  # type: ignore[no-untyped-def]
    stack = np.empty(len(points))
    ranges, means = np.empty(len(points) // 2), np.empty(len(points) // 2)
    depth, count = 0, 0
    for value in points:
        stack[depth] = value
        depth += 1
        while depth >= 3 and abs(value - stack[depth - 2]) >= abs(stack[depth - 2] - stack[depth - 3]):
            ranges[count] = abs(stack[depth - 2] - stack[depth - 3])
            means[count] = 0.5 * (stack[depth - 2] + stack[depth - 3])
            count += 1
            depth -= 2
            stack[depth - 1] = value
    return ranges[:count], means[:count]
