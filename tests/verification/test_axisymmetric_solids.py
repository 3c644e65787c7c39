"""Axisymmetric models against manufactured and closed-form solutions, and Kirchhoff plates."""

import math

import numpy as np
import pytest
import skfem
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve
from scipy.special import jv, spherical_jn

import impact
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import solve_modes

STEEL = Material(200e9, 0.3, 7850.0)


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
    """(u, force), each (3, n) amplitudes of u_r, u_th, u_z."""
    r, _, z = points
    below, above = jv(harmonic - 1, WAVE * r), jv(harmonic + 1, WAVE * r)
    slope, over_r = WAVE / 2 * (below - above), WAVE / 2 * (below + above) * (harmonic > 0)
    s, c = np.sin(AXIAL * z), np.cos(AXIAL * z)
    potential = np.stack([slope * s, -over_r * s, AXIAL * jv(harmonic, WAVE * r) * c])
    curl = np.stack([over_r * c, -slope * c, 0 * r]) * (harmonic > 0)
    lam, mu = SOFT.lame
    return potential + curl, (WAVE**2 + AXIAL**2) * ((lam + 2 * mu) * potential + mu * curl)


def manufactured_error(kind, order, harmonic, inner, n):
    """Relative L2 error; the exact displacement is prescribed on the outline, the axis is inside the body."""
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


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
@pytest.mark.parametrize(
    ("kind", "order", "tolerance"),
    [(skfem.MeshTri, 2, 1e-3), (skfem.MeshQuad, 1, 6e-3), (skfem.MeshQuad, 2, 1e-5)],
)
def test_thick_cylinder_under_pressure(kind, order, tolerance, poisson):
    """Lame, plane strain: u(a) = p a (1 + nu) ((1 - 2 nu) a^2 + b^2)/(E (b^2 - a^2)); also nearly incompressible."""
    a, b = 1.0, 2.0
    solid = Material(200e9, poisson, 7850.0)
    model = assemble_axisymmetric(
        rectangle(a, b, 0, 1, (8, 4), kind),
        solid,
        fixed=(),
        sliding=("top", "bottom"),
        ports={"contact": "inner"},
        order=order,
    )
    b_vector = model.ports["contact"].vector
    per_pressure = b_vector @ spsolve(model.K.tocsc(), b_vector) * model.ports["contact"].area
    exact = a * (1 + poisson) * ((1 - 2 * poisson) * a**2 + b**2) / (solid.young * (b**2 - a**2))
    assert per_pressure == pytest.approx(exact, rel=tolerance)


def test_without_lateral_strain_the_cylinder_is_the_rod():
    """nu = 0: g after the Hann pulse is the closed-form rod's; band five wavelengths long, 40 elements."""
    young, density, radius, length, zeta = 200e9, 7850.0, 1e-3, 20e-3, 0.1
    model = assemble_axisymmetric(
        rectangle(0, radius, 0, length, (1, 40)),
        Material(young, 0.0, density),
        fixed="bottom",
        ports={"contact": "top"},
        order=2,
    )
    width, t = 1 / 500e3, np.linspace(0, 40e-6, 201)
    greens = greens_function(model, bandwidth=1 / width, duration=t[-1], tolerance=1e-3, damping_ratio=zeta)
    rod = impact.fixed_rod(young=young, density=density, area=math.pi * radius**2, length=length, damping_ratio=zeta)
    exact = rod.filtered(t, width)
    assert np.abs(greens.filtered(t, width) - exact).max() < 1e-3 * np.abs(exact).max()
    assert greens.initial_value()[0, 0] == pytest.approx(float(rod.initial_value()[0, 0]), rel=1e-9)


def half_disc(refinements):
    """Meridian of the unit sphere by curved triangles."""
    disc = skfem.MeshTri.init_circle(refinements)
    half = disc.remove_elements(np.flatnonzero(disc.p[0, disc.t].mean(axis=0) < 0))
    points = np.array(half.p)
    points[0, np.abs(points[0]) < 1e-12] = 0.0
    half = skfem.MeshTri(points, half.t)
    mesh = skfem.MeshTri2.from_mesh(half)
    points = np.array(mesh.doflocs)
    edges = half.facets[:, half.boundary_facets()]
    round_edges = np.flatnonzero((np.hypot(*half.p[:, edges].reshape(2, -1)).reshape(2, -1) > 1 - 1e-9).all(axis=0))
    middles = half.nvertices + half.boundary_facets()[round_edges]
    points[:, middles] /= np.hypot(*points[:, middles])
    return skfem.MeshTri2(points, mesh.t)


def sphere_frequencies(harmonic, refinements):
    """omega a/c_s of the free sphere's elastic modes."""
    model = assemble_axisymmetric(half_disc(refinements), STEEL, harmonic=harmonic, fixed=(), ports={})
    found = solve_modes(model, 12).omega
    return found[found > 0] / STEEL.c_s


def test_free_sphere():
    """Lamb 1882: breathing x cot x = 1 - x^2 c_p^2/(4 c_s^2); torsion of degree 2, x j_3(x) = j_2(x).

    A mode of degree l has the same frequency in every harmonic n <= l.
    """
    ratio = STEEL.c_p / STEEL.c_s
    breathing = ratio * brentq(lambda x: x / math.tan(x) - 1 + (x * ratio) ** 2 / 4, 2.0, 3.0)
    assert breathing / ratio == pytest.approx(2.670214733, rel=1e-9)  # tests/literature: sphere_radial_nu0.3
    torsion = brentq(lambda x: x * spherical_jn(3, x) - spherical_jn(2, x), 2.0, 3.0)
    for exact, harmonic in ((breathing, 0), (torsion, 1), (torsion, 2)):
        errors = [np.abs(sphere_frequencies(harmonic, k) - exact).min() / exact for k in (2, 3)]
        assert observed_order(errors) > 3.5  # frequencies converge at twice the order of the strains, 4
        assert errors[-1] < 5e-5
    oblate = sphere_frequencies(0, 3)[0]
    for harmonic in (1, 2):
        assert np.abs(sphere_frequencies(harmonic, 3) - oblate).min() < 2e-5 * oblate


# omega a^2 sqrt(rho h/D), nu = 0.3: Leissa, Vibration of Plates (NASA SP-160), roots of the Bessel determinants
PLATES = {
    "clamped disc": (0.0, "outer", ((0, 10.215826), (1, 21.260398), (2, 34.877035), (3, 51.030035))),
    "free ring": (0.5, (), ((0, 9.313481), (1, 17.198225), (2, 4.271114), (3, 11.42544))),
    "ring clamped at both edges": (0.5, ("inner", "outer"), ((0, 89.250751), (1, 90.230269), (2, 93.3212))),
}


@pytest.mark.parametrize("plate", PLATES)
def test_thin_plates_tend_to_kirchhoffs(plate):
    """Frequencies extrapolated to no thickness by a parabola in h/a: shear and rotary inertia give h^2, edges give h.

    Measured: within 1e-3, most of it the mesh at clamped edges, where stresses are singular.
    """
    inner, fixed, values = PLATES[plate]
    thin = (0.02, 0.01, 0.005)
    for harmonic, exact in values:
        found = [plate_frequency(inner, fixed, harmonic, h, exact) for h in thin]
        limit = float(np.polynomial.Polynomial.fit(thin, found, 2)(0.0))
        assert limit == pytest.approx(exact, rel=2e-3), (harmonic, found)


def plate_frequency(inner, fixed, harmonic, thickness, expected):
    """omega a^2 sqrt(rho h/D) of the first elastic mode."""
    mesh = rectangle(inner, 1.0, -thickness / 2, thickness / 2, (80, 1))
    model = assemble_axisymmetric(mesh, STEEL, harmonic=harmonic, fixed=fixed, ports={}, order=2)
    scale = math.sqrt(STEEL.density * 12 * (1 - 0.3**2) / (STEEL.young * thickness**2))
    omega = solve_modes(model, 4, shift_hz=expected / scale / 6).omega
    return float(omega[omega > 0][0]) * scale
