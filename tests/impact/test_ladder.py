"""Marches in steps of different lengths against closed forms, energy and equal steps; histories made from them."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactError, ContactProblem, ContactStepper, ModalGreens, Residual
from impact.after.histories import largest_average
from impact.bodies.body import Load, ModalState
from impact.greens import oscillator
from impact.greens.base import Array
from impact.march import grid, ladder
from impact.march.grid import TimeGrid
from impact.march.ladder import SHARE, LadderMarch, Levels, finish_march, march, prepare_levels
from impact.march.prepared import Discretised, discretise, prepare
from impact.march.replay import BodyAtStart, LeapReplay
from impact.march.rows import MarchRun

H = 50e-9


def discretised(problem: ContactProblem, duration: float, dt: float = H) -> tuple[Discretised, Levels]:
    one = discretise(problem, dt, duration, engine="poles")
    levels = prepare_levels(one)
    return one, levels


def seat(ports: int = 1, seed: int = 1) -> Body:
    """Return forty modes from 20 kHz on, with what they leave out."""
    shapes = np.random.default_rng(seed).normal(0, 8.0, (40, ports))
    omega = 2 * np.pi * 20e3 * np.arange(1, 41) ** 1.1
    rest = Residual.exponential(2e-9 * np.eye(ports), 2e-2 * np.eye(ports))
    return Body(ModalGreens(omega, np.full(40, 0.02), shapes, rest, names(ports)))


def names(ports: int) -> tuple[str, ...]:
    return ("contact",) if ports == 1 else tuple(f"port {k + 1}" for k in range(ports))


def reed(ports: int = 1, **more: object) -> Body:
    """Return twelve modes of a cantilever from 150 Hz on, which yields at once to a force."""
    k = np.arange(1, 13)
    scatter = np.random.default_rng(2).normal(1, 0.05, (12, ports)) if ports > 1 else np.ones((12, 1))
    shapes = 30.0 * ((-1.0) ** (k + 1))[:, None] * scatter
    omega = 2 * np.pi * 150.0 * ((k - 0.4) / 0.6) ** 2
    greens = ModalGreens(omega, np.full(12, 0.01), shapes, Residual.spring(1e-7 * np.eye(ports)), names(ports))
    return Body(greens, **more)  # type: ignore[arg-type]


def in_gas(ports: int, pressed: Callable[[Array], Array]) -> Body:
    """Return a reed under a force on the mean of its ports."""
    body = reed(ports)
    assert body.greens.modal is not None
    return replace(body, loads=(Load(body.greens.modal.shapes.mean(axis=1), pressed),))


def deflected(ports: int = 1) -> Body:
    return reed(ports, state=ModalState(np.eye(12)[0] * 1e-4, np.zeros(12)))


def march_in_levels(one: Discretised, levels: Levels, share: float = SHARE) -> MarchRun:
    return finish_march(LadderMarch(one, levels, share))


@pytest.mark.slow
def test_free_motion_is_exact_whatever_the_steps() -> None:
    """A free body with modes, light and heavy damping, and a relaxation, under a constant force: each coordinate is
    that of Duhamel's integral, after random switches. 3 % of any coefficient is 1e9 of the tolerance."""
    omega, zeta = np.array([0.0, 2e3, 5e4, 3e5, 2e6]), np.array([0.0, 0.01, 1.0, 1.7, 0.02])
    greens = ModalGreens(omega, zeta, np.array([[9.0], [7.0], [5.0], [3.0], [2.0]]), Residual.relaxing(1e-9, 1e6))
    begin = ModalState(np.array([0.02, 1e-3, -1e-4, 1e-5, 1e-6]), np.array([3.0, -2.0, 4.0, 1.0, -5.0]))
    shape = np.array([1.0, -2.0, 3.0, 1.0, 2.0])
    striker = Body(greens, state=begin, loads=(Load(shape, lambda t: np.full(len(t), 0.3)),))
    one, levels = discretised(ContactProblem(striker, impact.spring(stiffness=1e9), gap=1.0), 20e-3)
    run = LadderMarch(one, levels, np.inf)
    random, top = np.random.default_rng(3), len(levels.lengths) - 1
    while run.done < one.steps:
        run.level = int(random.integers(0, top + 1))
        run.advance_far(min(run.done + int(4 ** random.uniform(0, top + 1)), one.steps))
    (q, v), _ = run.find_state()
    time = np.array(one.steps * H)
    moved = oscillator.free_transition(time, omega, zeta)
    pushed = np.array([oscillator.step_response(time, omega, zeta), oscillator.impulse_response(time, omega, zeta)])
    exact = moved[:, 0] * begin.displacement + moved[:, 1] * begin.velocity + pushed * shape * 0.3
    psi = greens.shapes[:, 0]
    assert len(run.record_run().rows.lengths) == len(levels.lengths)
    for computed, expected, size in zip((q, v), exact, (1.0, omega.clip(1.0)), strict=True):
        np.testing.assert_allclose(computed[:5] / psi / size, expected / size, rtol=1e-9, atol=1e-13)


@pytest.mark.slow
def test_a_force_that_rises_within_a_leap_is_a_ramp() -> None:
    """A free mass under b t moves by b t^3/(6 m) in the longest steps, to ten digits; a constant force in each step
    would leave b t H^2/(12 m)."""
    ball = impact.rigid_mass(mass=1e-3, velocity=0.0)
    assert ball.greens.modal is not None
    body = replace(ball, loads=(Load(ball.greens.modal.shapes[:, 0], lambda t: 0.2 * t),))
    one, levels = discretised(ContactProblem(body, impact.spring(stiffness=1e9), gap=1.0), 4096 * 64 * H)
    run = LadderMarch(one, levels, 1.0)
    run.level = len(levels.lengths) - 1
    while run.done < one.steps:
        run.advance_far()
    rows = run.record_run().rows
    assert rows.lengths == {4096: 64}
    np.testing.assert_allclose(rows.gap[:, 0] - 1.0, 0.2 * (H * rows.ends) ** 3 / 6 / 1e-3, rtol=1e-10, atol=1e-16)


@pytest.mark.parametrize(("omega", "zeta"), [(0.0, 0.0), (300.0, 0.01), (3e4, 0.02), (3e3, 1.5), (2e5, 1.0)])
def test_ramp_response(omega: float, zeta: float) -> None:
    """It solves the equation of motion under the force t, by differences of second order."""
    time = np.linspace(0, 1e-3, 4001)
    q = oscillator.ramp_response(time, np.array(omega), np.array(zeta))
    step = time[1]
    rate, bend = (q[2:] - q[:-2]) / (2 * step), (q[2:] - 2 * q[1:-1] + q[:-2]) / step**2
    residual = bend + 2 * zeta * omega * rate + omega**2 * q[1:-1] - time[1:-1]
    assert np.abs(residual).max() < 1e-3 * time[-1] * max(1.0, (omega * step) ** 2 * 1e2)


LAWS = {
    "rigid": impact.Signorini(),
    "spring": impact.LinearSpring(2e7),
    "Hertz": impact.Hertz(1e10),
    "damped": impact.HuntCrossley(1e10, 0.1),
    "joint": impact.RoughJoint(stiffness=1e13, exponent=2.0, recovery=0.5),
}


def energies(one: Discretised, run: MarchRun, states: list[tuple[Array, Array]], stops: list[int]) -> Array:
    """Return the stored energy at the ``stops`` [J]: of oscillators, relaxations, bare springs and contact laws."""
    kinetic, elastic, springs = [], [], np.zeros((2, 2))
    for body in one.bodies:
        greens, turn = body.kernel.modal, one.problem.directions(body.body)
        assert greens is not None
        kinetic += [np.ones(len(greens.omega)), np.zeros(len(greens.residual.rates))]
        elastic += [greens.omega**2, greens.residual.rates]
        springs += turn.T @ greens.residual.compliance @ turn
    masses, stiffness = np.concatenate(kinetic), np.concatenate(elastic)
    in_laws = sum(c.law.potential(-gap) for c, gap in zip(one.problem.contacts, run.rows.gap.T, strict=True))
    in_laws = np.asarray(in_laws)[np.searchsorted(run.rows.ends, stops)]
    own = [0.5 * (masses @ v**2 + stiffness @ q**2 + force @ springs @ force) for (q, v), force in states]
    return np.asarray(own) + in_laws


def gains(law: impact.Law, seed: int) -> float:
    """Return the largest rise of the energy over a march with random switches, over the largest energy."""
    random = np.random.default_rng(seed)
    target = seat(2, seed)
    contacts = [Contact(target, port=k, striker_port=k, gap=random.uniform(0, 2e-5), law=law) for k in range(2)]
    velocity = random.normal(0, 0.5, 12) * np.array([1.0] * 4 + [0.1] * 8)
    striker = reed(2, state=ModalState(np.zeros(12), velocity))
    one, levels = discretised(ContactProblem(striker, contacts=contacts), 2000 * H)
    march_of, states, stops = LadderMarch(one, levels, np.inf), [], [0]
    states.append(march_of.find_state())
    while march_of.done < one.steps:
        march_of.level = int(random.integers(0, len(levels.lengths)))
        march_of.advance_far(min(march_of.done + int(random.integers(1, 120)), one.steps))
        states.append(march_of.find_state())
        stops.append(march_of.done)
    run = march_of.record_run()
    assert len(run.rows.lengths) > 1
    stored = energies(one, run, states, stops)
    return float(np.max(np.diff(stored))) / float(stored.max())


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_no_switch_gains_energy_in_hundreds_of_marches(law: impact.Law) -> None:
    """Steps of random lengths gain no energy while contacts neither open nor close in them."""
    assert max(gains(law, seed) for seed in range(100, 500)) < 1e-12


def oscillating(t: Array) -> Array:
    return np.asarray(-4 * np.sin(2 * np.pi * 80 * t))


def scenes() -> dict[str, tuple[ContactProblem, float]]:
    """Return two kinds of strikers and drives with each law, film, base, side and start."""
    wide, film = seat(6), impact.SqueezeFilm(coefficient=2e-5 * 0.03 * 1e-9, floor=2e-6)
    tilted = [Contact(wide, port=k, striker_port=k, gap=1e-5 + 4e-6 * k) for k in range(6)]
    pressed = [Contact(wide, port=k, striker_port=k) for k in range(6)]
    stops = [Contact(seat(), gap=1e-5), Contact(impact.spring(stiffness=5e6), gap=1.5e-4, side=-1)]
    ball = impact.rigid_mass(mass=1e-3, velocity=-1.0)
    shaken = replace(seat(), base=lambda t: 2e-5 * np.sin(2 * np.pi * 400 * t))
    return {
        "release": (ContactProblem(deflected(), seat(), gap=1e-5), 4e-3),
        "gas": (ContactProblem(in_gas(1, oscillating), seat(), gap=1e-4), 6e-3),
        "gas, spring": (ContactProblem(in_gas(1, oscillating), seat(), gap=1e-4, law=LAWS["spring"]), 6e-3),
        "gas, Hertz": (ContactProblem(in_gas(1, oscillating), seat(), gap=1e-4, law=LAWS["Hertz"]), 6e-3),
        "gas, joint": (ContactProblem(in_gas(1, oscillating), seat(), gap=1e-4, law=LAWS["joint"]), 6e-3),
        "film": (ContactProblem(in_gas(1, oscillating), seat(), gap=1e-4, film=film), 6e-3),
        "ball": (ContactProblem(ball, seat(), gap=1e-4), 2e-3),
        "base": (ContactProblem(deflected(), shaken, gap=5e-6), 3e-3),
        "tilted": (ContactProblem(in_gas(6, oscillating), contacts=tilted), 4e-3),
        "pressed": (ContactProblem(in_gas(6, lambda t: -oscillating(t + 3e-3)), contacts=pressed, preload=True), 5e-3),
        "between stops": (ContactProblem(in_gas(1, lambda t: -oscillating(t)), contacts=stops), 5e-3),
    }


def taken(run: MarchRun) -> Array:
    """Return the whole impulse, the largest mean force over 5 us, and the closing speed before the first touch."""
    total = run.force[1:].sum(axis=1)
    first, part = np.argwhere(run.force > 0)[0]
    speed = 0.0 if first < 2 else (run.gap[first - 2, part] - run.gap[first - 1, part]) / run.dt
    return np.array([total.sum() * run.dt, largest_average(total, run.dt, 5e-6), speed])


@pytest.mark.slow
@pytest.mark.parametrize("name", scenes())
def test_it_is_as_good_as_equal_steps(name: str) -> None:
    """Long steps change at most a tenth of what the fine step leaves and of a bar of 0.3 %; gaps at the ends of steps
    agree, and at least a quarter of the steps is saved."""
    problem, duration = scenes()[name]
    run = march_in_levels(*discretised(problem, duration))
    equal, finer = (march(problem, H / part, duration, equal_steps=True) for part in (1, 2))
    changes = np.abs(taken(finer) - taken(equal))
    assert np.all(np.abs(taken(run) - taken(equal)) <= 0.1 * (changes + 3e-3 * taken(equal)))
    stepper = ContactStepper(prepare(problem, H, duration))
    stepper.advance(run.steps)
    apart = np.abs(run.rows.gap - stepper.gap[run.rows.ends]).max()
    assert apart <= 2e-3 * np.abs(stepper.gap).max()
    assert sum(run.rows.lengths.values()) < 0.75 * run.steps
    assert run.unsolved == 0


@pytest.mark.slow
@pytest.mark.parametrize("law", ["spring", "Hertz"])
def test_order_of_convergence(law: str) -> None:
    """Peak and impulse of a mass on a compliant contact err as at equal steps, to a twentieth and of second order, if
    the share for long steps falls as the square of the step."""
    ball = impact.rigid_mass(mass=1e-3, velocity=-1.0)
    problem = ContactProblem(ball, seat(), gap=1e-5, law=LAWS[law])
    exact = taken(march(problem, 200e-9 / 32, 1e-3, equal_steps=True))[:2]
    errors = []
    for part in (1, 2, 4):
        run = march_in_levels(*discretised(problem, 1e-3, 200e-9 / part), 1e-4 / part**2)
        equal = march(problem, 200e-9 / part, 1e-3, equal_steps=True)
        assert sum(run.rows.lengths.values()) < run.steps / 2
        errors.append([taken(run)[:2] - exact, taken(equal)[:2] - exact])
    np.testing.assert_allclose(*np.swapaxes(errors, 0, 1), rtol=0.05)
    assert np.log2(np.abs(errors[0][0] / errors[2][0])).min() / 2 > 1.5


@pytest.mark.slow
def test_a_wrong_effect_of_a_force_in_a_long_step_is_seen() -> None:
    """3 % of it change the impulse by more than a tenth of a bar of 0.3 %."""
    problem, duration = scenes()["gas, spring"]
    one, levels = discretised(problem, duration)
    factors = np.where(levels.lengths > 1, 1.03, 1.0)[:, None, None]
    right, wrong = (
        taken(march_in_levels(one, each)) for each in (levels, replace(levels, gains=levels.gains * factors))
    )
    assert abs(wrong[0] / right[0] - 1) > 3e-4


@pytest.mark.slow
def test_where_equal_steps_take_long_smooth_motion_takes_longer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long steps are taken for modes, but not on a rod by step weights or under loads by opening."""
    monkeypatch.setattr(ladder, "WORTHWHILE", 0.0)
    ball, rod = (
        impact.rigid_mass(mass=1e-3, velocity=-1.0),
        impact.fixed_rod(young=2e11, density=7850.0, area=1e-5, length=0.05),
    )
    assert len(march(ContactProblem(ball, seat(), gap=1e-4), 1e-7, 1e-3).rows.lengths) > 3
    assert march(ContactProblem(ball, rod), 1e-7, 1e-4).rows.lengths == {1: 1000}
    jet = Load(np.ones(1), lambda t: np.full(len(t), -0.1), by_opening=lambda lift: 1 + 1e3 * lift)
    assert march(ContactProblem(replace(ball, loads=(jet,)), seat(), gap=1e-4), 1e-7, 1e-4).rows.lengths == {1: 1000}


STEP = 1e-6
OMEGA = np.array([0.0, 10.0, 3e3, 4e4, 2e5, 3e6, 2e4, 5e5])
ZETA = np.array([0.0, 0.0, 1e-3, 0.02, 0.3, 0.01, 1.0, 3.0])


@pytest.mark.parametrize("wrong", [1.0, 1.03])
def test_energy_balances_under_loads_that_rise(wrong: float) -> None:
    """Stored energy, loss, work of loads and of forces are integrated separately, and their sum vanishes; not with a
    loss, or a rise in the work, that is off by 3 %."""
    random = np.random.default_rng(3)  # modes of all kinds with two ports, a state of theirs, the shape of a load
    residual = Residual(random.normal(size=(2, 2)), np.array([3e4, 2e5]), np.diag([1e-9, 2e-9]))
    shapes, rates = random.normal(size=(len(OMEGA), 2)), random.normal(size=len(OMEGA))
    state = ModalState(rates / np.maximum(OMEGA, 100.0), random.normal(size=len(OMEGA)))
    modal, shape = ModalGreens(OMEGA, ZETA, shapes, residual, ("one", "two")), random.normal(size=len(OMEGA))
    random, lengths = np.random.default_rng(4), np.array([1, 4, 64, 1024])
    levels = random.integers(0, 4, 200)
    body = BodyAtStart(modal, state, np.zeros(2), np.zeros(2), [shape], np.eye(2))
    leaps, again = (LeapReplay(body, STEP * lengths) for _ in range(2))
    force, means, rises = random.normal(size=(2, 200)), random.normal(size=(1, 200)), random.normal(size=(1, 200))
    start = leaps.stored
    ports = modal.shapes.T @ state.displacement
    block = leaps.advance(force, means, levels, rises)
    moved = np.diff(block.displacement, axis=1, prepend=ports[:, None])
    work = np.sum(force * moved, axis=0)
    change = np.diff(block.stored, prepend=start)
    balance = change + wrong * block.lost - work - block.load_work
    size = np.abs(change).max()
    assert (np.abs(balance).max() < 1e-10 * size) == (wrong == 1.0)
    off = change + block.lost - work - again.advance(force, means, levels, 1.03 * rises).load_work
    assert np.abs(off).max() > 1e-6 * size


STEPS = TimeGrid(1e-3, np.array([0, 1, 2, 6, 22]))
MOVED = np.array([0.0, 1.0, 2.0, 6.0, 22.0])  # on one line


def test_a_force_is_constant_over_a_step_and_a_motion_is_a_line() -> None:
    np.testing.assert_array_equal(STEPS.spread_forces(MOVED), [0, 1, 2, 6, 6, 6, 6, *[22] * 16])
    np.testing.assert_allclose(STEPS.spread_motions(MOVED), np.arange(23.0))
    np.testing.assert_array_equal(STEPS.spread_forces(MOVED, 2, 4), [2, 6, 6])
    for first, last in itertools.combinations_with_replacement(range(23), 2):  # windows are what single steps are
        steps, two = np.arange(first, last + 1), np.column_stack([MOVED, -MOVED])
        np.testing.assert_array_equal(STEPS.spread_forces(two, first, last), STEPS.find_forces(two, steps))
        np.testing.assert_allclose(STEPS.spread_motions(two, first, last), STEPS.find_motions(two, steps))
    np.testing.assert_allclose(
        STEPS.find_motions(np.stack([MOVED, -MOVED], axis=1), np.array([4, 14]))[:, 1], [-4, -14]
    )


@pytest.mark.parametrize(
    ("start", "stop", "rows", "times"),
    [
        (0, 22, [1, 2, 3, 4], [0, 1, 2, 6, 22]),
        (1, 6, [2, 3], [1, 2, 6]),
        (3, 5, [3], [3, 5]),
        (3, 7, [3, 4], [3, 6, 7]),
        (6, 7, [4], [6, 7]),
    ],
)
def test_rows_of_a_window_with_the_times_of_their_parts(
    start: int, stop: int, rows: list[int], times: list[float]
) -> None:
    cut, edges = STEPS.cut(start, stop)
    assert np.arange(5)[cut].tolist() == rows
    assert STEPS.until(stop).ends[-1] == stop
    np.testing.assert_allclose(edges, 1e-3 * np.array(times))


def test_a_history_that_would_not_fit_is_refused_and_its_windows_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid, "MOST_BYTES", 8.0 * 10)
    with pytest.raises(ContactError, match=r"0 to 22 .*window"):
        STEPS.spread_forces(MOVED)
    assert len(STEPS.spread_forces(MOVED, 3, 12)) == 10
    with pytest.raises(ContactError, match=r"0 to 23.*22 steps"):
        STEPS.spread_motions(MOVED, 0, 23)
