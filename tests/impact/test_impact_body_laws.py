"""Bodies and contact laws."""

import math

import numpy as np
import pytest

import impact
from impact import (
    Body,
    GreensFunctionError,
    Hertz,
    LinearSpring,
    ModalState,
    Signorini,
)
from impact.march.laws import PASSIVE
from impact.march.loop.forces import contact_force as march_force


def contact_force(code: int, k: float, pen: float, w0: float) -> float:
    """Force of a passive step that starts at no penetration."""
    return float(march_force(code, PASSIVE, k, 0.0, 0.0, None, pen, 0.0, w0, w0, 1.0))


ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Body(impact.fixed_rod(**ROD), velocity=-1.0), "held cannot translate: velocity = -1"),
        (lambda: Body(impact.free_rod(**ROD), velocity=math.inf), "must be finite"),
        (lambda: impact.rigid_mass(mass=0.0, velocity=-1.0), "mass = 0 kg"),
        (
            lambda: Body(impact.single_mode(frequency_hz=1, mass=1), state=ModalState(np.zeros(2), np.zeros(1))),
            "state.displacement must be 1",
        ),
        (
            lambda: Body(impact.single_mode(frequency_hz=1, mass=1), state=ModalState(np.zeros(1), np.full(1, np.nan))),
            "state.velocity must be 1 finite",
        ),
    ],
)
def test_impossible_bodies_are_refused(make: object, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        make()  # type: ignore[operator]


@pytest.mark.parametrize("exponent", range(-30, 31, 3))
@pytest.mark.parametrize("pen", [1e-9, 1.0, 1e6])
def test_hertz_force_is_the_root_over_sixty_decades(exponent: int, pen: float) -> None:
    """d^2 + k w0 d^3 = pen with N = k d^3: every term positive, so that the sum shows the relative error."""
    k, w0 = 10.0 ** (exponent / 2) * 7.0, 10.0 ** (exponent / 2) / 3.0
    force = contact_force(Hertz.code, k, pen, w0)
    assert force > 0
    assert (force / k) ** (2 / 3) + w0 * force == pytest.approx(pen, rel=1e-14)


@pytest.mark.parametrize("law", [Signorini(), LinearSpring(stiffness=50.0), Hertz(stiffness=50.0)])
def test_force_is_the_law_at_the_end_of_the_step_and_never_pulls(law: impact.Law) -> None:
    w0, k = 0.3, law.parameters[0]
    assert contact_force(law.code, k, -1.0, w0) == contact_force(law.code, k, 0.0, w0) == 0.0
    pen = np.linspace(1e-6, 3.0, 50)
    force = np.array([contact_force(law.code, k, float(p), w0) for p in pen])
    end = pen - w0 * force
    if isinstance(law, Signorini):
        np.testing.assert_allclose(end, 0.0, atol=1e-14)
    else:
        power = 1.0 if isinstance(law, LinearSpring) else 1.5
        np.testing.assert_allclose(force, k * end**power, rtol=1e-12)
    assert np.all(np.diff(force) > 0)


@pytest.mark.parametrize("law", [LinearSpring(stiffness=50.0), Hertz(stiffness=50.0)])
def test_potential_is_the_work_of_the_law(law: LinearSpring | Hertz) -> None:
    pen = np.linspace(0.0, 2.0, 20001)
    power = 1.0 if isinstance(law, LinearSpring) else 1.5
    work = np.trapezoid(50.0 * pen**power, pen)
    assert law.potential(np.array([2.0]))[0] == pytest.approx(work, rel=1e-7)
    assert law.potential(np.array([-2.0]))[0] == 0.0
