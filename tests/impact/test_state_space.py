"""Green's functions as state space and as arrays of receptance, and back."""

import numpy as np
import pytest
from scipy import linalg

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from impact.greens.poles import PoleGreens

TIMES = np.array([0.0, 1e-4, 7e-4, 3e-3])


def oscillators() -> ModalGreens:
    """Two ports: a rigid motion, one overdamped mode, one hardly damped, a relaxation and a bare compliance."""
    rest = Residual(np.array([[0.2, 0.1]]), np.array([4e3]), np.array([[2e-6, 1e-6], [1e-6, 3e-6]]))
    omega, zeta = np.array([0.0, 2e3, 5e3]), np.array([0.0, 1.5, 0.01])
    return ModalGreens(omega, zeta, np.array([[1.0, 1.0], [0.5, -0.7], [-0.3, 0.9]]), rest, ("a", "b"))


def poles() -> PoleGreens:
    """The same of complex shapes, with real poles and a rigid motion."""
    return PoleGreens(
        np.array([-50 + 2e3j, -80 + 6e3j]),
        np.array([[0.02 - 0.02j, 0.01 + 0.005j], [0.005 - 0.01j, 0.01 - 0.012j]]),
        np.array([3e3, 5e3]),
        np.array([[0.1, 0.05], [0.02, 0.03]]),
        np.array([1.0, -1.0]),
        np.array([[1.0, 0.5]]),
        np.array([[1e-6, 0.0], [0.0, 2e-6]]),
        ("a", "b"),
    )


@pytest.mark.parametrize("greens", [oscillators(), poles()], ids=["oscillators", "poles"])
def test_the_state_space_is_g(greens: GreensFunction) -> None:
    space = impact.state_space(greens)
    assert space.ports == ("a", "b")
    assert len(space.states) == len(space.A)
    for i in (0, 1):
        for j in (0, 1):
            found = [space.C[i] @ linalg.expm(space.A * t) @ space.B[:, j] for t in TIMES]
            exact = greens.impulse_response(TIMES, i, j)
            np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(space.D, greens.transfer(np.array([1e12 + 0j]))[0].real.round(12))


def test_a_rod_has_no_state_space() -> None:
    rod = impact.fixed_rod(young=2e11, density=7850.0, length=0.1, area=1e-4)
    with pytest.raises(impact.GreensFunctionError, match="no finite sum of poles"):
        impact.state_space(rod)


def test_receptance_arrays_and_back() -> None:
    """Frequency, response, reference; and poles fitted to them."""
    shapes = np.array([[0.5, -0.7], [-0.3, 0.9]])
    greens = ModalGreens(np.array([2e3, 5e3]), np.array([0.02, 0.01]), shapes, Residual.none(2), ("a", "b"))
    f = np.linspace(5.0, 1500.0, 300)
    array = impact.receptance(greens, f)
    assert array.shape == (300, 2, 2)
    assert impact.receptance(greens, f[0]).shape == (2, 2)
    w, response, reference = 2 * np.pi * f, 1, 0
    denominators = greens.omega**2 - w[:, None] ** 2 + 2j * greens.zeta * greens.omega * w[:, None]
    np.testing.assert_allclose(array[:, response, reference], (shapes[:, 1] * shapes[:, 0] / denominators).sum(axis=1))
    np.testing.assert_array_equal(array[:, 1, 0], impact.receptance(greens, f, 1, 0))
    back = impact.fit_poles(impact.FrequencyResponse(f, array, ("a", "b")))
    np.testing.assert_allclose(impact.receptance(back, f), array, atol=1e-6 * np.abs(array).max())
