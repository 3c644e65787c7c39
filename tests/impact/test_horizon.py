"""How a difference between two runs grows from landing to landing, where it is known in closed form."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.greens.base import Array
from impact.march import ladder
from impact.march.ladder import march
from impact.runs.solver import PERTURBATION, Horizon, make_twin
from tests.known_answers.compliant import rigid_seat

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
