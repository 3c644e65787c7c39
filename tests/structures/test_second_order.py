"""Coupled damping: the quadratic pencil against closed forms, second-order Krylov vectors against time stepping."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import skfem
from scipy import sparse

from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.second_order import Coupled, SecondOrderKrylov, poles
from tests.rod_model import rod_model
from tests.solids import Aims, Material, ModelError, Port, SecondOrderModel, assemble, greens_function

ROD = {"young": 200e9, "density": 7850.0, "area": 1e-4, "length": 30e-3}
C0, Z = np.sqrt(200e9 / 7850.0), 1e-4 * np.sqrt(200e9 * 7850.0)
STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0}


def test_coupled_damping_is_the_matrix_exponential():
    rng = np.random.default_rng(1)
    omega = np.array([0.0, 0.0, 1.0, 1.5, 4.0])
    half = rng.standard_normal((5, 3))
    half[0] = 0.0  # one undamped rigid body, one damped
    C, ports = half @ half.T * 0.3, rng.standard_normal((5, 2))
    greens = poles(Coupled(omega, C, ports), ("a", "b"))
    assert greens.rigid == pytest.approx(np.sign(greens.rigid[0, 0] * ports[0, 0]) * ports[:1], rel=1e-12)
    assert np.sum(greens.rates == 0) == 1
    first = np.block([[np.zeros((5, 5)), np.eye(5)], [-np.diag(omega**2), -C]])
    for t in (0.3, 2.0, 11.0):
        exact = ports.T @ scipy.linalg.expm(first * t)[:5, 5:] @ ports
        response = [[float(greens.impulse_response(t, i, j)) for j in range(2)] for i in range(2)]
        assert np.array(response) == pytest.approx(exact, abs=1e-11)


@pytest.mark.parametrize("share", [0.1, 1.0, 5.0])
def test_a_rod_on_a_dashpot_is_dalemberts(share):
    """g is, between the echoes of a dashpot share*Z, 1/Z (1 + 2 sum of R^k), R = (1 - share)/(1 + share)."""
    model = rod_model(**ROD, elements=80, fixed_end=False)
    far = np.zeros(model.size)
    far[np.argmax(model.dofs.points[0, model.dofs.free])] = 1.0
    damped = replace(model, C=sparse.csr_array(share * Z * np.outer(far, far)))
    width, trip = 4e-6, 2 * 30e-3 / C0
    greens = greens_function(damped, bandwidth=1 / width, duration=3 * trip, tolerance=1e-2)
    assert greens.provenance["method"] == "second_order"
    reflection = (1 - share) / (1 + share)
    # between echoes g is constant: 1/Z (1 + 2 sum of R^k)
    t = np.array([0.7, 1.7, 2.7]) * trip
    exact = np.cumsum([1.0, 2 * reflection, 2 * reflection**2]) / Z
    # stated error; elements of 0.4 mm add a thousandth at wavelengths of 20 mm
    limit = greens.error_estimate.reduction * max(exact.max(), 1 / Z) + 2e-3 / Z
    assert np.abs(greens.filtered(t, width) - exact).max() <= limit
    assert greens.provenance["checks"]["passive"]


@pytest.mark.slow
def test_loss_factors_by_region_are_the_modal_strain_energy():
    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 12e-3, 3), np.linspace(0, 11e-3, 3), np.linspace(0, 4e-3, 3))
    mesh = mesh.with_boundaries({"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: x[2] > 4e-3 - 1e-9})
    mesh = mesh.with_subdomains({"lossy": lambda x: x[0] < 6e-3, "plain": lambda x: x[0] > 6e-3})
    steel = Material(**STEEL)
    model = assemble(mesh, {"plain": steel, "lossy": replace(steel, loss_factor=0.04)}, order=2)
    assert model.damping.loss is not None
    greens = {
        method: greens_function(model, bandwidth=2e5, duration=3e-5, tolerance=1e-2, method=method)
        for method in ("krylov", "modes", "second_order")
    }
    values, shapes = scipy.linalg.eigh(model.K.toarray(), model.M.toarray())
    zeta = np.einsum("nm,nm->m", shapes, model.loss @ shapes) / (2 * values)
    assert 0.0 < zeta.min() < zeta.max() < 0.02
    assert 0.005 < zeta[:10].mean() < 0.015
    assert greens["modes"].zeta == pytest.approx(zeta[: len(greens["modes"].zeta)], rel=1e-6)
    t = np.linspace(0, 3e-5, 301)
    after = {method: g.filtered(t, 5e-6) for method, g in greens.items()}
    for method in ("krylov", "second_order"):
        allowed = greens[method].error_estimate.reduction + greens["modes"].error_estimate.reduction
        assert np.abs(after[method] - after["modes"]).max() <= allowed * np.abs(after["modes"]).max()
    undamped = greens_function(replace(model, loss=None), bandwidth=2e5, duration=3e-5, tolerance=1e-2, method="modes")
    assert np.abs(undamped.filtered(t, 5e-6) - after["modes"]).max() > 0.02 * np.abs(after["modes"]).max()


def test_a_uniform_loss_factor_is_half_of_it_as_a_ratio_and_ratios_add():
    model = rod_model(**ROD, elements=20, damping=(0.0, 1e-8))
    lossy = replace(model, loss=0.06 * model.K)
    damping = lossy.damping.plus(0.01)
    assert damping.ratio == pytest.approx(0.04, rel=1e-12)
    assert damping.ratios(np.array([0.0, 1e6])) == pytest.approx([0.04, 0.045], rel=1e-12)
    with pytest.raises(ModelError, match=r"frequency .*stepped"):
        greens_function(lossy, bandwidth=1e5, duration=1e-5, tolerance=1e-2, method="transient")


def test_refusals():
    model = rod_model(**ROD, elements=200)
    feeding = replace(model, C=sparse.diags_array(-np.arange(model.size, dtype=float)))
    with pytest.raises(ModelError, match="it must not be negative"):
        greens_function(feeding, bandwidth=1e5, duration=1e-5, tolerance=1e-2, method="second_order")
    b = model.port_matrix[:, 0]
    damped = SecondOrderModel(model.M, sparse.csr_array(Z * np.outer(b, b)), model.K, {"contact": Port(b)})
    with pytest.raises(ConvergenceError, match=r"25 second-order.*method='transient'"):
        SecondOrderKrylov().reduce(damped, damped.damping, Aims(1e6, 1e-4, 1e-4, 25))


@pytest.mark.parametrize("name", ["second_order", "krylov"])
@pytest.mark.parametrize("frequencies", [(20e3, 50e3, 150e3, 260e3), (250e3, 300e3)])
def test_a_space_of_all_there_is_is_exact(name: str, frequencies: tuple[float, ...]) -> None:
    """However high the last poles lie above the band, 100 kHz: with an exponential in their place, g would be off by
    0.4 % and 7 %."""
    omega = 2 * np.pi * np.array(frequencies)
    half = 30 * np.random.default_rng(0).standard_normal((len(omega), len(omega)))
    C = half @ half.T + np.diag(0.02 * omega) if name == "second_order" else np.zeros_like(half)
    push = np.linspace(1.0, 2.0, len(omega))
    model = SecondOrderModel(np.eye(len(omega)), C, np.diag(omega**2), {"contact": Port(push, impedance=5.0)})
    greens = greens_function(model, bandwidth=100e3, duration=2e-4, tolerance=1e-6, method=name)
    exact = poles(Coupled(omega, C, push[:, None]), ("contact",))
    t = np.linspace(0.0, 2e-4, 300)
    computed, right = (g.filtered(t, 1e-5) for g in (greens, exact))
    assert greens.error_estimate.reduction <= 1e-6
    assert np.abs(computed - right).max() < 1e-9 * np.abs(right).max()
