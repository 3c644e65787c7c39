"""How good the elements of a mesh are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from skfem import Basis, ElementHex0, ElementTetP0
from skfem.quadrature import get_quadrature

from seatfem.cell_kinds import CELL_KINDS, Floats, Integers
from seatfem.mesh_io import MeshArrays, SolidMesh


@dataclass(frozen=True)
class MeshQuality:
    """Measures of a mesh in SI units, from the quadrature that the finite elements use.

    ``min_scaled_jacobian``: smallest det J at the nodes and centroid of an element over the mean of its straight twin;
    1 for straight tetrahedra and parallelepipeds, 0 where an element starts to fold. ``min_shape``: smallest shape
    measure of the straight twins (`shape_measure`; 1: regular, 0: flat). ``cad_volume`` and ``cad_areas`` are exact,
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


def measure(
    mesh: SolidMesh, arrays: MeshArrays, cad_volume: float | None, cad_areas: Mapping[str, float]
) -> MeshQuality:
    """Volume, areas and element quality of a mesh made by `to_skfem`."""
    constant = ElementTetP0() if arrays.shape == "tetrahedron" else ElementHex0()
    return MeshQuality(
        nodes=mesh.doflocs.shape[1],
        elements=mesh.nelements,
        min_scaled_jacobian=float(scaled_jacobian(arrays).min()),
        min_shape=float(shape_measure(arrays).min()),
        volume=float(Basis(mesh, constant, intorder=arrays.kind.degree).dx.sum()),
        areas={name: _area(mesh, facets) for name, facets in mesh.boundaries.items()},
        cad_volume=cad_volume,
        cad_areas=dict(cad_areas),
    )


def straight_determinants(arrays: MeshArrays) -> Floats:
    """Mean det J over each element's straight twin, negative where its vertices are in mirrored order; (m,)."""
    kind = CELL_KINDS[arrays.kind.corners]
    points, weights = get_quadrature(kind.element.refdom, kind.degree)
    determinants = _determinants(arrays.points[arrays.vertices], kind.gradients(points.T))
    return np.asarray(determinants @ (weights / weights.sum()))


def scaled_jacobian(arrays: MeshArrays) -> Floats:
    """Per element: smallest det J over the nodes and the centroid, divided by |mean det J| of its straight twin; (m,).

    -inf where the straight twin is flat. The sign of the straight twin counts too, so an element with vertices in
    mirrored order is negative.
    """
    kind = arrays.kind
    straight = straight_determinants(arrays)
    least = straight.copy()
    for place in kind.places:
        determinant = _determinants(arrays.points[arrays.cells], kind.gradients(place[None, :]))
        least = np.minimum(least, determinant[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(straight == 0.0, -np.inf, least / np.abs(straight))


def shape_measure(arrays: MeshArrays) -> Floats:
    """Shape of the straight elements, 1 for regular ones and 0 for flat ones; (m,).

    Tetrahedra: 3 r_in / r_circum. Hexahedra: the smallest over the vertices of 3 det(J)^(2/3) / |J|_F^2, J the three
    edges that meet there [Knupp 2001, SIAM J. Sci. Comput. 23(1), 193-218].
    """
    return _radius_ratio(arrays) if arrays.shape == "tetrahedron" else _corner_shape(arrays)


def _determinants(nodes: Floats, gradients: Floats) -> Floats:
    """det J of elements (m, k, 3) at places (q, k, 3): (m, q)."""
    jacobian = np.einsum("qna,enx->eqax", gradients, nodes, optimize=True)
    return np.asarray(np.linalg.det(jacobian))


def _area(mesh: SolidMesh, facets: Integers) -> float:
    """Area of boundary facets; a FacetBasis would invert the elements' maps, which fails on coarse curved ones."""
    points, weights = get_quadrature(mesh.brefdom, 6)
    return float(np.sum(np.abs(mesh.mapping().detDG(points, find=facets)) * weights))


def _radius_ratio(arrays: MeshArrays) -> Floats:
    a, b, c = np.moveaxis(arrays.points[arrays.vertices[:, 1:]] - arrays.points[arrays.vertices[:, :1]], 1, 0)
    sixfold_volume = np.abs(np.einsum("ex,ex->e", a, np.cross(b, c)))
    pairs = [np.cross(b, c), np.cross(c, a), np.cross(a, b), np.cross(b - a, c - a)]
    twice_area = sum((np.linalg.norm(pair, axis=1) for pair in pairs), start=np.zeros(len(a)))
    squares = [np.einsum("ex,ex->e", v, v)[:, None] for v in (a, b, c)]
    centre = sum((s * p for s, p in zip(squares, pairs[:3], strict=True)), start=np.zeros_like(a))
    circumradius = np.linalg.norm(centre, axis=1) / (2 * sixfold_volume)
    return np.asarray(3 * (sixfold_volume / twice_area) / circumradius)


def _corner_shape(arrays: MeshArrays) -> Floats:
    kind = CELL_KINDS[8]
    jacobian = np.einsum("qna,enx->eqax", kind.gradients(kind.nodes), arrays.points[arrays.vertices], optimize=True)
    positive = np.maximum(np.linalg.det(jacobian), 0.0)
    return np.asarray((3 * positive ** (2 / 3) / np.sum(jacobian**2, axis=(2, 3))).min(axis=1))
