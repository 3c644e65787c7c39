"""Which points nothing beats in both time and error."""

from __future__ import annotations

import math
from collections.abc import Sequence


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> tuple[int, ...]:
    """Indices of the points that no other one beats, by increasing cost.

    A point is beaten by one that is at least as cheap and at least as accurate, and better in one of the two; of equal
    points the first stands for all. Points with a cost or error that is no finite number are left out.
    """
    order = sorted(
        (i for i in range(len(costs)) if math.isfinite(costs[i]) and math.isfinite(errors[i])),
        key=lambda i: (costs[i], errors[i], i),
    )
    front: list[int] = []
    for i in order:
        if not front or errors[i] < errors[front[-1]]:
            front.append(i)
    return tuple(front)


def cost_excess(cost: float, error: float, costs: Sequence[float], errors: Sequence[float]) -> float:
    """``cost`` over the least cost among the points at most as wrong as ``error``; 1 on the front or before it.

    Not a number where the point itself is none, or nothing is as accurate.
    """
    as_good = [c for c, e in zip(costs, errors, strict=True) if math.isfinite(c) and e <= error]
    if not math.isfinite(cost) or not math.isfinite(error):
        return math.nan
    return max(1.0, cost / min(as_good)) if as_good else 1.0
