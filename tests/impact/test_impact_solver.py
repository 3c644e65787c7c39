"""The passive march: what it refuses, what it conserves, how fast it converges."""

import math
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, ContactError, ContactProblem, ModalGreens, Residual, measures
from impact.march.motion import Discrete
from impact.march.prepared import step_count

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1, mass 6


def mass_on(greens: impact.GreensFunction, **more: object) -> ContactProblem:
    striker = impact.rigid_mass(mass=6.0, velocity=-1.0)
    return ContactProblem(striker, Body(greens), **more)  # type: ignore[arg-type]


def test_rigid_contact_of_bodies_that_do_not_yield_at_once_is_refused() -> None:
    bare = impact.single_mode(frequency_hz=1.0, mass=1.0)
    with pytest.raises(ContactError, match=r"grow like 1/dt; add a residual \(impact.Residual\)"):
        impact.solve(mass_on(bare), dt=0.01, duration=1.0)
    impact.solve(mass_on(bare, law=impact.Hertz(stiffness=1.0)), dt=0.01, duration=0.1)
    yielding = replace(bare, residual=Residual.exponential(1e-3, 0.1))
    impact.solve(mass_on(yielding), dt=0.01, duration=0.1)


@pytest.mark.parametrize(
    ("dt", "duration", "words"),
    [
        (0.0, 1.0, "dt = 0.0 s"),
        (math.nan, 1.0, "dt = nan s"),
        (0.1, -1.0, "duration = -1.0 s"),
        (0.1, math.inf, "duration = inf s"),
        (0.1, 0.05, "must be at least one step"),
    ],
)
def test_impossible_steps_are_refused(dt: float, duration: float, words: str) -> None:
    with pytest.raises(ContactError, match=words):
        impact.solve(mass_on(impact.fixed_rod(**ROD)), dt=dt, duration=duration)


def test_impossible_problems_are_refused() -> None:
    rod = impact.fixed_rod(**ROD)
    with pytest.raises(ContactError, match="gap = nan"):
        mass_on(rod, gap=math.nan)
    with pytest.raises(impact.GreensFunctionError, match="no port 'lip'"):
        mass_on(rod, target_port="lip")


def test_record_covers_the_duration_and_tells_progress() -> None:
    heard: list[float] = []
    problem = mass_on(impact.fixed_rod(**ROD))
    result = impact.solve(problem, dt=0.1, duration=0.95, progress=lambda _, done: heard.append(done))
    assert len(result.time) == len(result.force) == len(result.gap) == len(result.energy.stored) == 11
    assert result.time[-1] == pytest.approx(1.0)
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    assert len(impact.solve(problem, dt=0.1, duration=1.0).time) == 11  # 1.0/0.1 is ten steps, not eleven


def test_advice_when_the_step_is_too_coarse_for_the_highest_mode() -> None:
    fast = ModalGreens(np.array([1.0, 100.0]), np.zeros(2), np.ones((2, 1)), Residual.exponential(1e-3, 0.1))
    modes, contacts = impact.solve(mass_on(fast), dt=0.02, duration=1.0).advice
    assert modes.value == pytest.approx(2.0)
    assert "use dt <= 0.005 s" in str(modes)
    assert contacts.name == "share of the impulse in contacts of fewer than 10 steps"
    assert contacts.value == 1.0
    assert not impact.solve(mass_on(fast), dt=0.004, duration=1.0).advice


def test_advice_on_a_contact_that_the_end_cuts() -> None:
    """Three steps of a force that rises are off by a third; three hundred are not."""
    rod = impact.fixed_rod(**ROD)
    (advice,) = impact.solve(mass_on(rod), dt=0.01, duration=0.03).advice
    assert advice.name == "share of the impulse in contacts of fewer than 10 steps"
    assert not impact.solve(mass_on(rod), dt=1e-4, duration=0.03).advice


@pytest.mark.parametrize("target", ["fixed", "damped", "free", "spring"])
def test_rigid_contact_neither_pulls_nor_penetrates(target: str) -> None:
    greens = {
        "fixed": impact.fixed_rod(**ROD),
        "damped": impact.fixed_rod(**ROD, damping_ratio=0.1),
        "free": impact.free_rod(**ROD),
        "spring": impact.spring(stiffness=3.0),
    }[target]
    result = impact.solve(mass_on(greens), dt=0.01, duration=9.0)
    assert np.all(result.force >= 0)
    assert np.max(result.force) > 1
    assert np.min(result.gap) >= -1e-12 * np.ptp(result.striker_displacement)
    assert np.max(np.abs(result.force * np.maximum(result.gap, 0)[:])) <= 1e-11  # N gap = 0


def free_pairs() -> list[ContactProblem]:
    rod = impact.free_rod(**ROD)
    soft = ModalGreens(np.array([0.0, 9.0]), np.array([0.0, 0.05]), np.array([[0.5], [0.7]]), Residual.none())
    return [
        ContactProblem(impact.rigid_mass(mass=2.0, velocity=-1.0), Body(rod)),
        ContactProblem(Body(rod, velocity=-1.0), Body(rod, velocity=0.5)),
        ContactProblem(impact.rigid_mass(mass=2.0, velocity=-1.0), Body(soft), law=impact.Hertz(stiffness=200.0)),
    ]


@pytest.mark.parametrize("problem", free_pairs())
def test_momentum_of_free_bodies_is_conserved(problem: ContactProblem) -> None:
    """The mean displacement of free bodies after contact grows with the velocity that the impulse gave them."""
    dt, period = 0.005, 2.0 if isinstance(problem.target.greens, impact.exact.rods.DelayRod) else 2 * np.pi / 9.0
    result = impact.solve(problem, dt=dt, duration=40.0)
    assert result.force[-1] == 0
    span = round(3 * period / dt)
    momentum = 0.0
    for body, u in ((problem.striker, result.striker_displacement), (problem.target, result.target_displacement)):
        one, other = u[-1 - span : -1], u[-1 - 3 * span : -1 - 2 * span]  # means over whole periods
        momentum += body.mass * (np.mean(one) - np.mean(other)) / (2 * span * dt)
    before = problem.striker.mass * problem.striker.velocity + problem.target.mass * problem.target.velocity
    # 3 periods of the mode are 418.88 steps; rounding leaves its amplitude times 0.1/419
    assert momentum == pytest.approx(before, abs=2e-4)


def test_units_do_not_matter() -> None:
    """SI against mm, t, s, N: stresses 1e-6, density 1e-12, lengths 1e3, masses 1e-3, times and forces unchanged."""

    def collide(length: float, mass: float) -> impact.ImpactResult:
        stress, density = 1 / length**2, mass / length**3
        rod = impact.fixed_rod(
            young=2e11 * stress, density=7850 * density, area=1e-4 * length**2, length=0.1 * length, damping_ratio=0.1
        )
        reed = impact.cantilever_reed(
            young=2e11 * stress,
            density=7850 * density,
            length=0.0254 * length,
            width=0.01 * length,
            thickness=0.000305 * length,
            n_modes=10,
            tip_deflection=1e-4 * length,
        )
        return impact.solve(ContactProblem(reed, Body(rod)), dt=5e-7, duration=9e-4)

    si, mm = collide(1.0, 1.0), collide(1e3, 1e-3)
    first = measures.contact_groups(si)[0]
    assert first[1] < 9e-4
    # chatter amplifies round-off: compare up to the end of the first contact interval, and the impulse of all
    stop = int(measures.contact_intervals(si)[0, 1] / si.dt)
    np.testing.assert_allclose(mm.force[:stop], si.force[:stop], atol=1e-9 * si.force.max())
    np.testing.assert_allclose(mm.gap[:stop], 1e3 * si.gap[:stop], atol=1e-9 * 0.1)
    assert measures.impulse(mm) == pytest.approx(measures.impulse(si), rel=1e-6)
    assert mm.energy.stored[0] == pytest.approx(1e3 * si.energy.stored[0], rel=1e-12)  # N mm


def exact_force(t: np.ndarray) -> np.ndarray:
    """Rigid mass on a fixed rod of the same mass: exp(-t), then + 2 exp(-s) (1 - s), s = t - 2; Z = V = 1 here."""
    s = t - 2.0
    return np.where(t < 2, np.exp(-t), np.exp(-t) + 2 * np.exp(-s) * (1 - s))


def test_first_order_at_the_jumps_second_order_between_them() -> None:
    """alpha = 1. The peak is a step's mean just after a jump: order 1. Forces at the middle of steps: order 2."""
    peak, between = [], []
    for steps in (50, 100, 200):
        result = impact.solve(mass_on(impact.fixed_rod(**ROD)), dt=1 / steps, duration=3.0)
        middle, force = result.time[1:] - result.dt / 2, result.force[1:] / 6.0
        peak.append(2 + math.exp(-2) - force.max())
        between.append(np.max(np.abs(force - exact_force(middle))))
    orders = np.log2(np.array([peak[:-1], between[:-1]]) / np.array([peak[1:], between[1:]]))
    np.testing.assert_allclose(orders[0], 1.0, atol=0.05)
    np.testing.assert_allclose(orders[1], 2.0, atol=0.05)
    assert peak[-1] < 1.1e-2
    assert between[-1] < 1e-4


def force_errors(problem: ContactProblem, steps: int) -> tuple[float, float, float]:
    """Against the exact rod at the same step: L1 of the force, its largest average over l/4c, the impulse."""
    exact = impact.solve(mass_on(impact.fixed_rod(**ROD)), dt=1 / steps, duration=3.5)
    result = impact.solve(problem, dt=1 / steps, duration=3.5)
    filtered = measures.filtered_force(exact, 0.25)
    return (
        float(np.sum(np.abs(result.force - exact.force)) / np.sum(exact.force)),
        float(np.max(np.abs(measures.filtered_force(result, 0.25) - filtered)) / filtered.max()),
        abs(measures.impulse(result) / measures.impulse(exact) - 1),
    )


def test_modes_with_the_exponential_residual_converge_to_the_rod() -> None:
    """Static compliance and 1/Z restored: first order in 1/n, as fast as n modes resolve a jump."""
    l1, average, impulse = np.array([force_errors(mass_on(truncated_rod(n)), 2000) for n in (10, 40, 160)]).T
    for error in (l1, average):
        order = np.log(error[:-1] / error[1:]) / np.log(4)
        # still below its limit of 1 at n = 10, where the cut-off is 3 periods of the rod
        np.testing.assert_allclose(order, 1.0, atol=0.12)
    assert l1[-1] < 0.01
    assert average[-1] < 0.006
    assert np.all(impulse < [5e-4, 1e-5, 1e-6])


def test_bare_residual_spring_rings_with_the_step_the_exponential_does_not() -> None:
    """The spring oscillates at the highest mode with nothing but the step to damp it; the impulse survives."""
    bare = [force_errors(mass_on(truncated_rod(40, bare=True)), steps) for steps in (500, 2000)]
    exponential = [force_errors(mass_on(truncated_rod(40)), steps) for steps in (500, 2000)]
    assert bare[1][0] > 2 * bare[0][0]
    assert exponential[1][0] == pytest.approx(exponential[0][0], rel=0.01)
    assert bare[1][2] < 1e-3


def test_problems_that_share_discretised_bodies_are_marched_alike() -> None:
    """A body at a step, its free motion included, serves several problems: bit for bit what each would make itself."""
    striker = impact.rigid_mass(mass=6.0, velocity=-1.0)
    dt, duration = 0.01, 2.0
    moving = Discrete.from_body(striker, dt, step_count(dt, duration))
    moving = replace(moving, free=moving.free_motion())
    for rod in (truncated_rod(10), impact.fixed_rod(**ROD)):
        problem = ContactProblem(striker, Body(rod), gap=0.005)
        still = Discrete.from_body(problem.bodies[1], dt, step_count(dt, duration))
        own, shared = (impact.prepare(problem, dt, duration, bodies=given) for given in (None, (moving, still)))
        forces = []
        for prepared in (own, shared):
            stepper = impact.ContactStepper(prepared)
            stepper.advance(prepared.steps)
            forces.append(stepper.force)
        assert np.array_equal(*forces)
        assert np.max(forces[0]) > 0
        for length, step in ((2 * duration, dt), (duration, dt / 2)):
            with pytest.raises(ContactError, match="must be those of the problem"):
                impact.prepare(problem, step, length, bodies=(moving, still))
    with pytest.raises(ContactError, match="must be those of the problem over 200 steps"):
        impact.prepare(mass_on(truncated_rod(10)), dt, duration, bodies=(moving, still))


def truncated_rod(n: int, bare: bool = False) -> ModalGreens:
    omega = (2 * np.arange(1, n + 1) - 1) * np.pi / 2
    left_out = 1 / 6.0 - math.fsum(2 / 6.0 / omega**2)
    rest = Residual.spring(left_out) if bare else Residual.exponential(left_out, 1 / 6.0)
    return ModalGreens(omega, np.zeros(n), np.full((n, 1), math.sqrt(2 / 6.0)), rest)
