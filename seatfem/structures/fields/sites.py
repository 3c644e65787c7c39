"""Where stress is looked for in a mesh: named points, or all nodes of its surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from seatfem.structures.elements.shape_functions import Discretization, gradients, values
from seatfem.structures.errors import ModelError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_NEAREST: Final = 24  # elements that are searched for a point, those with the nearest centres
_NEWTON: Final = 12
_INSIDE: Final = 1e-6  # of the reference element: a point on the side of an element is in both
_BESIDE: Final = 0.05  # of the reference element, that a point may lie off a curved surface
_CUTS: Final = ("symmetry_0", "symmetry_1")


@dataclass(frozen=True)
class Sites:
    """Points of a mesh and the elements around them: what is found in these is averaged.

    Attributes:
        points: (P, d) of them [m]; on a meridian r and z.
        site, element: (E,) which point is seen from which element.
        inside: (d, E) where it lies in that element's reference coordinates.
        share: (E,) of each element in its point's mean.
    """

    points: Array
    site: Integers
    element: Integers
    inside: Array
    share: Array

    @staticmethod
    def of(points: Array, site: Integers, element: Integers, inside: Array) -> Sites:
        """Return sites with equal shares of all elements about a point."""
        share = 1.0 / np.bincount(site, minlength=len(points))[site]
        return Sites(points, site, element, inside, share)

    def __len__(self) -> int:
        return len(self.points)

    def at(self, chosen: NDArray[np.bool_]) -> Sites:
        """Return those that are chosen (P,), numbered anew."""
        kept, number = chosen[self.site], np.cumsum(chosen) - 1
        return Sites.of(self.points[chosen], number[self.site[kept]], self.element[kept], self.inside[:, kept])


def at_points(made: Discretization, points: Array) -> Sites:
    """Return the elements around points (P, d) [m].

    Raises:
        ModelError: a point that lies off the body by more than a twentieth of an element.
    """
    vertices = made.places[made.corners[:, : made.mesh.t.shape[0]]]
    count = min(_NEAREST, len(vertices))
    near = cKDTree(vertices.mean(axis=1)).query(points, k=count)[1].reshape(len(points), count)
    site, element = np.repeat(np.arange(len(points)), count), near.ravel().astype(np.int64)
    inside = _inside(made, element, points[site])
    beyond = inside.sum(axis=0) if made.element.refdom.__name__ in ("RefTet", "RefTri") else inside.max(axis=0)
    off = np.maximum(-inside.min(axis=0), beyond - 1.0).reshape(len(points), count)  # of the reference element
    least = off.min(axis=1)
    if (lost := np.flatnonzero(least > _BESIDE)).size:
        place = ", ".join(f"{1e3 * x:.4g}" for x in points[lost[0]])
        raise ModelError(f"the point ({place}) mm lies off the body: name one in it, or on its surface")
    taken = (off <= np.maximum(least, _INSIDE)[:, None]).ravel()
    return Sites.of(points, site[taken], element[taken], inside[:, taken])


def on_surface(made: Discretization) -> Sites:
    """Return all displacement nodes on the surface, without those of planes of symmetry and of the axis alone."""
    _, elements, which = outer_facets(made.mesh)
    reference, outer = np.asarray(made.element.doflocs, dtype=float), np.zeros(made.size, dtype=bool)
    for k, corners in enumerate(made.element.refdom.facets):
        vertices = np.asarray(made.element.refdom.p, dtype=float)[:, corners].T
        across = np.linalg.svd(vertices[1:] - vertices[0])[2][-1]
        on_side = np.abs((reference - vertices[0]) @ across) < 1e-9
        outer[made.cells[elements[which == k]][:, on_side]] = True
    return at_nodes(made, np.flatnonzero(outer))


def at_nodes(made: Discretization, nodes: Integers) -> Sites:
    """Return the displacement nodes (P,), in rising order."""
    chosen = np.zeros(made.size, dtype=bool)
    chosen[nodes] = True
    element, local = np.nonzero(chosen[made.cells])
    site = np.searchsorted(nodes, made.cells[element, local])
    reference = np.asarray(made.element.doflocs, dtype=float)
    return Sites.of(made.nodes.T[nodes], site, element, reference[local].T)


def outer_facets(mesh: Any) -> tuple[Integers, Integers, Integers]:
    """Return the facets (f,) of the true surface, their elements and which sides of these they are."""
    facets = np.setdiff1d(mesh.boundary_facets(), [f for cut in _CUTS for f in (mesh.boundaries or {}).get(cut, ())])
    if mesh.dim() == 2:
        radii = mesh.p[0, mesh.facets[:, facets]]
        facets = facets[radii.max(axis=0) > _INSIDE * mesh.p[0].max()]
    facets = facets.astype(np.int64)
    elements = mesh.f2t[0, facets]
    return facets, elements, np.argmax(mesh.t2f[:, elements] == facets, axis=0)


def _inside(made: Discretization, element: Integers, targets: Array) -> Array:
    """Return the (d, E) reference coordinates of targets (E, d) in elements, or beyond, by Newton's method."""
    nodes = made.places[made.corners[element]]
    inside = np.tile(np.asarray(made.element.refdom.p, dtype=float).mean(axis=1)[:, None], len(element))
    for _ in range(_NEWTON):
        off = np.einsum("ev,eva->ea", values(made.geometry, inside), nodes) - targets
        jacobian = np.einsum("evc,eva->eac", gradients(made.geometry, inside), nodes)
        step = np.linalg.solve(jacobian + 1e-12 * np.abs(jacobian).max() * np.eye(len(inside)), off[..., None])
        inside = np.clip(inside - step[..., 0].T, -0.5, 1.5)
    return inside
