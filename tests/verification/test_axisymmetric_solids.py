"""Axisymmetric models against manufactured and closed-form solutions, and Kirchhoff plates."""

import math

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import spsolve
from scipy.special import jv

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material


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


def observed_order(errors):
    return math.log2(errors[-2] / errors[-1])


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
    assert observed_order(errors) > order + 1 - 0.2
    assert errors[-1] < (0.02 if order == 1 else 5e-4)
