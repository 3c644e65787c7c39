"""Lips of any outline: a flat face between two closed lines, as a drawing or a mesh has it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.errors import ModelError
from seatfem.structures.lip import AnyLip, check_parts

SAME: Final = 1e-6  # of the face's size: ends of edges that are one point
FLAT: Final = 1e-3  # the same, of a flat face's height
ONCE: Final = 1e-6  # of a turn: by as much an edge may run back about the centre
STEPS: Final = 4  # of Newton's iteration for the angle at a place: quadratic, from a table that is right to 1e-6
SQUARE_ON: Final = 1e-6  # a normal along x to this part

Triple = tuple[float, float, float]
Corners = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class RingFace:
    """A flat face between two polygons, seen against its outward normal from its centroid.

    Attributes:
        centre: its centroid [m]; x, y: the directions in which it is seen: x is the body's own x axis along the face,
            or its y axis of a face that lies across x.
        inner, outer: corners of both polygons from the centre [m], by their angles, the first on the x axis.
    """

    centre: Triple
    x: Triple
    y: Triple
    inner: Corners
    outer: Corners

    @cached_property
    def digest(self) -> str:
        """Of all of it."""
        return hashlib.sha256(repr((self.centre, self.x, self.y, self.inner, self.outer)).encode()).hexdigest()

    def seen(self, points: Array) -> Array:
        """(n, 2) places on the face of points (n, 3) [m]."""
        return np.asarray((points - np.array(self.centre)) @ np.array([self.x, self.y]).T)


class _Polygon:
    """A polygon that every ray from the origin crosses once, from the x axis anticlockwise."""

    def __init__(self, corners: Corners) -> None:
        self.corners = np.array([*corners, corners[0]])
        turns = np.arctan2(self.corners[:, 1], self.corners[:, 0]) % (2 * np.pi)
        self.turns = np.concatenate([[0.0], turns[1:-1], [2 * np.pi]])
        self.swept = np.concatenate([[0.0], np.cumsum(_cross(self.corners[:-1], self.corners[1:])) / 2])

    def at(self, angles: Array) -> tuple[Array, Array]:
        """Distance from the origin [m], and the area swept from the x axis on [m^2]."""
        k = np.clip(np.searchsorted(self.turns, angles, side="right") - 1, 0, len(self.turns) - 2)
        ray = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        start, end = self.corners[k], self.corners[k + 1]
        radius = _cross(start, end) / _cross(ray, end - start)
        return radius, self.swept[k] + radius * _cross(start, ray) / 2


@dataclass(frozen=True)
class FaceLip(AnyLip):
    """A `RingFace` divided into arcs of equal areas and rings.

    Raises:
        ModelError: numbers of parts below one or above `MOST_PORTS` together.
    """

    face: RingFace
    arcs: int = 1
    rings: int = 1
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_parts(self)

    @cached_property
    def _lines(self) -> tuple[_Polygon, _Polygon]:
        return _Polygon(self.face.inner), _Polygon(self.face.outer)

    @cached_property
    def lengths(self) -> Array:
        return super().lengths

    @property
    def content(self) -> Mapping[str, object]:
        return {"face": self.face.digest, "arcs": self.arcs, "rings": self.rings, "offset": self.offset}

    @property
    def area(self) -> float:
        inner, outer = self._lines
        return float(outer.swept[-1] - inner.swept[-1])

    def radii(self, angles: Array) -> tuple[Array, Array]:
        turned = np.where((angles >= 0) & (angles <= 2 * np.pi), angles, angles % (2 * np.pi))
        inner, outer = (line.at(turned)[0] for line in self._lines)
        return inner, outer

    def shares_at(self, angles: Array) -> Array:
        """(n,) places at angles [rad] from 0 to 2 pi."""
        (_, hole), (_, whole) = (line.at(angles) for line in self._lines)
        return np.asarray((whole - hole) / self.area)

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        inner, outer = self._lines
        angles = np.unique(np.concatenate([inner.turns, outer.turns, np.linspace(0.0, 2 * np.pi, 2049)]))
        return self.shares_at(angles), angles

    def angles_at(self, shares: Array) -> Array:
        angles = np.interp(shares, *self._table)
        for _ in range(STEPS):
            inner, outer = self.radii(angles)
            angles = angles - (self.shares_at(angles) - shares) * 2 * self.area / (outer**2 - inner**2)
            angles = np.clip(angles, 0.0, 2 * np.pi)
        return np.asarray(angles)

    def places(self, points: Array) -> tuple[Array, Array]:
        """Places (n,) around and across the lip, both shares of area, of points (n, 3) of its body [m]."""
        seen = self.face.seen(points)
        angles = np.arctan2(seen[:, 1], seen[:, 0]) % (2 * np.pi)
        inner, outer = self.radii(angles)
        return self.shares_at(angles), (np.sum(seen**2, axis=1) - inner**2) / (outer**2 - inner**2)


@lru_cache(maxsize=32)
def face_lip(face: RingFace, arcs: int, rings: int) -> FaceLip:
    """A face in parts: they are asked for again and again."""
    return FaceLip(face, arcs, rings)


def ring_face(edges: Array, normal: Sequence[float] | Array) -> RingFace:
    """The face that straight ``edges`` (e, 2, 3) bound, in any order [m], with its outward normal.

    Raises:
        ModelError: a face that is not flat, is not bounded by two closed lines, or whose lines turn back about its
            centre, with what would help.
    """
    from scipy.sparse import coo_array  # plans of other seats load none of these
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    points = edges.reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    n = np.asarray(normal) / np.linalg.norm(normal)
    off = float(np.ptp(points @ n))
    if off > FLAT * size:
        raise ModelError(
            f"the struck face is not flat: its edges lie {1e3 * off:.3g} mm apart along its normal; take flat faces, "
            "or strike it as a whole"
        )
    along = np.array([1.0, 0.0, 0.0]) if np.hypot(n[1], n[2]) > SQUARE_ON else np.array([0.0, 1.0, 0.0])
    x = along - (along @ n) * n
    x /= np.linalg.norm(x)
    y = np.cross(n, x)
    pairs = cKDTree(points).query_pairs(SAME * size, output_type="ndarray")
    joined = np.concatenate([np.arange(len(points)).reshape(-1, 2), pairs])
    graph = coo_array((np.ones(len(joined)), joined.T), shape=(len(points), len(points)))
    number, label = connected_components(graph, directed=False)
    if number != 2:
        raise ModelError(
            f"the struck face is bounded by {number} closed line{'s' if number > 1 else ''}, a lip in arcs by two, one "
            "within the other: take one ring-shaped face, as of one port, or strike it as a whole"
        )
    flat = edges @ np.array([x, y]).T
    lines = [flat[label[::2] == k] for k in range(2)]
    lines.sort(key=lambda line: float(np.linalg.norm(np.ptp(line.reshape(-1, 2), axis=0))))
    middle = lines[0].mean(axis=(0, 1))  # inside the hole; from there on to the centroid
    loops = [_ordered(line - middle) for line in lines]
    moments = [_moments(loop) for loop in loops]
    centre = (moments[1][1] - moments[0][1]) / (moments[1][0] - moments[0][0])
    inner, outer = (_corners(_ordered(line - middle - centre)) for line in lines)
    if not np.all(
        _Polygon(outer).at(np.arctan2(*np.array(inner).T[::-1]) % (2 * np.pi))[0] > np.hypot(*np.array(inner).T)
    ):
        raise ModelError("the lines that bound the struck face cross each other: take a ring-shaped face")
    at = (middle + centre) @ np.array([x, y]) + (points.mean(axis=0) @ n) * n
    return RingFace(_triple(at), _triple(x), _triple(y), inner, outer)


def _ordered(line: Array) -> Array:
    """(c, 2) corners of a closed line of edges (e, 2, 2) by their angles about the origin, once each.

    Raises `ModelError` of one that not every ray crosses once: its edges turn by more or less than 2 pi together.
    """
    turned = float(np.abs(np.arctan2(_cross(line[:, 0], line[:, 1]), np.sum(line[:, 0] * line[:, 1], axis=1))).sum())
    if abs(turned - 2 * np.pi) > 2 * np.pi * ONCE:
        raise ModelError(
            "the struck face is no ring about its middle: rays from there cross one of its edges not at all or more "
            "than once; strike it as a whole, or take a face that winds less"
        )
    corners = line.reshape(-1, 2)
    turns = np.arctan2(corners[:, 1], corners[:, 0]) % (2 * np.pi)
    order = np.argsort(turns)
    apart = np.diff(turns[order], prepend=turns[order[-1]] - 2 * np.pi) > ONCE
    return np.asarray(corners[order[apart]])


def _corners(loop: Array) -> Corners:
    """With a corner on the x axis as the first."""
    before, first = loop[-1], loop[0]
    if abs(first[1]) <= ONCE * first[0]:
        start, loop = first[0], loop[1:]
    elif abs(before[1]) <= ONCE * before[0]:
        start, loop = before[0], loop[:-1]
    else:
        start = _cross(before, first) / (first[1] - before[1])
    return ((float(start), 0.0), *((float(a), float(b)) for a, b in loop))


def _moments(loop: Array) -> tuple[float, Array]:
    """Area and its first moments of a polygon about the origin."""
    ahead = np.roll(loop, -1, axis=0)
    twice = _cross(loop, ahead)
    return float(twice.sum() / 2), np.asarray((twice[:, None] * (loop + ahead)).sum(axis=0) / 6)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _triple(values: Array) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z
