"""Manufactured solutions of three-dimensional elasticity: optimal orders on straight and curved elements.

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
from scipy.sparse.linalg import spsolve
from scipy.special import jv

from tests.known_answers.manufactured import RelativeErrors, Waves, relative_errors
from tests.solids import Material, assemble_axisymmetric

Array = NDArray[np.float64]
MATERIAL = Material(1.0, 0.3, 1.0)
WAVES = Waves(
    np.array([[1.0, -0.5, 0.7], [0.3, 0.8, -0.4]]), np.array([[1.5, 0.7, -1.1], [-0.8, 1.9, 1.2]]), np.array([0.4, 1.3])
)
ELEMENTS = {
    ("tetrahedra", 1): (skfem.ElementTetP1, (4, 8, 16)),
    ("tetrahedra", 2): (skfem.ElementTetP2, (2, 4, 8)),
    ("hexahedra", 1): (skfem.ElementHex1, (4, 8, 16)),
    ("hexahedra", 2): (skfem.ElementHex2, (2, 4, 8)),
}


def cube(shape: str, n: int, curved: bool) -> skfem.Mesh:
    axis = np.linspace(0.0, 1.0, n + 1)
    kind = skfem.MeshTet if shape == "tetrahedra" else skfem.MeshHex
    mesh = kind.init_tensor(axis, axis, axis)
    boundaries = {"held": mesh.facets_satisfying(lambda x: x[0] < 1e-9, boundaries_only=True)}
    boundaries["loaded"] = np.setdiff1d(mesh.boundary_facets(), boundaries["held"])
    if curved:
        second = skfem.MeshTet2 if shape == "tetrahedra" else skfem.MeshHex2
        fine = second.from_mesh(mesh)
        x, bump = fine.doflocs, 0.12 * np.sin(math.pi * fine.doflocs)  # all faces are curved
        curved = x + np.stack([bump[1] * (0.5 + x[2]), bump[2] * (0.5 + x[0]), bump[0] * (0.5 + x[1])])
        return second(curved, fine.t, _boundaries=boundaries)
    return mesh.with_boundaries(boundaries)


def errors(shape: str, order: int, n: int, curved: bool, material: Material = MATERIAL) -> RelativeErrors:
    """Return the errors; ``material`` is the one assembled."""
    element = ELEMENTS[shape, order][0]()
    return relative_errors(cube(shape, n, curved), element, order, WAVES, MATERIAL, assembled=material)


@cache
def orders(shape: str, order: int, curved: bool) -> tuple[float, float]:
    _, middle, fine = ELEMENTS[shape, order][1]
    coarse, finer = errors(shape, order, middle, curved), errors(shape, order, fine, curved)
    return math.log2(coarse.displacement / finer.displacement), math.log2(coarse.energy / finer.energy)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "order", "curved"),
    [(shape, order, False) for shape, order in ELEMENTS] + [(shape, 2, True) for shape in ("tetrahedra", "hexahedra")],
)
def test_orders_are_optimal(shape: str, order: int, curved: bool) -> None:
    of_displacement, of_energy = orders(shape, order, curved)
    slack = 0.15 if order == 1 else 0.25
    assert of_displacement == pytest.approx(order + 1, abs=slack)
    assert of_energy == pytest.approx(order, abs=slack)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [Material(1.03, 0.3, 1.0), Material(1.0, 0.309, 1.0)], ids=["young", "poisson"])
def test_a_wrong_constant_does_not_converge(wrong: Material) -> None:
    """3 % off in a constant leaves an error of that size, whatever the mesh."""
    right = errors("hexahedra", 2, 4, False)
    off = errors("hexahedra", 2, 4, False, wrong)
    assert off.displacement > 0.005
    assert off.displacement > 10 * right.displacement


def rectangle(r0, r1, z0, z1, n, kind=skfem.MeshQuad):
    mesh = kind.init_tensor(np.linspace(r0, r1, n[0] + 1), np.linspace(z0, z1, n[1] + 1))
    return mesh.with_boundaries(
        {
            "bottom": lambda x: np.isclose(x[1], z0),
            "top": lambda x: np.isclose(x[1], z1),
            "inner": lambda x: np.isclose(x[0], r0),
            "outer": lambda x: np.isclose(x[0], r1),
        }
    )


# manufactured: u = grad phi + curl(psi e_z) with phi = J_n(k r) cos(n th) sin(q z), psi = J_n(k r) sin(n th) cos(q z);
# both are eigenfunctions of the Laplacian, so that -div sigma = (k^2 + q^2) ((lambda + 2 mu) u_phi + mu u_psi)
WAVE, AXIAL = 3.0, 2.0
SOFT = Material(2.5, 0.25, 1.0)


def manufactured(points, harmonic):
    """Return (u, force), each (3, n) amplitudes of u_r, u_th, u_z."""
    r, _, z = points
    below, above = jv(harmonic - 1, WAVE * r), jv(harmonic + 1, WAVE * r)
    slope, over_r = WAVE / 2 * (below - above), WAVE / 2 * (below + above) * (harmonic > 0)
    s, c = np.sin(AXIAL * z), np.cos(AXIAL * z)
    potential = np.stack([slope * s, -over_r * s, AXIAL * jv(harmonic, WAVE * r) * c])
    curl = np.stack([over_r * c, -slope * c, 0 * r]) * (harmonic > 0)
    lam, mu = SOFT.lame
    return potential + curl, (WAVE**2 + AXIAL**2) * ((lam + 2 * mu) * potential + mu * curl)


def manufactured_error(kind, order, harmonic, inner, n):
    """Return the relative L2 error; the outline has the exact displacement, and the axis is inside the body."""
    mesh = rectangle(inner, inner + 1, 0.3, 1.3, (n, n), kind)
    model = assemble_axisymmetric(mesh, SOFT, harmonic=harmonic, fixed=(), ports={}, order=order)
    u, force = manufactured(model.dofs.points, harmonic)
    u, force = model.dofs.turned.T @ u.T.ravel(), model.dofs.turned.T @ force.T.ravel()
    r, _, z = model.dofs.points[:, model.dofs.free // 3]
    outline = np.isclose(r, inner + 1) | np.isclose(z, 0.3) | np.isclose(z, 1.3) | (np.isclose(r, inner) & (inner > 0))
    ours = np.where(outline, u, 0.0)
    ours[~outline] = spsolve(model.K[~outline][:, ~outline].tocsc(), (model.M @ force - model.K @ ours)[~outline])
    return math.sqrt((ours - u) @ model.M @ (ours - u) / (u @ model.M @ u))


@pytest.mark.parametrize("inner", [0.0, 0.5])
@pytest.mark.parametrize("harmonic", [0, 1, 2, 5])
@pytest.mark.parametrize(("kind", "order"), [(k, p) for k in (skfem.MeshTri, skfem.MeshQuad) for p in (1, 2)])
def test_manufactured_solutions_converge_at_full_order(kind, order, harmonic, inner):
    """Nodal errors converge at least as fast as the interpolation's order p + 1."""
    errors = [manufactured_error(kind, order, harmonic, inner, n) for n in (8, 16)]
    assert math.log2(errors[0] / errors[1]) > order + 1 - 0.2
    assert errors[-1] < (0.02 if order == 1 else 5e-4)
