"""Landings: begin, end, quasi-static load, pairs of two runs; touch and opening are known to a part of a step."""

import math

import numpy as np
import pytest

import impact
from impact import Body, ContactProblem
from impact.after.landings import (
    BAND,
    JUMP,
    ContactRecord,
    Landing,
    find_closing_speeds,
    find_hardest,
    find_landings,
    find_pressed_contact,
    find_restitutions,
    find_step_responses,
    pair_landings,
)
from impact.after.loads import SOFT, find_static_load
from impact.exact.contact_stress import hertz_impact
from impact.march.grid import TimeGrid
from impact.march.motion import PortForces

MASS, STIFFNESS, SPEED = 5e-3, 2e6, 0.8
WEIGHT = 3.0  # N


def record(force: np.ndarray, static: np.ndarray, dt: float = 1e-6, speed: float = 1.0) -> ContactRecord:
    """Return one contact that closes at ``speed`` whenever it touches."""
    gap = -speed * dt * np.arange(len(force))[:, None]
    grid = TimeGrid.from_equal_steps(dt, len(force) - 1)
    return ContactRecord(force, force > 0, grid, force[:, None], gap, static, 2 * dt, np.array([speed]))


def fallen(weight: float = WEIGHT, dt: float = 1e-7) -> tuple[impact.ContactProblem, impact.ImpactResult]:
    """Run a mass thrown at a spring under a constant load that presses it down."""
    mass = impact.rigid_mass(mass=MASS, velocity=-SPEED)
    load = impact.Load(np.array([1 / math.sqrt(MASS)]), lambda t: np.full_like(t, -weight))
    body = impact.Body(mass.greens, velocity=-SPEED, loads=(load,))
    problem = impact.ContactProblem(body, impact.spring(stiffness=STIFFNESS), gap=10e-6)
    return problem, impact.solve(problem, dt=dt, duration=0.4e-3)


def of_run(problem: impact.ContactProblem, result: impact.ImpactResult, static: np.ndarray) -> tuple[Landing, ...]:
    columns, speeds = (result.force[:, None], result.gap[:, None]), find_closing_speeds(problem, result.dt)
    record = ContactRecord(result.force, result.force > 0, result.rows, *columns, static, 1e-6, speeds)
    return find_landings(record)


def test_a_mass_on_a_spring_lands_with_its_speed_and_momentum() -> None:
    """Landing measures of a mass on a spring under a load are the closed forms, but for the step's loss."""
    problem, result = fallen()
    load = find_static_load(problem, float(result.time[-1]))
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
        landings = of_run(problem, result, find_static_load(problem, float(result.time[-1])).course(result.time))
        pushed = np.full((1, len(result.force) - 1), -WEIGHT)
        (value, *_) = find_restitutions(problem, result.force[1:, None], result.rows, landings, np.zeros_like, pushed)
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

    def stored(steps: list[int]) -> np.ndarray:
        return striker.stored_after(PortForces(result.rows, result.force[None, 1:], problem.directions(reed)), steps)

    values = find_restitutions(
        problem, result.force[1:, None], result.rows, landings, stored, np.zeros((0, prepared.steps))
    )
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
    load = find_static_load(problem, 1e-3).course(time)
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
    (force,) = find_static_load(problem, 1e-3).course(np.array([0.0]))
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
    lasting, largest = find_pressed_contact(record(force, np.full(len(time), load)), (landing,))
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
    assert find_hardest((first, second)) is first
    assert first.impulse == pytest.approx(80 * 5e-6)


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


HERTZ, GAP = 1e9, 1e-5
YOUNG, DENSITY, AREA, LENGTH = 200e9, 7850.0, 1e-4, 0.1
TRIP = 2 * LENGTH / math.sqrt(YOUNG / DENSITY)
HALF_SWING = math.pi * math.sqrt(MASS / STIFFNESS)
FAR = impact.rigid_mass(mass=1e9, velocity=0.0)
PARTS = (1.0, 1.13, 1.29, 1.47, 1.61, 1.83)  # steps that end a contact at different places


def rods(off: float = 1.0) -> ContactProblem:
    young = YOUNG / off**2
    striker, target = (impact.free_rod(young=young, density=DENSITY, area=AREA, length=LENGTH) for _ in range(2))
    return ContactProblem(Body(striker, velocity=-1.0), Body(target), gap=GAP)


CASES = {
    "on a spring": (Body(impact.spring(stiffness=STIFFNESS)), impact.Signorini(), HALF_SWING),
    "by a spring": (FAR, impact.LinearSpring(STIFFNESS), HALF_SWING),
    "by Hertz's law": (FAR, impact.Hertz(HERTZ), hertz_impact(stiffness=HERTZ, mass=MASS, speed=1.0).duration),
}


def landing_of(problem: ContactProblem, dt: float, duration: float) -> Landing:
    result = impact.solve(problem, dt=dt, duration=duration)
    columns, speeds = (result.rows.solid[:, None], result.rows.gap[:, None]), find_closing_speeds(problem, dt)
    responses = find_step_responses(problem.contacts, problem.striker, dt)
    none = np.zeros(len(result.force))
    record = ContactRecord(result.force, result.solid > 0, result.rows, *columns, none, 4 * dt, speeds, responses)
    return find_landings(record)[0]


@pytest.mark.slow
@pytest.mark.parametrize(("other", "law", "exact"), CASES.values(), ids=CASES)
def test_a_duration_is_of_second_order(other: Body, law: impact.Law, exact: float) -> None:
    """Its error is a smooth function of the step, however the steps fall; a mass 6 % off, that is 3 %, is seen."""
    right, heavier = (
        ContactProblem(impact.rigid_mass(mass=off * MASS, velocity=-1.0), other, law=law, gap=GAP) for off in (1, 1.06)
    )
    errors = []
    for steps in (20, 40, 80):
        each = [landing_of(right, exact / steps / part, 2 * exact) for part in PARTS]
        assert all(one.is_resolved for one in each)
        assert [one.touch for one in each] == pytest.approx([GAP] * len(each), rel=1e-9)
        errors.append([one.duration / exact - 1 for one in each])
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert orders.min() > 1.8
    assert np.max(np.abs(errors[-1])) < 2e-4
    off = landing_of(heavier, exact / 80, 2 * exact).duration / exact - 1
    assert off > 0.02


@pytest.mark.slow
def test_a_duration_by_waves_errs_by_a_part_of_a_step() -> None:
    """Equal rods part after one round trip, with a jump of the force, which whole steps miss by up to a step."""
    errors, whole, off = [], [], []
    for part in (*PARTS, *(2 * part for part in PARTS)):
        dt = TRIP / 40 / part
        landing = landing_of(rods(), dt, 2 * TRIP + GAP)
        errors.append((landing.duration - TRIP) / dt)
        whole.append((landing.end - landing.start - TRIP) / dt)
        off.append(landing_of(rods(1.03), dt, 2 * TRIP + GAP).duration / TRIP - 1.03)
    assert np.max(np.abs(errors)) <= JUMP < 0.5 < np.max(np.abs(whole))
    assert np.max(np.abs(off)) < JUMP / 40


def test_a_film_and_touches_that_merge_leave_whole_steps() -> None:
    film = impact.SqueezeFilm(1e-12, 1e-6)
    contact = impact.Contact(impact.spring(stiffness=STIFFNESS), gap=GAP, film=film)
    mass = impact.rigid_mass(mass=MASS, velocity=-1.0)
    assert find_step_responses(ContactProblem(mass, contacts=[contact]).contacts, mass, 1e-6).shape == (2, 0)
    force = np.zeros(200)
    force[50:60] = force[70:80] = 1.0
    gap = np.where(force > 0, 0.0, np.abs(np.arange(200.0) - 49) * 1e-6)[:, None]
    grid = impact.march.grid.TimeGrid.from_equal_steps(1e-6, 199)
    each = (force, force > 0, grid, force[:, None], gap, np.zeros(200), 4e-6, np.ones(1), np.full((2, 1), 1e-7))
    (landing,) = find_landings(ContactRecord(*each))
    assert not landing.is_resolved
    assert landing.end - landing.start == pytest.approx(30e-6)


@pytest.mark.parametrize(("gap", "part", "speed", "touch"), [(5.6e-6, 0, 2.0, 1.1e-6), (4.4e-6, 1, 4.0, 1.1e-6)])
def test_the_part_that_touches_first_within_a_step_closes_with_its_own_speed(
    gap: float, part: int, speed: float, touch: float
) -> None:
    """The other one is twice as fast, and touches in the same step: later, or at once."""
    steps, closing = np.arange(40.0), np.array([2.0, 4.0])
    gaps = np.maximum(np.array([2.2e-6, gap]) - 1e-6 * steps[:, None] * closing, 0.0)
    solid = np.where((gaps == 0) & (steps[:, None] < 20), 1.0, 0.0)
    force = solid.sum(axis=1)
    grid = impact.march.grid.TimeGrid.from_equal_steps(1e-6, 39)
    record = ContactRecord(force, force > 0, grid, solid, gaps, 0 * force, 4e-6, closing, np.zeros((2, 2)))
    (landing,) = find_landings(record)
    assert (landing.part, landing.touch) == (part, pytest.approx(touch))
    assert landing.closing_speed == pytest.approx(speed)
