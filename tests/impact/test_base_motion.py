"""Moving bases against closed forms: an oscillator that is shaken, a beam in resonance, a seat that comes up."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual

FAR = impact.spring(stiffness=1e9)
WAY, RATE, OWN, MASS = 1e-3, 300.0, 1000.0, 0.02  # m, rad/s, rad/s, kg
SHAKEN = impact.BaseMotion(lambda t: WAY * np.sin(RATE * t), lambda t: -WAY * RATE**2 * np.sin(RATE * t))
SPRING = ModalGreens(np.array([OWN]), np.zeros(1), np.array([[MASS**-0.5]]), Residual.none())
BEAM = {"young": 206e9, "density": 7800.0, "length": 25e-3, "width": 1e-2, "thickness": 3e-4}


def oscillator(motion: impact.BaseMotion) -> impact.Body:
    load = motion.load(np.array([MASS**-0.5]), MASS)
    return impact.Body(SPRING, loads=(load,), base=motion.displacement)


def place(body: impact.Body, dt: float, duration: float) -> Array:
    """Of a body that touches nothing, its base included."""
    result = impact.solve(impact.ContactProblem(body, FAR, gap=1.0), dt=dt, duration=duration)
    np.testing.assert_allclose(result.gap, 1.0 + result.striker_displacement, rtol=1e-12)
    return result.striker_displacement


def test_a_shaken_oscillator_follows_its_closed_form() -> None:
    """x'' + w^2 (x - s) = 0, carried along at first: x = A/(1 - r^2) (sin W t - r^3 sin w t), r = W/w; the load is
    constant over each step, of second order."""
    r, off = RATE / OWN, []
    for dt in (4e-5, 2e-5, 1e-5):
        x = place(oscillator(SHAKEN), dt, 0.05)
        t = dt * np.arange(len(x))
        exact = WAY / (1 - r**2) * (np.sin(RATE * t) - r**3 * np.sin(OWN * t))
        off.append(float(np.abs(x - exact).max()) / WAY)
    assert off[0] < 1e-4
    assert np.all(np.log2(np.array(off[:-1]) / off[1:]) > 1.9)


def test_a_clamp_in_resonance_swings_its_beam_as_known() -> None:
    """Of a cantilever: w_1(L) int rho A w_1 = 1.5660 (from its first root 1.8751); the tip swings by 1.5660 a/(2 zeta
    w_1^2) once it has settled."""
    zeta, a = 0.05, 100.0
    first = 1.8751040687**2 * np.sqrt(206e9 * 3e-4**2 / (12 * 7800)) / 25e-3**2
    swinging = impact.BaseMotion(lambda t: -a / first**2 * np.sin(first * t), lambda t: a * np.sin(first * t))
    beam = impact.cantilever_reed(**BEAM, damping_ratio=zeta, n_modes=1, tip_deflection=0.0, loads=[swinging])
    duration = 30 / (zeta * first)
    tip = place(replace(beam, base=swinging.displacement), 2e-6, duration) - swinging.displacement(
        2e-6 * np.arange(int(np.ceil(duration / 2e-6 * (1 - 1e-12))) + 1)
    )
    assert np.abs(tip[-5000:]).max() == pytest.approx(1.5660 * a / (2 * zeta * first**2), rel=1e-3)


def test_a_seat_that_comes_up_is_struck_as_by_what_comes_down() -> None:
    """Galilei: forces and gap of a mass that falls at V, with all energies accounted for."""
    v, found = 0.5, []
    for velocity, base in ((-v, None), (0.0, lambda t: v * t)):
        seat = impact.Body(impact.fixed_rod(young=2e11, density=7850.0, area=1e-5, length=2e-2), base=base)
        striker = impact.rigid_mass(mass=1e-3, velocity=velocity)
        problem = impact.ContactProblem(striker, seat, gap=1e-6, law=impact.LinearSpring(1e8))
        found.append(impact.solve(problem, dt=2e-8, duration=60e-6))
    fell, rose = found
    size = fell.force.max()
    assert size > 50.0
    np.testing.assert_allclose(rose.force, fell.force, atol=1e-9 * size)
    np.testing.assert_allclose(rose.gap, fell.gap, atol=1e-12)
    assert fell.energy.residual < 1e-9
    assert rose.energy.residual < 1e-9
    assert rose.energy.input[-1] > 0.5 * 1e-3 * v**2
    assert rose.target_displacement[-1] > 0.9 * v * 60e-6
