"""Hertz's law less the local compliance that a patch brings: in series with it, it is Hertz's law again."""

import math

import numpy as np
import pytest

import impact
from impact.exact.contact_stress import hertz_impact
from impact.march.loop.forces import law_force, law_potential, patch_secant

STIFFNESS, MASS, SPEED = 2.5e10, 1.0, 3.0
PEAK = hertz_impact(stiffness=STIFFNESS, mass=MASS, speed=SPEED).force
LARGEST = (PEAK / STIFFNESS) ** (1 / 3)  # square root of the indentation at the peak


def law_with(firmness: float, damping: float = 0.0) -> impact.HertzOnPatch:
    """Return a law whose curve is used up to this share of its limit."""
    return impact.HertzOnPatch(STIFFNESS, 2 * firmness / (3 * STIFFNESS * LARGEST), damping)


def struck(law: impact.Law, local: float, dt: float = 2e-8) -> impact.ImpactResult:
    seat = impact.ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), impact.Residual.exponential(local, 1.0))
    striker = impact.rigid_mass(mass=MASS, velocity=-SPEED)
    return impact.solve(impact.ContactProblem(striker, impact.Body(seat), law=law), dt=dt, duration=3e-4)


@pytest.mark.parametrize("firmness", [1e-6, 0.1, 0.5, 0.89, 0.97])
def test_force_and_potential_belong_to_one_another(firmness: float) -> None:
    """The penetration of a force gives it back, and the secant of the potential is its difference."""
    law = law_with(0.5)
    k, d, c = law.parameters
    force = STIFFNESS * (firmness / (1.5 * c * k)) ** 3
    pen = law.closure(force)
    if firmness < 0.9:
        assert pen == pytest.approx((force / k) ** (2 / 3) - c * force, rel=1e-12)
    assert law_force(law.code, k, d, c, None, pen, pen, 1.0) == pytest.approx(force, rel=1e-11)
    near, far = pen * (1 - 1e-5), pen * (1 + 1e-5)
    work = law_potential(law.code, k, d, c, far) - law_potential(law.code, k, d, c, near)
    assert work / (far - near) == pytest.approx(force, rel=1e-6)
    assert patch_secant(k, c, far, near) == pytest.approx(force, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("firmness", [0.05, 0.3, 0.6, 0.85])
def test_in_series_with_the_patch_it_is_hertz(firmness: float) -> None:
    """The patch's relaxation lasts c/g(0+), 1e-5 of the blow at most; a share of the compliance 3 % off is seen."""
    law = law_with(firmness)
    result = struck(law, law.local)
    exact = hertz_impact(stiffness=STIFFNESS, mass=MASS, speed=SPEED)
    assert result.force.max() == pytest.approx(exact.force, rel=2e-4)
    ((start, end),) = impact.measures.contact_intervals(result)
    assert end - start == pytest.approx(exact.duration, rel=2e-3)
    assert result.energy.residual < 1e-9
    off = struck(law, 1.03 * law.local).force.max()
    assert abs(off / exact.force - 1) > 0.01 * firmness


@pytest.mark.slow
@pytest.mark.parametrize("firmness", [0.1, 0.4])
def test_damping_in_series_with_the_patch_is_hunt_and_crossleys(firmness: float) -> None:
    """Restitution of 0.91 agrees to first order in d V; without the patch's part it is 0.02 off."""
    damping = 0.15 / SPEED
    law = law_with(firmness, damping)
    plain = struck(impact.HuntCrossley(STIFFNESS, damping), 1e-15)
    patched = struck(law, law.local)
    assert impact.measures.restitution(plain) == pytest.approx(0.91, abs=0.01)
    assert impact.measures.restitution(patched) == pytest.approx(impact.measures.restitution(plain), abs=2e-3)


def test_it_ends_where_the_patch_is_as_small_as_the_contact() -> None:
    law = law_with(0.5)
    limit = (2 / (3 * law.local)) ** 3 / law.stiffness**2
    assert law.largest == pytest.approx(0.9**3 * limit)
    beyond = [law.closure(share * law.largest) for share in (0.999, 1.0, 1.001, 3.0)]
    assert np.all(np.diff(beyond) > 0)
    assert math.isclose((beyond[2] - beyond[1]) / (beyond[1] - beyond[0]), 1.0, rel_tol=1e-2)
