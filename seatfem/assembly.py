"""Stiffness, consistent mass and port vectors of a linear elastic solid on a scikit-fem mesh.

The element matrices come from scikit-fem's own basis arrays by one batched matrix product. With T_ij = integral of
grad phi_i (x) grad phi_j over the body, the 3 x 3 blocks of the isotropic stiffness are

    K_ij = lambda T_ij + mu T_ij' + mu tr(T_ij) I,        M_ij = rho I integral phi_i phi_j

so only T is integrated, on the sparsity pattern of a scalar field, and the material enters afterwards.
Unknowns are numbered node by node: 3 node + component.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse

from impact.progress import Progress, silent
from seatfem.materials import material_from
from seatfem.model import Array, DofMap, Material, ModelError, Port, SecondOrderModel

__all__ = ["DofMap", "Material", "ModelError", "Port", "SecondOrderModel", "assemble"]

_ELEMENTS = {
    ("RefTet", 1): skfem.ElementTetP1,
    ("RefTet", 2): skfem.ElementTetP2,
    ("RefHex", 1): skfem.ElementHex1,
    ("RefHex", 2): skfem.ElementHex2,
}
_CHUNK = 16_384  # elements per batch: bounds the memory of the batched products


def assemble(
    mesh: Any,
    material: Material | Mapping[str, Any],
    *,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    ports: Mapping[str, str] | None = None,
    order: int | None = None,
    rayleigh: tuple[float, float] | None = None,
    progress: Progress = silent,
) -> SecondOrderModel:
    """Small-strain isotropic elasticity by displacement elements with a consistent mass.

    Args:
        mesh: scikit-fem mesh with named boundaries, coordinates in m, or an object that carries one as ``.mesh``.
        material: a `Material`, or a mapping with young [Pa], poisson and density [kg/m^3].
        fixed: boundaries without displacement; ``()`` for a free body.
        sliding: plane boundaries normal to a coordinate axis, without normal displacement.
        ports: boundary name of each port's patch; default ``{"contact": "contact"}``.
        order: 1 or 2, polynomial order of the displacement; default: that of the mesh.
        rayleigh: (alpha [1/s], beta [s]) of the damping C = alpha M + beta K.
        progress: called with ("assembly", fraction).

    Raises:
        ModelError: a boundary that is missing or empty, a port on a fixed face, folded elements.
    """
    mesh = getattr(mesh, "mesh", mesh)
    material = material if isinstance(material, Material) else material_from(material)
    patches = {"contact": "contact"} if ports is None else dict(ports)
    held = {"fixed": _names(fixed), "sliding": _names(sliding)}
    for role, group in {**held, "port": tuple(patches.values())}.items():
        for name in group:
            _facets(mesh, name, role)
    element = _element(mesh, order)

    scalar = _integrate(mesh, element, progress)
    K, M = scalar.elasticity(material)
    free = np.setdiff1d(np.arange(K.shape[0]), _held(mesh, element, held["fixed"], held["sliding"]))
    K, M = K[free][:, free], M[free][:, free]
    C = None if rayleigh is None else rayleigh[0] * M + rayleigh[1] * K
    made = {port: _port(mesh, element, name, held, material, free) for port, name in patches.items()}
    progress("assembly", 1.0)
    return SecondOrderModel(M, C, K, made, DofMap(scalar.points, free, mesh))


@dataclass(frozen=True)
class _Integrals:
    """Integrals of the scalar shape functions on one sparsity pattern (indptr, indices).

    ``gradients`` (nnz, dim, dim) holds T_ij, ``products`` (nnz,) the integral of phi_i phi_j.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    gradients: Array
    products: Array
    points: Array

    def elasticity(self, material: Material) -> tuple[sparse.csr_array, sparse.csr_array]:
        """(K, M) of the unconstrained solid."""
        lam, mu = material.lame
        T, n, identity = self.gradients, len(self.indptr) - 1, np.eye(self.gradients.shape[1])
        trace = np.trace(T, axis1=1, axis2=2)[:, None, None]
        blocks = lam * T + mu * T.transpose(0, 2, 1) + mu * trace * identity
        shape = (n * len(identity), n * len(identity))
        K = sparse.bsr_array((blocks, self.indices, self.indptr), shape=shape).tocsr()
        M = sparse.kron(sparse.csr_array((material.density * self.products, self.indices, self.indptr)), identity)
        return (K + K.T) / 2, sparse.csr_array(M)  # the products are symmetric to round-off only


def _integrate(mesh: Any, element: Any, progress: Progress) -> _Integrals:
    """T and the scalar mass over all elements; quadrature exact on straight simplices, two orders more on curved."""
    degree = 2 * element.maxdeg
    extra = 0 if _is_affine(mesh) else 2
    dofs = skfem.Basis(mesh, element, intorder=1, elements=np.arange(1)).dofs
    cells = np.asarray(dofs.element_dofs)
    local, n_cells = cells.shape
    n = int(dofs.N)
    key = (cells[:, None, :].astype(np.int64) * n + cells[None, :, :]).reshape(local * local, n_cells).T.ravel()
    unique, place = np.unique(key, return_inverse=True)
    dim = mesh.dim()
    gradients, products = np.zeros((len(unique), dim, dim)), np.zeros(len(unique))
    for start in range(0, n_cells, _CHUNK):
        some = np.arange(start, min(start + _CHUNK, n_cells))
        where = place[start * local * local : (some[-1] + 1) * local * local]
        _check_jacobian(mesh, some)
        stiff = skfem.Basis(mesh, element, intorder=max(degree - 2 + extra, 1), elements=some, disable_doflocs=True)
        mass = skfem.Basis(mesh, element, intorder=degree + extra, elements=some, disable_doflocs=True)
        grad = np.stack([np.broadcast_to(f[0].grad, (dim, *stiff.dx.shape)) for f in stiff.basis])
        grad = np.ascontiguousarray(grad.transpose(2, 0, 1, 3)).reshape(len(some), local * dim, -1)
        T = ((grad * stiff.dx[:, None, :]) @ grad.transpose(0, 2, 1)).reshape(-1, local, dim, local, dim)
        value = np.stack([np.broadcast_to(np.asarray(f[0]), mass.dx.shape) for f in mass.basis], axis=1)
        products += np.bincount(where, ((value * mass.dx[:, None, :]) @ value.transpose(0, 2, 1)).ravel(), len(unique))
        for a in range(dim):
            for b in range(dim):
                gradients[:, a, b] += np.bincount(where, T[:, :, a, :, b].ravel(), len(unique))
        progress("assembly", 0.9 * (some[-1] + 1) / n_cells)
    indptr = np.searchsorted(unique, np.arange(n + 1, dtype=np.int64) * n).astype(np.int32)
    points = np.asarray(skfem.Basis(mesh, element, intorder=1).doflocs)
    return _Integrals(indptr, (unique % n).astype(np.int32), gradients, products, points)


def _is_affine(mesh: Any) -> bool:
    """Whether every element is a straight simplex (constant Jacobian)."""
    if mesh.dofs.element_dofs.shape[0] == mesh.dim() + 1:
        return True
    jacobian = mesh.mapping().DF(np.asarray(mesh.elem.refdom.p, dtype=float))
    return bool(np.ptp(jacobian, axis=-1).max() <= 1e-10 * np.abs(jacobian).max())


def _check_jacobian(mesh: Any, some: NDArray[np.int64]) -> None:
    """Raise if the Jacobian of an element is zero or changes sign, at its corners or in its middle."""
    corners = np.asarray(mesh.elem.refdom.p, dtype=float)
    places = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    det = np.linalg.det(np.moveaxis(mesh.mapping().DF(places, tind=some), (0, 1), (-2, -1)))
    folded = some[(det.min(axis=-1) <= 0) & (det.max(axis=-1) >= 0)]
    if folded.size:
        centre = mesh.p[:, mesh.t[:, folded[0]]].mean(axis=1)
        raise ModelError(
            f"{folded.size} elements are folded (Jacobian changes sign), the first at {np.round(centre, 6)} m: "
            "mesh finer there or straighten the element sides"
        )


def _element(mesh: Any, order: int | None) -> Any:
    reference = mesh.elem.refdom.__name__
    wanted = (1 if mesh.dofs.element_dofs.shape[0] == mesh.t.shape[0] else 2) if order is None else order
    if (reference, wanted) not in _ELEMENTS:
        known = ", ".join(f"{kind} order {p}" for kind, p in _ELEMENTS)
        raise ModelError(f"no element for {reference} of order {wanted}; there are {known}")
    return _ELEMENTS[reference, wanted]()


def _names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _facets(mesh: Any, name: str, role: str) -> NDArray[np.int64]:
    """Facets of a named boundary; the error lists the names there are."""
    boundaries = mesh.boundaries or {}
    if name not in boundaries:
        raise ModelError(f"{role}: the mesh has no boundary {name!r}; it has {', '.join(sorted(boundaries)) or 'none'}")
    facets = np.asarray(boundaries[name])
    if facets.size == 0:
        raise ModelError(f"{role}: boundary {name!r} is empty (area 0): select at least one facet")
    inside = np.setdiff1d(facets, mesh.boundary_facets())
    if inside.size:
        raise ModelError(f"{role}: {inside.size} facets of boundary {name!r} lie inside the body, not on its surface")
    return facets


def _surface(mesh: Any, element: Any, name: str) -> Any:
    facets = _facets(mesh, name, name)
    try:
        return skfem.FacetBasis(mesh, element, facets=facets, intorder=2 * element.maxdeg + 2)
    except Exception as problem:  # scikit-fem inverts the map of each curved element by Newton's method
        if "Newton" not in str(problem):
            raise
        raise ModelError(
            f"boundary {name!r}: its {facets.size} facets are too strongly curved to be integrated over; "
            "use smaller elements there (contact_size)"
        ) from problem


def _held(mesh: Any, element: Any, fixed: Sequence[str], sliding: Sequence[str]) -> NDArray[np.int64]:
    """Indices of the unknowns without displacement."""
    basis = skfem.Basis(mesh, element, intorder=1, elements=np.arange(1))
    dim = mesh.dim()
    held = [np.zeros(0, dtype=np.int64)]
    for name in fixed:
        nodes = np.unique(basis.get_dofs(_facets(mesh, name, "fixed")).all())
        held.append((dim * nodes[:, None] + np.arange(dim)).ravel())
    for name in sliding:
        normals = _surface(mesh, element, name).normals.reshape(dim, -1)
        axis = int(np.argmax(np.abs(normals[:, 0])))
        if (off := 1 - np.abs(normals[axis]).min()) > 1e-6:
            raise ModelError(f"sliding: boundary {name!r} is not normal to a coordinate axis (off by {off:.1e})")
        held.append(dim * np.unique(basis.get_dofs(_facets(mesh, name, "sliding")).all()) + axis)
    return np.unique(np.concatenate(held))


def _port(
    mesh: Any, element: Any, name: str, held: Mapping[str, Sequence[str]], material: Material, free: NDArray[np.int64]
) -> Port:
    """b = integral of n . N over the patch / area."""
    for role, group in held.items():
        for other in group:
            common = np.intersect1d(_facets(mesh, name, "port"), _facets(mesh, other, role)).size
            if common:
                raise ModelError(f"port: {common} facets of {name!r} are also {role} ({other!r}) and cannot be pushed")
    surface = _surface(mesh, element, name)
    area = float(surface.dx.sum())
    if not area > 0:
        raise ModelError(f"port: boundary {name!r} has area {area:g} m^2")
    dim, n = mesh.dim(), int(surface.N)
    vector = np.zeros((n, dim))
    for dofs, field in zip(surface.element_dofs, surface.basis, strict=True):
        weights = np.asarray(field[0]) * surface.dx
        for axis in range(dim):
            vector[:, axis] += np.bincount(dofs, (surface.normals[axis] * weights).sum(axis=-1), n)
    return Port(vector.ravel()[free] / area, area, material.density * material.c_p * area)
