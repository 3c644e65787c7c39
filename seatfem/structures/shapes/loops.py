"""Closed loops of straight edges and circular arcs: (n, 3) arrays of x, y [m] and the bulge of the edge that follows.

The bulge is tan(angle/4) for the central angle of an arc, positive anticlockwise, 0 for a straight edge: as in DXF.
Polygons are (n, 2) arrays of corners [m]; functions test for points inside and intersections, and measure widths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures.errors import GeometryError

CHORD: Final = math.radians(5.0)  # largest angle of a chord in place of an arc: a circle loses 1.3e-3 of its area
WIDEST: Final = 0.95 * math.pi  # largest angle of an arc in gmsh; larger ones are divided
ALONG: Final = (0.1, 0.3, 0.5, 0.7, 0.9)  # fractions of each edge at which widths are measured
BLOCK: Final = 1 << 20  # number of pairs that are evaluated at once
FACING: Final = -0.5  # largest n.n of opposite edges, between which a width is measured: 60 degrees from parallel
Corners = Sequence[Sequence[float]]


def as_loop(corners: Corners) -> Array:
    """Return the (n, 3) loop of corners (x, y), or (x, y, bulge)."""
    return np.array([(*corner, 0.0)[:3] for corner in corners], dtype=float).reshape(-1, 3)


def whole(centre: Sequence[float], radius: float) -> Array:
    """Return a circle as a (2, 3) loop of two half circles."""
    x, y = centre
    return np.array([(x - radius, y, 1.0), (x + radius, y, 1.0)])


def angles(loop: Array) -> Array:
    """Return the (n,) signed central angles of the edges [rad], 0 for straight ones."""
    return np.asarray(4 * np.arctan(loop[:, 2]))


def circle(start: Array, end: Array, bulge: float) -> tuple[Array, float]:
    """Return the centre and radius of an arc."""
    normal = np.array([start[1] - end[1], end[0] - start[0]])
    centre = (start[:2] + end[:2]) / 2 + (1 - bulge**2) / (4 * bulge) * normal
    return centre, float(np.linalg.norm(start[:2] - centre))


def along(start: Array, end: Array, at: Array) -> Array:
    """Return the (k, 2) points of the edge from one corner to the next, at fractions (k,) of its length."""
    bulge = float(start[2])
    if bulge == 0:
        return np.asarray(start[:2] + at[:, None] * (end[:2] - start[:2]))
    centre, _ = circle(start, end, bulge)
    turns, (x, y) = 4 * math.atan(bulge) * at, start[:2] - centre
    points = centre + np.column_stack([x * np.cos(turns) - y * np.sin(turns), x * np.sin(turns) + y * np.cos(turns)])
    return np.where((at == 1)[:, None], end[:2], np.where((at == 0)[:, None], start[:2], points))


def pieces(start: Array, end: Array, at: Array) -> Array:
    """Return the (k, 3) corners of an edge divided at the fractions 0 = at[0] < ... < at[k - 1] < 1."""
    turns = np.tan(np.arctan(start[2]) * np.diff(np.append(at, 1.0)))
    return np.column_stack([along(start, end, at), turns])


def edges(loop: Array) -> Iterator[tuple[Array, Array]]:
    """Return both ends of each edge."""
    return zip(loop, np.roll(loop, -1, axis=0), strict=True)


def chord_count(loop: Array) -> float:
    """Return the number of corners of the loop's `polygon`."""
    turns = np.abs(angles(loop))
    return float(np.where(turns == 0, 1.0, np.maximum(2.0, np.ceil(turns / CHORD - 1e-9))).sum())


def polygon(loop: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return the (m, 2) corners of a polygon with chords of at most `CHORD` for arcs, and the (m,) numbers of the
    loop's edges from which they come."""
    counts = [max(2, math.ceil(abs(turn) / CHORD - 1e-9)) if turn else 1 for turn in angles(loop)]
    parts = [along(a, b, np.arange(n) / n) for (a, b), n in zip(edges(loop), counts, strict=True)]
    return np.concatenate(parts), np.repeat(np.arange(len(loop)), counts)


def area(loop: Array) -> float:
    """Return the area, positive for an anticlockwise loop: that of the polygon of corners plus the circular segments
    beyond its sides."""
    middle = loop[:, :2] - loop[:, :2].mean(axis=0)
    total = polygon_area(middle)
    for (start, end), turn in zip(edges(loop), angles(loop), strict=True):
        if turn:
            total += circle(start, end, float(start[2]))[1] ** 2 / 2 * (turn - math.sin(turn))
    return total


def arcs_through(points: Array) -> Array:
    """Return the (n + 1, 3) open chain of the n arcs through points (2 n + 1, 2), three each."""
    first, second = points[1::2] - points[:-1:2], points[2::2] - points[1::2]
    bends = np.arctan2(cross(first, second), (first * second).sum(axis=1))  # half of each arc's central angle
    return np.column_stack([points[::2], np.append(np.tan(bends / 2), 0.0)])


def turned_over(chain: Array) -> Array:
    """Return an open chain of edges reversed."""
    return np.column_stack([chain[::-1, :2], -np.roll(chain[::-1, 2], -1)])


def ordered(loop: Array, *, clockwise: bool = False) -> Array:
    """Return the loop anticlockwise, or clockwise, beginning with its corner of smallest x (then y)."""
    if (area(loop) < 0) != clockwise:
        loop = turned_over(np.vstack([loop, loop[:1]]))[:-1]
    return np.roll(loop, -int(np.lexsort((loop[:, 1], loop[:, 0]))[0]), axis=0)


def below(loop: Array, normal: Array, offset: float, within: float) -> Array:
    """Return the part of the loop with n.x <= offset, for a unit normal n; arcs are cut exactly.

    Source: I. Sutherland and G. Hodgman, Comm. ACM 17 (1974) 32.
    """
    cut = np.concatenate([pieces(a, b, np.append(0.0, _crossed(a, b, normal, offset, within))) for a, b in edges(loop)])
    middles = np.concatenate([along(a, b, np.array([0.5])) for a, b in edges(cut)])
    bulges = np.where(middles @ normal - offset <= within, cut[:, 2], 0.0)
    return np.column_stack([cut[:, :2], bulges])[cut[:, :2] @ normal - offset <= within]


def _crossed(start: Array, end: Array, normal: Array, offset: float, within: float) -> Array:
    """Return the fractions of an edge at which it crosses the line n.x = offset, except at its ends."""
    if start[2] == 0:
        start_height, end_height = (float(point[:2] @ normal) - offset for point in (start, end))
        clear = min(abs(start_height), abs(end_height)) > within and start_height * end_height < 0
        return np.array([start_height / (start_height - end_height)] if clear else [])
    centre, radius = circle(start, end, float(start[2]))
    height, turn = float(centre @ normal) - offset, 4 * math.atan(float(start[2]))
    if abs(height) >= radius:
        return np.zeros(0)
    first = math.atan2(*(start[:2] - centre)[::-1]) - math.atan2(normal[1], normal[0])
    open_by = math.acos(-height / radius)
    fractions = np.array([(way * open_by - first + 2 * math.pi * k) / turn for way in (1, -1) for k in range(-2, 3)])
    edge = within / (radius * abs(turn))
    return np.sort(fractions[(fractions > edge) & (fractions < 1 - edge)])


def mirrored(outlines: Sequence[Array], marked: NDArray[np.bool_], within: float) -> bool:
    """Return whether the loops and the marks of their edges are symmetric about the line y = 0."""
    corners, ahead = (np.concatenate([np.roll(loop, -k, axis=0) for loop in outlines]) for k in (0, 1))
    marks = np.ptp(corners[:, 0]) * np.column_stack([corners[:, 2], marked])
    rows = np.hstack([corners[:, :2], ahead[:, :2], marks])
    image = rows[:, [2, 3, 0, 1, 4, 5]] * (1, -1, 1, -1, 1, 1)
    return bool(np.abs(rows[:, None] - image[None]).max(axis=2).min(axis=1).max() <= within)


def nearest(loop: Array, point: Array) -> float:
    """Return the distance of a point from a loop."""
    return min(_distance(a, b, point) for a, b in edges(loop))


def _distance(start: Array, end: Array, point: Array) -> float:
    to_ends = min(float(np.linalg.norm(corner[:2] - point)) for corner in (start, end))
    if start[2] == 0:
        return float(distances(start[None, :2], end[None, :2], point[None])[0, 0])
    centre, radius = circle(start, end, float(start[2]))
    away, turn = math.atan2(*(point - centre)[::-1]), 4 * math.atan(float(start[2]))
    ahead = (math.copysign(1, turn) * (away - math.atan2(*(start[:2] - centre)[::-1]))) % (2 * math.pi)
    beside = ahead <= abs(turn) or not (point - centre).any()
    return abs(float(np.linalg.norm(point - centre)) - radius) if beside else to_ends


JOINED: Final = 1e-6  # largest distance of end points that count as one, over the outline's size


def outlines(chains: Sequence[Array], wrong: Callable[[Array], GeometryError]) -> list[Array]:
    """Return the closed loops of open chains (k, 3) that meet at their ends, the largest first.

    ``wrong``: function from the point at which a loop is open to the error to raise.
    """
    within = JOINED * float(np.ptp(np.concatenate(chains)[:, :2], axis=0).max())
    return sorted(_closed(chains, within, wrong), key=lambda loop: -abs(area(loop)))


def _closed(chains: Sequence[Array], within: float, wrong: Callable[[Array], GeometryError]) -> Iterator[Array]:
    """Yield the loops, without repeating the first corner."""
    ends = np.array([chain[[0, -1], :2] for chain in chains])
    free = np.ones(len(chains), dtype=bool)
    for first, chain in enumerate(chains):
        if not free[first]:
            continue
        free[first] = False
        parts, end, count = [chain[:-1]], ends[first, 1], len(chain) - 1
        while np.linalg.norm(end - ends[first, 0]) > within or count < 2:
            near = free[:, None] & (np.linalg.norm(ends - end, axis=2) <= within)
            if not near.any():
                raise wrong(end)
            k, last = divmod(int(np.argmax(near)), 2)
            free[k] = False
            parts.append((turned_over(chains[k]) if last else chains[k])[:-1])
            end, count = ends[k, 1 - last], count + len(parts[-1])
        yield np.concatenate(parts)


def chained(segments: Array, near: float) -> list[Array]:
    """Return the loops (n, 2), closed or open, that segments (s, 2, 2) in any order form; ends within ``near`` [m]
    coincide."""
    keys = np.round(np.asarray(segments) / max(near, 1e-15)).astype(np.int64)
    beside: dict[tuple[int, int], list[int]] = {}
    for number, ends in enumerate(keys.tolist()):
        for end in ends:
            beside.setdefault((end[0], end[1]), []).append(number)
    remaining, loops = set(range(len(segments))), []
    while remaining:
        number = remaining.pop()
        line, key = [segments[number, 0], segments[number, 1]], tuple(keys[number, 1].tolist())
        while (following := next((k for k in beside.get(key, ()) if k in remaining), None)) is not None:
            remaining.discard(following)
            near_end = 0 if tuple(keys[following, 0].tolist()) == key else 1
            line.append(segments[following, 1 - near_end])
            key = tuple(keys[following, 1 - near_end].tolist())
        if len(line) > 3:
            loops.append(np.array(line[:-1] if np.allclose(line[0], line[-1], atol=10 * near) else line))
    return loops


def unshared(sides: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the rows (k, m) whose numbers, in any order, occur once: the boundary of cells with these sides."""
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(sides[first[count == 1]])


def rim(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the edges (k, 2), numbers rising, that belong to only one of the triangles (m, 3)."""
    return unshared(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1))


def curve_loop(occ: Any, loop: Array) -> int:
    """Return the tag of a curve loop (millimetres), added to the given gmsh OpenCASCADE model."""
    fine = np.concatenate(
        [
            pieces(a, b, np.arange(n) / n)
            for (a, b), n in zip(edges(loop), np.ceil(np.maximum(np.abs(angles(loop)) / WIDEST, 0.5)), strict=True)
        ]
    )
    points = [occ.addPoint(1e3 * x, 1e3 * y, 0.0) for x, y, _ in fine]
    curves = []
    for (start, end), a, b in zip(edges(fine), points, [*points[1:], points[0]], strict=True):
        if start[2] == 0:
            curves.append(occ.addLine(a, b))
            continue
        x, y = 1e3 * circle(start, end, float(start[2]))[0]
        middle = occ.addPoint(x, y, 0.0)
        curves.append(occ.addCircleArc(a, middle, b))
        occ.remove([(0, middle)])
    return int(occ.addCurveLoop(curves))


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
    """Return whether a point lies inside a polygon."""
    return bool(inside([corners], np.asarray(point, dtype=float)[None])[0])


def are_holes(loops: Sequence[Array]) -> list[bool]:
    """Return for each polygon whether it lies within an odd number of the others."""
    return [bool(inside([other for other in loops if other is not loop], loop[:1])[0]) for loop in loops]


def polygon_area(corners: Array) -> float:
    """Return the area, positive for an anticlockwise polygon."""
    return float(cross(corners, np.roll(corners, -1, axis=0)).sum() / 2)


def crossing(corners: Array, within: float) -> tuple[int, int] | None:
    """Return the first two edges of a polygon that meet, except at a common corner; ``None`` if there are none."""
    n, ahead = len(corners), np.roll(corners, -1, axis=0)
    for i in range(n):
        meets = _meets(corners[i], ahead[i], corners, ahead, within)
        meets[[i, (i + 1) % n, (i - 1) % n]] = False
        back = distances(corners[i][None], ahead[i][None], ahead[(i + 1) % n][None])
        if n > 3 and back[0, 0] <= within:  # the next edge lies on this one
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
    """Return flags of the straight edges that meet the edge from ``start`` to ``end``."""
    edge = end - start
    one, other = cross(edge, starts - start), cross(edge, ends - start)
    back = cross(ends - starts, start - starts), cross(ends - starts, end - starts)
    meets = (one * other < 0) & (back[0] * back[1] < 0)
    ends_on_it = distances(start[None], end[None], np.concatenate([starts, ends]))[0] <= within
    return np.asarray(meets | ends_on_it[: len(starts)] | ends_on_it[len(starts) :])


def narrowest(around: Sequence[Array], within: float) -> float:
    """Return the smallest distance, normal to an edge, from an opposite edge; infinite if there is none.

    ``around``: outline, anticlockwise, and holes, clockwise.
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
