"""Closed-form Green's functions against sums, integrals and each other; waves in rods against d'Alembert."""

import math

import numpy as np
import pytest

import impact
from impact.bodies.time_series import TimeSeriesError
from impact.exact.closed_form import DampedFreeRod, PowerGreens, damped_start

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1


def test_damped_start_is_smooth_through_critical_damping() -> None:
    assert damped_start(0.0) == pytest.approx(1.0)
    assert damped_start(0.1) == pytest.approx(0.940948, abs=5e-7)
    around = [damped_start(1 + d) for d in (-1e-5, 0.0, 1e-5)]
    assert around[1] == pytest.approx((around[0] + around[2]) / 2, rel=1e-8)
    with pytest.raises(impact.GreensFunctionError, match="must be >= 0"):
        damped_start(-0.1)


@pytest.mark.parametrize(("zeta", "dt"), [(0.1, 0.01), (0.1, 0.5), (0.7, 0.05), (1.5, 0.02)])
def test_kernel_of_the_damped_rod_is_exact_at_its_step(zeta: float, dt: float) -> None:
    """Modes that outlive a step, and a spring for the rest, have the closed form's weights."""
    rod = impact.fixed_rod(**ROD, damping_ratio=zeta)
    kernel = rod.step_kernel(dt, 200)
    assert kernel.weights is None
    t = dt * np.arange(1, 201)
    exact, ours = np.diff(rod.step_response(t)), np.diff(kernel.modal.step_response(t))
    # differences of S, known to about 1e-14 of its largest value 1/6 on either side
    np.testing.assert_allclose(ours, exact, atol=1e-13)
    assert kernel.self_weight(dt)[0, 0] == pytest.approx(float(rod.step_response(dt)), abs=1e-13)


@pytest.mark.parametrize("zeta", [0.02, 0.1, 0.6, 1.0, 1.4])
def test_damped_free_rod_is_the_sum_of_its_modes(zeta: float) -> None:
    rod = impact.free_rod(**ROD, damping_ratio=zeta)
    assert isinstance(rod, DampedFreeRod)
    mass, n = 6.0, 20_000  # Z l/c
    omega = np.arange(n + 1) * np.pi
    shapes = np.sqrt(np.where(omega > 0, 2.0, 1.0) / mass)[:, None]
    tail = 2 / mass * (1 / 6 - math.fsum(1 / omega[1:] ** 2))
    modes = impact.ModalGreens(omega, np.where(omega > 0, zeta, 0.0), shapes, impact.Residual.spring(tail))
    t = np.array([0.05, 0.3, 1.0, 2.0, 3.3, 11.0])
    limit = 2e-7 if zeta == 1.0 else 1e-11  # as for the fixed rod
    np.testing.assert_allclose(rod.impulse_response(t), modes.impulse_response(t), atol=limit)
    np.testing.assert_allclose(rod.step_response(t), modes.step_response(t), atol=limit)
    assert float(rod.impulse_response(1e-9)) == pytest.approx(rod.initial_value()[0, 0], rel=1e-6)
    assert impact.Body(rod, velocity=-1.0).mass == mass


def test_damped_free_rods_collide_and_lose_energy() -> None:
    """Momentum is exact; the undamped pair of Saint-Venant is the limit."""
    spent = []
    for zeta in (0.0, 1e-4, 0.1):
        rod = impact.free_rod(**ROD, damping_ratio=zeta)
        problem = impact.ContactProblem(impact.Body(rod, velocity=-1.0), impact.Body(rod))
        result = impact.solve(problem, dt=0.01, duration=6.0)
        spent.append(impact.measures.restitution(result))
        assert result.energy.residual < 1e-12
        assert result.energy.input[0] == pytest.approx(3.0)  # m V^2/2, also of a rod known by its weights
    assert spent[0] == pytest.approx(1.0, abs=1e-9)
    assert spent[1] == pytest.approx(1.0, abs=5e-3)
    assert 0.5 < spent[2] < 0.95


def test_rod_limits() -> None:
    fixed, free = impact.fixed_rod(**ROD), impact.free_rod(**ROD)
    matched = impact.rod_with_end_impedance(**ROD, end_impedance=6.0)
    t = np.array([0.0, 1.0, 1.999, 2.0, 3.9, 4.0])
    np.testing.assert_allclose(fixed.impulse_response(t), np.array([1, 1, 1, -1, -1, 1]) / 6)
    np.testing.assert_allclose(free.impulse_response(t), np.array([1, 1, 1, 3, 3, 5]) / 6)
    np.testing.assert_allclose(matched.impulse_response(t), np.full(6, 1 / 6))
    assert fixed.static_compliance()[0, 0] == pytest.approx(ROD["length"] / (ROD["young"] * ROD["area"]))
    assert free.mass() == pytest.approx(ROD["density"] * ROD["area"] * ROD["length"])
    endless = impact.semi_infinite_rod(young=4.0, density=1.0, area=3.0)
    np.testing.assert_allclose(endless.impulse_response(t), matched.impulse_response(t))


def test_dashpots_springs_and_power_laws() -> None:
    assert impact.spring(stiffness=4.0).static_compliance()[0, 0] == 0.25
    plate = impact.infinite_plate(young=2e11, poisson=0.3, density=7850.0, thickness=0.01)
    rigidity = 2e11 * 1e-6 / 12 / 0.91
    assert plate.initial_value()[0, 0] == pytest.approx(1 / (8 * math.sqrt(rigidity * 78.5)), rel=1e-12)
    law = PowerGreens(3.0, 0.5)
    assert float(law.impulse_response(4.0)) == 6.0
    assert float(law.step_response(4.0)) == pytest.approx(16.0)
    weights = law.step_kernel(0.5, 8).weights
    assert np.sum(weights) == pytest.approx(16.0)
    assert law.initial_value()[0, 0] == 0.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: impact.spring(stiffness=0.0), "stiffness = 0 must be"),
        (lambda: impact.fixed_rod(**{**ROD, "length": -1.0}), "length = -1 must be"),
        (lambda: impact.fixed_rod(**ROD, damping_ratio=-0.1), "damping_ratio = -0.1"),
        (lambda: impact.rod_with_end_impedance(**ROD, end_impedance=-1.0), "end would feed energy"),
        (lambda: impact.infinite_plate(young=1, poisson=0.6, density=1, thickness=1), "poisson = 0.6"),
    ],
)
def test_impossible_parameters_are_named(make: object, words: str) -> None:
    with pytest.raises(impact.GreensFunctionError, match=words):
        make()  # type: ignore[operator]


YOUNG, DENSITY, AREA = 206e9, 7810.0, 3.14e-4
BAR = {"young": YOUNG, "density": DENSITY, "area": AREA}
SPEED = math.sqrt(YOUNG / DENSITY)
STRAIN = -8e-4


def wave(rise: float, lasts: float, recorded_at: float = 0.0) -> impact.IncomingWave:
    times, values = np.array([0.0, rise, lasts, lasts + rise]), STRAIN * np.array([0.0, 1.0, 1.0, 0.0])
    return impact.IncomingWave(impact.TimeSeries(times, values, "zero"), SPEED, recorded_at)


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
    first = impact.Body(impact.semi_infinite_rod(**BAR), base=coming.outwards)
    second = impact.Body(impact.semi_infinite_rod(**{**BAR, "area": ratio * AREA}))
    result = impact.solve(impact.ContactProblem(second, first, law=impact.Signorini()), dt=1e-6, duration=1.2e-4)
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
    rod = impact.rod_of_two_ends(**BAR, length=0.4)
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
