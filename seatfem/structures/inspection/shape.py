"""A body as points, surface triangles and cells: what of it counts before a model is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SAMPLED: Final = 400  # points of the struck outline that distances are taken from
BLOCK: Final = 256  # points that distances are taken to at once
DIRECTED: Final = 0.1  # excess of the normals along one direction; a cone of 60 degrees has 1/8
BESIDE: Final = 0.5  # part of the depth by which held faces may lie beside the struck ones of a bulky body


@dataclass(frozen=True, eq=False)
class Shape:
    """Attributes:
    points: (n, 3) [m].
    triangles: (m, 3) of the surface.
    groups: named parts of the surface, rows of ``triangles``.
    cells: (k, 4) tetrahedra; none where they are not known.
    volume: [m^3].
    """

    points: Array
    triangles: Integers
    groups: dict[str, Integers]
    cells: Integers
    volume: float

    @cached_property
    def extent(self) -> Array:
        """Return the (3,) sides of the bounding box [m]."""
        used = self.points[np.unique(self.triangles)] if len(self.triangles) else self.points
        return np.asarray(np.ptp(used, axis=0))

    @cached_property
    def _crosses(self) -> Array:
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.asarray(np.cross(b - a, c - a)) / 2

    @cached_property
    def areas(self) -> Array:
        """Return the (m,) areas of the triangles [m^2]."""
        return np.asarray(np.linalg.norm(self._crosses, axis=1))

    @cached_property
    def normals(self) -> Array:
        """Return the (m, 3) unit normals of the triangles, of either sign; zero where one has no area."""
        return np.asarray(self._crosses / np.maximum(self.areas[:, None], np.finfo(float).tiny))

    def area(self, group: str) -> float:
        """Return the area [m^2]."""
        return float(self.areas[self.groups[group]].sum())

    def normal(self, group: str) -> Array | None:
        """Return the (3,) unit vector that most of the group's faces look along, or its opposite; ``None``: a bore."""
        rows = self.groups[group]
        n = self.normals[rows]
        values, vectors = np.linalg.eigh(np.einsum("i,ij,ik->jk", self.areas[rows], n, n))
        return np.asarray(vectors[:, 2]) if values[2] - values[1] > DIRECTED * values.sum() else None

    def outline(self, group: str) -> Integers:
        """Return the (e, 2) edges that bound the group."""
        rows = self.triangles[self.groups[group]]
        edges = np.sort(np.concatenate([rows[:, [0, 1]], rows[:, [1, 2]], rows[:, [2, 0]]]), axis=1)
        distinct, counts = np.unique(edges, axis=0, return_counts=True)
        return np.asarray(distinct[counts == 1], dtype=np.int64)

    def width(self, group: str) -> float:
        """Return twice the area over the length of the outline [m]: of a ring its width, of a disc its radius."""
        edges = self.outline(group)
        around = float(np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1).sum())
        return 2 * self.area(group) / around if around > 0 else math.sqrt(self.area(group))

    def depth(self, group: str) -> float:
        """Return the depth behind the group, along its normal [m]; where that has none, the body's shortest side."""
        normal = self.normal(group)
        if normal is None:
            return float(self.extent.min())
        return float(np.ptp(self.points[np.unique(self.triangles)] @ normal))

    def span(self, group: str, held: Sequence[str]) -> float:
        """Return the mean distance, along its plane, from the group to what is held [m]; 0 where that lies beneath.

        Of a body that nothing holds: to the farthest point.
        """
        depth = self.depth(group)
        held_triangles = [self.triangles[self.groups[name]] for name in held if name in self.groups]
        nodes = np.unique(self.triangles[self.groups[group]])
        points = self.points[nodes[:: max(1, len(nodes) // SAMPLED)]]
        if not held_triangles:
            return float(np.linalg.norm(points.mean(axis=0) - self.points, axis=1).max())
        away = float(np.mean(distances(points, self._sampled(np.concatenate(held_triangles)))))
        beside = math.sqrt(max(0.0, away**2 - depth**2))
        return beside if beside > BESIDE * depth else 0.0

    def _sampled(self, triangles: Integers) -> Array:
        corners = self.points[triangles]
        return np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])


def distances(points: Array, others: Array) -> Array:
    """Return (n,) distances from ``points`` (n, 3) to the nearest of ``others`` (m, 3), some hundreds."""
    nearest = np.full(len(points), np.inf)
    squares = np.einsum("ij,ij->i", points, points)
    for some in np.array_split(others, max(1, len(others) // BLOCK)):
        off = squares[:, None] - 2 * points @ some.T + np.einsum("ij,ij->i", some, some)
        np.minimum(nearest, off.min(axis=1, initial=np.inf), out=nearest)
    return np.asarray(np.sqrt(np.maximum(nearest, 0.0)))
