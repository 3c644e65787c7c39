"""Manufactured solutions of three-dimensional elasticity: optimal orders on straight and curved elements.

u(x) = sum_w a_w sin(k_w . x + phase_w), whose body force is

    f = -(lambda + mu) grad div u - mu laplace u = sum_w ((lambda + mu) (a.k) k + mu |k|^2 a) sin(k . x + phase)

Displacements of the exact solution on one face, its tractions on all others, f inside. Elements of order p are to
converge like h^(p+1) in L2 and h^p in energy (Ciarlet, The Finite Element Method for Elliptic Problems, ch. 3; curved
isoparametric elements: ch. 4). Observed between n and 2n the orders lie within 0.15 of these, as the next term is
of order h relative to the first, for second-order elements, whose meshes are coarser, within 0.25.
"""

import math
from functools import cache

import numpy as np
import pytest
import skfem
from numpy.typing import NDArray

from seatfem.elements.assembly import assemble
from seatfem.model import Material
from seatfem.roads.factorization import factorize

Array = NDArray[np.float64]
MATERIAL = Material(1.0, 0.3, 1.0)
LAM, MU = MATERIAL.lame
AMPLITUDES = np.array([[1.0, -0.5, 0.7], [0.3, 0.8, -0.4]])
WAVES = np.array([[1.5, 0.7, -1.1], [-0.8, 1.9, 1.2]])
PHASES = np.array([0.4, 1.3])
ELEMENTS = {
    ("tetrahedra", 1): (skfem.ElementTetP1, (4, 8, 16)),
    ("tetrahedra", 2): (skfem.ElementTetP2, (2, 4, 8)),
    ("hexahedra", 1): (skfem.ElementHex1, (4, 8, 16)),
    ("hexahedra", 2): (skfem.ElementHex2, (2, 4, 8)),
}


def phase(x: Array) -> Array:
    """(waves, ...) k . x + phase at points (3, ...)."""
    return np.tensordot(WAVES, x, axes=1) + PHASES.reshape(-1, *(1,) * (x.ndim - 1))


def displacement(x: Array) -> Array:
    return np.tensordot(AMPLITUDES.T, np.sin(phase(x)), axes=1)


def gradient(x: Array) -> Array:
    """du_i/dx_j at [i, j]."""
    return np.einsum("wi,wj,w...->ij...", AMPLITUDES, WAVES, np.cos(phase(x)))


def stress(gradients: Array, material: Material = MATERIAL) -> Array:
    lam, mu = material.lame
    strain = (gradients + gradients.swapaxes(0, 1)) / 2
    identity = np.eye(3).reshape(3, 3, *(1,) * (gradients.ndim - 2))
    return lam * np.trace(strain) * identity + 2 * mu * strain


def body_force(x: Array) -> Array:
    along = np.sum(AMPLITUDES * WAVES, axis=1)[:, None]
    vectors = (LAM + MU) * along * WAVES + MU * np.sum(WAVES**2, axis=1)[:, None] * AMPLITUDES
    return np.tensordot(vectors.T, np.sin(phase(x)), axes=1)


def bulge(x: Array) -> Array:
    """The unit cube with all faces curved."""
    bump = 0.12 * np.sin(math.pi * x)
    return x + np.stack([bump[1] * (0.5 + x[2]), bump[2] * (0.5 + x[0]), bump[0] * (0.5 + x[1])])


def cube(shape: str, n: int, curved: bool) -> skfem.Mesh:
    axis = np.linspace(0.0, 1.0, n + 1)
    kind = skfem.MeshTet if shape == "tetrahedra" else skfem.MeshHex
    mesh = kind.init_tensor(axis, axis, axis)
    boundaries = {"held": mesh.facets_satisfying(lambda x: x[0] < 1e-9, boundaries_only=True)}
    boundaries["loaded"] = np.setdiff1d(mesh.boundary_facets(), boundaries["held"])
    if curved:
        second = skfem.MeshTet2 if shape == "tetrahedra" else skfem.MeshHex2
        fine = second.from_mesh(mesh)
        return second(bulge(fine.doflocs), fine.t, _boundaries=boundaries)
    return mesh.with_boundaries(boundaries)


def errors(shape: str, order: int, n: int, curved: bool, material: Material = MATERIAL) -> tuple[float, float]:
    """(L2 norm, energy norm) of the error, relative; ``material`` is the one assembled."""
    mesh = cube(shape, n, curved)
    element = ELEMENTS[shape, order][0]()
    model = assemble(mesh, material, fixed=(), ports={}, order=order)
    inside = skfem.Basis(mesh, element, intorder=2 * order + 3)
    surface = skfem.FacetBasis(mesh, element, facets=mesh.boundaries["loaded"], intorder=2 * order + 3)
    load = np.zeros((inside.N, 3))
    forces = body_force(inside.global_coordinates().value)
    tractions = np.einsum("ij...,j...->i...", stress(gradient(surface.global_coordinates().value)), surface.normals)
    for basis, density in ((inside, forces), (surface, tractions)):
        for dofs, field in zip(basis.element_dofs, basis.basis, strict=True):
            for i in range(3):
                load[:, i] += np.bincount(dofs, (density[i] * field[0] * basis.dx).sum(axis=-1), basis.N)

    held = inside.get_dofs("held").all()
    u = np.zeros((inside.N, 3))
    u[held] = displacement(inside.doflocs[:, held]).T
    free = np.setdiff1d(np.arange(3 * inside.N), (3 * held[:, None] + np.arange(3)).ravel())
    rest = (load.ravel() - model.K @ u.ravel())[free]
    u.ravel()[free] = factorize(model.K[free][:, free]).solve(rest)

    fields = [inside.interpolate(np.ascontiguousarray(u[:, i])) for i in range(3)]
    x = inside.global_coordinates().value
    off = displacement(x) - np.stack([f.value for f in fields])
    slope = gradient(x) - np.stack([f.grad for f in fields])

    def norm(density: Array) -> float:
        return math.sqrt(float(np.sum(density * inside.dx)))

    def energy(g: Array) -> float:
        return norm(np.sum(stress(g) * g, axis=(0, 1)))

    exact = np.sum(displacement(x) ** 2, axis=0)
    return norm(np.sum(off**2, axis=0)) / norm(exact), energy(slope) / energy(gradient(x))


@cache
def orders(shape: str, order: int, curved: bool) -> tuple[float, float]:
    _, middle, fine = ELEMENTS[shape, order][1]
    coarse, finer = errors(shape, order, middle, curved), errors(shape, order, fine, curved)
    return math.log2(coarse[0] / finer[0]), math.log2(coarse[1] / finer[1])


@pytest.mark.parametrize(
    ("shape", "order", "curved"),
    [(shape, order, False) for shape, order in ELEMENTS] + [(shape, 2, True) for shape in ("tetrahedra", "hexahedra")],
)
def test_orders_are_optimal(shape: str, order: int, curved: bool) -> None:
    of_displacement, of_energy = orders(shape, order, curved)
    slack = 0.15 if order == 1 else 0.25
    assert of_displacement == pytest.approx(order + 1, abs=slack)
    assert of_energy == pytest.approx(order, abs=slack)


@pytest.mark.parametrize("wrong", [Material(1.03, 0.3, 1.0), Material(1.0, 0.309, 1.0)], ids=["young", "poisson"])
def test_a_wrong_constant_does_not_converge(wrong: Material) -> None:
    """3 % off in a constant leaves an error of that size, whatever the mesh."""
    right = errors("hexahedra", 2, 4, False)
    off = errors("hexahedra", 2, 4, False, wrong)
    assert off[0] > 0.005
    assert off[0] > 10 * right[0]
