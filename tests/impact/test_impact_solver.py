"""The passive march: what it refuses and advises, and how a difference between two runs grows in closed form."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, ContactError, ContactProblem, ModalGreens, Residual
from impact.greens.base import Array
from impact.march import ladder
from impact.march.ladder import march
from impact.runs.solver import PERTURBATION, Horizon, make_twin
from tests.known_answers.compliant import rigid_seat

ROD = {"young": 4.0, "density": 1.0, "area": 3.0, "length": 2.0}  # c = 2, Z = 6, l/c = 1, mass 6


def mass_on(greens: impact.GreensFunction, **more: object) -> ContactProblem:
    striker = impact.rigid_mass(mass=6.0, velocity=-1.0)
    return ContactProblem(striker, Body(greens), **more)  # type: ignore[arg-type]


def test_rigid_contact_of_bodies_that_do_not_yield_at_once_is_refused() -> None:
    bare = impact.single_mode(frequency_hz=1.0, mass=1.0)
    with pytest.raises(ContactError, match=r"1/dt.*impact\.Residual"):
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
def test_impossible_steps_and_gaps_are_refused(dt: float, duration: float, words: str) -> None:
    rod = impact.fixed_rod(**ROD)
    with pytest.raises(ContactError, match=words):
        impact.solve(mass_on(rod), dt=dt, duration=duration)
    with pytest.raises(ContactError, match="gap = nan"):
        mass_on(rod, gap=math.nan)


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
    assert "contacts of fewer than 10 steps" in contacts.name
    assert contacts.value == pytest.approx(1.0, rel=1e-12)
    assert not impact.solve(mass_on(fast), dt=0.004, duration=1.0).advice


@pytest.mark.parametrize(("velocity", "side", "away"), [(2.0, 1, True), (-2.0, 1, False), (-2.0, -1, True)])
def test_a_striker_that_flies_away_is_told_the_sign_of_velocities(velocity: float, side: int, away: bool) -> None:
    contact = impact.Contact(impact.spring(stiffness=1e6), gap=1e-6, side=side, law=impact.LinearSpring(1e6))
    problem = ContactProblem(impact.rigid_mass(mass=1e-3, velocity=velocity), contacts=[contact])
    advice = " ".join(map(str, impact.solve(problem, dt=1e-7, duration=5e-5).advice))
    assert ("flies away" in advice) == (f"write velocity = {-velocity:g}" in advice) == away


G = 9.81
MASS = 1e-3
STIFFNESS = 1e6
CONTACT = math.pi * math.sqrt(MASS / STIFFNESS)  # duration of an elastic contact [s]
PERIOD = 0.1


def ball(speed: float, force: Callable[[Array], Array]) -> impact.Body:
    body = impact.rigid_mass(mass=MASS, velocity=speed)
    return replace(body, loads=(impact.Load(np.ones(1) / math.sqrt(MASS), force),))


def dropped(height: float) -> impact.ContactProblem:
    """Return a ball that falls from a height and bounces without loss."""
    weight = ball(0.0, lambda t: np.full_like(t, -MASS * G))
    return impact.ContactProblem(weight, rigid_seat(), gap=height, law=impact.LinearSpring(stiffness=STIFFNESS))


def shaken(q: float) -> impact.ContactProblem:
    """Return a ball that bounces once a period on a table with the acceleration q g cos(w t), seen from the table.

    It touches where the table turns upward, so that without a disturbance all flights are alike: v = g T/2.
    """

    def weight(t: Array) -> Array:
        return -MASS * G * (1 + q * np.cos(2 * math.pi * t / PERIOD))

    law = impact.LinearSpring(stiffness=STIFFNESS)
    return impact.ContactProblem(ball(-G * PERIOD / 2, weight), rigid_seat(), gap=0.0, law=law)


def growth_on_a_table(q: float, n: int) -> list[float]:
    """Return differences of place before each touch over that of the gap: of the time of a touch, dt' = dt + 2 dv/g, of
    the speed after it, dv' = dv + 2 q g dt'; the first touch, later by dt = d/v, is faster by g (1 + 2 q) dt."""
    late, fast, growth = 1.0, G * (1 + 2 * q), [1.0]
    while len(growth) < n:
        late += 2 * fast / G
        fast += 2 * q * G * late
        growth.append(late)
    return growth


def test_free_bounces_grow_apart_by_two_a_flight() -> None:
    """A ball from d higher lands with g d/v more speed: each flight is longer by 2 d/v, and d becomes (2 n - 1) d."""
    v = 0.5
    horizon = impact.measure_horizon(dropped(v**2 / (2 * G)), dt=CONTACT / 40, duration=9.5 * v / G)
    assert horizon.growth == pytest.approx([1, 3, 5, 7, 9], rel=5e-3)  # a contact lasts 1e-3 of a flight
    assert horizon.known() == 5


@pytest.mark.slow
def test_bounces_on_a_table_grow_apart_as_their_map_has_it() -> None:
    """Whatever the step: by a factor of 1 + 2 q + 2 sqrt(q + q^2) = 3.73 in the end; q that is 3 % off shows."""
    q = 0.5
    growth, finer = (impact.measure_horizon(shaken(q), dt=CONTACT / n, duration=3.3 * PERIOD).growth for n in (40, 80))
    # contacts of 1e-3 of the period shift the orbit, and the shift grows as any difference
    assert growth == pytest.approx(growth_on_a_table(q, 4), rel=2e-2)
    assert growth[-1] != pytest.approx(growth_on_a_table(1.03 * q, 4)[-1], rel=2e-2)
    assert growth == pytest.approx(finer, rel=1e-3)


@pytest.mark.parametrize(
    ("growth", "difference", "count"),
    [
        ([1.0, 4.0, 16.0, 64.0], 1e-12, 4),
        ([1.0, 4.0, 16.0, 64.0], 1e-2, 2),  # 16 % before the third
        ([1.0, 4.0, 16.0, 64.0], 0.2, 0),
        ([100.0**k for k in range(4)] + [3e8] * 4, 1e-12, 6),  # 1e6 is the last small one, 1e11 is felt
        ([np.nan, 4.0], 1e-12, 2),
    ],
)
def test_landings_are_known_until_a_difference_is_felt(growth: list[float], difference: float, count: int) -> None:
    assert Horizon(np.array(growth)).known(difference) == count


def test_bodies_that_never_part_have_no_horizon() -> None:
    with pytest.raises(impact.march.problem.ContactError, match="never part"):
        make_twin(dropped(1.0), np.full((3, 1), -1e-6), PERTURBATION)


@pytest.mark.slow
def test_between_two_walls_a_ball_falls_behind_by_two_a_flight() -> None:
    """Both walls further off by d make each flight but the first longer by 2 d; at the other wall's touch all of it is
    missing: 1, 3, 5, ... d."""
    law, width, v = impact.LinearSpring(stiffness=STIFFNESS), 0.2, 1.0
    contacts = [
        impact.Contact(impact.Body(rigid_seat()), gap=width / 2, law=law),
        impact.Contact(impact.Body(rigid_seat()), gap=width / 2, law=law, side=-1),
    ]
    problem = impact.ContactProblem(impact.rigid_mass(mass=MASS, velocity=-v), contacts=contacts)
    horizon = impact.measure_horizon(problem, dt=CONTACT / 40, duration=4.0 * width / v)
    assert horizon.growth == pytest.approx([1, 3, 5, 7], rel=5e-3)


@pytest.mark.slow
def test_a_twin_that_follows_the_long_steps_of_its_run_grows_as_one_at_equal_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A difference of 1e-9 is far below what the choice of steps may change; the same steps leave it alone, but for the
    round-off of the poles: 0.4 % of it after two flights."""
    problem = dropped(0.5**2 / (2 * G))
    way: dict[str, float] = {"dt": CONTACT / 400, "duration": 0.31}
    equal = impact.measure_horizon(problem, **way)
    monkeypatch.setattr(ladder, "WORTHWHILE", 0.0)
    result = impact.solve(problem, **way)
    assert len(result.rows.ends) < len(result.time) / 10
    np.testing.assert_allclose(impact.measure_horizon(problem, **way).growth, equal.growth, rtol=1e-2)
    twin, _ = make_twin(problem, result.rows.gap[:, None], PERTURBATION)
    followed = march(twin, way["dt"], way["duration"], like=result.rows)
    alone = march(twin, way["dt"], way["duration"])
    assert np.mean(np.isin(followed.rows.ends, result.rows.ends)) >= np.mean(np.isin(alone.rows.ends, result.rows.ends))
    assert np.mean(np.isin(result.rows.ends, followed.rows.ends)) > 0.99
