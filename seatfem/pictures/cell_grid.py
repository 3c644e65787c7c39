"""Nodes and cells in the order of VTK and ParaView, and the visible surface ("skin") of a body."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.structures.elements import axisymmetric, mindlin
from seatfem.structures.formats.file_mesh import VTK, to_vtk
from seatfem.structures.mesh.io import CELL_KINDS, HEX_VERTICES, nodes_of
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.shapes import loops

Integers = NDArray[np.int64]

# A ten-node tetrahedron is split into eight of four nodes. Nodes 4..9 lie on the edges 01, 12, 02, 03, 13, 23; the
# inner octahedron is divided along the diagonal 4-9.
_EIGHT_TETS = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 9, 6, 7], [4, 9, 7, 8], [4, 9, 8, 5], [4, 9, 5, 6]]
)
_HEX = nodes_of(HEX_VERTICES, VTK[27])  # node positions (27, 3) in the unit cube
VTK_TYPES = {4: 10, 10: 24, 8: 12, 27: 29}
"""VTK's cell type by number of nodes."""
# straight triangles on the nodes of a cell of 3, 6, 4 or 9 nodes, in the order of scikit-fem
_TRIANGLES = {
    3: ((0, 1, 2),),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    4: ((0, 1, 2), (0, 2, 3)),
    9: ((0, 4, 8), (0, 8, 7), (4, 1, 5), (4, 5, 8), (8, 5, 2), (8, 2, 6), (7, 8, 6), (7, 6, 3)),
}
_PRISM = np.array([[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]])  # prism with bottom 0 1 2 and top 3 4 5


def _eight_hexes() -> Integers:
    """Return the corners (8, 8) of the eight octants of a 27-node hexahedron, as indices of its nodes."""
    places = [tuple(row) for row in (2 * _HEX).astype(int)]
    octants = product((0, 1), repeat=3)
    return np.array([[places.index(tuple(np.add(low, corner))) for corner in HEX_VERTICES] for low in octants])


_EIGHT = {10: _EIGHT_TETS, 27: _eight_hexes()}


@dataclass(frozen=True, eq=False)
class CellGrid:
    """Mesh of one kind of cell, for pictures.

    Attributes:
        points: nodes (n, 3) [m].
        cells: nodes (m, k) of each cell in VTK's order; k = 4, 10 for tetrahedra, 8, 27 for hexahedra.
    """

    points: Array
    cells: Integers

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise ModelError(f"points have shape {self.points.shape}, pictures need (n, 3)")
        if self.cells.ndim != 2 or self.cells.shape[1] not in VTK_TYPES:
            raise ModelError(
                f"cells have shape {self.cells.shape}, pictures need tetrahedra (4, 10 nodes) or hexahedra (8, 27)"
            )

    @staticmethod
    def of_model(model: SecondOrderModel) -> CellGrid:
        """Return the grid for displacements from ``model.expand``.

        Raises:
            ModelError: the model has no mesh, or one that is not of tetrahedra or hexahedra.
        """
        if model.dofs is None or model.dofs.mesh is None:
            raise ModelError("this model does not know its mesh: construct it with dofs= to draw its shapes")
        mesh: Any = model.dofs.mesh
        points = model.dofs.points.T
        order = 1 if len(points) == mesh.nvertices else 2
        alike = (kind for kind in CELL_KINDS.values() if isinstance(mesh, CELL_KINDS[kind.corners].mesh))
        kind = next((kind for kind in alike if kind.order == order), None)
        if kind is None:
            raise ModelError(f"shapes on {type(mesh).__name__} cannot be drawn; pictures need tetrahedra or hexahedra")
        nodes = skfem.Basis(mesh, kind.element, intorder=1).element_dofs
        return CellGrid(np.ascontiguousarray(points), to_vtk(nodes, kind))

    @property
    def linear_cells(self) -> Integers:
        """Return straight-edged cells on the same nodes: the cells themselves, or eight for each quadratic one."""
        split = _EIGHT.get(self.cells.shape[1])
        return self.cells if split is None else np.asarray(self.cells[:, split].reshape(-1, split.shape[1]))

    @property
    def size(self) -> float:
        """Return the largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())


@dataclass(frozen=True, eq=False)
class RevolvedGrid:
    """Meridian section revolved about the z axis.

    Attributes:
        grid: tetrahedra of the body, for displacements from `shape`.
        nodes: node of the section (n,) that each point of the grid comes from.
        angles: angle (n,) of each point [rad].
    """

    grid: CellGrid
    nodes: Integers
    angles: Array

    def shape(self, amplitudes: Array, harmonic: int, *, angle: float = 0.0) -> Array:
        """Return displacements (3, n) in Cartesian axes from amplitudes (3, n_nodes) (U, V, W) of ``model.expand``.

        u_r = U cos n(th - angle), u_th = V sin n(th - angle), u_z = W cos n(th - angle); u_th = V for n = 0, torsion.
        """
        if amplitudes.ndim != 2 or amplitudes.shape[0] != 3 or amplitudes.shape[1] <= self.nodes.max():
            raise ModelError(f"amplitudes have shape {amplitudes.shape}, must be (3, nodes of the section)")
        phase = harmonic * (self.angles - angle)
        radial, axial = (amplitudes[k, self.nodes] * np.cos(phase) for k in (0, 2))
        tangential = amplitudes[1, self.nodes] * (np.sin(phase) if harmonic else 1.0)
        c, s = np.cos(self.angles), np.sin(self.angles)
        return np.stack([radial * c - tangential * s, radial * s + tangential * c, axial])


def revolve(model: SecondOrderModel, *, slices: int = 64) -> RevolvedGrid:
    """Return the body of an axisymmetric model with ``slices`` around; nodes on the axis occur once.

    All tetrahedra have positive volume. The section starts at half a slice, so that no node off the axis lies in the
    planes y = 0 and, for ``slices`` a multiple of 4, x = 0: a cut in these contains no degenerate cells.

    Raises:
        ModelError: the model has no meridian section, or ``slices`` is below 3.
    """
    if slices < 3:
        raise ModelError(f"slices = {slices}: give at least 3")
    if model.dofs is None or model.dofs.mesh is None or len(model.dofs.points) != 3:
        raise ModelError("this model does not know its meridian section: construct it with dofs= to draw its shapes")
    mesh: Any = model.dofs.mesh
    r, _, z = model.dofs.points
    triangles = section_triangles(mesh, len(r))
    on_axis = r <= 1e-9 * r.max()
    n = len(r)
    number = np.arange(slices * n).reshape(slices, n)
    number[:, on_axis] = number[0, on_axis]
    bottom, top = number[:, triangles], np.roll(number, -1, axis=0)[:, triangles]
    cells = np.concatenate([bottom, top], axis=-1).reshape(-1, 6)[:, _PRISM].reshape(-1, 4)
    ordered = np.sort(cells, axis=1)
    cells = cells[np.all(np.diff(ordered, axis=1) > 0, axis=1)]  # prisms on the axis have fewer tetrahedra
    used, cells = np.unique(cells, return_inverse=True)
    nodes, angles = used % n, 2 * np.pi * (used // n + 0.5) / slices
    points = np.stack([r[nodes] * np.cos(angles), r[nodes] * np.sin(angles), z[nodes]], axis=1)
    return RevolvedGrid(CellGrid(points, _positive(points, cells.reshape(-1, 4))), nodes, angles)


def _positive(points: Array, cells: Any) -> Integers:
    """Return tetrahedra (m, 4) of positive volume: the first three nodes run anticlockwise as seen from the fourth."""
    corners = points[cells]
    flipped = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    return np.asarray(np.where(flipped[:, None], cells[:, [1, 0, 2, 3]], cells), dtype=np.int64)


def section_triangles(mesh: Any, n_nodes: int) -> Integers:
    """Return straight triangles (m, 3) on all nodes, sorted by number, so that neighbouring prisms split alike."""
    if not isinstance(mesh, skfem.MeshTri | skfem.MeshQuad):
        raise ModelError(f"shapes on {type(mesh).__name__} cannot be revolved; it must be a meridian section")
    element = axisymmetric.section_element(mesh, 1 if n_nodes == mesh.nvertices else 2)
    cells = np.asarray(skfem.Basis(mesh, element, intorder=1).element_dofs)
    picked = np.concatenate([cells[list(corners)].T for corners in _TRIANGLES[len(cells)]])
    return np.sort(picked, axis=1)


OPENED: Final = (math.radians(-6.0), math.radians(234.0))
"""Angles between which a body of revolution is drawn, open towards the camera at `rendering.ABOVE` [rad]."""
SLICES: Final = 48
_QUARTERS: Final = ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))  # quadrants of a nine-node element
_SIDES: Final = {
    4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


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

    def moved(self, displacement: Array, harmonic: int = 0) -> Array:
        """Return displacements (n, 3) from (S, 3) of ``nodes``; for a half section u_r, u_th, u_z, which vary around
        the axis as cos n th, sin n th, cos n th, n = ``harmonic``."""
        each = displacement[self.which]
        if self.angles is None:
            return each
        c, s = np.cos(self.angles), np.sin(self.angles)
        radial, around, axial = each.T * np.cos(harmonic * self.angles)
        if harmonic:
            around = each[:, 1] * np.sin(harmonic * self.angles)
        return np.stack([radial * c - around * s, radial * s + around * c, axial], axis=1)


def skin_of(model: SecondOrderModel) -> Skin:
    """Return the surface of a solid; for an axisymmetric model its section swept over `OPENED`, with both cut faces.

    Raises:
        ModelError: the model has no mesh, or one that cannot be drawn.
    """
    if model.dofs is None or getattr(model.dofs.mesh, "dim", lambda: 3)() == 3:
        grid = CellGrid.of_model(model)
        cells = grid.linear_cells
        sides = loops.unshared(np.concatenate([cells[:, list(side)] for side in _SIDES[cells.shape[1]]]))
        return _skin(grid.points, as_triangles(sides))
    r, _, z = model.dofs.points
    return skin_of_section(model.dofs.mesh, r, z)


def skin_of_section(mesh: Any, r: Array, z: Array, angles: Array | None = None) -> Skin:
    """Return the skin as `skin_of` of a section with unknowns at r, z (n,) [m]; at ``angles`` or `SLICES` of them."""
    angles = np.linspace(*OPENED, SLICES + 1) if angles is None else angles
    slices = len(angles) - 1
    triangles = section_triangles(mesh, len(r))
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
    quarters = mesh.cells[:, np.array(_QUARTERS)].reshape(-1, 4)
    return _skin(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), as_triangles(quarters))


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


def as_triangles(sides: Integers) -> Integers:
    """Return triangles (m, 3) unchanged, quadrilaterals (m, 4) each as two triangles."""
    return sides if sides.shape[1] == 3 else np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
