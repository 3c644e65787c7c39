"""Plane polygons, (n, 2) arrays of corners [m]: what lies in them, what meets, how wide they are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array

ALONG: Final = (0.1, 0.3, 0.5, 0.7, 0.9)  # of each edge: where widths are measured
BLOCK: Final = 1 << 20  # pairs that are looked at together
FACING: Final = -0.5  # n.n of two edges at most, whose distance is a width: they make 60 degrees at most


def cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def distances(starts: Array, ends: Array, points: Array) -> Array:
    """Return the (edges, points) distances of points from straight edges."""
    run = (ends - starts)[:, None]
    off = points[None] - starts[:, None]
    at = np.clip((off * run).sum(axis=2) / (run * run).sum(axis=2), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - at[..., None] * run, axis=2))


def inside(loops: Iterable[Array], points: Array) -> NDArray[np.bool_]:
    """Return (n,) whether points (n, 2) lie within an odd number of polygons."""
    odd = np.zeros(len(points), dtype=bool)
    for loop in loops:
        (x0, y0), (x1, y1) = loop.T, np.roll(loop, -1, axis=0).T
        slope = np.divide(x1 - x0, y1 - y0, out=np.zeros(len(loop)), where=y1 != y0)
        for rows in np.array_split(np.arange(len(points)), 1 + len(points) * len(loop) // BLOCK):
            x, y = points[rows].T[:, :, None]
            crossed = ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * slope)
            odd[rows] ^= crossed.sum(axis=1) % 2 == 1
    return odd


def holds(corners: Array, point: Sequence[float] | Array) -> bool:
    """Return whether a polygon has a point inside."""
    return bool(inside([corners], np.asarray(point, dtype=float)[None])[0])


def area(corners: Array) -> float:
    """Return the area, positive of a polygon that runs anticlockwise."""
    return float(cross(corners, np.roll(corners, -1, axis=0)).sum() / 2)


def crossing(corners: Array, within: float) -> tuple[int, int] | None:
    """Return the first two edges of a polygon that meet elsewhere than at a corner which they share."""
    n, ahead = len(corners), np.roll(corners, -1, axis=0)
    for i in range(n):
        meets = _meets(corners[i], ahead[i], corners, ahead, within)
        meets[[i, (i + 1) % n, (i - 1) % n]] = False
        back = distances(corners[i][None], ahead[i][None], ahead[(i + 1) % n][None])
        if n > 3 and back[0, 0] <= within:  # the next edge runs back on it
            meets[(i + 1) % n] = True
        if meets.any():
            return i, int(np.argmax(meets))
    return None


def touching(one: Array, other: Array, within: float) -> bool:
    """Return whether the edges of two polygons meet."""
    if (one.min(axis=0) > other.max(axis=0) + within).any() or (other.min(axis=0) > one.max(axis=0) + within).any():
        return False
    ahead = np.roll(other, -1, axis=0)
    return any(_meets(a, b, other, ahead, within).any() for a, b in zip(one, np.roll(one, -1, axis=0), strict=True))


def _meets(start: Array, end: Array, starts: Array, ends: Array, within: float) -> NDArray[np.bool_]:
    """Return which straight edges meet the one given."""
    edge = end - start
    one, other = cross(edge, starts - start), cross(edge, ends - start)
    back = cross(ends - starts, start - starts), cross(ends - starts, end - starts)
    meets = (one * other < 0) & (back[0] * back[1] < 0)
    ends_on_it = distances(start[None], end[None], np.concatenate([starts, ends]))[0] <= within
    return np.asarray(meets | ends_on_it[: len(starts)] | ends_on_it[len(starts) :])


def narrowest(around: Sequence[Array], within: float) -> float:
    """Return the shortest way across, square to an edge, to one that faces it; infinite where none does.

    ``around``: the outline anticlockwise, then holes clockwise.
    """
    start = np.concatenate(around)
    edges = np.concatenate([np.roll(corners, -1, axis=0) for corners in around]) - start
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1)[:, None]
    ways = []
    for rows in np.array_split(np.arange(len(start)), 1 + len(start) ** 2 // BLOCK):
        faces, across = inward[rows] @ inward.T <= FACING, cross(inward[rows, None], edges[None])
        for at in ALONG:
            apart = start[None] - (start + at * edges)[rows, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                far, along = cross(apart, edges[None]) / across, cross(apart, inward[rows, None]) / across
            hit = np.isfinite(far) & (along >= 0) & (along <= 1) & (far > within)
            far = np.where(hit, far, np.inf)
            first = np.argmin(far, axis=1)[:, None]
            ways.append(np.where(np.take_along_axis(faces, first, 1), np.take_along_axis(far, first, 1), np.inf).min())
    return float(min(ways))
