"""Element shapes in gmsh's and scikit-fem's order of nodes; plain arrays -> scikit-fem mesh with named boundaries."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2, MeshHex, MeshHex2, MeshTet, MeshTet2
from skfem.assembly import Dofs

from seatfem.structures.errors import MeshError

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

    ``nodes`` (k, 3): reference coordinates in gmsh's order, on the unit tetrahedron or the unit cube; ``corners``:
    number of vertices; ``element``, ``mesh``: classes of scikit-fem; ``degree``: polynomial degree of det J.
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
        """Return, for each node in scikit-fem's order, its column in gmsh's order."""
        distance = np.abs(self.element.doflocs[:, None, :] - self.nodes[None, :, :]).sum(axis=2)
        return np.asarray(distance.argmin(axis=1))

    @cached_property
    def places(self) -> Floats:
        """Return the reference coordinates of the nodes and the centroid, at which det J is checked; (k + 1, 3)."""
        return np.vstack([self.nodes, self.nodes[: self.corners].mean(axis=0)])

    def gradients(self, places: Floats) -> Floats:
        """Return the reference gradients of the shape functions, gmsh's node order: (places, k, 3)."""
        out = np.empty((len(places), len(self.nodes), 3))
        for i, column in enumerate(self.columns):
            out[:, column] = self.element.lbasis(places.T, i)[1].T
        return out


def nodes_of(vertices: tuple[tuple[int, int, int], ...], *groups: tuple[tuple[int, ...], ...]) -> Floats:
    """Return the vertices, then the centre of each listed group of vertices."""
    corner = np.array(vertices, dtype=float)
    return np.vstack([corner, *(corner[list(members)].mean(axis=0) for group in groups for members in group)])


_TET, _HEX = "tetrahedron", "hexahedron"
_ALL = (tuple(range(8)),)

# Kinds of elements by number of nodes
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
    """Return the sorted distinct numbers, ten times as fast as NumPy's `unique`, which hashes integers."""
    ordered = np.sort(numbers, axis=None)
    first = np.ones(len(ordered), dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[first])


def serendipity_to_27(points: Floats, cells: Integers) -> tuple[Floats, Integers]:
    """Turn hexahedra of 20 nodes into hexahedra of 27 nodes of the same curved shape, in gmsh's order.

    The 20 shape functions span a subset of the 27, so the 20-node map gives the added nodes: the centre of a face is
    half the sum of its four mid-edge nodes less a quarter of that of its vertices; the centre of the element is a
    quarter of the sum of all mid-edge nodes less a quarter of that of all vertices.
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


SolidMesh: TypeAlias = MeshTet | MeshTet2 | MeshHex | MeshHex2


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Mesh of one kind of element in gmsh's node order, metres.

    ``points`` (n, 3); ``cells`` (m, k) rows of ``points``: tetrahedra for k = 4 or 10, hexahedra for k = 8 or 27;
    ``surfaces``: name -> (f, 3) or (f, 4) vertices of its triangles or quadrilaterals; ``volumes``: name -> (v,) rows
    of ``cells``; ``source``: name in error messages. Raises `MeshError` for another k.
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
    def vertices(self) -> Integers:
        """Return (m, 4) or (m, 8), the cells without their nodes on edges, on faces and inside."""
        return self.cells[:, : self.kind.corners]


def from_gmsh(named: Mapping[str, NDArray[Any]], source: str) -> MeshArrays:
    """Return the mesh from the arrays of the gmsh process; hexahedra of 20 nodes are completed to 27."""
    points, cells = named["points"], named["cells"]
    if cells.shape[1] == 20:
        points, cells = serendipity_to_27(points, cells)
    return MeshArrays(points, cells, groups(named, "surface"), groups(named, "volume"), source)


def groups(named: Mapping[str, NDArray[Any]], kind: str) -> dict[str, NDArray[Any]]:
    """Return name -> array of the groups of a kind: "surface", "volume", "nodes", "line", "area" or "cad"."""
    return {key.removeprefix(f"{kind}:"): rows for key, rows in named.items() if key.startswith(f"{kind}:")}


def to_skfem(arrays: MeshArrays) -> SolidMesh:
    """Return the scikit-fem mesh with every named surface as a boundary and every named volume as a subdomain.

    MeshTet, MeshTet2, MeshHex or MeshHex2; those of order 2 are isoparametric. Nodes of no element are dropped; a
    subdomain "seat" with all elements is added if there is none. Elements keep their orientation. Raises `MeshError`
    for a surface that is no part of the mesh; other checks are those of `seatfem.structures.mesh.checks`.
    """
    kind = arrays.kind
    used = distinct(arrays.vertices)
    number = np.full(len(arrays.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    flat = CELL_KINDS[kind.corners]
    t = np.ascontiguousarray(number[arrays.vertices[:, flat.columns]].T)
    straight = flat.mesh(np.ascontiguousarray(arrays.points[used].T), t)
    boundaries = {
        name: matched_facets(straight, number[faces], name, arrays.source) for name, faces in arrays.surfaces.items()
    }
    subdomains = {"seat": np.arange(len(arrays.cells)), **arrays.volumes}
    places = straight.doflocs
    if kind.order == 2:
        places = node_places(straight, kind.element, arrays.points, arrays.cells, kind.columns)
    return kind.mesh(np.asarray(places), t, boundaries, subdomains)


def facets_within(facets: Integers, vertices: Integers) -> Integers:
    """Return the columns of ``facets`` (3 or 4, n) whose vertices are all among ``vertices``."""
    chosen = np.zeros(int(max(facets.max(initial=-1), vertices.max(initial=-1))) + 1, dtype=bool)
    chosen[vertices] = True
    return np.flatnonzero(chosen[facets].all(axis=0))


def matched_facets(mesh: Any, faces: Integers, name: str, source: str) -> Integers:
    """Return the sorted facet numbers of ``faces`` (f, 2, 3 or 4), rows of vertices."""
    shape = {2: "lines", 3: "triangles", 4: "quadrilaterals"}[mesh.facets.shape[0]]
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


def node_places(straight: Any, kind: Any, points: Floats, cells: Integers, columns: Sequence[int] | Integers) -> Floats:
    """Return the (d, n) coordinates of the nodes of ``cells``, in scikit-fem's numbering of an element ``kind``."""
    dofs = Dofs(straight, kind)
    places = np.empty((points.shape[1], dofs.N))
    for row, column in zip(dofs.element_dofs, columns, strict=True):
        places[:, row] = points[cells[:, column]].T
    return places
