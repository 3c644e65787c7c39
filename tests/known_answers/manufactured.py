"""Manufactured solutions of elasticity: sums of plane waves, whose body force is known, against finite elements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import Array, Material
from seatfem.structures.reduction.factorization import factorize
from seatfem.verify import Case

from .grids import box
from .limits import converged

_CIARLET = "manufactured; Ciarlet, Finite Element Method for Elliptic Problems, ch. 3"
_MATERIAL = Material(1.0, 0.3, 1.0)
_ELEMENTS: dict[str, tuple[Any, Any]] = {
    "hexahedra": (skfem.MeshHex, skfem.ElementHex2),
    "tetrahedra": (skfem.MeshTet, skfem.ElementTetP2),
}


@dataclass(frozen=True)
class Waves:
    """u(x) = sum_w a_w sin(k_w . x + phase_w); amplitudes and wave vectors (waves, 3), phases (waves,)."""

    amplitudes: Array
    vectors: Array
    phases: Array

    def _phase(self, x: Array) -> Array:
        return np.tensordot(self.vectors, x, axes=1) + self.phases.reshape(-1, *(1,) * (x.ndim - 1))

    def displacement(self, x: Array) -> Array:
        """Return the displacement (3, ...) at points (3, ...)."""
        return np.tensordot(self.amplitudes.T, np.sin(self._phase(x)), axes=1)

    def gradient(self, x: Array) -> Array:
        """Return the gradient (3, 3, ...): du_i/dx_j at [i, j]."""
        cosines: Array = np.cos(self._phase(x))
        return np.asarray(np.einsum("wi,wj,w...->ij...", self.amplitudes, self.vectors, cosines), dtype=np.float64)

    def body_force(self, x: Array, material: Material) -> Array:
        """Return -div sigma = sum_w ((lambda + mu) (a.k) k + mu |k|^2 a) sin(k . x + phase)."""
        lam, mu = material.lame
        along = np.sum(self.amplitudes * self.vectors, axis=1)[:, None]
        forces = (lam + mu) * along * self.vectors + mu * np.sum(self.vectors**2, axis=1)[:, None] * self.amplitudes
        return np.tensordot(forces.T, np.sin(self._phase(x)), axes=1)


PLANE = Waves(
    np.array([[1.0, -0.5, 0.0], [0.3, 0.8, 0.0]]), np.array([[1.5, 0.7, 0.0], [-0.8, 1.9, 0.0]]), np.array([0.4, 1.3])
)


@dataclass(frozen=True)
class RelativeErrors:
    """Norms of the errors over those of the solution: L2 of displacement and of stress, energy."""

    displacement: float
    stress: float
    energy: float


def stress(gradients: Array, material: Material) -> Array:
    """Return the stress by Hooke's law: (3, 3, ...) from du_i/dx_j."""
    lam, mu = material.lame
    strain = (gradients + gradients.swapaxes(0, 1)) / 2
    identity = np.eye(3).reshape(3, 3, *(1,) * (gradients.ndim - 2))
    return np.asarray(lam * np.trace(strain) * identity + 2 * mu * strain, dtype=np.float64)


def relative_errors(
    mesh: Any,
    element: Any,
    order: int,
    waves: Waves,
    material: Material,
    *,
    assembled: Material | None = None,
    sliding: Sequence[str] = (),
) -> RelativeErrors:
    """Return the errors of elements with waves given on "held", tractions on "loaded" and their body force.

    ``assembled``: material of the elements, if not that of the loads; ``sliding``: boundaries without normal
    displacement.
    """
    model = assemble(mesh, assembled or material, fixed=(), sliding=sliding, ports={}, order=order)
    assert model.dofs is not None
    inside = skfem.Basis(mesh, element, intorder=2 * order + 3)
    held = inside.get_dofs("held").all()
    u = np.zeros((inside.N, 3))
    u[held] = waves.displacement(inside.doflocs[:, held]).T
    free = model.dofs.free
    unknown = ~np.isin(free // 3, held)
    rest = (_loads(mesh, element, order, waves, material)[free] - model.K @ u.ravel()[free])[unknown]
    u.ravel()[free[unknown]] = factorize(model.K[unknown][:, unknown]).solve(rest)
    fields = [inside.interpolate(np.ascontiguousarray(u[:, i])) for i in range(3)]
    x = inside.global_coordinates().value
    off = waves.displacement(x) - np.stack([field.value for field in fields])
    slope = waves.gradient(x) - np.stack([field.grad for field in fields])

    def norm(density: Array) -> float:
        return math.sqrt(float(np.sum(density * inside.dx)))

    def energy(g: Array) -> float:
        return norm(np.sum(stress(g, material) * g, axis=(0, 1)))

    def force(g: Array) -> float:
        return norm(np.sum(stress(g, material) ** 2, axis=(0, 1)))

    exact, size = waves.gradient(x), norm(np.sum(waves.displacement(x) ** 2, axis=0))
    return RelativeErrors(
        norm(np.sum(off**2, axis=0)) / size, force(slope) / force(exact), energy(slope) / energy(exact)
    )


def _loads(mesh: Any, element: Any, order: int, waves: Waves, material: Material) -> Array:
    """Return consistent nodal forces (3 nodes,) of the body force and of the tractions on "loaded"."""
    inside = skfem.Basis(mesh, element, intorder=2 * order + 3)
    surface = skfem.FacetBasis(mesh, element, facets=mesh.boundaries["loaded"], intorder=2 * order + 3)
    forces = waves.body_force(inside.global_coordinates().value, material)
    pull = stress(waves.gradient(surface.global_coordinates().value), material)
    tractions = np.einsum("ij...,j...->i...", pull, surface.normals)
    load = np.zeros((inside.N, 3))
    for basis, density in ((inside, forces), (surface, tractions)):
        for dofs, field in zip(basis.element_dofs, basis.basis, strict=True):
            for i in range(3):
                load[:, i] += np.bincount(dofs, (density[i] * field[0] * basis.dx).sum(axis=-1), basis.N)
    return load.ravel()


def manufactured_cases() -> tuple[Case, ...]:
    """Manufactured solutions of elasticity: sums of plane waves, whose body force is known.

    Plane strain: a slab, one element thick, between sliding faces; it is held on one side and pulled on three.
    """
    return tuple(case for shape in _ELEMENTS for case in _plane_strain(shape))


def _plane_strain(shape: str) -> tuple[Case, Case]:
    """Return what the error leaves of 1, so that its limit is known and its order is that of the error."""
    cells, element = _ELEMENTS[shape]

    def solve(n: int, young: float) -> Sequence[float]:
        mesh = box(np.linspace(0, 1, n + 1), np.linspace(0, 0.8, n + 1), np.array([0.0, 1.0 / n]), cells=cells)
        sides = np.concatenate([mesh.boundaries[name] for name in ("x1", "y0", "y1")])
        mesh = mesh.with_boundaries({"held": mesh.boundaries["x0"], "loaded": np.sort(sides)})
        stiff = Material(young, _MATERIAL.poisson, _MATERIAL.density)
        errors = relative_errors(mesh, element(), 2, PLANE, _MATERIAL, assembled=stiff, sliding=("z0", "z1"))
        return 1 - errors.displacement, 1 - errors.stress

    shared = cache(solve)
    name, share = f"plane strain, slab of quadratic {shape}, smooth solution", "1 - |error|/|{}| in L2, {}".format
    return (
        Case(name, share("u", "displacement"), 1.0, 1e-9, _CIARLET, converged(shared, 4, 3)(0)),
        Case(name, share("sigma", "stress"), 1.0, 1e-9, _CIARLET, converged(shared, 4, 2)(1)),
    )
