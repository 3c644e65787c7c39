"""The displacement of a body without its energies is that of the motion with them."""

import numpy as np
import pytest

from impact import Body, ModalGreens, Residual
from impact.exact.damped_rods import BareFixedRod
from impact.march.motion import Discrete
from impact.march.replay import port_displacement

DT, STEPS = 2e-6, 3000


def seat(residual: Residual) -> ModalGreens:
    rng = np.random.default_rng(3)
    omega = np.sort(rng.uniform(6e3, 5e5, 25))
    zeta = np.where(np.arange(25) % 5 == 0, 1.4, 0.02)  # some above critical damping
    return ModalGreens(omega, zeta, rng.normal(size=(25, 1)), residual)


@pytest.mark.parametrize(
    "residual",
    [Residual.none(), Residual.spring(3e-9), Residual.exponential(np.array([[3e-9]]), np.array([[2e-2]]))],
)
def test_displacement_of_poles(residual: Residual) -> None:
    body = Discrete.of(Body(seat(residual)), DT, STEPS)
    force = np.maximum(np.random.default_rng(5).normal(size=STEPS).cumsum(), 0.0)
    expected = body.motion(force[None]).displacement[0]
    # two orders of the same sums over 3,000 steps
    np.testing.assert_allclose(port_displacement(body, force), expected, atol=1e-12 * np.abs(expected).max())


def test_displacement_of_weights() -> None:
    rod = BareFixedRod(impedance=6.0, transit=1.0, damping_ratio=0.02)
    body = Discrete.of(Body(rod), 0.01, STEPS)
    assert body.kernel.modal is None
    force = np.sin(0.01 * np.arange(STEPS)) ** 2
    expected = body.motion(force[None]).displacement[0]
    np.testing.assert_allclose(port_displacement(body, force), expected, rtol=0, atol=1e-14 * np.abs(expected).max())
