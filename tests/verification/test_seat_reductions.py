"""Reductions agree pairwise within their stated errors on seats of four kinds; modes by scikit-fem alone agree."""

import itertools
from functools import cache

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import eigsh
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.supports import Absorbing
from seatfem.structures.model import Material
from seatfem.structures.shapes import AnnularSeat, ConicalSeat, ValvePlate
from tests.solids import MeshSpec, assemble, greens_function, make_meridian, make_mesh, solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
TOLERANCE = 3e-2


@cache
def annular_mesh():
    seat = AnnularSeat(bore_radius=2e-3, lip_width=1e-3, outer_radius=5e-3, thickness=3e-3)
    return make_mesh(seat, MeshSpec(size=2e-3, contact_size=1.2e-3)).mesh


def annular(rayleigh=(0.0, 0.0)):
    return assemble(annular_mesh(), STEEL, rayleigh=rayleigh)


def block(**options):
    """Return two patches, on hexahedra with a nodal mass; nothing is symmetric."""
    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 12e-3, 6), np.linspace(0, 11e-3, 5), np.linspace(0, 5e-3, 4))
    mesh = mesh.with_boundaries(
        {
            "fixed": lambda x: x[2] < 1e-9,
            "side": lambda x: x[0] < 1e-9,
            "left": lambda x: (x[2] > 5e-3 - 1e-9) & (x[0] < 4.9e-3) & (x[1] < 8.3e-3),
            "right": lambda x: (x[2] > 5e-3 - 1e-9) & (x[0] > 7.1e-3),
        }
    )
    return assemble(mesh, STEEL, order=2, mass="nodal", ports={"left": "left", "right": "right"}, **options)


@cache
def conical():
    """Return an axisymmetric model of triangles."""
    return assemble_axisymmetric(make_meridian(ConicalSeat(), MeshSpec(size=2e-3, contact_size=0.7e-3)), STEEL)


def plate():
    """Return lands of two ports in a rectangular plate, tetrahedra."""
    geometry = ValvePlate(ports=2, layout="row", port_radius=2e-3, pitch=7e-3, margin=3e-3, thickness=3e-3)
    mesh = make_mesh(geometry, MeshSpec(size=3e-3, contact_size=1.5e-3)).mesh
    return assemble(mesh, STEEL, ports={"first": "land_1", "second": "land_2"})


TOGETHER = ("krylov", "modes", "transient")
SEATS = {
    "annular, Rayleigh": (lambda: annular((2e4, 2e-8)), ("krylov", "transient", "second_order"), 1.5e5, 4e-5),
    "block": (block, TOGETHER, 2e5, 2e-5),
    "free block": (lambda: block(fixed=()), TOGETHER, 2e5, 2e-5),
    "absorbing block": (lambda: block(supports=(Absorbing("side"),)), ("transient", "second_order"), 2e5, 2e-5),
    "conical": (conical, TOGETHER, 2e5, 4e-5),
    "plate": (plate, TOGETHER, 6e4, 4e-5),
}


@pytest.mark.slow
@pytest.mark.parametrize("seat", SEATS)
def test_reductions_agree_within_their_stated_errors(seat):
    make, methods, bandwidth, duration = SEATS[seat]
    model = make()
    t = np.linspace(0, duration, 301)
    response, stated = {}, {}
    for method in methods:
        greens = greens_function(model, bandwidth=bandwidth, duration=duration, tolerance=TOLERANCE, method=method)
        response[method] = greens.filtered_matrix(t, 1 / bandwidth)
        stated[method] = greens.error_estimate.reduction
        assert 0 < stated[method] <= TOLERANCE
        checks = greens.provenance["checks"]
        assert checks["reciprocity"] < 1e-8  # solves to round-off times the condition
        assert checks.get("passive", True)
    scale = np.abs(response[methods[0]]).max()
    for one, other in itertools.combinations(methods, 2):
        assert np.abs(response[one] - response[other]).max() / scale <= stated[one] + stated[other], (one, other)


@pytest.mark.parametrize(("method", "ratio"), [("krylov", 0.5), ("modes", 0.1), ("krylov", 0.0)])
def test_the_first_velocity_is_one_over_rho_c_area(method, ratio):
    """g(0+) is 1/(rho c_p A), times (2/pi) acos(zeta)/sqrt(1 - zeta^2) under modal damping."""
    model = conical()
    greens = greens_function(
        model, bandwidth=2e5, duration=2e-5, tolerance=TOLERANCE, damping_ratio=ratio, method=method
    )
    impedance = 7850.0 * STEEL.c_p * model.ports["contact"].area
    factor = 2 / np.pi * np.arccos(ratio) / np.sqrt(1 - ratio**2)
    assert greens.initial_value()[0, 0] == pytest.approx(factor / impedance, rel=1e-9)


@pytest.mark.slow
def test_modes_equal_scipys_on_scikit_fems_own_matrices():
    """Frequencies are those of skfem's matrices by eigsh, with the same quadrature of orders 4 and 6."""
    mesh = annular_mesh()

    @skfem.BilinearForm
    def mass(u, v, _):
        return STEEL.density * dot(u, v)

    vector = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.Basis(mesh, vector, intorder=4)
    K = skfem.asm(linear_elasticity(*STEEL.lame), basis)
    M = skfem.asm(mass, skfem.Basis(mesh, vector, intorder=6))
    free = basis.complement_dofs(basis.get_dofs("fixed"))
    values = eigsh(K[free][:, free], 8, M[free][:, free], sigma=0.0, return_eigenvectors=False)
    theirs = np.sqrt(np.sort(values)) / (2 * np.pi)
    ours = solve_modes(annular(), 8)
    assert ours.complete
    assert ours.frequencies_hz == pytest.approx(theirs, rel=1e-8)  # both solve to round-off times the condition
