"""Points of a mesh at which stress is evaluated, maxima and singular points of stress, and the stress of Mindlin
plates.

Singular points are reentrant corners and ends of clamped faces; a maximum elsewhere has a mesh error. Gradients of the
plate's rotations are evaluated at the 2 x 2 Gauss points of an element, where they are accurate to one order more than
elsewhere (Barlow, IJNME 10 (1976) 243), and extrapolated linearly to the point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from seatfem.structures import errors, materials
from seatfem.structures.elements import mindlin, shape_functions
from seatfem.structures.elements.mindlin import PlateMesh, shapes_at
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.model import SecondOrderModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_NEAREST: Final = 24  # elements with the nearest centres, among which that around a point is searched
_NEWTON: Final = 12  # iterations of Newton's method for reference coordinates
_INSIDE: Final = 1e-6  # reference distance outside an element within which a point counts as inside (of both at a side)
_BESIDE: Final = 0.05  # reference distance by which a point may lie off a curved surface
_CUTS: Final = ("symmetry_0", "symmetry_1")  # boundaries on planes of symmetry


@dataclass(frozen=True)
class Sites:
    """P points of a mesh and the elements around each, over which stress is averaged: E pairs of point and element.

    Attributes:
        points: (P, d) coordinates [m]; on a meridian r and z.
        site, element: (E,) point number and element number of each pair.
        inside: (d, E) reference coordinates of the point in the element.
        share: (E,) weight of the element in the mean at its point.
    """

    points: Array
    site: Integers
    element: Integers
    inside: Array
    share: Array

    @staticmethod
    def averaged(points: Array, site: Integers, element: Integers, inside: Array) -> Sites:
        """Return sites with equal weights of all elements around a point."""
        share = 1.0 / np.bincount(site, minlength=len(points))[site]
        return Sites(points, site, element, inside, share)

    def __len__(self) -> int:
        return len(self.points)

    def at(self, chosen: NDArray[np.bool_]) -> Sites:
        """Return the sites chosen by a mask (P,), renumbered."""
        kept, number = chosen[self.site], np.cumsum(chosen) - 1
        return Sites.averaged(self.points[chosen], number[self.site[kept]], self.element[kept], self.inside[:, kept])


def at_points(made: shape_functions.Discretization, points: Array) -> Sites:
    """Return the sites at points (P, d) [m].

    Raises:
        ModelError: a point lies off the body by more than `_BESIDE` of an element.
    """
    vertices = made.places[made.corners[:, : made.mesh.t.shape[0]]]
    count = min(_NEAREST, len(vertices))
    near = cKDTree(vertices.mean(axis=1)).query(points, k=count)[1].reshape(len(points), count)
    site, element = np.repeat(np.arange(len(points)), count), near.ravel().astype(np.int64)
    inside = _inside(made, element, points[site])
    beyond = inside.sum(axis=0) if made.element.refdom.__name__ in ("RefTet", "RefTri") else inside.max(axis=0)
    off = np.maximum(-inside.min(axis=0), beyond - 1.0).reshape(len(points), count)  # of the reference element
    least = off.min(axis=1)
    if (outside := np.flatnonzero(least > _BESIDE)).size:
        place = ", ".join(f"{1e3 * x:.4g}" for x in points[outside[0]])
        raise errors.ModelError(f"the point ({place}) mm lies off the body: name one in it, or on its surface")
    chosen = (off <= np.maximum(least, _INSIDE)[:, None]).ravel()
    return Sites.averaged(points, site[chosen], element[chosen], inside[:, chosen])


def on_surface(made: shape_functions.Discretization) -> Sites:
    """Return the displacement nodes on the surface; planes of symmetry and the axis are no surface."""
    _, elements, which = outer_facets(made.mesh)
    reference, outer = np.asarray(made.element.doflocs, dtype=float), np.zeros(made.size, dtype=bool)
    for k, corners in enumerate(made.element.refdom.facets):
        vertices = np.asarray(made.element.refdom.p, dtype=float)[:, corners].T
        across = np.linalg.svd(vertices[1:] - vertices[0])[2][-1]
        on_side = np.abs((reference - vertices[0]) @ across) < 1e-9
        outer[made.cells[elements[which == k]][:, on_side]] = True
    return at_nodes(made, np.flatnonzero(outer))


def at_nodes(made: shape_functions.Discretization, nodes: Integers) -> Sites:
    """Return the sites at displacement nodes (P,), which must be sorted."""
    chosen = np.zeros(made.size, dtype=bool)
    chosen[nodes] = True
    element, local = np.nonzero(chosen[made.cells])
    site = np.searchsorted(nodes, made.cells[element, local])
    reference = np.asarray(made.element.doflocs, dtype=float)
    return Sites.averaged(made.nodes.T[nodes], site, element, reference[local].T)


def outer_facets(mesh: Any) -> tuple[Integers, Integers, Integers]:
    """Return the facets (f,) of the surface without planes of symmetry, their elements, and their numbers in these."""
    facets = np.setdiff1d(mesh.boundary_facets(), [f for cut in _CUTS for f in (mesh.boundaries or {}).get(cut, ())])
    if mesh.dim() == 2:
        radii = mesh.p[0, mesh.facets[:, facets]]
        facets = facets[radii.max(axis=0) > _INSIDE * mesh.p[0].max()]
    facets = facets.astype(np.int64)
    elements = mesh.f2t[0, facets]
    return facets, elements, np.argmax(mesh.t2f[:, elements] == facets, axis=0)


def _inside(made: shape_functions.Discretization, element: Integers, targets: Array) -> Array:
    """Return the (d, E) reference coordinates in elements of points (E, d), inside or not, by Newton's method."""
    nodes = made.places[made.corners[element]]
    inside = np.tile(np.asarray(made.element.refdom.p, dtype=float).mean(axis=1)[:, None], len(element))
    for _ in range(_NEWTON):
        off = np.einsum("ev,eva->ea", shape_functions.values(made.geometry, inside), nodes) - targets
        jacobian = np.einsum("evc,eva->eac", shape_functions.gradients(made.geometry, inside), nodes)
        step = np.linalg.solve(jacobian + 1e-12 * np.abs(jacobian).max() * np.eye(len(inside)), off[..., None])
        inside = np.clip(inside - step[..., 0].T, -0.5, 1.5)
    return inside


_NODES = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float)
_GAUSS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / np.sqrt(3)


def plate_points(mesh: mindlin.PlateMesh, points: Array) -> Sites:
    """Return the sites at points (P, 2) of a plate [m]. Raises `ModelError` if one lies off the plate."""
    element, inside = mindlin.located(mesh, points, np.full(len(points), "stress.points"))
    return Sites.averaged(points, np.arange(len(points)), element, inside.T)


def plate_nodes(mesh: mindlin.PlateMesh) -> Sites:
    """Return the sites at all nodes of a plate."""
    site, element = mesh.cells.ravel(), np.repeat(np.arange(len(mesh.cells)), 9)
    return Sites.averaged(mesh.points, site, element, np.tile(_NODES, (len(mesh.cells), 1)).T)


def plate_stress(
    mesh: mindlin.PlateMesh, material: materials.Material, thickness: float, model: SecondOrderModel, sites: Sites
) -> sparse.csr_array:
    """Return the (6 P, n) matrix C: C u is the stress xx, yy, zz, yz, xz, xy at P sites of the face z = h/2 [Pa].

    With moments M = D ((1 - nu) kappa + nu tr(kappa) I), kappa = -sym grad a of the rotations a, the in-plane stress is
    6 M/h^2 and the others are zero; on the face z = -h/2 the sign is opposite.

    Raises:
        ModelError: the model is of another mesh.
    """
    factor = -material.young * thickness / (2 * (1 - material.poisson**2))
    nu, slopes = material.poisson, _extrapolate_gradients(mesh, sites)
    rows = np.zeros((len(slopes), 6, 9, 3))
    rows[:, 0, :, 1], rows[:, 0, :, 2] = slopes[..., 0], nu * slopes[..., 1]
    rows[:, 1, :, 1], rows[:, 1, :, 2] = nu * slopes[..., 0], slopes[..., 1]
    rows[:, 5, :, 1], rows[:, 5, :, 2] = (1 - nu) / 2 * slopes[..., 1], (1 - nu) / 2 * slopes[..., 0]
    rows[..., 1:] *= factor / mesh.side
    return _assemble_rows(mesh, model, sites, rows)


def _extrapolate_gradients(mesh: mindlin.PlateMesh, sites: Sites) -> Array:
    """Return the (E, 9, 2) gradients of the shape functions, extrapolated from the Gauss points."""
    _, slopes = mindlin.shapes_at(_GAUSS)
    s, t = sites.inside
    weights = (1 + 3 * s[:, None] * _GAUSS[:, 0]) * (1 + 3 * t[:, None] * _GAUSS[:, 1]) / 4
    cells: NDArray[np.int64] = mesh.cells[sites.element]
    tangents = np.einsum("gks,ekc->egsc", slopes, mesh.points[cells])
    along = np.einsum("gks,egcs->egkc", slopes, np.linalg.inv(tangents), optimize=True)
    return np.asarray(np.einsum("eg,egkc->ekc", weights, along))


def _assemble_rows(mesh: mindlin.PlateMesh, model: SecondOrderModel, sites: Sites, rows: Array) -> sparse.csr_array:
    """Return the (R P, n) matrix of R quantities a site, averaged over elements with ``rows`` (E, R, 9, 3) that act on
    the nodal unknowns w and l a (deflection; rotations times the side l)."""
    if model.dofs is None or model.dofs.points.shape[1] != len(mesh.points):
        raise errors.ModelError("the model's unknowns are not those of this plate: use the mesh of its assembly")
    count = rows.shape[1]
    which = count * sites.site[:, None, None] + np.arange(count)[:, None]
    unknowns = (3 * mesh.cells[sites.element][:, :, None] + np.arange(3)).reshape(len(rows), 1, -1)
    which, unknowns = np.broadcast_arrays(which, unknowns)
    data = rows.reshape(len(rows), count, -1) * sites.share[:, None, None]
    matrix = sparse.coo_array(
        (data.ravel(), (which.ravel(), unknowns.ravel())), (count * len(sites), 3 * len(mesh.points))
    )
    return sparse.csr_array(matrix.tocsc()[:, model.dofs.free])


SHARPEST: Final = math.radians(30)  # largest turn between two facets of a smooth surface


def singular_points(mesh: Any, clamped: Sequence[str]) -> Array:
    """Return the (k, d) points on singular edges of a mesh [m]: vertices, and of a solid also the edges' midpoints.

    An edge is singular where its two facets turn inwards by more than `SHARPEST`, or only one of them is clamped.
    """
    mesh = getattr(mesh, "mesh", mesh)
    held = np.zeros(mesh.facets.shape[1], dtype=bool)
    for name in clamped:
        held[np.asarray((mesh.boundaries or {})[name])] = True
    facets, elements, which = outer_facets(mesh)
    vertices = mesh.t[np.asarray(mesh.elem.refdom.facets)[which], elements[:, None]]
    middles, normals = mesh.p.T[vertices].mean(axis=1), _normals(mesh, vertices, elements)
    edges, sides = _edges(vertices, mesh.dim())
    order = np.lexsort(edges.T)
    edges, sides = edges[order], sides[order]
    pair = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    edge, one, two = edges[pair], sides[pair], sides[pair + 1]
    opening = np.einsum("ea,ea->e", normals[one], middles[two] - middles[one])
    turn = np.einsum("ea,ea->e", normals[one], normals[two])
    inwards = (opening > 0) & (turn < math.cos(SHARPEST))
    ends = held[facets[one]] != held[facets[two]]
    chosen = mesh.p.T[edge[inwards | ends]]
    return np.concatenate([chosen.reshape(-1, mesh.dim()), chosen.mean(axis=1)])


def near(points: Array, singular: Array, distance: float) -> NDArray[np.bool_]:
    """Return a (P,) mask of the points closer than ``distance`` [m] to a singular point."""
    return np.asarray(nearest_distances(points, singular) < distance * (1 - 1e-9))


def _normals(mesh: Any, vertices: NDArray[np.int64], elements: NDArray[np.int64]) -> Array:
    """Return the (f, d) outward normals of flat facets through the vertices."""
    corners = mesh.p.T[vertices]
    if mesh.dim() == 2:
        along = corners[:, 1] - corners[:, 0]
        across = np.stack([along[:, 1], -along[:, 0]], axis=1)
    else:
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    inside = mesh.p.T[mesh.t[:, elements].T].mean(axis=1)
    across *= np.sign(np.einsum("fa,fa->f", across, corners.mean(axis=1) - inside))[:, None]
    return np.asarray(across / np.linalg.norm(across, axis=1)[:, None])


def _edges(vertices: NDArray[np.int64], dim: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the sorted vertices (e, d - 1) of each edge of each facet, and the number (e,) of its facet."""
    count, size = vertices.shape
    if dim == 2:
        return vertices.reshape(-1, 1), np.repeat(np.arange(count), 2)
    ring = np.stack([vertices, np.roll(vertices, -1, axis=1)], axis=-1)
    return np.sort(ring.reshape(-1, 2), axis=1), np.repeat(np.arange(count), size)


def sharp_nodes(mesh: PlateMesh) -> Array:
    """Return the (k, 2) vertices of a plate's outline at which it turns inwards by more than `SHARPEST` [m]."""
    vertices = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
    tangents = np.einsum("qks,mkc->mqsc", shapes_at(vertices)[1], mesh.points[mesh.cells])
    one, two = tangents[:, :, 0] * -vertices[:, :1], tangents[:, :, 1] * -vertices[:, 1:]
    size = np.linalg.norm(one, axis=2) * np.linalg.norm(two, axis=2)
    angles = np.arccos(np.clip(np.sum(one * two, axis=2) / size, -1.0, 1.0))
    around = np.bincount(mesh.cells[:, :4].ravel(), angles.ravel(), len(mesh.points))
    return mesh.points[(around > math.pi + SHARPEST) & (around < 2 * math.pi - 1e-3)]


def local_maxima(points: Array, values: Array, apart: float, *, least: float = 0.0) -> NDArray[np.int64]:
    """Return the indices of the points (P, d) whose value (P,) is the largest within a radius ``apart`` [m], the
    largest first; of equal values the first counts. Values below ``least`` times the largest are ignored."""
    order = np.lexsort((np.arange(len(values)), -values))
    order = order[values[order] >= least * values.max(initial=0.0)]
    rank = np.full(len(values), len(values))
    rank[order] = np.arange(len(order))
    tree, maxima = cKDTree(points), []
    for number in order:
        if rank[tree.query_ball_point(points[number], apart)].min() == rank[number]:
            maxima.append(int(number))
    return np.array(maxima, dtype=np.int64)


REACH: Final = 2.0  # radius in which maxima of two meshes are compared, over the spacing of the coarser mesh's points


def peak_mesh_error(points: Array, stress: Array, coarser_points: Array, on_coarser: Array, weight: float) -> float:
    """Return the mesh error of the largest ``stress`` (P,) at points (P, d) [Pa], by that (Q,) on a coarser mesh.

    At each point the stress is uncertain by ``weight`` times its change from the coarser mesh; the error bounds the
    maximum over all points within these intervals, as a hot spot that is resolved badly may exceed the present
    maximum. The points of two meshes differ: the maxima within `REACH` of each point are compared.
    """
    trees = cKDTree(points), cKDTree(coarser_points)
    coarse = trees[1]
    reach = REACH * float(np.median(coarse.query(coarser_points, k=[2])[0]))
    nearest = np.asarray(coarse.query(points)[1])
    near, coarse_near = (
        [np.asarray(each, dtype=int) for each in tree.query_ball_point(points, reach)] for tree in trees
    )
    fine_peaks = np.array([stress[each].max() for each in near])
    coarse_peaks = np.array([on_coarser[[*each, k]].max() for each, k in zip(coarse_near, nearest, strict=True)])
    change, peak = np.abs(coarse_peaks - fine_peaks), float(stress.max())
    return float(max((stress + weight * change).max() - peak, peak - (stress - weight * change).max()))
