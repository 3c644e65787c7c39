"""Stress in a struck rod from the contact force."""

import numpy as np
import pytest

import impact
from impact.after.stresses import StressError, rod_stress
from impact.exact.rods import DelayRod

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1
STEPS = 40  # per l/c


def strike(rod: DelayRod, steps: int = STEPS) -> impact.ImpactResult:
    striker = impact.rigid_mass(mass=8.0, velocity=-1.0)
    return impact.solve(impact.ContactProblem(striker, impact.Body(rod)), dt=1 / steps, duration=5.0)


@pytest.mark.parametrize("end", [0.0, 2.0, 6.0, np.inf])
def test_contact_end_carries_the_contact_force(end: float) -> None:
    rod = impact.rod_with_end_impedance(**ROD, end_impedance=end)
    result = strike(rod)
    np.testing.assert_allclose(rod_stress(result, rod, area=3.0, at=0.0), result.force / 3.0, atol=1e-13)


def test_far_ends() -> None:
    free = impact.free_rod(**ROD)
    np.testing.assert_allclose(rod_stress(strike(free), free, area=3.0), 0.0, atol=1e-13)
    fixed = impact.fixed_rod(**ROD)
    result = strike(fixed)
    stress = rod_stress(result, fixed, area=3.0)
    first = slice(STEPS + 1, 3 * STEPS + 1)  # doubled at the wall until the next reflection from the contact
    np.testing.assert_allclose(stress[first], 2 * result.force[1 : 2 * STEPS + 1] / 3.0, rtol=1e-13)


def test_strain_along_the_rod_integrates_to_the_displacement() -> None:
    """u = integral of N/(EA); a front inside one of the cells of length c dt costs at most 2 Z V c dt/(EA)."""
    rod = impact.fixed_rod(**ROD)
    result = strike(rod, 200)
    x = np.linspace(0.0, 1.0, 201)
    stress = np.array([rod_stress(result, rod, area=3.0, at=float(at)) for at in x])
    shortening = np.trapezoid(stress / 4.0, 2.0 * x, axis=0)
    assert shortening.max() > 1.0
    np.testing.assert_allclose(shortening, -result.target_displacement, atol=2 * 6.0 * 2.0 / 200 / 12.0)


@pytest.mark.parametrize(
    ("area", "at", "words"),
    [(3.0, 1.5, "at = 1.5 is off the rod"), (0.0, 1.0, "area = 0"), (3.0, 0.26, r"10.4 steps.*use dt = 0.026")],
)
def test_impossible_stress_is_refused(area: float, at: float, words: str) -> None:
    rod = impact.fixed_rod(**ROD)
    with pytest.raises(StressError, match=words):
        rod_stress(strike(rod), rod, area=area, at=at)
