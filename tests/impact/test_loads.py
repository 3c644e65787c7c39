"""Loads on reeds and moving bases: statics against beam formulas, dynamics against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import impact
from impact.beams.euler_bernoulli import Cantilever, ClampedClamped, RectangularBeam, TipMassCantilever
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.bodies.loads import Gravity, PointForce, Pressure, PressureField, ReedLoad
from impact.bodies.reeds import cantilever_reed, reed
from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual

REED = {"young": 2e11, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}
STUBBY = {**REED, "thickness": 5.08e-3}  # L/h = 5: shear adds 6 % to the tip deflection
L, W = REED["length"], REED["width"]
CANTILEVER = Cantilever(**REED)
EI = CANTILEVER.rigidity


def sag(beam: RectangularBeam, at: float, *loads: ReedLoad, n_modes: int = 60) -> float:
    """Return the static deflection under the loads at t = 0, from the modes alone."""
    body = reed(beam, n_modes=n_modes, contact_at=at, loads=loads)
    force = sum(load.shape * load.amplitude(np.zeros(1))[0] for load in body.loads)
    return float(body.greens.shapes[:, 0] @ (force / body.greens.omega**2))


@pytest.mark.parametrize("beam", [CANTILEVER, ClampedClamped(**REED), TimoshenkoCantilever(**STUBBY)])
def test_pressure_over_a_hole_with_a_profile(beam: RectangularBeam) -> None:
    """The deflection is the static compliance integrated over the hole."""
    hole, at = (0.55 * L, 0.9 * L), 0.8 * L
    exact = W * quad(lambda x: (1 + x / L) * beam.compliance(at, x), *hole, points=[at], epsabs=0, epsrel=1e-10)[0]
    load = Pressure(lambda t: 1.0, between=hole, profile=lambda x: 1 + x / L)
    assert sag(beam, at, load) == pytest.approx(exact, rel=1e-4)  # a load that ends sharply: modal tail n^-4


@pytest.mark.parametrize(
    ("beam", "tip_mass"), [(CANTILEVER, 0.0), (TipMassCantilever(**REED, tip_mass=4e-4), 4e-4)], ids=["plain", "mass"]
)
def test_weight(beam: RectangularBeam, tip_mass: float) -> None:
    exact = -9.81 * (beam.mass * L**3 / 8 + tip_mass * L**3 / 3) / EI
    assert sag(beam, L, Gravity(-9.81)) == pytest.approx(exact, rel=1e-6)


def test_point_force() -> None:
    exact = -3.0 * CANTILEVER.compliance(L, 0.4 * L)
    assert sag(CANTILEVER, L, PointForce(lambda t: -3.0, at=0.4 * L)) == pytest.approx(exact, rel=1e-6)


def test_field_of_a_polynomial_is_exact() -> None:
    field = PressureField(lambda x, t: (x / L) ** 3 * (1 + t), between=(0.2 * L, L), points=4)
    plain = Pressure(lambda t: 1 + t, between=(0.2 * L, L), profile=lambda x: (x / L) ** 3)
    modes, t = CANTILEVER.modes(50), np.array([0.0, 2.0])
    ours, exact = (sum(np.outer(p.shape, p.amplitude(t)) for p in f.modal(modes)) for f in (field, plain))
    np.testing.assert_allclose(ours, exact, atol=1e-12 * abs(exact).max())


def flight(load: ReedLoad, *, dt: float, duration: float, zeta: float = 0.0, n_modes: int = 15) -> impact.ImpactResult:
    """Run the reed under a load, its seat out of reach."""
    body = cantilever_reed(**REED, damping_ratio=zeta, n_modes=n_modes, loads=[load])
    seat = impact.Body(impact.spring(stiffness=1e6))
    return impact.solve(impact.ContactProblem(body, seat, gap=1.0), dt=dt, duration=duration)


def test_oscillating_load_is_second_order_in_the_step() -> None:
    """A mode under F cos(w t) tends to F phi (cos w t - cos w1 t)/(w1^2 - w^2) at second order."""
    w1 = CANTILEVER.frequencies(1)[0]
    w, phi, end = 0.6 * w1, CANTILEVER.shapes(1, L)[0], 2e-3
    exact = phi**2 * (np.cos(w * end) - np.cos(w1 * end)) / (w1**2 - w**2)
    errors = []
    for dt in (4e-5, 2e-5, 1e-5):
        result = flight(PointForce(lambda t: np.cos(w * t), at=L), dt=dt, duration=end, n_modes=1)
        errors.append(result.striker_displacement[-1] / exact - 1)
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    np.testing.assert_allclose(orders, 2, atol=0.1)
    assert abs(errors[-1]) < 1e-3


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (PointForce(lambda t: 1.0, at=0.03), "position 0.03 m is outside"),
        (Pressure(lambda t: 1.0, between=(0.02, 0.01)), "0.02.*0.01 m"),
        (Pressure(lambda t: 1.0, between=(0.0, 0.03)), "between 0 and 0.03 m"),
        (Pressure(lambda t: 1.0, profile=lambda x: x * np.nan), "profile must be finite"),
        (PressureField(lambda x, t: x * t, points=0), "points = 0"),
        (Gravity(float("nan")), "acceleration = nan"),
        (PointForce(lambda t: t[:3], at=L), "3,"),
        (PointForce(lambda t: t * np.nan, at=L), "must be finite"),
    ],
)
def test_impossible_loads_are_refused(load: ReedLoad, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        flight(load, dt=1e-5, duration=1e-3)


FAR = impact.spring(stiffness=1e9)
WAY, RATE, OWN, MASS = 1e-3, 300.0, 1000.0, 0.02  # m, rad/s, rad/s, kg
SHAKEN = impact.BaseMotion(lambda t: WAY * np.sin(RATE * t), lambda t: -WAY * RATE**2 * np.sin(RATE * t))
SPRING = ModalGreens(np.array([OWN]), np.zeros(1), np.array([[MASS**-0.5]]), Residual.none())
BEAM = {"young": 206e9, "density": 7800.0, "length": 25e-3, "width": 1e-2, "thickness": 3e-4}


def oscillator(motion: impact.BaseMotion) -> impact.Body:
    load = motion.load(np.array([MASS**-0.5]), MASS)
    return impact.Body(SPRING, loads=(load,), base=motion.displacement)


def place(body: impact.Body, dt: float, duration: float) -> Array:
    """Return the displacement of a body that touches nothing, its base included."""
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
    """The tip swings by 1.5660 a/(2 zeta w_1^2) once it has settled, as w_1(L) int rho A w_1 = 1.5660 for a cantilever
    (its first root is 1.8751)."""
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
    """A rising seat has by Galilei the forces and gap of a falling mass, and energies balance."""
    v, runs = 0.5, []
    for velocity, base in ((-v, None), (0.0, lambda t: v * t)):
        seat = impact.Body(impact.fixed_rod(young=2e11, density=7850.0, area=1e-5, length=2e-2), base=base)
        striker = impact.rigid_mass(mass=1e-3, velocity=velocity)
        problem = impact.ContactProblem(striker, seat, gap=1e-6, law=impact.LinearSpring(1e8))
        runs.append(impact.solve(problem, dt=2e-8, duration=60e-6))
    fell, rose = runs
    size = fell.force.max()
    assert size > 50.0
    np.testing.assert_allclose(rose.force, fell.force, atol=1e-9 * size)
    np.testing.assert_allclose(rose.gap, fell.gap, atol=1e-12)
    assert fell.energy.residual < 1e-9
    assert rose.energy.residual < 1e-9
    assert rose.energy.input[-1] > 0.5 * 1e-3 * v**2
    assert rose.target_displacement[-1] > 0.9 * v * 60e-6
