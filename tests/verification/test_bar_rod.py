"""A bar meshed by gmsh and solved in 3-D against the 1-D rod: frequencies, echoes, slenderness.

Orders. Quadratic elements have a frequency error h^4 w^4. After a Hann pulse, whose spectrum falls like w^-3, mode w
takes part in g with w^-4, and is wrong by min(1, h^4 w^5 t): all up to w* = (h^4 t)^(-1/5) add h^4 w*^2 and all beyond
w*^-3, both h^(12/5). So the largest error after the pulse falls like h^2.4; its mean square, where modes add
up in squares, like h^(28/5): the rms like h^2.8. (The kinks of the pulse's second derivative travel through the mesh
and spread over t^(1/5) h^(4/5); nothing is wrong elsewhere.)
"""

from functools import cache

import numpy as np
import pytest

import impact
from seatfem.structures.shapes import Bar
from tests.solids import MeshSpec, assemble, greens_function, make_mesh, solve_modes

pytestmark = pytest.mark.slow
E, RHO, LENGTH, WIDTH = 200e9, 7850.0, 40e-3, 8e-3
C0 = np.sqrt(E / RHO)
ROUND_TRIP = 2 * LENGTH / C0
AREA = WIDTH**2
SIZES = (8e-3, 5.2e-3, 3.2e-3, 2.6e-3, 2e-3)


def hann_integral(t: np.ndarray, width: float) -> np.ndarray:
    """Return the integral of p from 0 to t: 0 before, 1 after the pulse."""
    s = np.clip(t / width, 0.0, 1.0)
    return np.asarray(s - np.sin(2 * np.pi * s) / (2 * np.pi))


def echoes(t, width):
    """Return (rho c A) g of the fixed rod after the pulse: d'Alembert's waves, exact."""
    n = int(t.max() / ROUND_TRIP) + 1
    return hann_integral(t, width) + sum(
        2 * (-1) ** k * hann_integral(t - k * ROUND_TRIP, width) for k in range(1, n + 1)
    )


@cache
def bar(size, width=WIDTH):
    return make_mesh(Bar(length=LENGTH, width=width, height=width), MeshSpec(size=size)).mesh


@cache
def model(size):
    """Return a model with nu = 0 and sliding sides: the 1-D rod, exactly."""
    return assemble(bar(size), {"young": E, "poisson": 0.0, "density": RHO}, sliding=("sides_x", "sides_y"))


def fitted_order(errors):
    """Return the slope over all meshes: unstructured ones scatter about it by their luck of shapes."""
    return np.polyfit(np.log([1 / bar(size).t.shape[1] for size in SIZES]) / 3, np.log(errors), 1)[0]


def test_frequencies_converge_at_fourth_order():
    exact = np.array([1, 3, 5]) * C0 / (4 * LENGTH)
    errors = np.array([solve_modes(model(size), 3).frequencies_hz / exact - 1 for size in SIZES])
    assert np.all(errors > 0)  # Rayleigh-Ritz: from above
    assert np.all(np.abs(fitted_order(errors) - 4) < 0.5)
    assert np.all(errors[-1] < (1e-7, 1e-5, 1e-4))


def test_g_after_the_pulse_converges_at_its_order():
    width = ROUND_TRIP
    t = np.linspace(0, 3 * ROUND_TRIP, 1201)
    exact = echoes(t, width) / (RHO * C0 * AREA)
    closed = impact.fixed_rod(young=E, density=RHO, area=AREA, length=LENGTH).filtered(t, width)
    # the general quadrature over the pulse meets kinks where an echo arrives
    assert closed == pytest.approx(exact, abs=1e-5 * exact.max())
    largest, rms = [], []
    for size in SIZES:
        greens = greens_function(
            model(size), bandwidth=1 / width, duration=t[-1], tolerance=5e-5, method="krylov"
        )  # an eighth of the smallest rms error below
        error = (greens.filtered(t, width) - exact) / np.abs(exact).max()
        largest.append(np.abs(error).max())
        rms.append(np.sqrt(np.mean(error**2)))
    assert abs(fitted_order(largest) - 2.4) < 0.4
    assert abs(fitted_order(rms) - 2.8) < 0.4
    assert largest[-1] < 2e-4


def test_what_poissons_ratio_adds_falls_with_slenderness_as_rayleigh_and_love_predict():
    """Poisson's ratio lowers w by (nu k r)^2/2, r^2 = w^2/6 the square of the polar radius of gyration.

    The next term is (k r)^4: the ratio of the measured to the predicted drop tends to 1 at second order in w/l. After
    the pulse the whole difference from the 1-D rod is second order in w/l.
    """
    nu, widths = 0.3, np.array([8e-3, 4e-3, 2e-3])
    k = np.array([1, 3, 5]) * np.pi / (2 * LENGTH)
    t = np.linspace(0, 3 * ROUND_TRIP, 601)
    exact = echoes(t, ROUND_TRIP)
    ratios, differences = [], []
    for width in widths:
        solid = {"young": E, "poisson": nu, "density": RHO}
        body = assemble(bar(0.7 * width, width), solid, fixed=(), sliding="fixed")
        greens = greens_function(
            body, bandwidth=1 / ROUND_TRIP, duration=t[-1], tolerance=5e-4, method="krylov"
        )  # against differences of 8e-4 and more
        # each extensional mode takes part with 2/m; all others hardly move the end
        extensional = greens.omega[greens.shapes[:, 0] ** 2 > 1 / (RHO * width**2 * LENGTH)][:3]
        drop = 1 - extensional / (k * C0)
        ratios.append(drop / ((nu * k) ** 2 * width**2 / 6 / 2))
        response = greens.filtered(t, ROUND_TRIP) * RHO * C0 * width**2
        differences.append(np.abs(response - exact).max())
    off = np.abs(np.array(ratios) - 1)
    assert np.all(off[-1] < (0.002, 0.005, 0.01))
    assert np.all(np.abs(np.log2(off[:-1] / off[1:]) - 2) < 0.3)
    orders = np.log2(np.array(differences[:-1]) / differences[1:])
    assert np.all(np.abs(orders - 2) < 0.3)
    assert differences[-1] < 2e-3
