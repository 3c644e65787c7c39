"""Touch and opening are known to a part of a step: of second order where the force falls to zero without a jump."""

import math
from collections.abc import Callable

import numpy as np
import pytest

import impact
from impact import Body, ContactProblem
from impact.after.landings import JUMP, ContactRecord, Landing, closing_speeds, find_landings, find_own_yield
from impact.exact.contact_stress import hertz_impact

MASS, STIFFNESS, HERTZ, GAP = 5e-3, 2e6, 1e9, 1e-5
YOUNG, DENSITY, AREA, LENGTH = 200e9, 7850.0, 1e-4, 0.1
TRIP = 2 * LENGTH / math.sqrt(YOUNG / DENSITY)
HALF_SWING = math.pi * math.sqrt(MASS / STIFFNESS)
FAR = impact.rigid_mass(mass=1e9, velocity=0.0)
PARTS = (1.0, 1.13, 1.29, 1.47, 1.61, 1.83)  # steps that end a contact at different places


def thrown(other: Body | impact.GreensFunction, law: impact.Law, off: float) -> ContactProblem:
    return ContactProblem(impact.rigid_mass(mass=MASS * off, velocity=-1.0), other, law=law, gap=GAP)


def on_spring(off: float = 1.0) -> ContactProblem:
    return thrown(impact.spring(stiffness=STIFFNESS), impact.Signorini(), off)


def by_spring(off: float = 1.0) -> ContactProblem:
    return thrown(FAR, impact.LinearSpring(STIFFNESS), off)


def by_hertz(off: float = 1.0) -> ContactProblem:
    return thrown(FAR, impact.Hertz(HERTZ), off)


def rods(off: float = 1.0) -> ContactProblem:
    young = YOUNG / off**2
    striker, target = (impact.free_rod(young=young, density=DENSITY, area=AREA, length=LENGTH) for _ in range(2))
    return ContactProblem(Body(striker, velocity=-1.0), Body(target), gap=GAP)


def landing_of(problem: ContactProblem, dt: float, duration: float) -> Landing:
    result = impact.solve(problem, dt=dt, duration=duration)
    columns, speeds = (result.rows.solid[:, None], result.rows.gap[:, None]), closing_speeds(problem, dt)
    own = find_own_yield(problem.contacts, problem.striker, dt)
    none = np.zeros(len(result.force))
    record = ContactRecord(result.force, result.solid > 0, result.rows, *columns, none, 4 * dt, speeds, own)
    return find_landings(record)[0]


CASES = {
    on_spring: HALF_SWING,
    by_spring: HALF_SWING,
    by_hertz: hertz_impact(stiffness=HERTZ, mass=MASS, speed=1.0).duration,
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_duration_is_of_second_order(case: Callable[..., ContactProblem]) -> None:
    """Its error is a smooth function of the step, however the steps fall; a mass 6 % off, that is 3 %, is seen."""
    exact, errors = CASES[case], []
    for steps in (20, 40, 80):
        each = [landing_of(case(), exact / steps / part, 2 * exact) for part in PARTS]
        assert all(one.is_resolved for one in each)
        assert [one.touch for one in each] == pytest.approx([GAP] * len(each), rel=1e-9)
        errors.append([one.duration / exact - 1 for one in each])
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert orders.min() > 1.8
    assert np.max(np.abs(errors[-1])) < 2e-4
    off = landing_of(case(1.06), exact / 80, 2 * exact).duration / exact - 1
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
    assert find_own_yield(ContactProblem(mass, contacts=[contact]).contacts, mass, 1e-6).shape == (2, 0)
    force = np.zeros(200)
    force[50:60] = force[70:80] = 1.0
    gap = np.where(force > 0, 0.0, np.abs(np.arange(200.0) - 49) * 1e-6)[:, None]
    grid = impact.march.grid.TimeGrid.of_equal_steps(1e-6, 199)
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
    grid = impact.march.grid.TimeGrid.of_equal_steps(1e-6, 39)
    record = ContactRecord(force, force > 0, grid, solid, gaps, 0 * force, 4e-6, closing, np.zeros((2, 2)))
    (landing,) = find_landings(record)
    assert (landing.part, landing.touch) == (part, pytest.approx(touch))
    assert landing.closing_speed == pytest.approx(speed)
