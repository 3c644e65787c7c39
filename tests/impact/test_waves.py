"""Waves in rods: that come along one, that a chain passes on, and that gauges see; all against d'Alembert."""

import math

import numpy as np
import pytest

import impact
from impact import Body, ContactProblem
from impact.bodies.time_series import TimeSeriesError

YOUNG, DENSITY, AREA = 206e9, 7810.0, 3.14e-4
ROD = {"young": YOUNG, "density": DENSITY, "area": AREA}
SPEED = math.sqrt(YOUNG / DENSITY)
STRAIN = -8e-4


def wave(rise: float, lasts: float, recorded_at: float = 0.0) -> impact.IncomingWave:
    times, values = np.array([0.0, rise, lasts, lasts + rise]), STRAIN * np.array([0.0, 1.0, 1.0, 0.0])
    return impact.IncomingWave(impact.TimeSeries(times, values, "zero"), SPEED, recorded_at)


def passed_on(law: impact.Law, coming: impact.IncomingWave, dt: float, ratio: float = 1.0) -> impact.ImpactResult:
    """Run a wave through a joint into a bar of ``ratio`` times the area."""
    first = Body(impact.semi_infinite_rod(**ROD), base=coming.outwards)
    second = Body(impact.semi_infinite_rod(**{**ROD, "area": ratio * AREA}))
    return impact.solve(ContactProblem(second, first, law=law), dt=dt, duration=1.2e-4)


def test_the_free_end_moves_by_twice_the_wave() -> None:
    """The end moves by -2 c times the strain's integral, late by its way; an earlier wave is refused."""
    coming = wave(1e-5, 5e-5, recorded_at=0.1)
    late = 0.1 / SPEED
    time = late + np.array([-1e-6, 5e-6, 3e-5, 5.5e-5, 1.0])
    whole = 5e-5
    moved = -2 * SPEED * STRAIN * np.array([0.0, 1.25e-6, 2.5e-5, whole - 1.25e-6, whole])
    np.testing.assert_allclose(coming.outwards(time), moved, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(coming.strain_at(time[2:3], 0.0), 0.0, atol=1e-18)  # free
    there = coming.strain_at(np.array([2.5e-5]), 0.1)
    np.testing.assert_allclose(there, STRAIN, rtol=1e-12)
    early = impact.TimeSeries(np.array([-2e-5, 2e-5]), np.array([STRAIN, STRAIN]), "zero")
    with pytest.raises(TimeSeriesError, match="by t = 0 the wave has moved"):
        impact.IncomingWave(early, SPEED)


@pytest.mark.parametrize("slip", [1.0, 1.03])
@pytest.mark.parametrize("ratio", [0.25, 1.0, 3.0])
def test_a_bar_of_other_impedance_is_given_its_share(ratio: float, slip: float) -> None:
    """The bar takes 2 Z_2/(Z_1 + Z_2) of the force, and (Z_1 - Z_2)/(Z_1 + Z_2) of the strain comes back."""
    coming = wave(1e-5, 8e-5)
    result = passed_on(impact.Signorini(), coming, 1e-6, ratio)
    plateau = (result.time > 2e-5) & (result.time < 7e-5)
    expected = 2 * ratio / (1 + ratio) * YOUNG * AREA * -STRAIN * slip
    agrees = np.allclose(result.force[plateau], expected, rtol=1e-9)
    assert agrees == (slip == 1.0)
    at = 0.05
    borne = impact.axial_force(result.force, result.dt, lambda t: (t >= at / SPEED).astype(float))
    middle = result.time - result.dt / 2
    seen = coming.strain_at(middle, at) - borne / (YOUNG * AREA)
    back = (middle > 3.5e-5) & (middle < 7e-5)
    np.testing.assert_allclose(seen[back], STRAIN + STRAIN * (ratio - 1) / (1 + ratio), rtol=1e-9)


def test_both_ends_of_a_rod_are_its_sum_of_modes() -> None:
    """S_ij = t^2/(2m) + (2/m) sum (+-1)^n (1 - cos w_n t)/w_n^2, w_n = n pi c/l; 20,000 of them leave out 1e-5."""
    rod = impact.rod_of_two_ends(**ROD, length=0.4)
    mass, time = DENSITY * AREA * 0.4, np.linspace(0.0, 4e-4, 41)
    assert rod.mass() == pytest.approx(mass, rel=1e-14)
    n = np.arange(1, 20_001)
    omega = n * math.pi * SPEED / 0.4
    terms = (1 - np.cos(omega[:, None] * time)) / omega[:, None] ** 2
    for j, signs in ((0, np.ones(len(n))), (1, (-1.0) ** n)):
        exact = time**2 / (2 * mass) + 2 / mass * signs @ terms
        np.testing.assert_allclose(rod.step_response(time, 0, j), exact, atol=1e-5 * exact.max())
        rates = np.diff(rod.step_response(np.array([1.0e-4, 1.0e-4 + 1e-9]), 0, j)) / 1e-9
        np.testing.assert_allclose(rod.impulse_response(np.array([1.0e-4]), 0, j), rates, rtol=1e-5)
