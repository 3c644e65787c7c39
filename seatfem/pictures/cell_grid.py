"""Nodes and cells as VTK wants them, linear or quadratic; axisymmetric models turned into bodies in space."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from seatfem.structures.elements.revolved_elements import section_element
from seatfem.structures.formats.file_mesh import VTK, to_vtk
from seatfem.structures.mesh.io import CELL_KINDS, HEX_VERTICES, nodes_of
from seatfem.structures.model import Array, ModelError, SecondOrderModel

Integers = NDArray[np.int64]

# A ten-node tetrahedron as eight four-node ones; mid-edge nodes 4..9 on 01, 12, 02, 03, 13, 23. The octahedron that
# remains inside is split along the diagonal 4-9.
_EIGHT_TETS = np.array(
    [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 9, 6, 7],
        [4, 9, 7, 8],
        [4, 9, 8, 5],
        [4, 9, 5, 6],
    ]
)
_HEX = nodes_of(HEX_VERTICES, VTK[27])  # (27, 3) on the unit cube
VTK_TYPES = {4: 10, 10: 24, 8: 12, 27: 29}
"""VTK's cell type by number of nodes."""
# straight triangles on the nodes of a cell of 3, 6, 4 or 9 nodes, in scikit-fem's order
_TRIANGLES = {
    3: ((0, 1, 2),),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    4: ((0, 1, 2), (0, 2, 3)),
    9: ((0, 4, 8), (0, 8, 7), (4, 1, 5), (4, 5, 8), (8, 5, 2), (8, 2, 6), (7, 8, 6), (7, 6, 3)),
}
_PRISM = np.array([[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]])  # bottom 0 1 2, top 3 4 5: three tetrahedra


def _eight_hexes() -> Integers:
    """Return (8, 8) columns of a 27-node hexahedron: the corners of its eight octants."""
    places = [tuple(row) for row in (2 * _HEX).astype(int)]
    octants = product((0, 1), repeat=3)
    return np.array([[places.index(tuple(np.add(low, corner))) for corner in HEX_VERTICES] for low in octants])


_EIGHT = {10: _EIGHT_TETS, 27: _eight_hexes()}


@dataclass(frozen=True, eq=False)
class CellGrid:
    """Mesh of one kind of cell, for pictures.

    Attributes:
        points: (n, 3) nodes [m].
        cells: (m, k) nodes of each cell in VTK's order; k = 4, 10 tetrahedra, 8, 27 hexahedra.
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
        """Return the grid on which ``model.expand(shape)`` lives.

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
        """Return cells with straight edges on the same nodes: the cells themselves, or eight for each quadratic one."""
        split = _EIGHT.get(self.cells.shape[1])
        return self.cells if split is None else np.asarray(self.cells[:, split].reshape(-1, split.shape[1]))

    @property
    def size(self) -> float:
        """Return the largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())


@dataclass(frozen=True, eq=False)
class RevolvedGrid:
    """A meridian section turned about the z axis.

    Attributes:
        grid: tetrahedra in space, to be drawn with the shapes that `shape` makes.
        nodes: (n,) node of the section that each point of the grid came from.
        angles: (n,) its angle [rad].
    """

    grid: CellGrid
    nodes: Integers
    angles: Array

    def shape(self, amplitudes: Array, harmonic: int, *, angle: float = 0.0) -> Array:
        """Return (3, n) displacements in space of (3, n_nodes) amplitudes (U, V, W), as ``model.expand`` gives them.

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
    """Return the body of an axisymmetric model, ``slices`` around; nodes on the axis occur once.

    All tetrahedra are positive. The section is turned by half a slice first, so that no node off the axis lies in the
    planes y = 0 and, for ``slices`` a multiple of 4, x = 0: a cut there has no flat cells.

    Raises:
        ModelError: the model does not know its section, or fewer than 3 slices.
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
    cells = cells[np.all(np.diff(ordered, axis=1) > 0, axis=1)]  # prisms on the axis have lost tetrahedra
    used, cells = np.unique(cells, return_inverse=True)
    nodes, angles = used % n, 2 * np.pi * (used // n + 0.5) / slices
    points = np.stack([r[nodes] * np.cos(angles), r[nodes] * np.sin(angles), z[nodes]], axis=1)
    return RevolvedGrid(CellGrid(points, _positive(points, cells.reshape(-1, 4))), nodes, angles)


def _positive(points: Array, cells: Any) -> Integers:
    """Return tetrahedra (m, 4) with the fourth node on the side that the first three turn around counterclockwise."""
    corners = points[cells]
    flipped = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    return np.asarray(np.where(flipped[:, None], cells[:, [1, 0, 2, 3]], cells), dtype=np.int64)


def section_triangles(mesh: Any, n_nodes: int) -> Integers:
    """Return straight triangles (m, 3) on all nodes; smaller numbers first, so that neighbouring prisms split alike."""
    if not isinstance(mesh, skfem.MeshTri | skfem.MeshQuad):
        raise ModelError(f"shapes on {type(mesh).__name__} cannot be revolved; it must be a meridian section")
    element = section_element(mesh, 1 if n_nodes == mesh.nvertices else 2)
    cells = np.asarray(skfem.Basis(mesh, element, intorder=1).element_dofs)
    picked = np.concatenate([cells[list(corners)].T for corners in _TRIANGLES[len(cells)]])
    return np.sort(picked, axis=1)
