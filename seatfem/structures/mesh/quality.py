"""How good the elements of a mesh are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from skfem.quadrature import get_quadrature

from seatfem.structures.mesh.cell_kinds import CELL_KINDS, CellKind, Floats, Integers
from seatfem.structures.mesh.io import MeshArrays, SolidMesh


@dataclass(frozen=True)
class MeshQuality:
    """Measures of a mesh in SI units; volumes by a quadrature that is exact for the elements' maps.

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
    """Return the volume, areas and element quality of a mesh made by `to_skfem`."""
    return MeshQuality(
        nodes=mesh.doflocs.shape[1],
        elements=mesh.nelements,
        min_scaled_jacobian=float(scaled_jacobian(arrays).min()),
        min_shape=float(shape_measure(arrays).min()),
        volume=float(_integrals(arrays.kind, arrays.points, arrays.cells).sum()),
        areas={name: _area(mesh, facets) for name, facets in mesh.boundaries.items()},
        cad_volume=cad_volume,
        cad_areas=dict(cad_areas),
    )


def straight_determinants(arrays: MeshArrays) -> Floats:
    """Return the mean det J over each element's straight twin, negative where its vertices are in mirrored order;
    (m,)."""
    return _integrals(CELL_KINDS[arrays.kind.corners], arrays.points, arrays.vertices, mean=True)


def scaled_jacobian(arrays: MeshArrays) -> Floats:
    """Return per element the smallest det J over the nodes and the centroid, divided by |mean det J| of its straight
    twin; (m,).

    -inf where the straight twin is flat. The sign of the straight twin counts too, so an element with vertices in
    mirrored order is negative.
    """
    kind = arrays.kind
    straight = straight_determinants(arrays)
    least = straight.copy()
    if kind.degree > 0:
        for determinant in _determinants(kind, arrays.points, arrays.cells, kind.places):
            np.minimum(least, determinant, out=least)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(straight == 0.0, -np.inf, least / np.abs(straight))


def shape_measure(arrays: MeshArrays) -> Floats:
    """Return the shape of the straight elements, 1 for regular ones and 0 for flat ones; (m,).

    Tetrahedra: 3 r_in / r_circum. Hexahedra: the smallest over the vertices of 3 det(J)^(2/3) / |J|_F^2, J the three
    edges that meet there [Knupp 2001, SIAM J. Sci. Comput. 23(1), 193-218].
    """
    return _radius_ratio(arrays) if arrays.shape == "tetrahedron" else _corner_shape(arrays)


def _integrals(kind: CellKind, points: Floats, cells: Integers, *, mean: bool = False) -> Floats:
    """Return the integral of det J over each element, its volume; or its mean; (m,)."""
    places, weights = get_quadrature(kind.element.refdom, kind.degree)
    if mean:
        weights = weights / weights.sum()
    total = np.zeros(len(cells))
    for weight, determinant in zip(weights, _determinants(kind, points, cells, places.T), strict=True):
        total += weight * determinant
    return total


def _determinants(kind: CellKind, points: Floats, cells: Integers, places: Floats) -> Iterator[Floats]:
    """Yield det J of every element, (m,), at one place after the other."""
    nodes = points[cells.T].transpose(0, 2, 1).reshape(cells.shape[1], -1)
    for gradient in kind.gradients(places):
        a, b, c = (gradient.T @ nodes).reshape(3, 3, -1)
        yield (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )


def _area(mesh: SolidMesh, facets: Integers) -> float:
    """Return the area of boundary facets; a FacetBasis would invert the elements' maps, which fails on coarse curved
    ones."""
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
    nodes = arrays.points[arrays.vertices.T].transpose(0, 2, 1).reshape(8, -1)
    least = np.full(len(arrays.cells), np.inf)
    gradients, determinants = (
        kind.gradients(kind.nodes),
        _determinants(kind, arrays.points, arrays.vertices, kind.nodes),
    )
    for gradient, determinant in zip(gradients, determinants, strict=True):
        squares = np.sum(((gradient.T @ nodes) ** 2).reshape(9, -1), axis=0)
        np.minimum(least, 3 * np.maximum(determinant, 0.0) ** (2 / 3) / squares, out=least)
    return least
