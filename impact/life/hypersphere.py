"""The smallest sphere around points in a space of few dimensions, exactly."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from impact.greens.base import Array
from impact.life.curves import LifeError

_INSIDE = 1e-12  # relative, of a squared radius: what round-off puts outside
_MOST = 2000  # exchanges; some ten happen


def enclosing_sphere(points: Array) -> tuple[Array, float]:
    """Return the (d,) centre and radius of the smallest sphere that holds (n, d) points, d <= 6, all finite.

    The sphere is determined by at most d + 1 of the points. Beginning with two, the point furthest outside joins them,
    and the smallest sphere around these few, found among the circumscribed spheres of their subsets, replaces the last
    one: its radius grows, so that no set returns, and the work ends with the exact sphere; else a `LifeError`.

    Source: E. Welzl, LNCS 555 (1991) 359; B. Gaertner, LNCS 1643 (1999) 325, for the exchange of the furthest point.
    """
    if not np.isfinite(points).all():
        raise LifeError(f"the stress history must be finite, {np.sum(~np.isfinite(points))} values are not")
    origin = points.mean(axis=0)
    scale = float(np.abs(points - origin).max())
    if scale == 0.0:
        return origin, 0.0
    centre, squared, converged = _smallest((points - origin) / scale, _INSIDE, _MOST)
    if not converged:
        raise LifeError(f"no smallest sphere around {len(points)} points after {_MOST} exchanges; report this history")
    return origin + scale * centre, scale * math.sqrt(squared)


@njit(cache=True)
def _furthest(points, centre):  # type: ignore[no-untyped-def]
    best, at = -1.0, 0
    for k in range(points.shape[0]):
        distance = 0.0
        for j in range(points.shape[1]):
            distance += (points[k, j] - centre[j]) ** 2
        if distance > best:
            best, at = distance, k
    return best, at


@njit(cache=True)
def _smallest(points, inside, most):  # type: ignore[no-untyped-def]
    """Return the centre, squared radius, and whether it ended; the radius holds the furthest point."""
    size = points.shape[1]
    held = np.empty((size + 2, size))
    held[0] = points[_furthest(points, points[0])[1]]
    count, centre, squared = 1, held[0].copy(), 0.0
    for _ in range(most):
        distance, at = _furthest(points, centre)
        if distance <= squared * (1 + inside):
            return centre, distance, True
        held[count] = points[at]
        new_centre, new_squared, chosen = _around(held[: count + 1])
        if new_squared <= squared:  # by round-off alone
            return centre, distance, distance <= squared * (1 + 1e-6)
        centre, squared = new_centre, new_squared
        kept = 0
        for k in range(count + 1):
            if chosen >> k & 1:
                held[kept] = held[k]
                kept += 1
        count = kept
    return centre, squared, False


@njit(cache=True)
def _around(few):  # type: ignore[no-untyped-def]
    """Return the smallest sphere around at most d + 2 points, the last of them on it: centre, squared radius, subset as
    bits."""
    count, size = few.shape
    best, centre, chosen = np.inf, few[0].copy(), 0
    for subset in range(1, 1 << (count - 1)):
        members = 0
        for k in range(count - 1):
            members += subset >> k & 1
        if members <= size:
            trial = _circumscribed(few, subset)
            squared = _furthest(few, trial)[0]
            if squared < best:
                best, centre, chosen = squared, trial, subset | 1 << (count - 1)
    return centre, best, chosen


@njit(cache=True)
def _circumscribed(few, subset):  # type: ignore[no-untyped-def]
    """Return the centre in the plane of the subset and the last point: 2 G lam = diag G, G of the edges from that
    point."""
    count, size = few.shape
    edges = np.empty((count, size))
    m = 0
    for k in range(count - 1):
        if subset >> k & 1:
            edges[m] = few[k] - few[count - 1]
            m += 1
    edges = edges[:m]
    matrix = 2 * edges @ edges.T
    right = 0.5 * np.diag(matrix)
    for k in range(m):  # elimination; edges that others imply are left out
        pivot = k + np.argmax(np.abs(np.diag(matrix)[k:]))
        for each in range(m):
            matrix[k, each], matrix[pivot, each] = matrix[pivot, each], matrix[k, each]
        for each in range(m):
            matrix[each, k], matrix[each, pivot] = matrix[each, pivot], matrix[each, k]
        right[k], right[pivot] = right[pivot], right[k]
        edges[k], edges[pivot] = edges[pivot].copy(), edges[k].copy()
        if matrix[k, k] <= 1e-24:
            m = k
            break
        for row in range(k + 1, m):
            factor = matrix[row, k] / matrix[k, k]
            matrix[row] -= factor * matrix[k]
            right[row] -= factor * right[k]
    centre = few[count - 1].copy()
    weights = np.zeros(m)
    for k in range(m - 1, -1, -1):
        weights[k] = (right[k] - matrix[k, k + 1 : m] @ weights[k + 1 :]) / matrix[k, k]
        centre += weights[k] * edges[k]
    return centre
