"""How fine a mesh is where, and how many elements that makes, by integrals over the body: no mesh is needed.

The size h grows with the distance from the patch as the mesher lets it: constant near it, then linear up to the
bulk's. A body has about c int dV/h^3 elements, a section c int dA/h^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from impact.greens.base import Array
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes.profile import Point


@dataclass(frozen=True)
class Samples:
    """Places of a body, ``weight`` [m, m^2 or m^3] of it around each, at ``distance`` [m] from the struck patch.

    ``cap``: element size that something else there allows [m].
    """

    weight: Array
    distance: Array
    cap: Array | None = None

    def count(self, spec: MeshSpec, dimension: int) -> float:
        """int dV/h^3, int dA/h^2 or int ds/h."""
        h = size_at(self.distance, spec)
        h = h if self.cap is None else np.minimum(h, self.cap)
        count = self.weight / h
        for _ in range(dimension - 1):  # a power takes several times as long
            count /= h
        return float(np.sum(count))

    @property
    def total(self) -> float:
        """Volume, area or length."""
        return float(self.weight.sum())


def size_at(distance: Array, spec: MeshSpec) -> Array:
    """Element size [m] at distances from the patch [m]."""
    near = spec.patch_size
    return np.asarray(np.interp(distance, [near, max(near + spec.transition, 1.001 * near)], [near, spec.size]))


def from_segments(points: Array, segments: Sequence[tuple[Point, Point]]) -> Array:
    """Distance (n,) of points (n, 2) from the nearest of some straight segments; infinite without any."""
    nearest = np.full(len(points), np.inf)
    for start, end in segments:
        a, along = np.asarray(start), np.subtract(end, start)
        t = np.clip((points - a) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        off = points - a - t[:, None] * along
        np.minimum(nearest, np.hypot(off[:, 0], off[:, 1]), out=nearest)
    return nearest


def inside(points: Array, outline: Array) -> Array:
    """Whether points (n, 2) lie in a closed polygon (m, 2)."""
    x, y = points.T
    odd = np.zeros(len(points), dtype=bool)
    for (xa, ya), (xb, yb) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        crosses = (ya > y) != (yb > y)
        if crosses.any():
            odd ^= crosses & (x < xa + (y - ya) * (xb - xa) / (yb - ya if yb != ya else 1.0))
    return odd
