"""The Euler-Bernoulli cantilever against its textbook formulas."""

import numpy as np
import pytest

import impact
from impact import Cantilever, GreensFunctionError

BEAM = Cantilever(young=2e11, density=7850.0, length=25.4e-3, width=10e-3, thickness=0.305e-3)
REED = {"young": 2e11, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}


def test_wave_numbers_solve_their_equation() -> None:
    k = BEAM.wave_numbers(10)
    np.testing.assert_allclose(np.cos(k) + 1 / np.cosh(k), 0.0, atol=1e-13)
    many = BEAM.wave_numbers(2000)
    assert np.all(np.abs(np.diff(many) - np.pi) < 0.33)  # none missed, none twice
    assert many[-1] == pytest.approx((2000 - 0.5) * np.pi, rel=1e-15)


@pytest.mark.parametrize("contact_at", [None, 20e-3])
def test_reed_starts_from_the_static_shape_with_the_exact_stiffness(contact_at: float | None) -> None:
    body = impact.cantilever_reed(**REED, n_modes=30, tip_deflection=1e-3, contact_at=contact_at)
    x = BEAM.length if contact_at is None else contact_at
    assert body.greens.static_compliance()[0, 0] == pytest.approx(BEAM.compliance(x, x), rel=1e-12)
    assert body.state is not None
    assert not np.any(body.state.velocity)
    here = float(body.greens.shapes[:, 0] @ body.state.displacement)
    exact = 1e-3 * BEAM.compliance(x, BEAM.length) / BEAM.compliance(BEAM.length, BEAM.length)
    assert here == pytest.approx(exact, rel=1e-5)  # 30 modes, tail 1/n^3


def test_contact_march_meets_the_free_flight() -> None:
    """First contact of the paper's reed, 653.3246 us and 2.133170 m/s, seen by the march to one step."""
    body = impact.cantilever_reed(**REED, damping_ratio=0.03, n_modes=40, tip_deflection=1e-3)
    seat = impact.Body(impact.spring(stiffness=1e5))
    result = impact.solve(impact.ContactProblem(body, seat), dt=1e-7, duration=0.66e-3)
    first = impact.measures.contact_intervals(result)[0, 0]
    assert first == pytest.approx(653.3246e-6, abs=1.1e-7)
    assert impact.measures.impact_velocity(result) == pytest.approx(2.133170, rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"length": 0.0}, "cantilever length = 0"),
        ({"thickness": -1.0}, "cantilever thickness = -1"),
        ({"n_modes": 0}, "n_modes = 0"),
        ({"damping_ratio": -0.1}, "damping_ratio = -0.1"),
        ({"contact_at": 0.03}, "contact_at = 0.03 m is off the reed"),
        ({"contact_at": 0.0}, "contact_at = 0 m is off the reed"),
    ],
)
def test_impossible_reeds_are_refused(changed: dict[str, float], words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        impact.cantilever_reed(**{**REED, **changed})
