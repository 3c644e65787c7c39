"""The visible surface ("skin") of a body: triangles, and the nodes of its model that move them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.structures.elements import axisymmetric, mindlin
from seatfem.structures.mesh.io import CELL_KINDS, CellKind
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.shapes import loops

Integers = NDArray[np.int64]

_TRIANGLES: Final = {
    3: ((0, 1, 2),),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    4: ((0, 1, 2), (0, 2, 3)),
    9: ((0, 4, 8), (0, 8, 7), (4, 1, 5), (4, 5, 8), (8, 5, 2), (8, 2, 6), (7, 8, 6), (7, 6, 3)),
}
"""Straight triangles on the nodes of a flat element: its corners, the middles of its sides, its centre."""
OPENED: Final = (math.radians(-6.0), math.radians(234.0))
"""Angles between which a body of revolution is drawn, open towards the camera at `rendering.ABOVE` [rad]."""
SLICES: Final = 48


@dataclass(frozen=True, eq=False)
class Skin:
    """Triangulated surface in space, with the nodes of the model that move it.

    Attributes:
        points: points at rest (n, 3) [m].
        triangles: point numbers (m, 3).
        nodes: numbers (S,) of the model's nodes on the surface, rising; after `spread` one per point.
        which: index (n,) into ``nodes`` of each point.
        angles: angle (n,) of each point about z if a half section was revolved [rad], otherwise ``None``.
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
        """Return the skin with one node per point, since values of a half section may depend on the angle."""
        return replace(self, nodes=self.nodes[self.which], which=np.arange(len(self.points)))

    def moved(self, displacement: Array, harmonic: int = 0, *, turned: float = 0.0) -> Array:
        """Return displacements (n, 3) from (S, 3) of ``nodes``; for a half section u_r, u_th, u_z, which vary around
        the axis as cos n a, sin n a, cos n a, n = ``harmonic``, a the angle less that of ``turned`` [rad]; u_th of
        n = 0, torsion, is the same all around."""
        each = displacement[self.which]
        if self.angles is None:
            return each
        phase, c, s = harmonic * (self.angles - turned), np.cos(self.angles), np.sin(self.angles)
        radial, axial = each[:, [0, 2]].T * np.cos(phase)
        around = each[:, 1] * (np.sin(phase) if harmonic else 1.0)
        return np.stack([radial * c - around * s, radial * s + around * c, axial], axis=1)


def skin_of(model: SecondOrderModel) -> Skin:
    """Return the surface of a solid; for an axisymmetric model its section swept over `OPENED`, with both cut faces.

    Raises:
        ModelError: the model has no mesh, or one that cannot be drawn.
    """
    if model.dofs is None or model.dofs.mesh is None:
        raise ModelError("this model does not know its mesh: construct it with dofs= to draw its shapes")
    mesh: Any = model.dofs.mesh
    if isinstance(mesh, skfem.MeshTri | skfem.MeshQuad):
        r, _, z = model.dofs.points
        return skin_of_section(mesh, r, z)
    points = np.ascontiguousarray(model.dofs.points.T)
    order = 1 if len(points) == mesh.nvertices else 2
    alike = (kind for kind in CELL_KINDS.values() if isinstance(mesh, CELL_KINDS[kind.corners].mesh))
    kind = next((kind for kind in alike if kind.order == order), None)
    if kind is None:
        raise ModelError(f"shapes on {type(mesh).__name__} cannot be drawn; pictures need tetrahedra or hexahedra")
    cells = np.asarray(skfem.Basis(mesh, kind.element, intorder=1).element_dofs).T
    return _skin(points, as_triangles(loops.unshared(np.concatenate([cells[:, side] for side in _sides(kind)]))))


def _sides(kind: CellKind) -> list[Integers]:
    """Return the nodes of each side of an element in scikit-fem's order, the corners first, as in `_TRIANGLES`."""
    places, sides = kind.nodes[kind.columns], []
    for face in kind.faces:
        corners = kind.nodes[list(face)]
        on_side = corners
        if kind.order == 2:
            centre = [corners.mean(axis=0)] if len(face) == 4 else []
            on_side = np.array([*corners, *(corners + np.roll(corners, -1, axis=0)) / 2, *centre])
        sides.append(np.linalg.norm(places - on_side[:, None], axis=2).argmin(axis=1))
    return sides


def skin_of_section(mesh: Any, r: Array, z: Array, angles: Array | None = None) -> Skin:
    """Return the skin as `skin_of` of a section with unknowns at r, z (n,) [m]; at ``angles`` or `SLICES` of them."""
    angles = np.linspace(*OPENED, SLICES + 1) if angles is None else angles
    slices = len(angles) - 1
    element = axisymmetric.section_element(mesh, 1 if len(r) == mesh.nvertices else 2)
    triangles = as_triangles(np.asarray(skfem.Basis(mesh, element, intorder=1).element_dofs).T)
    low, high = loops.unshared(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])).T
    first = len(r) * np.arange(slices)[:, None]
    rings = np.stack([low + first, high + first, high + first + len(r), low + first + len(r)], axis=-1).reshape(-1, 4)
    corners = np.concatenate([triangles, triangles[:, ::-1] + slices * len(r), as_triangles(rings)])
    used, numbered = np.unique(corners, return_inverse=True)
    nodes, which = np.unique(used % len(r), return_inverse=True)
    turned, node = angles[used // len(r)], used % len(r)
    points = np.stack([r[node] * np.cos(turned), r[node] * np.sin(turned), z[node]], axis=1)
    return Skin(points, numbered.reshape(-1, 3), nodes, which, turned)


def skin_of_plate(mesh: mindlin.PlateMesh) -> Skin:
    """Return one face of a plate, drawn in its mid-surface."""
    return _skin(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), as_triangles(mesh.cells))


def wound_outward(points: Array, triangles: Integers) -> Integers | None:
    """Return the triangles of a closed surface with corners anticlockwise as seen from outside; ``None`` if the surface
    has a boundary.

    Each triangle is two vertices of a graph, one per orientation, linked to the consistently oriented neighbours. Of a
    body's two connected components, the one that encloses a positive volume is chosen.
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
    turned = np.where(rising[one] != rising[two], 0, count)  # consistent neighbours traverse their edge oppositely
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


def as_triangles(cells: Integers) -> Integers:
    """Return straight triangles (m, 3) on the nodes (k, 3, 4, 6 or 9) of flat elements in scikit-fem's order."""
    return np.concatenate([cells[:, list(corners)] for corners in _TRIANGLES[cells.shape[1]]])
