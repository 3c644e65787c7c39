"""Plain arrays of tetrahedra or hexahedra -> scikit-fem mesh with named boundaries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex, MeshHex2, MeshTet, MeshTet2
from skfem.assembly import Dofs

from seatfem.structures.mesh.cell_kinds import CELL_KINDS, CellKind, Floats, Integers, distinct, serendipity_to_27

SolidMesh: TypeAlias = MeshTet | MeshTet2 | MeshHex | MeshHex2


class MeshError(ValueError):
    """A mesh that cannot be used; the message names source, group, and what the mesh has instead.

    ``problems``: each by the argument of the reader that is to blame, "" where none is.
    """

    def __init__(self, message: str, *, field: str = "", problems: tuple[tuple[str, str], ...] = ()) -> None:
        super().__init__(message)
        self.problems = problems or ((field, message),)


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Mesh of one kind of element in gmsh's node order, metres.

    ``points`` (n, 3); ``cells`` (m, k) rows of ``points``: tetrahedra for k = 4 or 10, hexahedra for k = 8 or 27;
    ``surfaces``: name -> (f, 3) or (f, 4) vertices of its triangles or quadrilaterals; ``volumes``: name -> (v,) rows
    of ``cells``; ``source``: what error messages call this mesh. Raises `MeshError` for another k.
    """

    points: Floats
    cells: Integers
    surfaces: Mapping[str, Integers]
    volumes: Mapping[str, Integers]
    source: str

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.shape[1] not in CELL_KINDS:
            raise MeshError(
                f"{self.source}: cells of shape {self.cells.shape}: must be (m, 4) or (m, 10) for tetrahedra, "
                "(m, 8) or (m, 27) for hexahedra"
            )

    @property
    def kind(self) -> CellKind:
        return CELL_KINDS[self.cells.shape[1]]

    @property
    def order(self) -> int:
        return self.kind.order

    @property
    def shape(self) -> str:
        """Return "tetrahedron" or "hexahedron"."""
        return self.kind.shape

    @property
    def vertices(self) -> Integers:
        """Return (m, 4) or (m, 8), the cells without their nodes on edges, on faces and inside."""
        return self.cells[:, : self.kind.corners]


def from_gmsh(found: Mapping[str, NDArray[Any]], source: str) -> MeshArrays:
    """Return the mesh from the arrays that the gmsh process gives; hexahedra of 20 nodes get the 7 others."""
    points, cells = found["points"], found["cells"]
    if cells.shape[1] == 20:
        points, cells = serendipity_to_27(points, cells)
    return MeshArrays(points, cells, groups(found, "surface"), groups(found, "volume"), source)


def groups(found: Mapping[str, NDArray[Any]], kind: str) -> dict[str, NDArray[Any]]:
    """Return name -> array of those of a kind: "surface", "volume", "nodes", "line", "area", "cad"."""
    return {key.removeprefix(f"{kind}:"): rows for key, rows in found.items() if key.startswith(f"{kind}:")}


def to_skfem(arrays: MeshArrays) -> SolidMesh:
    """Return the scikit-fem mesh with every named surface as a boundary and every named volume as a subdomain.

    MeshTet, MeshTet2, MeshHex or MeshHex2; those of order 2 are isoparametric. Nodes of no element are dropped; a
    subdomain "seat" with all elements is added where the mesh names none. Positive elements stay positive. Raises
    `MeshError` for a surface that is no part of the mesh; what else can be wrong is found by `mesh_checks`.
    """
    kind = arrays.kind
    used = distinct(arrays.vertices)
    number = np.full(len(arrays.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    flat = CELL_KINDS[kind.corners]
    t = np.ascontiguousarray(number[arrays.vertices[:, flat.columns]].T)
    straight = flat.mesh(np.ascontiguousarray(arrays.points[used].T), t)
    boundaries = {
        name: _facets(straight, number[faces], name, arrays.source) for name, faces in arrays.surfaces.items()
    }
    subdomains = {"seat": np.arange(len(arrays.cells)), **arrays.volumes}
    return kind.mesh(_node_places(straight, arrays), t, boundaries, subdomains)


def facets_within(facets: Integers, vertices: Integers) -> Integers:
    """Return the columns of ``facets`` (3 or 4, n) all of whose vertices are among the given ones."""
    chosen = np.zeros(int(max(facets.max(initial=-1), vertices.max(initial=-1))) + 1, dtype=bool)
    chosen[vertices] = True
    return np.flatnonzero(chosen[facets].all(axis=0))


def _facets(mesh: SolidMesh, faces: Integers, name: str, source: str) -> Integers:
    """Return facet numbers of faces given by their vertices."""
    shape = "triangles" if mesh.facets.shape[0] == 3 else "quadrilaterals"
    if faces.shape[1] != mesh.facets.shape[0]:
        raise MeshError(f"{source}: faces of {name!r} have {faces.shape[1]} vertices, must be {shape} as the mesh's")
    known = faces[(faces >= 0).all(axis=1)]
    near = facets_within(mesh.facets, known)
    rows = np.vstack([np.sort(mesh.facets[:, near].T, axis=1), np.sort(known, axis=1)])
    _, key = np.unique(rows, axis=0, return_inverse=True)
    key = key.ravel()
    matched = np.isin(key[len(near) :], key[: len(near)])
    lost = len(faces) - int(matched.sum())
    if lost:
        raise MeshError(f"{source}: {lost} of {len(faces)} {shape} of {name!r} must be faces of its elements")
    return np.sort(near[np.isin(key[: len(near)], key[len(near) :])])


def _node_places(straight: SolidMesh, arrays: MeshArrays) -> Floats:
    """Return all nodes as scikit-fem numbers them: vertices, edges, faces, interiors; shape (3, n)."""
    kind = arrays.kind
    if kind.order == 1:
        return np.asarray(straight.doflocs)
    dofs = Dofs(straight, kind.element)
    places = np.empty((3, dofs.N))
    for row, column in zip(dofs.element_dofs, kind.columns, strict=True):
        places[:, row] = arrays.points[arrays.cells[:, column]].T
    return places
