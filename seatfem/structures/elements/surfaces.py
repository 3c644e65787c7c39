"""Integrals over named boundaries: facets, their nodes, outward normals and quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad, RefTri

from seatfem.structures.elements.shape_functions import Array, Discretization, gradients, values
from seatfem.structures.errors import ModelError


@dataclass(frozen=True)
class Surface:
    """Surface of f facets with Q quadrature points and N nodes each.

    Attributes:
        cells: (f, N) displacement nodes.
        shapes: (f, Q, N) their shape functions.
        normals: (f, Q, 3) outward unit normals.
        weights: (f, Q) area of the points [m^2].
        elements: (f,) the element behind each facet.
        facets: (f,) their numbers in the mesh.
        places: (f, Q, 3) coordinates of the points [m], (f, Q, 2) of r and z on a meridian.
    """

    cells: NDArray[np.int32]
    shapes: Array
    normals: Array
    weights: Array
    elements: NDArray[np.int64]
    facets: NDArray[np.int64]
    places: Array

    @property
    def nodes(self) -> NDArray[np.int32]:
        """Return the displacement nodes on the surface."""
        return np.unique(self.cells)

    @property
    def area(self) -> float:
        """Return the area [m^2]."""
        return float(self.weights.sum())


def facets_of(mesh: Any, name: str, role: str) -> NDArray[np.int64]:
    """Return the facets of a named boundary; the error lists the names there are."""
    boundaries = mesh.boundaries or {}
    if name not in boundaries:
        raise ModelError(f"{role}: the mesh has no boundary {name!r}; it has {', '.join(sorted(boundaries)) or 'none'}")
    facets = np.asarray(boundaries[name])
    if facets.size == 0:
        raise ModelError(f"{role}: boundary {name!r} is empty (area 0): select at least one facet")
    inside = np.setdiff1d(facets, mesh.boundary_facets())
    if inside.size:
        raise ModelError(f"{role}: {inside.size} facets of boundary {name!r} must lie on the surface, they lie inside")
    return facets


def surface(made: Discretization, name: str, role: str, degree: int | None = None) -> Surface:
    """Return the named boundary, integrated over on the curved facets themselves: n dA = |det J| J^-T (e_1 x e_2) dX.

    ``degree``: of the quadrature; default: exact for products of shape functions on flat facets.
    """
    facets = facets_of(made.mesh, name, role)
    elements = np.asarray(made.mesh.f2t[0, facets], dtype=np.int64)
    which = np.argmax(made.mesh.t2f[:, elements] == facets, axis=0)
    parts = [
        _on_one_side(made, elements[which == k], corners, 2 * made.order + 2 if degree is None else degree)
        for k, corners in enumerate(made.element.refdom.facets)
        if np.any(which == k)
    ]
    cells, shapes, normals, weights, places = (np.concatenate(group) for group in zip(*parts, strict=True))
    order = np.argsort(which, kind="stable")
    return Surface(cells, shapes, normals, weights, elements[order], facets[order], places)


def _on_one_side(made: Discretization, elements: NDArray[np.int64], corners: list[int], degree: int) -> tuple[Any, ...]:
    """Return the facets of ``elements`` that lie on the same side of the reference element."""
    vertices = np.asarray(made.element.refdom.p, dtype=float)[:, corners]
    origin, edges = vertices[:, 0], np.stack([vertices[:, 1], vertices[:, -1]], axis=1) - vertices[:, :1]
    across = np.cross(edges[:, 0], edges[:, 1])
    across *= np.sign(across @ (origin - np.asarray(made.element.refdom.p, dtype=float).mean(axis=1)))
    flat, area = get_quadrature(RefTri if len(corners) == 3 else RefQuad, degree)
    points = origin[:, None] + edges @ np.asarray(flat)
    jacobian = np.einsum("qvc,mva->mqac", gradients(made.geometry, points), made.places[made.corners[elements]])
    det = np.abs(np.linalg.det(jacobian))
    normals = np.einsum("mqca,c,mq->mqa", np.linalg.inv(jacobian), across, det)
    length = np.linalg.norm(normals, axis=-1)
    reference = np.asarray(made.element.doflocs, dtype=float)
    on_side = np.flatnonzero(np.abs((reference - origin) @ across) < 1e-9)
    shapes = np.broadcast_to(values(made.element, points)[:, on_side], (len(elements), points.shape[1], len(on_side)))
    places = np.einsum("qv,mva->mqa", values(made.geometry, points), made.places[made.corners[elements]])
    return made.cells[elements][:, on_side], shapes, normals / length[..., None], length * np.asarray(area), places
