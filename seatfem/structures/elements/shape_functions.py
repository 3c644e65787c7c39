"""Displacement elements on a scikit-fem mesh: numbering, quadrature over bodies and named boundaries, checks of shape.

Shape functions, their gradients at reference points, quadrature and node numbers are those of scikit-fem.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import ElementHex1, ElementHex2, ElementTetP1, ElementTetP2
from skfem.assembly import Dofs
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad, RefTri

from seatfem.structures.elements.element_kernels import jacobian_range, node_graph
from seatfem.structures.errors import ModelError

Array = NDArray[np.float64]
Rule = tuple[Array, Array, Array, Array]
"""Weights (Q,), shape functions (Q, V) and slopes (Q, V, 3) of the geometry, those of the displacement (Q, L, ...)."""

_ELEMENTS = {
    ("RefTet", 1): ElementTetP1,
    ("RefTet", 2): ElementTetP2,
    ("RefHex", 1): ElementHex1,
    ("RefHex", 2): ElementHex2,
}
_FLAT = 1e-10  # largest Jacobian of a flat element, over the cube of its longest side


@dataclass(frozen=True)
class Discretization:
    """Elements of one kind and order on a mesh.

    Attributes:
        mesh: scikit-fem mesh.
        element, geometry: scikit-fem elements of the displacement and of the map from the reference element.
        order: polynomial order p of the displacement.
        cells: (m, L) displacement nodes of each element.
        corners: (m, V) geometry nodes of each element, rows of ``places``.
        places: (g, 3) coordinates of the geometry nodes [m].
        straight: whether every element is a straight tetrahedron.
    """

    mesh: Any
    element: Any
    geometry: Any
    order: int
    cells: NDArray[np.int32]
    corners: NDArray[np.int32]
    places: Array
    straight: bool

    @cached_property
    def size(self) -> int:
        """Return the number of displacement nodes."""
        return int(self.cells.max()) + 1

    @cached_property
    def nodes(self) -> Array:
        """Return the (d, n) coordinates of the displacement nodes [m]."""
        reference = np.asarray(self.element.doflocs, dtype=float)
        points = np.empty((self.size, self.places.shape[1]))
        for k, shape in enumerate(values(self.geometry, reference.T)):
            points[self.cells[:, k]] = np.einsum("v,mvc->mc", shape, self.places[self.corners])
        return points.T

    @cached_property
    def graph(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return (indptr, indices) of the nodes that share an element."""
        starts, nodes = node_graph(self.cells, self.size)
        return starts, nodes

    def centre(self, element: int) -> str:
        """Return the centre of an element, for messages."""
        x, y, z = self.places[self.corners[element]].mean(axis=0)
        return f"({x:.4g}, {y:.4g}, {z:.4g}) m"


def discretize(mesh: Any, order: int) -> Discretization:
    """Return the elements of ``order`` on ``mesh`` (0: the order of its geometry), checked.

    Raises:
        ModelError: an unknown element, flat or folded elements, or disconnected parts.
    """
    kind, curved = mesh.elem.refdom.__name__, mesh.dofs.element_dofs.shape[0] != mesh.t.shape[0]
    wanted = order or (2 if curved else 1)
    element, geometry = element_of(mesh, wanted, _ELEMENTS), mesh.elem()
    corners, places = mesh.dofs.element_dofs, np.ascontiguousarray(mesh.doflocs.T)
    straight = kind == "RefTet" and (not curved or _has_straight_sides(geometry, places[corners.T]))
    if straight and curved:
        geometry, corners, places = ElementTetP1(), mesh.t, np.ascontiguousarray(mesh.p.T)
    cells = mesh.dofs.element_dofs if curved and wanted == 2 else Dofs(mesh, element).element_dofs
    space = Discretization(mesh, element, geometry, wanted, _rows(cells), _rows(corners), places, straight)
    _check_shape(space)
    _check_connected(space)
    return space


def element_of(mesh: Any, order: int, known: Mapping[tuple[str, int], Any], where: str = "") -> Any:
    """Return scikit-fem's element of an ``order`` on a mesh, or raise `ModelError` if it is not ``known``."""
    kind = mesh.elem.refdom.__name__
    if (kind, order) not in known:
        choices = ", ".join(f"{name} order {p}" for name, p in known)
        raise ModelError(f"no element for {kind} of order {order}{where}; there are {choices}")
    return known[kind, order]()


def _rows(table: Any) -> NDArray[np.int32]:
    return np.ascontiguousarray(np.asarray(table).T, dtype=np.int32)


def _has_straight_sides(geometry: Any, corners: Array) -> bool:
    """Return whether the geometry nodes (m, V, 3) are those of elements with straight sides."""
    linear = values(ElementTetP1(), np.asarray(geometry.doflocs, dtype=float).T)
    off = np.abs(np.einsum("kv,mvc->mkc", linear, corners[:, :4]) - corners).max()
    return bool(off <= 1e-10 * np.abs(corners - corners[:, :1]).max())


def values(element: Any, points: Array) -> Array:
    """Return the (Q, L) shape functions of a scikit-fem element at (d, Q) reference points."""
    count = points.shape[1]
    return np.stack([np.broadcast_to(element.lbasis(points, k)[0], count) for k in range(len(element.doflocs))], axis=1)


def gradients(element: Any, points: Array) -> Array:
    """Return the (Q, L, d) gradients of the shape functions in reference coordinates."""
    shape, count = points.shape, len(element.doflocs)
    return np.stack([np.broadcast_to(element.lbasis(points, k)[1], shape).T for k in range(count)], axis=1)


def rule_at(made: Discretization, points: Array, weights: Array, displacement: Array) -> Rule:
    """Return a quadrature rule with the arrays that the compiled loops need."""
    shapes, slopes = values(made.geometry, points), gradients(made.geometry, points)
    weights = np.asarray(weights, dtype=float)
    return weights, np.ascontiguousarray(shapes), np.ascontiguousarray(slopes), np.ascontiguousarray(displacement)


def stiffness_rule(made: Discretization) -> Rule:
    """Return a rule exact on straight tetrahedra, two degrees higher on curved; (p + 1)^3 points on hexahedra."""
    points, weights = _gauss(made, 2 * made.order - 2)
    return rule_at(made, points, weights, gradients(made.element, points))


def mass_rule(made: Discretization) -> Rule:
    """Return the rule of `stiffness_rule` for products of shape functions."""
    points, weights = _gauss(made, 2 * made.order)
    return rule_at(made, points, weights, values(made.element, points))


def nodal_rule(made: Discretization) -> Rule:
    """Return the rule by which an element's mass is distributed to its nodes.

    Hexahedra: Gauss-Lobatto rule at the nodes (Cohen 2002), with masses in proportion to w_i det J_i. Tetrahedra: the
    diagonal of the consistent mass, scaled (Hinton, Rock & Zienkiewicz 1976).
    """
    if made.element.refdom.__name__ == "RefTet":
        return mass_rule(made)
    points = np.asarray(made.element.doflocs, dtype=float)
    lobatto = {1: {0.0: 1 / 2, 1.0: 1 / 2}, 2: {0.0: 1 / 6, 0.5: 4 / 6, 1.0: 1 / 6}}[made.order]
    weights = np.array([np.prod([lobatto[x] for x in point]) for point in points.tolist()])
    return rule_at(made, points.T, weights, np.eye(len(points)))


def _gauss(made: Discretization, degree: int) -> tuple[Array, Array]:
    if made.element.refdom.__name__ == "RefHex":
        degree = 2 * made.order + 1  # per direction
    elif not made.straight:
        degree += 2
    points, weights = get_quadrature(made.element.refdom, max(degree, 1))
    return np.asarray(points), np.asarray(weights)


def _check_shape(made: Discretization) -> None:
    """Raise if an element's Jacobian vanishes or changes sign at its geometry nodes, centre or quadrature points."""
    corners = np.asarray(made.geometry.doflocs, dtype=float).T
    points = np.concatenate([corners, corners.mean(axis=1, keepdims=True), _gauss(made, 2 * made.order - 2)[0]], axis=1)
    extremes = jacobian_range(made.corners, made.places, np.ascontiguousarray(gradients(made.geometry, points)))
    box = np.ptp(made.places[made.corners[:, : made.mesh.t.shape[0]]], axis=1).max(axis=1)
    least = np.where(extremes[:, 1] > 0, extremes[:, 0], -extremes[:, 1])
    flat = np.abs(extremes).max(axis=1) <= _FLAT * box**3
    for bad, what in ((flat, "flat (no volume)"), (least <= _FLAT * box**3, "folded (Jacobian changes sign)")):
        if (which := np.flatnonzero(bad)).size:
            raise ModelError(
                f"{which.size} elements are {what}, the first at {made.centre(which[0])}: "
                "mesh finer there or straighten the element sides"
            )


def _check_connected(made: Discretization) -> None:
    """Raise `ModelError` if the mesh consists of parts that share no node."""
    indptr, indices = made.graph
    graph = sparse.csr_array((np.ones(len(indices), np.int8), indices, indptr), shape=(made.size, made.size))
    count, part = sparse.csgraph.connected_components(graph, directed=False)
    if count == 1:
        return
    of_element = part[made.cells[:, 0]]
    sizes = np.bincount(of_element, minlength=count)
    order = np.argsort(-sizes)
    first = [int(np.flatnonzero(of_element == k)[0]) for k in order[:5]]
    listed = ", ".join(f"{sizes[k]} elements about {made.centre(e)}" for k, e in zip(order, first, strict=False))
    raise ModelError(
        f"the mesh falls into {count} parts that share no node: {listed}{', ...' if count > 5 else ''}; "
        "merge coincident nodes (imprint touching solids before meshing) or leave the loose parts out"
    )


@dataclass(frozen=True)
class Surface:
    """Surface of f facets with Q quadrature points and N nodes each.

    Attributes:
        cells: (f, N) displacement nodes.
        shapes: (f, Q, N) shape functions at the points.
        normals: (f, Q, 3) outward unit normals.
        weights: (f, Q) quadrature weights, which add up to the area [m^2].
        elements: (f,) element behind each facet.
        facets: (f,) numbers of the facets in the mesh.
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
    """Return the facets of a named boundary. Raises `ModelError` unless it exists and lies on the surface."""
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


def surface(made: Discretization, name: str, role: str, degree: int = 0) -> Surface:
    """Return the quadrature on the curved facets of a named boundary: n dA = |det J| J^-T (e_1 x e_2) dX.

    ``degree``: degree of the quadrature; default: exact for products of shape functions on flat facets.
    """
    facets = facets_of(made.mesh, name, role)
    elements = np.asarray(made.mesh.f2t[0, facets], dtype=np.int64)
    which = np.argmax(made.mesh.t2f[:, elements] == facets, axis=0)
    parts = [
        _list_facets(made, elements[which == k], corners, degree or 2 * made.order + 2)
        for k, corners in enumerate(made.element.refdom.facets)
        if np.any(which == k)
    ]
    cells, shapes, normals, weights, places = (np.concatenate(group) for group in zip(*parts, strict=True))
    order = np.argsort(which, kind="stable")
    return Surface(cells, shapes, normals, weights, elements[order], facets[order], places)


def _list_facets(made: Discretization, elements: NDArray[np.int64], corners: list[int], degree: int) -> tuple[Any, ...]:
    """Return cells, shapes, normals, weights and places of the facets of ``elements`` with these reference corners."""
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
