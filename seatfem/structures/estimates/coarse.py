"""Numbers of elements of meshes that are not made yet, predicted from the coarsest mesh of the body.

    n = sum of max(1, a int dV/h^d + b int dS/h^(d - 1), c int dL/h)

over the elements of the coarse mesh, with element size h of the finer mesh, volume V, surface S, and d = 3 for
tetrahedra, 2 for half sections. An element never becomes less than one, as fillets and thin walls require;
the second term adds elements along the surface; the third counts those along sharp edges L of bars thinner than h. The
sum is corrected such that the coarse mesh has its own number of elements.
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
from seatfem.structures import inspection
from seatfem.structures import mesh as meshes
from seatfem.structures.errors import GeometryError
from seatfem.structures.mesh.gmsh_process import MeshingError, remembered_gmsh
from seatfem.structures.mesh.spec import COARSE, GROWTH, SIZE_PER_WIDTH, MeshSpec
from seatfem.structures.shapes import CadPart, Geometry, encode

Integers = NDArray[np.int64]
PLACES: Final = 64  # sample points in an element near the struck face, where sizes change; one in others
BINS, CLOSEST = 40, 1e-4  # bins of distance in which the points of an element are joined; the smallest over the largest
NEAR: Final = 1.5  # distance within which an element is near the struck face, over its extent
AT_ONCE: Final = 4096  # points whose distances are computed at once
SHARP: Final = math.radians(30)  # least turn of a surface at a sharp edge
ON_STRUCK: Final = 64  # sample points on each facet of the struck face, from which distances are taken


@dataclass(frozen=True)
class Law:
    """Fitted densities of the elements that gmsh makes.

    Attributes:
        sides: corners of an element on each of its facets.
        dimension: d.
        inside, along: elements over int dV/h^d and over int dS/h^(d - 1).
        at_edge: elements and facets over int dL/h of a sharp edge, where the body is thinner than h: a bar with four
            edges has 13 and 9 in each length h (19 mm in 4 x 6 mm, 3 to 100 m long).
        facets: surface facets over int dS/h^(d - 1).
        of_elements, of_facets: vertices per element and per facet, which add up.
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
}


@dataclass(frozen=True)
class Tally:
    """Numbers of elements, of facets on the surface (edges on an outline), and of vertices."""

    elements: float
    facets: float
    vertices: float


@dataclass(frozen=True)
class Places:
    """Sample points in elements or facets: the volume, area or length of each, its distance from the struck face [m],
    and the number of its element or facet."""

    weight: Array
    distance: Array
    row: Integers

    def per_row(self, spec: MeshSpec, dimension: int, rows: int) -> Array:
        """Return int dV/h^d over each of the elements or facets, ``rows`` in number."""
        h = size_at(self.distance, spec)
        return np.asarray(np.bincount(self.row, self.weight / h**dimension, rows), dtype=np.float64)


def size_at(distance: Array, spec: MeshSpec) -> Array:
    """Return the requested element size [m] at distances from the patch [m]."""
    fine = spec.patch_size
    return np.asarray(np.interp(distance, [fine, max(fine + spec.transition, 1.001 * fine)], [fine, spec.size]))


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """A coarse mesh from which the numbers of elements of finer ones are predicted.

    Attributes:
        kind: kind of its elements, in `LAWS`.
        spec: element sizes with which it was made.
        own: its numbers of elements, facets and vertices.
        inner, outer, edges: sample points in its elements, on its facets, and on sharp edges of a solid, by facet.
        owner: (facets,) number of the element of each facet.
    """

    kind: str
    spec: MeshSpec
    own: Tally
    inner: Places
    outer: Places
    edges: Places
    owner: Integers

    def count(self, spec: MeshSpec) -> Tally:
        """Return the predicted numbers of a mesh with other sizes."""
        law = LAWS[self.kind]
        now, before = (self._per_part(each) for each in (spec, self.spec))
        elements, facets = (_at_least_one(*pair) for pair in zip(now, before, strict=True))
        more = law.of_elements * (elements - self.own.elements) + law.of_facets * (facets - self.own.facets)
        return Tally(elements, facets, max(self.own.vertices + more, law.of_elements * elements))

    def _per_part(self, spec: MeshSpec) -> tuple[Array, Array]:
        """Return the numbers by `Law` in place of each coarse element and of each coarse facet."""
        law, m, n = LAWS[self.kind], round(self.own.elements), round(self.own.facets)
        inside = law.inside * self.inner.per_row(spec, law.dimension, m)
        area = self.outer.per_row(spec, law.dimension - 1, n)
        elements, edges = inside + law.along * np.bincount(self.owner, area, m), self.edges.per_row(spec, 1, n)
        at_edge, facets_at_edge = law.at_edge
        at_edges = at_edge * np.bincount(self.owner, edges, m)
        return np.maximum(elements, at_edges), np.maximum(law.facets * area, facets_at_edge * edges)


def _at_least_one(now: Array, before: Array) -> float:
    """Return the sum over the parts of a coarse mesh of the predicted numbers ``now``, each less the excess over one
    that the law predicts for the coarse mesh itself (``before``), and at least one."""
    return float(max(np.maximum(1.0, now - np.maximum(0.0, before - 1.0)).sum(), now.sum()))


Part = Literal["solid", "section"]
"""The part of a body that gmsh meshes: the solid or a sector, or its half section."""


def count_elements(
    geometry: Geometry, spec: MeshSpec, coarse: MeshSpec, part: Part = "solid", sectors: int = 1
) -> Tally | None:
    """Return the predicted numbers of a mesh, from a coarse mesh of the body; ``None`` if that cannot be made.

    Args:
        geometry: geometry of the body.
        spec: element sizes of the mesh.
        coarse: element sizes of the coarse mesh, cached in the process; for a CAD file, that of its inspection is used.
        part: part of the body that is meshed.
        sectors: number of sectors of the body, one of which is meshed.
    """
    if isinstance(geometry, CadPart):
        coarse_mesh = _inspected(inspection.cad.inspect_geometry(geometry))
    else:
        coarse_mesh = _drawn(json.dumps(encode(geometry), sort_keys=True), coarse, part, sectors)
    return None if coarse_mesh is None else coarse_mesh.count(spec)


@lru_cache(maxsize=8)
def _drawn(geometry: str, spec: MeshSpec, part: Part, sectors: int) -> CoarseMesh | None:
    """Return the coarse mesh of a geometry in JSON, by the same gmsh job as a run, which can then reuse it."""
    job: dict[str, Any] = {"task": "section", "geometry": json.loads(geometry), "spec": asdict(spec)}
    job |= {} if part == "section" else {"task": "mesh", "sectors": sectors, "msh": None}
    try:
        arrays = remembered_gmsh(job)
    except (GeometryError, MeshingError, OSError):  # the run reports the error
        return None
    kind, struck = ("triangles", "line:contact") if part == "section" else ("tetrahedra", "surface:contact")
    points, cells = arrays["points"], arrays["cells"][:, : len(LAWS[kind].sides)]
    return _with_places(kind, spec, points, cells, points[arrays[struck]])


@lru_cache(maxsize=4)
def _inspected(part: inspection.cad.Inspected) -> CoarseMesh | None:
    """Return the coarse mesh from the inspection of a CAD part; ``None`` if gmsh could not mesh it."""
    shape, struck = part.shape, part.shape.groups.get("contact")
    if not len(shape.cells) or struck is None or not len(struck):
        return None
    size = COARSE * float(np.linalg.norm(shape.extent))
    spec = MeshSpec(size, min(size, SIZE_PER_WIDTH * shape.width("contact")), grading=GROWTH)
    return _with_places("tetrahedra", spec, shape.points, shape.cells, shape.points[shape.triangles[struck]])


def _with_places(kind: str, spec: MeshSpec, points: Array, cells: Integers, struck: Array) -> CoarseMesh:
    """Return the mesh with sample points and their distances from the ``struck`` facets (n, corners, d)."""
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
    """Return the (n, 2) edges at which a surface of triangles turns by `SHARP` or more, and a triangle at each; none
    for an outline."""
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
    """Return sample points in elements, many in those near points ``struck``."""
    measures, middles = _measures(corners), corners.mean(axis=1)
    distances = _distances(middles, struck)
    near = np.flatnonzero(distances < NEAR * np.linalg.norm(np.ptp(corners, axis=1), axis=1))
    far = np.setdiff1d(np.arange(len(corners)), near)
    points = _spread_points(corners[near], PLACES)
    weight, distance = np.repeat(measures[near] / PLACES, PLACES), _distances(points, struck)
    ends = np.geomspace(CLOSEST, 1.0, BINS) * max(float(distance.max(initial=0.0)), float(np.finfo(float).tiny))
    bins = np.repeat(near, PLACES) * (BINS + 1) + np.digitize(distance, ends)
    bins, bin_of = np.unique(bins, return_inverse=True)
    total, moment = (np.bincount(bin_of, each, len(bins)) for each in (weight, weight * distance))
    mean = moment / np.maximum(total, np.finfo(float).tiny)
    rows = np.concatenate([far, bins // (BINS + 1)])
    return Places(np.concatenate([measures[far], total]), np.concatenate([distances[far], mean]), rows)


def _distances(points: Array, struck: Array) -> Array:
    """Return the distances from the nearest struck point."""
    if points.shape[1] == 3:
        return meshes.checks.distances(points, struck)
    parts = np.array_split(points, 1 + len(points) // AT_ONCE)
    return np.concatenate([inspection.cad.distances(part, struck) for part in parts])


def _spread_points(corners: Array, number: int) -> Array:
    """Return (m number, d) points spread over each of m simplices (m, corners, d)."""
    count, dimension = corners.shape[1:]
    shares = np.random.default_rng(1).dirichlet(np.ones(count), number)
    return np.asarray(np.einsum("qk,mkd->mqd", shares, corners).reshape(-1, dimension))


def _measures(corners: Array) -> Array:
    """Return the (m,) lengths, areas or volumes of elements (m, corners, d)."""
    edges = corners[:, 1:] - corners[:, :1]
    gram = np.linalg.det(edges @ edges.transpose(0, 2, 1))
    return np.asarray(np.sqrt(np.maximum(gram, 0.0)) / math.factorial(corners.shape[1] - 1))
