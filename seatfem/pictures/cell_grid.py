"""Nodes and cells as VTK wants them: tetrahedra or hexahedra, linear or quadratic."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

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
_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_EDGES = ((0, 1), (1, 2), (3, 2), (0, 3), (4, 5), (5, 6), (7, 6), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7))
_FACES = ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (3, 2, 7, 6), (0, 1, 2, 3), (4, 5, 6, 7))


def _cube_nodes() -> Array:
    """(27, 3) places of a triquadratic hexahedron's nodes on the unit cube, in VTK's order."""
    corner = np.array(_CUBE, dtype=float)
    middles = [corner[list(group)].mean(axis=0) for groups in (_EDGES, _FACES) for group in groups]
    return np.vstack([corner, *middles, corner.mean(axis=0)])


_NODES = {8: np.array(_CUBE, dtype=float), 27: _cube_nodes()}
_ELEMENTS = {
    (skfem.MeshTet, 1): skfem.ElementTetP1,
    (skfem.MeshTet, 2): skfem.ElementTetP2,
    (skfem.MeshHex, 1): skfem.ElementHex1,
    (skfem.MeshHex, 2): skfem.ElementHex2,
}


def _eight_hexes() -> Integers:
    """(8, 8) columns of a 27-node hexahedron: the corners of its eight octants."""
    places = [tuple(row) for row in (2 * _NODES[27]).astype(int)]
    octants = product((0, 1), repeat=3)
    return np.array([[places.index(tuple(np.add(low, corner))) for corner in _CUBE] for low in octants])


_EIGHT = {10: _EIGHT_TETS, 27: _eight_hexes()}
VTK_TYPES = {4: 10, 10: 24, 8: 12, 27: 29}
"""VTK's cell type by number of nodes."""


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
        """The grid on which ``model.expand(shape)`` lives.

        Raises:
            ModelError: the model has no mesh, or one that is not of tetrahedra or hexahedra.
        """
        if model.dofs is None or model.dofs.mesh is None:
            raise ModelError("this model does not know its mesh, so that its shapes cannot be drawn")
        mesh: Any = model.dofs.mesh
        points = model.dofs.points.T
        order = 1 if len(points) == mesh.nvertices else 2
        found = [make for (kind, degree), make in _ELEMENTS.items() if isinstance(mesh, kind) and degree == order]
        if not found:
            raise ModelError(f"shapes on {type(mesh).__name__} cannot be drawn; pictures need tetrahedra or hexahedra")
        element = found[0]()
        nodes = skfem.Basis(mesh, element, intorder=1).element_dofs.T
        if isinstance(mesh, skfem.MeshHex):
            apart = np.abs(_NODES[len(element.doflocs)][:, None] - np.asarray(element.doflocs)[None]).sum(axis=2)
            nodes = nodes[:, apart.argmin(axis=1)]
        return CellGrid(np.ascontiguousarray(points), np.ascontiguousarray(nodes, dtype=np.int64))

    @property
    def linear_cells(self) -> Integers:
        """Cells with straight edges on the same nodes: the cells themselves, or eight for each quadratic one."""
        split = _EIGHT.get(self.cells.shape[1])
        return self.cells if split is None else np.asarray(self.cells[:, split].reshape(-1, split.shape[1]))

    @property
    def size(self) -> float:
        """Largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())
