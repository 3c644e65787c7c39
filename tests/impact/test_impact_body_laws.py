"""Bodies and contact laws."""

import math

import numpy as np
import pytest

import impact
from impact import Body, GreensFunctionError, Hertz, ModalState
from impact.march.laws import PASSIVE
from impact.march.loop.forces import contact_force as march_force


def contact_force(code: int, k: float, pen: float, w0: float) -> float:
    """Return the force of a passive step that starts at no penetration."""
    return float(march_force(code, PASSIVE, k, 0.0, 0.0, None, pen, 0.0, w0, w0, 1.0))


ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Body(impact.fixed_rod(**ROD), velocity=-1.0), "translate: velocity = -1"),
        (lambda: Body(impact.free_rod(**ROD), velocity=math.inf), "must be finite"),
        (lambda: impact.rigid_mass(mass=0.0, velocity=-1.0), "mass = 0 kg"),
        (
            lambda: Body(impact.single_mode(frequency_hz=1, mass=1), state=ModalState(np.zeros(2), np.zeros(1))),
            "state.displacement must be 1",
        ),
        (
            lambda: Body(impact.single_mode(frequency_hz=1, mass=1), state=ModalState(np.zeros(1), np.full(1, np.nan))),
            "state.velocity.*1 finite",
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
