"""The exact step of a damped oscillator, for any frequency and damping, against the matrix exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from impact.greens import oscillator

OMEGA = [0.0, 1e-8, 1e-4, 0.3, 1.0, 7.0, 40.0]
ZETA = [0.0, 1e-12, 0.03, 0.5, 1 - 1e-9, 1.0, 1 + 1e-9, 1.3, 8.0]


def exact_step(dt: float, omega: float, zeta: float) -> np.ndarray:
    """Return the (2, 3) map of (q, q', f), f constant."""
    generator = np.array([[0.0, 1.0, 0.0], [-(omega**2), -2 * zeta * omega, 1.0], [0.0, 0.0, 0.0]])
    # balanced by max(omega, 1/dt), so that every entry is a number of order one
    scale = np.diag([max(omega, 1.0 / dt), 1.0, 1.0])
    inverse = np.diag(1 / np.diag(scale))
    return (inverse @ expm(scale @ generator @ inverse * dt) @ scale)[:2]


@pytest.mark.parametrize("omega", OMEGA)
@pytest.mark.parametrize("zeta", ZETA)
@pytest.mark.parametrize("dt", [1e-3, 1.0])
def test_transition_is_the_matrix_exponential(omega: float, zeta: float, dt: float) -> None:
    a, b = oscillator.transition(dt, np.array([omega]), np.array([zeta]))
    ours = np.column_stack([a[:, :, 0], b[:, 0]])
    exact = exact_step(dt, omega, zeta)
    # expm loses about norm(A dt) = 2 zeta omega dt <= 640 times round-off, each entry against its row and column scale
    size = np.array([[1.0, dt, dt**2], [1 / dt, 1.0, dt]])
    limit = 1e-13 * (1 + (1 + 2 * zeta) * omega * dt) ** 2 * size
    assert np.all(np.abs(ours - exact) <= limit)


def test_step_response_keeps_its_digits_from_short_to_long() -> None:
    """The response is t^2/2 - w^2 t^4/24 for w t -> 0 and does not jump where the formula changes."""
    t = np.array([1e-9, 1e-6, 1e-3])
    series = t**2 / 2 - t**4 / 24
    np.testing.assert_allclose(oscillator.step_response(t, np.array(1.0), np.array(0.0)), series, rtol=1e-14)
    around = np.array([0.5 - 1e-12, 0.5 + 1e-12])
    low, high = oscillator.step_response(around, np.array(1.0), np.array(0.0))
    assert high == pytest.approx(low, rel=1e-11)


@pytest.mark.parametrize("omega", [0.0, 1e-3, 0.5, 4.0, 300.0])
@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.3, 0.6, 1.0, 3.0])
def test_dissipation_closes_the_energy_balance(omega: float, zeta: float) -> None:
    """E0 + work of f - E1 = D(x, x): D is integrated on its own, E1 comes from the exact step."""
    dt = 0.7
    form = oscillator.dissipation_form(dt, np.array([omega]), np.array([zeta]))[:3, :3, 0]
    np.testing.assert_allclose(form, form.T, atol=1e-14 * (1 + np.abs(form).max()))
    step = exact_step(dt, omega, zeta)
    for q, p, f in np.random.default_rng(3).normal(size=(20, 3)):
        x = np.array([q / max(omega, 1.0), p, f * max(omega, 1.0)])
        q1, p1 = step @ x
        before, after = (x[1] ** 2 + (omega * x[0]) ** 2) / 2, (p1**2 + (omega * q1) ** 2) / 2
        lost = before + x[2] * (q1 - x[0]) - after
        assert x @ form @ x == pytest.approx(lost, abs=1e-11 * (before + after + abs(x[2] * (q1 - x[0]))))
