"""The skin of a body, which is seen: triangles on its surface, a body of revolution laid open, a plate's one face."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.pictures.cell_grid import CellGrid, section_triangles
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.model import Array, SecondOrderModel

Integers = NDArray[np.int64]

OPENED: Final = (math.radians(-6.0), math.radians(234.0))
"""Angles between which a body of revolution is drawn: the gap faces who looks from `rendering.ABOVE`."""
SLICES: Final = 48
_QUARTERS: Final = ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))  # of an element of nine nodes
_SIDES: Final = {
    4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


@dataclass(frozen=True, eq=False)
class Skin:
    """Triangles in space on nodes of a model.

    Attributes:
        points: (n, 3) at rest [m].
        triangles: (m, 3) of them.
        nodes: (S,) of the model that are seen, in rising order; of a skin that is `spread` each point's own.
        which: (n,) of these each point came from.
        angles: (n,) of each about z, where a half section was turned; ``None`` of other bodies.
    """

    points: Array
    triangles: Integers
    nodes: Integers
    which: Integers
    angles: Array | None = None

    @property
    def size(self) -> float:
        """Return the largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())

    def spread(self) -> Skin:
        """Return the same with a node for each point, so that a half section may differ from angle to angle."""
        return replace(self, nodes=self.nodes[self.which], which=np.arange(len(self.points)))

    def moved(self, displacement: Array, harmonic: int = 0) -> Array:
        """Return (n, 3) displacements of (S, 3) of the nodes seen; of a half section u_r, u_th, u_z, which go around as
        cos n th, sin n th and cos n th, of ``harmonic`` n = 0 not at all."""
        each = displacement[self.which]
        if self.angles is None:
            return each
        c, s = np.cos(self.angles), np.sin(self.angles)
        radial, around, axial = each.T * np.cos(harmonic * self.angles)
        if harmonic:
            around = each[:, 1] * np.sin(harmonic * self.angles)
        return np.stack([radial * c - around * s, radial * s + around * c, axial], axis=1)


def skin_of(model: SecondOrderModel) -> Skin:
    """Return the surface of a solid; of an axisymmetric model what its section sweeps between `OPENED`, with both cuts.

    Raises:
        ModelError: the model does not know its mesh, or one that cannot be drawn.
    """
    if model.dofs is None or getattr(model.dofs.mesh, "dim", lambda: 3)() == 3:
        grid = CellGrid.of_model(model)
        cells = grid.linear_cells
        sides = _outer(np.concatenate([cells[:, list(side)] for side in _SIDES[cells.shape[1]]]))
        return _skin(grid.points, as_triangles(sides))
    r, _, z = model.dofs.points
    return skin_of_section(model.dofs.mesh, r, z)


def skin_of_section(mesh: Any, r: Array, z: Array, angles: Array | None = None) -> Skin:
    """Return the skin as `skin_of`, of a section with unknowns at nodes r, z (n,) [m]; at angles or `SLICES`."""
    angles = np.linspace(*OPENED, SLICES + 1) if angles is None else angles
    slices = len(angles) - 1
    triangles = section_triangles(mesh, len(r))
    low, high = _outer(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])).T
    first = len(r) * np.arange(slices)[:, None]
    rings = np.stack([low + first, high + first, high + first + len(r), low + first + len(r)], axis=-1).reshape(-1, 4)
    every = np.concatenate([triangles, triangles[:, ::-1] + slices * len(r), as_triangles(rings)])
    used, numbered = np.unique(every, return_inverse=True)
    nodes, which = np.unique(used % len(r), return_inverse=True)
    turned, node = angles[used // len(r)], used % len(r)
    points = np.stack([r[node] * np.cos(turned), r[node] * np.sin(turned), z[node]], axis=1)
    return Skin(points, numbered.reshape(-1, 3), nodes, which, turned)


def skin_of_plate(mesh: PlateMesh) -> Skin:
    """Return one face of a plate, drawn in its mid-surface."""
    quarters = mesh.cells[:, np.array(_QUARTERS)].reshape(-1, 4)
    return _skin(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), as_triangles(quarters))


def wound_outward(points: Array, triangles: Integers) -> Integers | None:
    """Return the triangles of a closed surface with corners that run anticlockwise as seen from outside; ``None`` of a
    surface with a rim.

    Each triangle stands in a graph twice, as it is and turned over, and is linked to its neighbours as they would be
    wound alike. Of the two parts that this makes of a body, the one that encloses a positive volume is taken.
    """
    count = len(triangles)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner, rising = np.tile(np.arange(count), 3), sides[:, 0] < sides[:, 1]
    _, edge, users = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    if (users % 2).any():
        return None
    order = np.argsort(edge, kind="stable")
    one, two = order[users[edge[order]] == 2].reshape(-1, 2).T
    turned = np.where(rising[one] != rising[two], 0, count)  # neighbours wound alike pass their edge in opposite ways
    ends = (
        np.concatenate([owner[one], owner[one] + count]),
        np.concatenate([owner[two] + turned, owner[two] + count - turned]),
    )
    _, part = connected_components(
        coo_array((np.ones(len(ends[0])), ends), shape=(2 * count, 2 * count)), directed=False
    )
    corners = (points - points.mean(axis=0))[triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    enclosed = np.bincount(part, np.concatenate([volume, -volume]))
    return np.where((enclosed[part[:count]] < 0)[:, None], triangles[:, ::-1], triangles)


def _skin(points: Array, triangles: Integers) -> Skin:
    nodes, numbered = np.unique(triangles, return_inverse=True)
    return Skin(points[nodes], numbered.reshape(-1, 3), nodes, np.arange(len(nodes)))


def _outer(sides: Integers) -> Integers:
    """Return the sides that belong to one cell alone."""
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(sides[first[count == 1]])


def as_triangles(sides: Integers) -> Integers:
    """Return triangles (m, 3) as they are, quadrilaterals (m, 4) each as two."""
    return sides if sides.shape[1] == 3 else np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
