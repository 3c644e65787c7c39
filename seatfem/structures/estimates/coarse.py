"""The coarsest mesh of a body, and how many elements finer ones have in its place.

    n = sum of max(1, a int dV/h^d + b int dS/h^(d - 1), c int dL/h)

over the elements of the coarse mesh: none of them becomes less than one, as fillets and thin walls ask for, and where
the sizes h of the finer mesh are smaller, as many as gmsh makes in the volume and more along the surface; d = 3 of
tetrahedra, 2 of half sections and plans. A solid thinner than h both ways has as many as follow each other along its
sharp edges L. Each has its own number of elements, whatever the sum says of it.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures import mesh as meshes
from seatfem.structures.errors import GeometryError
from seatfem.structures.inspection import cad
from seatfem.structures.mesh._gmsh_inspect import COARSE, GROWTH, SIZE_PER_WIDTH
from seatfem.structures.mesh.gmsh_process import MeshingError, remembered_gmsh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, Geometry, encode

Integers = NDArray[np.int64]
HALVED: Final = 2.0  # gmsh meshes this many times coarser, then quarters
PLACES: Final = 64  # points in an element near the struck face, where sizes change; one in others
BINS, CLOSEST = 40, 1e-4  # of distances, over which points of an element are one; the smallest over the largest
NEAR: Final = 1.5  # extents of an element within which it is near
AT_ONCE: Final = 4096  # points whose distances are taken together
SHARP: Final = math.radians(30)  # turn of a surface at an edge
ON_STRUCK: Final = 64  # points on each facet of the struck face, from which distances are taken


@dataclass(frozen=True)
class Law:
    """How many elements gmsh makes.

    Attributes:
        sides: corners of an element on each of its facets.
        dimension: d.
        inside, along: elements over int dV/h^d and over int dS/h^(d - 1).
        at_edge: elements and facets over int dL/h of a sharp edge where the body is thinner than h: a bar of four has
            13 and 9 in each length h (19 mm in 4 x 6 mm, 3 to 100 m long).
        facets: on the surface, over the latter.
        of_elements, of_facets: vertices over both numbers.
    """

    sides: tuple[tuple[int, ...], ...]
    dimension: int
    inside: float
    along: float
    at_edge: tuple[float, float]
    facets: float
    of_elements: float
    of_facets: float


LAWS: Final = {
    "tetrahedra": Law(((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)), 3, 2.26, 4.77, (3.3, 2.2), 2.69, 0.145, 0.347),
    "triangles": Law(((0, 1), (1, 2), (2, 0)), 2, 2.23, 1.06, (0.0, 0.0), 1.2, 0.5, 0.5),
    "quadrilaterals": Law(((0, 1), (1, 2), (2, 3), (3, 0)), 2, 3.5, 3.23, (0.0, 0.0), 2.9, 1.0, 0.5),
}


@dataclass(frozen=True)
class Tally:
    """Numbers of elements, of facets on the surface (sides on an outline), and of vertices."""

    elements: float
    facets: float
    vertices: float


@dataclass(frozen=True)
class Places:
    """Points in elements or facets: the measure that each stands for, its distance from the struck face [m], and the
    row of what it lies in."""

    weight: Array
    distance: Array
    row: Integers

    def per_row(self, spec: MeshSpec, dimension: int, rows: int) -> Array:
        """Return int dV/h^d over each of so many rows."""
        h = size_at(self.distance, spec)
        return np.asarray(np.bincount(self.row, self.weight / h**dimension, rows), dtype=np.float64)


def size_at(distance: Array, spec: MeshSpec) -> Array:
    """Return the element size [m] that is asked for at distances from the patch [m]."""
    near = spec.patch_size
    return np.asarray(np.interp(distance, [near, max(near + spec.transition, 1.001 * near)], [near, spec.size]))


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """A mesh that tells the numbers of others.

    Attributes:
        kind: of its elements, in `LAWS`.
        spec: sizes that it was made with.
        own: its numbers.
        inner, outer, edges: places in its elements, on its facets, and on sharp edges of a solid, by facet.
        owner: (facets,) the element behind each.
    """

    kind: str
    spec: MeshSpec
    own: Tally
    inner: Places
    outer: Places
    edges: Places
    owner: Integers

    def count(self, spec: MeshSpec) -> Tally:
        """Return the numbers of a mesh of other sizes."""
        law = LAWS[self.kind]
        now, before = (self._per_part(each) for each in (spec, self.spec))
        elements, facets = (_at_least_one(*pair) for pair in zip(now, before, strict=True))
        more = law.of_elements * (elements - self.own.elements) + law.of_facets * (facets - self.own.facets)
        return Tally(elements, facets, max(self.own.vertices + more, law.of_elements * elements))

    def _per_part(self, spec: MeshSpec) -> tuple[Array, Array]:
        """Return what the law says of each element and of each facet."""
        law, m, n = LAWS[self.kind], round(self.own.elements), round(self.own.facets)
        if self.kind == "quadrilaterals":
            spec = replace(spec, size=HALVED * spec.size, contact_size=HALVED * spec.patch_size)
        inside = law.inside * self.inner.per_row(spec, law.dimension, m)
        area = self.outer.per_row(spec, law.dimension - 1, n)
        elements, edges = inside + law.along * np.bincount(self.owner, area, m), self.edges.per_row(spec, 1, n)
        at_edge, facets_at_edge = law.at_edge
        at_edges = at_edge * np.bincount(self.owner, edges, m)
        return np.maximum(elements, at_edges), np.maximum(law.facets * area, facets_at_edge * edges)


def _at_least_one(now: Array, before: Array) -> float:
    """Return the sum over parts of a coarse mesh, by what the law says of each now, less what it said too much
    before."""
    return float(max(np.maximum(1.0, now - np.maximum(0.0, before - 1.0)).sum(), now.sum()))


TASKS: Final = {"solid": "mesh", "section": "section", "plan": "plan"}
Part = Literal["solid", "section", "plan"]
"""What is meshed of a body: the solid or a sector, its half section, or its plan, which is swept."""


def count_elements(
    geometry: Geometry, spec: MeshSpec, coarse: MeshSpec, part: Part = "solid", sectors: int = 1
) -> Tally | None:
    """Return the numbers of a mesh of these sizes, by a mesh with ``coarse`` ones; ``None`` where that cannot be made.

    Args:
        geometry: of the body.
        spec: whose sizes count.
        coarse: sizes of the mesh that is made, once in a process; of a file, its inspection has made one.
        part: that is meshed.
        sectors: that the body is cut into; one of them is meshed.
    """
    if isinstance(geometry, CadPart):
        made = _inspected(cad.inspect_geometry(geometry))
    else:
        struck = geometry.plan.top["contact"] if part == "plan" and geometry.plan is not None else ()
        made = _drawn(json.dumps(encode(geometry), sort_keys=True), coarse, part, sectors, tuple(struck))
    return None if made is None else made.count(spec)


@lru_cache(maxsize=8)
def _drawn(geometry: str, spec: MeshSpec, part: Part, sectors: int, areas: tuple[str, ...]) -> CoarseMesh | None:
    """Return the mesh of a geometry in JSON, by the job that a run has, which finds it again; ``areas``: of a plan,
    those that are struck."""
    job: dict[str, Any] = {"task": TASKS[part], "geometry": json.loads(geometry), "spec": asdict(spec)}
    job |= {} if part == "section" else {"sectors": sectors}
    try:
        arrays = remembered_gmsh(job | ({"msh": None} if part == "solid" else {}))
    except (GeometryError, MeshingError, OSError):  # its run tells
        return None
    kind = "tetrahedra" if part == "solid" else "triangles" if spec.shape == "tet" else "quadrilaterals"
    points, cells = arrays["points"], arrays["cells"][:, : len(LAWS[kind].sides)]
    if part != "plan":
        struck = arrays["surface:contact" if part == "solid" else "line:contact"]
    else:
        rows = [arrays[f"area:{name}"] for name in areas if f"area:{name}" in arrays]
        struck = cells[np.unique(np.concatenate(rows))] if rows else cells
    return _with_places(kind, spec, points, cells, points[struck])


@lru_cache(maxsize=4)
def _inspected(part: cad.Inspected) -> CoarseMesh | None:
    """Return the coarse elements that the inspection of a part made; ``None`` where gmsh could not fill it."""
    shape, struck = part.shape, part.shape.groups.get("contact")
    if not len(shape.cells) or struck is None or not len(struck):
        return None
    size = COARSE * float(np.linalg.norm(shape.extent))
    spec = MeshSpec(size, min(size, SIZE_PER_WIDTH * shape.width("contact")), grading=GROWTH)
    return _with_places("tetrahedra", spec, shape.points, shape.cells, shape.points[shape.triangles[struck]])


def _with_places(kind: str, spec: MeshSpec, points: Array, cells: Integers, struck: Array) -> CoarseMesh:
    """Return the mesh with places in its elements and facets, by distance from the ``struck`` ones (n, corners, d)."""
    sides = np.sort(cells[:, LAWS[kind].sides], axis=2)
    faces = sides.reshape(-1, sides.shape[2])
    _, first, count = np.unique(faces, axis=0, return_index=True, return_counts=True)
    outside = first[count == 1]
    near = np.concatenate([struck.reshape(-1, struck.shape[2]), _spread_points(struck, ON_STRUCK)])
    own = Tally(len(cells), len(outside), len(np.unique(cells)))
    sharp, facets = _sharp_edges(points, faces[outside])
    inner, outer, edges = (_spread_places(points[part], near) for part in (cells, faces[outside], sharp))
    edges = replace(edges, row=facets[edges.row])
    return CoarseMesh(kind, spec, own, inner, outer, edges, outside // sides.shape[1])


def _sharp_edges(points: Array, triangles: Integers) -> tuple[Integers, Integers]:
    """Return the (n, 2) edges at which triangles of a surface meet at `SHARP` or more, and a triangle at each; none of
    an outline."""
    if triangles.shape[1] != 3:
        return triangles[:0], np.zeros(0, dtype=np.int64)
    ends, tips = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2), triangles[:, [2, 0, 1]].ravel()
    order = np.lexsort(ends.T)
    first = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    one, other = order[first], order[first + 1]
    start, along = points[ends[one, 0]], points[ends[one, 1]] - points[ends[one, 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    arms = (points[tips[each]] - start for each in (one, other))
    across = [arm - np.sum(arm * along, axis=1, keepdims=True) * along for arm in arms]
    straight = -np.sum(across[0] * across[1], axis=1) / np.prod([np.linalg.norm(arm, axis=1) for arm in across], axis=0)
    chosen = one[straight < math.cos(SHARP)]
    return ends[chosen], chosen // 3


def _spread_places(corners: Array, struck: Array) -> Places:
    """Return places in elements, many in those near points ``struck``."""
    measures, middles = _measures(corners), corners.mean(axis=1)
    away = _distances(middles, struck)
    near = np.flatnonzero(away < NEAR * np.linalg.norm(np.ptp(corners, axis=1), axis=1))
    far = np.setdiff1d(np.arange(len(corners)), near)
    points = _spread_points(corners[near], PLACES)
    weight, distance = np.repeat(measures[near] / PLACES, PLACES), _distances(points, struck)
    ends = np.geomspace(CLOSEST, 1.0, BINS) * max(float(distance.max(initial=0.0)), float(np.finfo(float).tiny))
    bins = np.repeat(near, PLACES) * (BINS + 1) + np.digitize(distance, ends)
    bins, alike = np.unique(bins, return_inverse=True)
    total, moment = (np.bincount(alike, each, len(bins)) for each in (weight, weight * distance))
    mean = moment / np.maximum(total, np.finfo(float).tiny)
    rows = np.concatenate([far, bins // (BINS + 1)])
    return Places(np.concatenate([measures[far], total]), np.concatenate([away[far], mean]), rows)


def _distances(points: Array, struck: Array) -> Array:
    """Return the distances from the nearest struck point; in space, where they are many, by a tree."""
    if points.shape[1] == 3:
        return meshes.checks.distances(points, struck)
    parts = np.array_split(points, 1 + len(points) // AT_ONCE)
    return np.concatenate([cad.distances(part, struck) for part in parts])


def _spread_points(corners: Array, number: int) -> Array:
    """Return (m number, d) points spread over each of m simplices or quadrilaterals (m, corners, d)."""
    count, dimension = corners.shape[1:]
    if count == 4 and dimension == 2:
        u, v = np.random.default_rng(1).random((2, number))
        shares = np.column_stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])
    else:
        shares = np.random.default_rng(1).dirichlet(np.ones(count), number)
    return np.asarray(np.einsum("qk,mkd->mqd", shares, corners).reshape(-1, dimension))


def _measures(corners: Array) -> Array:
    """Return the (m,) lengths, areas or volumes of elements (m, corners, d)."""
    count, dimension = corners.shape[1:]
    if count == 4 and dimension == 2:
        edges = np.stack([corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]], axis=1)
        return np.asarray(np.abs(np.linalg.det(edges)) / 2)
    edges = corners[:, 1:] - corners[:, :1]
    gram = np.linalg.det(edges @ edges.transpose(0, 2, 1))
    return np.asarray(np.sqrt(np.maximum(gram, 0.0)) / math.factorial(count - 1))
