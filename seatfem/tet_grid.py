"""Nodes and tetrahedra as VTK wants them, linear or quadratic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from seatfem.model import Array, ModelError, SecondOrderModel

Integers = NDArray[np.int64]

# A ten-node tetrahedron as eight four-node ones; mid-edge nodes 4..9 on 01, 12, 02, 03, 13, 23. The octahedron that
# remains inside is split along the diagonal 4-9.
_EIGHT = np.array(
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


@dataclass(frozen=True, eq=False)
class TetGrid:
    """Tetrahedral mesh for pictures.

    Attributes:
        points: (n, 3) nodes [m].
        cells: (m, 4) or (m, 10) nodes of each tetrahedron; mid-edge nodes on edges 01, 12, 02, 03, 13, 23 (the order of
            VTK and of scikit-fem).
    """

    points: Array
    cells: Integers

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3:
            raise ModelError(f"points have shape {self.points.shape}, pictures need (n, 3)")
        if self.cells.ndim != 2 or self.cells.shape[1] not in (4, 10):
            raise ModelError(f"cells have shape {self.cells.shape}, pictures need tetrahedra, (m, 4) or (m, 10)")

    @staticmethod
    def of_model(model: SecondOrderModel) -> TetGrid:
        """The grid on which ``model.expand(shape)`` lives.

        Raises:
            ModelError: the model has no mesh, or one that is not of tetrahedra.
        """
        if model.dofs is None or model.dofs.mesh is None:
            raise ModelError("this model does not know its mesh, so that its shapes cannot be drawn")
        mesh: Any = model.dofs.mesh
        points = model.dofs.points.T
        if not isinstance(mesh, skfem.MeshTet):
            raise ModelError(f"shapes on {type(mesh).__name__} cannot be drawn; pictures need tetrahedra")
        element = skfem.ElementTetP1() if len(points) == mesh.nvertices else skfem.ElementTetP2()
        cells = skfem.Basis(mesh, element, intorder=1).element_dofs.T
        return TetGrid(np.ascontiguousarray(points), np.ascontiguousarray(cells, dtype=np.int64))

    @property
    def linear_cells(self) -> Integers:
        """(m, 4), or (8 m, 4) for quadratic cells: four-node tetrahedra on the same nodes."""
        if self.cells.shape[1] == 4:
            return self.cells
        return np.asarray(self.cells[:, _EIGHT].reshape(-1, 4))

    @property
    def size(self) -> float:
        """Largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())
