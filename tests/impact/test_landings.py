"""Landings: what begins one, what ends one, the quasi-static load, and how landings of two runs are paired."""

import math

import numpy as np
import pytest

import impact
from impact.after.landings import (
    BAND,
    ContactRecord,
    Landing,
    closing_speeds,
    find_landings,
    hardest,
    pair_landings,
    pressed_on,
    restitutions,
)
from impact.after.loads import SOFT, static_load
from impact.march.grid import TimeGrid

MASS, STIFFNESS, SPEED = 5e-3, 2e6, 0.8
WEIGHT = 3.0  # N


def record(force: np.ndarray, static: np.ndarray, dt: float = 1e-6, speed: float = 1.0) -> ContactRecord:
    """Return one contact that closes at ``speed`` whenever it touches."""
    gap = -speed * dt * np.arange(len(force))[:, None]
    grid = TimeGrid.of_equal_steps(dt, len(force) - 1)
    return ContactRecord(force, force > 0, grid, force[:, None], gap, static, 2 * dt, np.array([speed]))


def fallen(weight: float = WEIGHT, dt: float = 1e-7) -> tuple[impact.ContactProblem, impact.ImpactResult]:
    """Run a mass thrown at a spring under a constant load that presses it down."""
    mass = impact.rigid_mass(mass=MASS, velocity=-SPEED)
    load = impact.Load(np.array([1 / math.sqrt(MASS)]), lambda t: np.full_like(t, -weight))
    body = impact.Body(mass.greens, velocity=-SPEED, loads=(load,))
    problem = impact.ContactProblem(body, impact.spring(stiffness=STIFFNESS), gap=10e-6)
    return problem, impact.solve(problem, dt=dt, duration=0.4e-3)


def of_run(problem: impact.ContactProblem, result: impact.ImpactResult, static: np.ndarray) -> tuple[Landing, ...]:
    columns, speeds = (result.force[:, None], result.gap[:, None]), closing_speeds(problem, result.dt)
    record = ContactRecord(result.force, result.force > 0, result.rows, *columns, static, 1e-6, speeds)
    return find_landings(record)


def test_a_mass_on_a_spring_lands_with_its_speed_and_momentum() -> None:
    """Landing measures of a mass on a spring under a load are the closed forms, but for the step's loss."""
    problem, result = fallen()
    load = static_load(problem, float(result.time[-1]))
    static = load.course(result.time)
    assert static == pytest.approx(WEIGHT, rel=2 * SOFT)
    (landing, *_) = of_run(problem, result, static)
    speed = math.sqrt(SPEED**2 + 2 * WEIGHT / MASS * 10e-6)
    assert landing.closing_speed == pytest.approx(speed, rel=2e-3)
    # a half swing about the static deflection: N = W + m w v' sin(...), above the load 2 m v
    swing = math.sqrt(STIFFNESS / MASS)
    amplitude = math.hypot(WEIGHT, math.sqrt(STIFFNESS * MASS) * speed)
    assert landing.excess_peak == pytest.approx(amplitude, rel=5e-3)
    assert landing.filtered_peak == pytest.approx(WEIGHT + amplitude, rel=5e-3)
    assert landing.impulse == pytest.approx(2 * MASS * speed, rel=5e-3)
    assert landing.duration == pytest.approx(math.pi / swing, rel=0.05)
    assert not landing.pressed_on
    assert not landing.cut_off


def test_what_it_gives_back_follows_from_the_impulses_of_a_free_mass() -> None:
    """Restitution is 1 but for the loss of the step, which falls in proportion to it or faster."""
    losses = []
    for dt in (2e-6, 1e-6):
        problem, result = fallen(dt=dt)
        landings = of_run(problem, result, static_load(problem, float(result.time[-1])).course(result.time))
        pushed = np.full((1, len(result.force) - 1), -WEIGHT)
        (value, *_) = restitutions(problem, result.force[1:, None], result.rows, landings, lambda steps: None, pushed)
        assert value is not None
        losses.append(abs(1 - value))
    assert losses[1] < 0.6 * losses[0] < 0.02


def test_what_a_held_reed_gives_back_is_the_root_of_its_energies() -> None:
    """The landing's own definition is that of `impact.measures.restitution`, by energies found in another way."""
    reed = impact.cantilever_reed(
        young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.3e-3, damping_ratio=0.01, n_modes=6,
        tip_deflection=0.2e-3,
    )  # fmt: skip
    problem = impact.ContactProblem(reed, impact.spring(stiffness=1e6), gap=0.0)
    prepared = impact.prepare(problem, 1e-7, 1e-3)
    stepper = impact.ContactStepper(prepared)
    stepper.advance(prepared.steps)
    result = impact.collect(stepper)
    landings = of_run(problem, result, np.zeros(len(result.time)))
    striker = prepared.bodies[0]

    def stored(steps: list[int]) -> np.ndarray | None:
        return striker.stored_after(problem.directions(reed) @ result.force[None, 1:], steps)

    values = restitutions(problem, result.force[1:, None], result.rows, landings, stored, np.zeros((0, prepared.steps)))
    assert values[0] == pytest.approx(impact.measures.restitution(result), rel=1e-9)


@pytest.mark.parametrize("stiffness", [1e3, 1e5])
def test_the_static_load_of_a_reed_is_that_of_two_springs(stiffness: float) -> None:
    """The load is (u - gap)/(C_reed + C_seat + C_law), u the free deflection, and zero before it touches."""
    reed = impact.cantilever_reed(
        young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.3e-3, damping_ratio=0.01, n_modes=6,
        tip_deflection=0.0,
    )  # fmt: skip
    modal = reed.greens.modal
    shape = modal.shapes[:, 0]
    pressed = impact.Body(reed.greens, loads=(impact.Load(shape, lambda t: -2.0 * t / 1e-3),))
    law = impact.LinearSpring(stiffness=4e4)
    problem = impact.ContactProblem(pressed, impact.spring(stiffness=stiffness), gap=0.3e-3, law=law)
    time = np.array([0.1e-3, 0.5e-3, 1e-3])
    load = static_load(problem, 1e-3).course(time)
    of_modes = float(np.sum(shape**2 / modal.omega**2))
    deflection = 2.0 * time / 1e-3 * of_modes
    compliance = float(reed.greens.static_compliance()[0, 0]) + 1 / stiffness + 1 / 4e4
    assert load == pytest.approx(np.maximum(deflection - 0.3e-3, 0) / compliance, rel=1e-3, abs=1e-3)
    assert load[0] == 0
    assert load[2] > 0.2


def test_a_hertzian_contact_presses_by_its_secant() -> None:
    """A held spring pressed into a Hertzian seat has F C + (F/k)^(2/3) = interference."""
    stiffness, interference = 1e9, 20e-6
    spring = impact.spring(stiffness=1e6)
    law = impact.Hertz(stiffness=stiffness)
    problem = impact.ContactProblem(impact.Body(spring), impact.spring(stiffness=2e6), gap=-interference, law=law)
    (force,) = static_load(problem, 1e-3).course(np.array([0.0]))
    assert force * 1.5e-6 + (force / stiffness) ** (2 / 3) == pytest.approx(interference, rel=1e-6)


def test_a_landing_ends_where_a_decaying_force_stays_within_the_band() -> None:
    """N = S (1 + A exp(-t/T) cos wt): from the end on, and not before, it is in the band for a quarter of a swing."""
    dt, load, share, decay, swing = 1e-6, 10.0, 0.9, 200e-6, 2 * math.pi / 100e-6
    time = dt * np.arange(4000)
    force = np.where(time > 0, load * (1 + share * np.exp(-time / decay) * np.cos(swing * time)), 0.0)
    (landing,) = find_landings(record(force, np.full(len(time), load)))
    fine = np.arange(0, 1000e-6, 1e-7)
    within = np.abs(share * np.exp(-fine / decay) * np.cos(swing * fine)) <= BAND
    first = int(np.argmin(share * np.exp(-fine / decay) * np.cos(swing * fine) > BAND))  # how long it is above it
    lasts = np.convolve(within, np.ones(first), "valid") == first
    assert landing.end == pytest.approx(float(fine[np.argmax(lasts)]), abs=3 * dt)
    assert landing.pressed_on
    assert landing.excess_peak == pytest.approx(share * load, rel=0.02)  # the filter takes 1 %
    damped = np.exp(-landing.end / decay) * (swing * np.sin(swing * landing.end) - np.cos(swing * landing.end) / decay)
    integral = share * load * (damped + 1 / decay) / (swing**2 + 1 / decay**2)
    assert landing.impulse == pytest.approx(integral, abs=load * dt)  # known to a step
    lasting, largest = pressed_on(record(force, np.full(len(time), load)), (landing,))
    assert lasting == pytest.approx(time[-1] - landing.end, abs=3 * dt)
    assert largest == pytest.approx(load, rel=1.5 * BAND)  # a later swing may leave the band once more


@pytest.mark.parametrize(("excess", "landings"), [(0.8 * BAND, 0), (1.2 * BAND, 1)])
def test_a_pressed_reed_trembles_within_the_band(excess: float, landings: int) -> None:
    force = np.zeros(1000)
    force[100:900] = 10.0
    force[150:160] *= 1 + excess
    tremblings = find_landings(record(force, np.full(1000, 10.0)))
    assert len(tremblings) == landings
    if landings:
        assert tremblings[0].static_load == pytest.approx(10.0)


def test_a_preload_is_no_landing_and_a_release_at_no_gap_is_one() -> None:
    force, none = np.full(500, 5.0), np.zeros(500)
    assert find_landings(record(force, np.full(500, 5.0))) == ()
    released = np.where(np.arange(500) == 0, 0.0, np.where(np.arange(500) < 100, 5.0, 0.0))
    assert len(find_landings(record(released, none, speed=0.5))) == 1
    assert find_landings(record(released, none, speed=0.0)) == ()  # at rest: nothing approaches


def test_openings_shorter_than_thirty_microseconds_end_no_landing() -> None:
    force = np.zeros(1000)
    force[100:150] = force[170:200] = 5.0
    force[240:260] = 4.0
    first, second = find_landings(record(force, np.zeros(1000)))
    assert first.duration == pytest.approx(100e-6)
    assert second.duration == pytest.approx(20e-6)
    assert hardest((first, second)) is first
    assert first.impulse == pytest.approx(80 * 5e-6)


def test_the_end_of_the_record_cuts_a_landing_off() -> None:
    force = np.zeros(300)
    force[250:] = 5.0
    (landing,) = find_landings(record(force, np.zeros(300)))
    assert landing.cut_off


def test_landings_are_paired_by_time_and_only_once() -> None:
    def at(*starts: float) -> tuple[Landing, ...]:
        return tuple(
            Landing(start, start + 20e-6, start, 0, 1.0, 1.0, 0.0, 1.0, 1.0, pressed_on=False, cut_off=False)
            for start in starts
        )

    one, other = at(1e-3, 2e-3, 3e-3), at(1.05e-3, 3.02e-3)
    first, second, third = pair_landings(one, other)
    assert first is other[0]
    assert second is None
    assert third is other[1]
    assert pair_landings(one, ()) == (None, None, None)
    assert pair_landings(at(1e-3), at(1.1e-3)) == (None,)
