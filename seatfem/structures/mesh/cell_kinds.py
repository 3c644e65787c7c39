"""The element shapes a mesh may have: nodes in gmsh's order, and their columns in scikit-fem's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2, MeshHex, MeshHex2, MeshTet, MeshTet2

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
HEX_EDGES = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
HEX_FACES = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))
TET_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))

TET_VERTICES = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
HEX_VERTICES = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


@dataclass(frozen=True, eq=False)
class CellKind:
    """One kind of element.

    ``nodes`` (k, 3): reference coordinates in gmsh's order, on the unit tetrahedron or the unit cube; ``corners``: how
    many of them are vertices; ``element``, ``mesh``: scikit-fem's; ``degree``: of its det J, for exact volumes.
    """

    shape: str
    order: int
    corners: int
    nodes: Floats
    faces: tuple[tuple[int, ...], ...]
    element: Any
    mesh: type[MeshTet]
    degree: int

    @cached_property
    def columns(self) -> Integers:
        """Return the column of gmsh's order where scikit-fem's i-th node stands."""
        distance = np.abs(self.element.doflocs[:, None, :] - self.nodes[None, :, :]).sum(axis=2)
        return np.asarray(distance.argmin(axis=1))

    @cached_property
    def places(self) -> Floats:
        """Return the nodes and the centroid: where det J is looked at; (k + 1, 3)."""
        return np.vstack([self.nodes, self.nodes[: self.corners].mean(axis=0)])

    def gradients(self, places: Floats) -> Floats:
        """Return the reference gradients of the shape functions, gmsh's node order: (places, k, 3)."""
        out = np.empty((len(places), len(self.nodes), 3))
        for i, column in enumerate(self.columns):
            out[:, column] = self.element.lbasis(places.T, i)[1].T
        return out


def nodes_of(vertices: tuple[tuple[int, int, int], ...], *groups: tuple[tuple[int, ...], ...]) -> Floats:
    """Return the vertices, then the mean of each listed group of them."""
    corner = np.array(vertices, dtype=float)
    return np.vstack([corner, *(corner[list(members)].mean(axis=0) for group in groups for members in group)])


_TET, _HEX = "tetrahedron", "hexahedron"
_ALL = (tuple(range(8)),)

# By number of nodes.
CELL_KINDS: Mapping[int, CellKind] = MappingProxyType(
    {
        4: CellKind(_TET, 1, 4, nodes_of(TET_VERTICES), TET_FACES, ElementTetP1(), MeshTet, 0),
        10: CellKind(_TET, 2, 4, nodes_of(TET_VERTICES, TET_EDGES), TET_FACES, ElementTetP2(), MeshTet2, 3),
        8: CellKind(_HEX, 1, 8, nodes_of(HEX_VERTICES), HEX_FACES, ElementHex1(), MeshHex, 2),
        27: CellKind(
            _HEX, 2, 8, nodes_of(HEX_VERTICES, HEX_EDGES, HEX_FACES, _ALL), HEX_FACES, ElementHex2(), MeshHex2, 5
        ),
    }
)


def distinct(numbers: Integers) -> Integers:
    """Return the numbers sorted, each once. NumPy's `unique` hashes whole numbers, at ten times the time of sorting."""
    ordered = np.sort(numbers, axis=None)
    first = np.ones(len(ordered), dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[first])


def serendipity_to_27(points: Floats, cells: Integers) -> tuple[Floats, Integers]:
    """Turn hexahedra of 20 nodes into ones of 27, in gmsh's order: the same curved shape.

    The 20 shape functions span a subset of the 27, so the added nodes stand where the 20-node map puts the centres of
    faces (half the sum of its four mid-edge nodes less a quarter of that of its vertices) and of the element (a quarter
    of the sum of all mid-edge nodes less a quarter of that of all vertices).
    """
    place = points[cells]
    edge = {frozenset(ends): 8 + k for k, ends in enumerate(HEX_EDGES)}
    around = [[edge[frozenset((face[i - 1], face[i]))] for i in range(4)] for face in HEX_FACES]
    centres = np.stack(
        [
            place[:, mids].sum(axis=1) / 2 - place[:, list(face)].sum(axis=1) / 4
            for face, mids in zip(HEX_FACES, around, strict=True)
        ],
        axis=1,
    )
    keys = np.sort(cells[:, np.array(HEX_FACES)], axis=2).reshape(-1, 4)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    middle = place[:, 8:].sum(axis=1) / 4 - place[:, :8].sum(axis=1) / 4
    n, faces = len(points), len(first)
    added = np.hstack([n + number.reshape(-1, 6), n + faces + np.arange(len(cells))[:, None]])
    return np.vstack([points, centres.reshape(-1, 3)[first], middle]), np.hstack([cells, added])
