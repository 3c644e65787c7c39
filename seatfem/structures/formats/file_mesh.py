"""Content of a mesh file before its groups become surfaces; decks of other programs, with the file's own numbers.

Abaqus, Nastran and VTK have the same order of an element's vertices, but different orders of nodes on edges and faces.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.structures import errors
from seatfem.structures.mesh import checks, io

SPAN = 10**9  # numbers of nodes and elements of a deck are below; those of a k-th copy of a part are larger by k SPAN
MOST_GROUPS = 5000  # largest number of groups of a file: sets of nodes, of elements, surfaces
Groups = tuple[tuple[int, ...], ...]
TET_RING: Groups = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
BOTTOM: Groups = ((0, 1), (1, 2), (2, 3), (3, 0))
TOP: Groups = ((4, 5), (5, 6), (6, 7), (7, 4))
UPRIGHT: Groups = ((0, 4), (1, 5), (2, 6), (3, 7))
HEX_RING = BOTTOM + TOP + UPRIGHT
CENTRE: Groups = (tuple(range(8)),)
ABAQUS_HEX_FACES: Groups = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
ABAQUS_TET_FACES: Groups = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
VTK_HEX_FACES: Groups = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))
# Nodes after the vertices, each by the vertices between which it lies.
GMSH: Mapping[int, Groups] = MappingProxyType(
    {4: (), 8: (), 10: io.TET_EDGES, 20: io.HEX_EDGES, 27: io.HEX_EDGES + io.HEX_FACES + CENTRE}
)
ABAQUS: Mapping[int, Groups] = MappingProxyType(
    {4: (), 8: (), 10: TET_RING, 20: HEX_RING, 27: HEX_RING + CENTRE + ABAQUS_HEX_FACES}
)
NASTRAN: Mapping[int, Groups] = MappingProxyType({4: (), 8: (), 10: TET_RING, 20: BOTTOM + UPRIGHT + TOP})
VTK: Mapping[int, Groups] = MappingProxyType({**ABAQUS, 27: HEX_RING + VTK_HEX_FACES + CENTRE})


@dataclass(frozen=True, eq=False)
class FileMesh:
    """Nodes, elements and groups of a file, in its length unit and gmsh's node order.

    ``points`` (n, 3); ``cells`` (m, k) rows of ``points``, k = 20 or as in `MeshArrays`; ``surfaces``: name -> vertices
    (f, 3) or (f, 4); ``volumes``: name -> rows of ``cells``; ``node_sets``: name -> rows of ``points``. ``unit``:
    metres per length unit, 0 if the file does not state it; ``notes``: what was left aside, for the user.
    """

    points: io.Floats
    cells: io.Integers
    surfaces: Mapping[str, io.Integers] = field(default_factory=dict)
    volumes: Mapping[str, io.Integers] = field(default_factory=dict)
    node_sets: Mapping[str, io.Integers] = field(default_factory=dict)
    unit: float = 0.0
    notes: tuple[str, ...] = ()


def one_kind(solids: Sequence[tuple[str, io.Integers, bool]], source: str) -> io.Integers:
    """Return the nodes (m, k) of solids: name of their type in the file, rows of nodes, whether these are supported.

    Raises `MeshError` unless they are all of one supported kind.
    """
    if len({rows.shape[1] for _, rows, _ in solids}) == 1 and all(usable for *_, usable in solids):
        return np.concatenate([rows for _, rows, _ in solids])
    counts: Counter[str] = Counter()
    for name, rows, _ in solids:
        counts[name] += len(rows)
    kinds = ", ".join(f"{count} {name}" for name, count in sorted(counts.items())) or "none"
    raise errors.MeshError(
        f"{source}: solids must be tetrahedra or hexahedra, all of one order, 1 or 2; found: {kinds}"
    )


def check_group_count(count: int, source: str) -> None:
    """Raise `MeshError` for more groups than `MOST_GROUPS`, since each is looked up in the whole mesh."""
    if count > MOST_GROUPS:
        raise errors.MeshError(f"{source}: {count} groups, must be at most {MOST_GROUPS}; export those that are used")


def to_arrays(mesh: FileMesh, unit: float, source: str) -> io.MeshArrays:
    """Return arrays in metres, 20-node hexahedra as 27, node sets as the free faces of which they hold all vertices.

    A node set with the name of a surface, and one that holds no complete face, make no surface.
    """
    points, cells = unit * mesh.points, mesh.cells
    if cells.shape[1] == 20:
        points, cells = io.serendipity_to_27(points, cells)
    arrays = io.MeshArrays(points, cells, mesh.surfaces, mesh.volumes, source)
    if not mesh.node_sets:
        return arrays
    faces = np.array(arrays.kind.faces)
    free = arrays.cells[:, faces][free_face_mask(arrays.cells, faces)]
    complete = {name: free[io.facets_within(free.T, rows)] for name, rows in mesh.node_sets.items()}
    surfaces = without_empty(complete) | dict(mesh.surfaces)
    return io.MeshArrays(points, cells, surfaces, mesh.volumes, source)


def without_empty(groups: Mapping[str, io.Integers]) -> dict[str, io.Integers]:
    """Return the groups that have members."""
    return {name: members for name, members in groups.items() if len(members)}


def free_face_mask(cells: io.Integers, faces: io.Integers) -> NDArray[np.bool_]:
    """Return a mask (m, faces) of the faces that belong to only one element; ``faces``: columns of ``cells``."""
    vertices = np.sort(cells[:, faces].reshape(-1, faces.shape[1]), axis=1)
    _, number, count = np.unique(vertices, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(count[number.ravel()] == 1).reshape(len(cells), len(faces))


def merged(mesh: FileMesh, tolerance: float, source: str) -> FileMesh:
    """Return the mesh with nodes that are closer than ``tolerance`` (in the file's unit) merged."""
    pairs = checks.near_pairs(mesh.points, tolerance, source)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(mesh.points),) * 2)
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    keep = first[label]
    surfaces, node_sets = (
        {name: keep[rows] for name, rows in groups.items()} for groups in (mesh.surfaces, mesh.node_sets)
    )
    return replace(mesh, cells=keep[mesh.cells], surfaces=surfaces, node_sets=node_sets)


def stacked(parts: Sequence[io.Integers], width: int) -> io.Integers:
    """Return the parts stacked by rows; (0, width) without any."""
    return np.concatenate([np.empty((0, width), dtype=np.int64), *parts])


def face_width(cells: io.Integers) -> int:
    """Return the number of vertices of a face of such elements."""
    return 3 if cells.shape[1] in (4, 10) else 4


def to_gmsh(cells: io.Integers, order: Mapping[int, Groups]) -> io.Integers:
    """Return ``cells`` (m, k) with columns in gmsh's order instead of another program's."""
    nodes = cells.shape[1]
    corners = 4 if nodes in (4, 10) else 8
    column_of = {frozenset(group): corners + k for k, group in enumerate(order[nodes])}
    columns = [*range(corners), *(column_of[frozenset(group)] for group in GMSH[nodes])]
    return np.ascontiguousarray(cells[:, columns])


def to_vtk(rows: io.Integers, kind: io.CellKind) -> io.Integers:
    """Return cells (m, k) in VTK's order from scikit-fem's table (k, m) of their nodes."""
    cells = np.empty((rows.shape[1], rows.shape[0]), dtype=np.int64)
    cells[:, to_gmsh(np.arange(rows.shape[0])[None], VTK)[0][kind.columns]] = rows.T
    return cells


@dataclass(frozen=True, eq=False)
class Elements:
    """Elements of one type, by the file's name: rows of number and nodes (m, 1 + k); whether they are supported."""

    type: str
    table: io.Integers
    usable: bool = True


@dataclass(frozen=True, eq=False)
class Deck:
    """Mesh with the node and element numbers of the file.

    ``solids``: their nodes are in the ``order`` of the program; ``skins``: triangles and quadrilaterals, vertices only;
    ``element_sets``, ``node_sets``: name -> numbers. ``what``: the program's word for a node.
    """

    source: str
    order: Mapping[int, Groups]
    node_ids: io.Integers
    points: io.Floats
    solids: Sequence[Elements]
    skins: Sequence[Elements]
    element_sets: Mapping[str, io.Integers]
    node_sets: Mapping[str, io.Integers]
    what: str = "node"

    def rows(self, numbers: io.Integers) -> io.Integers:
        """Return the rows of ``points`` with these node numbers. Raises `MeshError` if a number is not defined."""
        missing = io.distinct(numbers[~np.isin(numbers, self.node_ids)])
        if len(missing):
            first = f"{self.what} {missing[0] % SPAN} is used and not defined"
            raise errors.MeshError(f"{self.source}: {first}, export it too ({len(missing)} such {self.what}s)")
        order = np.argsort(self.node_ids, kind="stable")
        return np.asarray(order[np.searchsorted(self.node_ids, numbers, sorter=order)])


@dataclass(frozen=True, eq=False)
class Assembled:
    """Mesh, numbers of its cells, and numbers and faces (rows of its points) of the skins that match its cells."""

    mesh: FileMesh
    ids: io.Integers
    skin_ids: io.Integers
    skin: io.Integers


def _check_numbers(what: str, numbers: io.Integers, rows: io.Integers | io.Floats | None, source: str) -> None:
    """Raise `MeshError` for a number that is there twice, with different ``rows`` if there are any."""
    order = np.argsort(numbers, kind="stable")
    twice = np.flatnonzero(numbers[order[1:]] == numbers[order[:-1]])
    if rows is not None:
        twice = twice[np.any(rows[order[twice]] != rows[order[twice + 1]], axis=1)]
    if len(twice):
        raise errors.MeshError(f"{source}: {what} {numbers[order[twice[0]]] % SPAN} is there twice; remove one")


def assembled(deck: Deck) -> Assembled:
    """Return the deck by rows: the solids of a set are a volume, its skins a surface, its nodes a node set.

    Raises `MeshError`: solids of several kinds, nodes that are used and not defined, numbers that are there twice.
    """
    check_group_count(len(deck.element_sets) + len(deck.node_sets), deck.source)
    nodes = one_kind([(each.type, each.table[:, 1:], each.usable) for each in deck.solids], deck.source)
    cells = to_gmsh(deck.rows(nodes), deck.order)
    ids, width = np.concatenate([each.table[:, 0] for each in deck.solids]), face_width(cells)
    _check_numbers("element", ids, None, deck.source)
    _check_numbers(deck.what, deck.node_ids, deck.points, deck.source)
    skins = stacked([each.table for each in deck.skins if each.table.shape[1] == 1 + width], 1 + width)
    skin_ids, skin = skins[:, 0], deck.rows(skins[:, 1:])
    volumes = {name: np.flatnonzero(np.isin(ids, members)) for name, members in deck.element_sets.items()}
    surfaces = {name: skin[np.isin(skin_ids, members)] for name, members in deck.element_sets.items()}
    node_sets = {name: deck.rows(numbers) for name, numbers in deck.node_sets.items()}
    mesh = FileMesh(deck.points, cells, without_empty(surfaces), without_empty(volumes), node_sets)
    return Assembled(mesh, ids, skin_ids, skin)
