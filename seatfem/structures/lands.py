"""Lands: the flat faces that a reed lands on, as a drawing or a mesh has them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.errors import ModelError
from seatfem.structures.shapes.polygons import area, inside
from seatfem.structures.strips import Strip, strip_of

SAME: Final = 1e-6  # of the face's size: ends of edges that are one point
FLAT: Final = 1e-3  # the same, of a flat face's height
SQUARE_ON: Final = 1e-6  # a normal along x to this part
TELLING: Final = 0.05  # of a direction, the least part along the face

Triple = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Land:
    """One flat face or several in one plane, seen against their outward normal from their common centroid.

    Attributes:
        centre: the centroid [m]; x, y: the directions in which it is seen (`axes_along`).
        strips: its faces from that centre, by the x and then the y of their own centroids.
    """

    centre: Triple
    x: Triple
    y: Triple
    strips: tuple[Strip, ...]

    @cached_property
    def digest(self) -> str:
        """Return the digest of all of it."""
        digest = hashlib.sha256(repr((self.centre, self.x, self.y)).encode())
        for strip in self.strips:
            digest.update(np.ascontiguousarray(np.stack([strip.left, strip.right])).tobytes())
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Land) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def seen(self, points: Array) -> Array:
        """Return the (n, 2) places on the face of points (n, 3) [m]."""
        return np.asarray((points - np.array(self.centre)) @ np.array([self.x, self.y]).T)


def axes_along(normal: Sequence[float] | Array, along: Sequence[float] | None = None) -> Array:
    """Return the (3, 3) unit vectors x, y, z of a face with the outward normal z.

    x is the part along the face of the direction ``along``; ``None``: of the body's own x axis, or of its y axis where
    the face lies across x.

    Raises:
        ModelError: a direction that is square to the face.
    """
    z = np.asarray(normal) / np.linalg.norm(normal)
    usual = np.array([1.0, 0.0, 0.0]) if np.hypot(z[1], z[2]) > SQUARE_ON else np.array([0.0, 1.0, 0.0])
    direction = usual if along is None else np.asarray(along) / np.linalg.norm(along)
    x = direction - (direction @ z) * z
    if along is not None and np.linalg.norm(x) < TELLING:
        words = ", ".join(f"{each:.4g}" for each in direction)
        raise ModelError(f"seat.along = ({words}) is square to the struck face; give a direction along it")
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def land_of(edges: Array, normal: Sequence[float] | Array, along: Sequence[float] | None = None) -> Land:
    """Return the land that straight ``edges`` (e, 2, 3) bound, in any order [m], with its outward normal; ``along``: as
    of `axes_along`.

    Raises:
        ModelError: faces that are not flat, overlap, have several holes, or are neither rings nor strips, with what
            would help.
    """
    points = edges.reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    x, y, n = axes_along(normal, along)
    off = float(np.ptp(points @ n))
    if off > FLAT * size:
        raise ModelError(
            f"the struck face is not flat: its edges lie {1e3 * off:.3g} mm apart along its normal; take flat faces, "
            "or strike it as a whole"
        )
    strips = [strip_of(outer, holes) for outer, holes in _nested(_loops(edges @ np.array([x, y]).T, SAME * size))]
    areas = np.array([strip.swept[-1] for strip in strips])
    middle = (areas[:, None] * [strip.centroid for strip in strips]).sum(axis=0) / areas.sum()
    moved = [strip.moved(-middle).begun_on_the_axis() for strip in strips]
    moved.sort(key=lambda strip: tuple(np.round(strip.centroid / (SAME * size))))
    at = middle @ np.array([x, y]) + (points.mean(axis=0) @ n) * n
    return Land(_triple(at), _triple(x), _triple(y), tuple(moved))


def _loops(edges: Array, near: float) -> list[Array]:
    """Return the (c, 2) corners of each closed line of edges (e, 2, 2), in order. Raises `ModelError` of lines that
    touch."""
    from scipy.sparse import coo_array  # plans of other seats load none of these
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    points = edges.reshape(-1, 2)
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    number, corner = connected_components(graph, directed=False)
    ends = corner.reshape(-1, 2)
    ends = ends[ends[:, 0] != ends[:, 1]]
    if np.any(np.bincount(ends.ravel(), minlength=number) != 2):
        raise ModelError(
            "the lines that bound the struck faces are not closed, or touch each other: choose separate faces"
        )
    place = np.empty((number, 2))
    place[corner] = points
    beside: list[list[int]] = [[] for _ in range(number)]
    for a, b in ends.tolist():
        beside[a].append(b)
        beside[b].append(a)
    loops, remaining = [], set(range(number))
    while remaining:
        line = [remaining.pop()]
        following = beside[line[0]][0]
        while following != line[0]:
            remaining.discard(following)
            a, b = beside[following]
            line.append(following)
            following = b if a == line[-2] else a
        loops.append(place[line])
    return loops


def _nested(loops: list[Array]) -> list[tuple[Array, list[Array]]]:
    """Return each outer line with those of its holes, all anticlockwise. Raises `ModelError` of lines that cross."""
    loops = [loop if area(loop) > 0 else loop[::-1] for loop in loops]
    loops.sort(key=area, reverse=True)
    nests: list[tuple[Array, list[Array]]] = []
    for k, loop in enumerate(loops):
        around = [other for other, larger in enumerate(loops[:k]) if _inside(loop, larger)]
        if len(around) % 2 == 0:
            nests.append((loop, []))
        else:
            next(holes for outer, holes in nests if outer is loops[around[-1]]).append(loop)
    return nests


def _inside(loop: Array, larger: Array) -> bool:
    """Return whether all of a line lies within another one; raises `ModelError` of one that lies there in part."""
    within = inside([larger], loop)
    if 0 < within.sum() < len(within):
        raise ModelError(
            "the lines that bound the struck faces cross each other, as of faces that overlap: take faces that stand "
            "apart, or strike them as a whole"
        )
    return bool(within.any())


def _triple(values: Array) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z
