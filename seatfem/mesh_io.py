"""Plain arrays from gmsh -> scikit-fem mesh with named boundaries, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementTetP0, MeshTet, MeshTet2
from skfem.quadrature import get_quadrature

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Vertices at the ends of each mid-edge node, in gmsh's order of nodes 4..9 of a ten-node tetrahedron.
GMSH_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))


class MeshError(ValueError):
    """A mesh that cannot be used; the message names source, group, and what the mesh has instead."""


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """Tetrahedral mesh in gmsh's node order, metres.

    ``points`` (n, 3); ``tets`` (m, 4) or (m, 10) rows of ``points``; ``surfaces``: name -> (k, 3) vertices of its
    triangles; ``volumes``: name -> (k,) rows of ``tets``; ``source``: what error messages call this mesh.
    """

    points: Floats
    tets: Integers
    surfaces: Mapping[str, Integers]
    volumes: Mapping[str, Integers]
    source: str

    @property
    def order(self) -> int:
        return 1 if self.tets.shape[1] == 4 else 2


@dataclass(frozen=True)
class MeshQuality:
    """Measures of a mesh in SI units, from the quadrature that the finite elements use.

    ``min_scaled_jacobian``: smallest det J at the nodes and centroid of an element over that of its straight twin;
    1 for straight elements, 0 where a curved element starts to fold. ``min_shape``: smallest ratio of inscribed to
    circumscribed radius of the straight twins, times 3 (1: regular). ``cad_volume`` and ``cad_areas`` are exact,
    None and empty where the mesh came from a file.
    """

    nodes: int
    elements: int
    min_scaled_jacobian: float
    min_shape: float
    volume: float
    areas: Mapping[str, float]
    cad_volume: float | None
    cad_areas: Mapping[str, float]


def to_skfem(arrays: MeshArrays, required: tuple[str, ...] = ("contact", "fixed")) -> MeshTet | MeshTet2:
    """The scikit-fem mesh with every named surface as a boundary and every named volume as a subdomain.

    Nodes that belong to no element are dropped; a subdomain "seat" with all elements is added where the mesh names
    none. Raises `MeshError` for a missing or empty required group, a group that is no part of the mesh, and
    inverted elements.
    """
    check_groups(arrays, required)
    check_elements(arrays)
    vertices, t = np.unique(arrays.tets[:, :4], return_inverse=True)
    t = np.ascontiguousarray(t.reshape(-1, 4).T)
    straight = MeshTet(np.ascontiguousarray(arrays.points[vertices].T), t)
    number = np.full(len(arrays.points), -1, dtype=np.int64)
    number[vertices] = np.arange(len(vertices))
    boundaries = {
        name: _facets(straight, number[triangles], name, arrays.source) for name, triangles in arrays.surfaces.items()
    }
    subdomains = {"seat": np.arange(len(arrays.tets)), **arrays.volumes}
    if arrays.order == 1:
        return MeshTet(straight.doflocs, t, boundaries, subdomains)
    return MeshTet2(_second_order_nodes(straight, arrays), t, boundaries, subdomains)


def check_groups(arrays: MeshArrays, required: tuple[str, ...]) -> None:
    """Every required surface group is there, and no group is empty."""
    for name in required:
        if name not in arrays.surfaces:
            there = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
            raise MeshError(f"{arrays.source}: no surface group named {name!r}; the mesh has: {there}")
    for kind, groups in (("surface", arrays.surfaces), ("volume", arrays.volumes)):
        for name, members in groups.items():
            if len(members) == 0:
                raise MeshError(f"{arrays.source}: {kind} group {name!r} is empty")


def check_elements(arrays: MeshArrays) -> None:
    """Finite coordinates and no inverted element."""
    if not np.all(np.isfinite(arrays.points)):
        raise MeshError(f"{arrays.source}: {np.sum(~np.isfinite(arrays.points))} node coordinates are not finite")
    jacobian = scaled_jacobian(arrays)
    inverted = np.flatnonzero(~(jacobian > 0.0))
    if len(inverted):
        worst = inverted[np.argmin(jacobian[inverted])]
        x, y, z = 1e3 * arrays.points[arrays.tets[worst, :4]].mean(axis=0)
        raise MeshError(
            f"{arrays.source}: {len(inverted)} inverted elements, the worst (scaled Jacobian {jacobian[worst]:.3g}) "
            f"near ({x:.4g}, {y:.4g}, {z:.4g}) mm; use smaller elements there, or curved = False"
        )


def scaled_jacobian(arrays: MeshArrays) -> Floats:
    """Per element: smallest det J over the nodes and the centroid, divided by |det J| of the straight element.

    The straight det J itself decides the sign, so an element with wrongly ordered vertices is negative too.
    """
    corners = arrays.points[arrays.tets[:, :4]]
    straight = np.linalg.det(corners[:, 1:] - corners[:, :1])
    size = np.abs(straight) + np.finfo(float).tiny
    if arrays.order == 1:
        return np.asarray(straight / size)
    nodes = arrays.points[arrays.tets]
    least = straight / size
    for gradient in _p2_gradients():
        jacobian = np.einsum("na,enx->eax", gradient, nodes)
        least = np.minimum(least, np.linalg.det(jacobian) / size)
    return np.asarray(least)


def measure(
    mesh: MeshTet | MeshTet2, arrays: MeshArrays, cad_volume: float | None, cad_areas: Mapping[str, float]
) -> MeshQuality:
    """Volume, areas and element quality of a mesh made by `to_skfem`."""
    volume = Basis(mesh, ElementTetP0(), intorder=3).dx.sum()  # det J of a curved element has degree 3
    areas = {name: _area(mesh, facets) for name, facets in mesh.boundaries.items()}
    return MeshQuality(
        nodes=mesh.doflocs.shape[1],
        elements=mesh.nelements,
        min_scaled_jacobian=float(scaled_jacobian(arrays).min()),
        min_shape=float(_radius_ratio(arrays).min()),
        volume=float(volume),
        areas=areas,
        cad_volume=cad_volume,
        cad_areas=dict(cad_areas),
    )


def _area(mesh: MeshTet | MeshTet2, facets: Integers) -> float:
    """Area of boundary facets; a FacetBasis would invert the elements' maps, which fails on coarse curved ones."""
    points, weights = get_quadrature(mesh.brefdom, 6)
    return float(np.sum(np.abs(mesh.mapping().detDG(points, find=facets)) * weights))


def _facets(mesh: MeshTet, triangles: Integers, name: str, source: str) -> Integers:
    """Facet numbers of triangles given by their vertices."""
    base = mesh.nvertices
    weights = np.array([base * base, base, 1], dtype=np.int64)
    keys = weights @ np.sort(mesh.facets, axis=0).astype(np.int64)
    wanted = np.sort(triangles, axis=1) @ weights
    order = np.argsort(keys)
    where = np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)
    found = order[where]
    lost = np.sum((keys[found] != wanted) | (triangles.min(axis=1) < 0))
    if lost:
        raise MeshError(f"{source}: {lost} of {len(triangles)} triangles of {name!r} are no faces of its tetrahedra")
    return np.unique(found)


def _second_order_nodes(mesh: MeshTet, arrays: MeshArrays) -> Floats:
    """scikit-fem's order: the vertices, then one node per edge as `mesh.edges` numbers them; shape (3, n)."""
    middle = np.empty((3, mesh.nedges))
    column = {frozenset(edge): 4 + k for k, edge in enumerate(GMSH_EDGES)}
    for row, edge in enumerate(mesh.elem.refdom.edges):
        middle[:, mesh.t2e[row]] = arrays.points[arrays.tets[:, column[frozenset(edge)]]].T
    return np.hstack([mesh.doflocs, middle])


def _p2_gradients() -> list[Floats]:
    """Gradients (10, 3) of the quadratic shape functions at the ten nodes and the centroid, in gmsh's node order.

    With barycentric L: vertices L_i (2 L_i - 1), mid-edges 4 L_i L_j.
    """
    of_barycentric = np.vstack([-np.ones(3), np.eye(3)])
    vertices = list(np.eye(4))
    places = vertices + [(vertices[i] + vertices[j]) / 2 for i, j in GMSH_EDGES] + [np.full(4, 0.25)]
    gradients = []
    for place in places:
        corner = (4 * place - 1)[:, None] * of_barycentric
        edge = [4 * (place[i] * of_barycentric[j] + place[j] * of_barycentric[i]) for i, j in GMSH_EDGES]
        gradients.append(np.vstack([corner, edge]))
    return gradients


def _radius_ratio(arrays: MeshArrays) -> Floats:
    """3 r_in / r_circum of the straight elements."""
    a, b, c = np.moveaxis(arrays.points[arrays.tets[:, 1:4]] - arrays.points[arrays.tets[:, :1]], 1, 0)
    sixfold_volume = np.abs(np.einsum("ex,ex->e", a, np.cross(b, c)))
    pairs = [np.cross(b, c), np.cross(c, a), np.cross(a, b), np.cross(b - a, c - a)]
    twice_area = sum((np.linalg.norm(pair, axis=1) for pair in pairs), start=np.zeros(len(a)))
    squares = [np.einsum("ex,ex->e", v, v)[:, None] for v in (a, b, c)]
    centre = sum((s * p for s, p in zip(squares, pairs[:3], strict=True)), start=np.zeros_like(a))
    circumradius = np.linalg.norm(centre, axis=1) / (2 * sixfold_volume)
    return np.asarray(3 * (sixfold_volume / twice_area) / circumradius)
