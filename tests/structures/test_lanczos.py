"""Lanczos-Gauss against all modes of the same lumped matrices; its window, its brackets, its refusals."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import skfem

from impact.exact.closed_form import fixed_rod
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.method import Aims
from seatfem.structures.model import Damping, ModelError
from seatfem.structures.reduction.eigen_search import rigid_shapes
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.lanczos import Lanczos
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.reducer import truncate
from tests.rod_model import rod_model

STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0}
BOUNDARIES = {
    "fixed": lambda x: x[2] < 1e-9,
    "left": lambda x: (x[2] > 4e-3 - 1e-9) & (x[0] < 5.9e-3),
    "right": lambda x: (x[2] > 4e-3 - 1e-9) & (x[0] > 6.1e-3),
}


def block(**options):
    """Steel block of quadratic hexahedra with two patches, about 800 unknowns, nodal mass."""
    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 12e-3, 5), np.linspace(0, 11e-3, 4), np.linspace(0, 4e-3, 3))
    ports = {"left": "left", "right": "right"}
    return assemble(mesh.with_boundaries(BOUNDARIES), STEEL, ports=ports, order=2, mass="nodal", **options)


@pytest.fixture(scope="module")
def model():
    return block()


def every_mode(model, damping):
    values, shapes = scipy.linalg.eigh(model.K.toarray(), model.M.toarray())
    omega = np.sqrt(np.maximum(values, 0.0))
    omega[: rigid_shapes(model).shape[1]] = 0.0
    p = len(model.ports)
    zeta = damping.ratios(omega)
    return truncate(omega, zeta, shapes.T @ model.port_matrix, np.inf, np.zeros((p, p)), model, damping)


@pytest.mark.parametrize("elements", [16, 32])
def test_the_rod_of_line_elements_follows_the_closed_form(elements):
    # of 32 unknowns too: the window asks for 157 steps, and orthogonality is lost long before there are 32
    steel = {"young": 200e9, "density": 7850.0, "area": 1e-4, "length": 30e-3}
    bandwidth, duration = 2e5, 3e-5
    t = np.linspace(0, duration, 301)
    model, aims = rod_model(**steel, elements=elements), {"bandwidth": bandwidth, "duration": duration}
    greens = greens_function(model, **aims, tolerance=2e-3, method="lanczos")
    exact, stated = fixed_rod(**steel).filtered(t, 1 / bandwidth), greens.error_estimate.reduction
    krylov = greens_function(model, **aims, tolerance=1e-4, method="krylov").filtered(t, 1 / bandwidth)
    found, largest = greens.filtered(t, 1 / bandwidth), np.abs(exact).max()
    assert np.abs(found - krylov).max() < (stated + 1e-4) * largest
    elements_leave = 2e-4 if elements == 32 else 3e-3  # fourth order
    assert np.abs(found - exact).max() < (stated + elements_leave) * largest  # three per cent in E are 1.5 % of g


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_the_error_is_below_its_estimate(model, ratio, tolerance):
    bandwidth, duration = 3e5, 4e-5
    greens = Lanczos().reduce(model, Damping(ratio), Aims(bandwidth, duration, tolerance)).greens
    t = np.linspace(0, duration, 1201)
    exact = every_mode(model, Damping(ratio)).filtered_matrix(t, 1 / bandwidth)
    error = np.abs(greens.filtered_matrix(t, 1 / bandwidth) - exact).max() / np.abs(exact).max()
    stated = greens.error_estimate.reduction
    assert error <= 1.02 * stated  # the measuring points miss the largest value by two per cent
    assert stated <= min(tolerance, 20 * error)  # once the window is covered the error falls at once, by any factor


@pytest.mark.parametrize("method", ["lanczos", "krylov", "modes"])
def test_a_free_block_keeps_its_rigid_part_exactly(method):
    free = block(fixed=())
    rigid = rigid_shapes(free)
    assert rigid.shape[1] == 6
    # six translations and rotations: total mass in the first moments, no energy
    assert np.abs(free.K @ rigid).max() < 1e-9 * np.abs(free.K).max() * np.abs(rigid).max()
    greens = greens_function(free, bandwidth=1.5e5, duration=3e-5, tolerance=3e-2, method=method)
    loose = greens.shapes[greens.omega == 0]
    assert np.sum(greens.omega == 0) == 6
    part = rigid.T @ free.port_matrix
    assert loose.T @ loose == pytest.approx(part.T @ part, rel=1e-12)
    # a push on both patches with equal pressure lifts the block and turns it about y: 1/m + (arm)^2/I by hand
    mass = 7850.0 * 12e-3 * 11e-3 * 4e-3
    inertia = mass / 12 * (np.array([11e-3, 12e-3, 0]) ** 2 + np.array([4e-3, 4e-3, 0]) ** 2)
    arm = 3e-3
    assert (loose.T @ loose)[0, 0] == pytest.approx(1 / mass + arm**2 / inertia[1], rel=1e-9)


def test_auto_takes_lanczos_for_short_windows_and_krylov_for_long_ones(model):
    short = greens_function(model, bandwidth=3e5, duration=1e-5, tolerance=2e-2)
    assert short.provenance["method"] == "lanczos"
    effort = Lanczos().cost(model, Aims(3e5, 1e-5, 2e-2)).effort
    assert f"unknowns: {effort}, about" in short.provenance["reason"]
    assert short.provenance["products"] < 1.3 * int(effort.split()[0])
    long = greens_function(model, bandwidth=3e5, duration=1e-3, tolerance=2e-2, damping_ratio=0.1)
    assert long.provenance["method"] == "krylov"
    assert re.search(r"one factorization .* s predicted;.* lanczos \S+ s;", long.provenance["reason"])
    checks = short.provenance["checks"]
    assert checks["passive"]
    assert checks["reciprocity"] < 1e-12


def test_refusals(model):
    indefinite_mass = replace(model, M=model.M - model.K * (2 * model.M.max() / model.K.max()) + 4 * model.M)
    with pytest.raises(ModelError, match=r"elements:.*positive"):
        greens_function(indefinite_mass, bandwidth=3e5, duration=1e-5, tolerance=1e-2, method="lanczos")
    with pytest.raises(ConvergenceError, match=r"40 Lanczos .*\d+.*method='krylov'"):
        Lanczos(most=40).reduce(model, Damping(), Aims(3e5, 1e-3, 1e-2))
    regional = replace(model, loss=model.K.multiply(0.02) + model.M * 1e11)
    with pytest.raises(ModelError, match=r"factors.*differ"):
        greens_function(regional, bandwidth=3e5, duration=1e-5, tolerance=1e-2, method="lanczos")
    indefinite = replace(model, K=model.K - (2 * np.pi * 2e5) ** 2 * model.M)
    with pytest.raises(ModelError, match="K is indefinite"):
        Lanczos().reduce(indefinite, Damping(), Aims(3e5, 2e-5, 1e-2))
