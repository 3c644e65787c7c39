"""Scenes solved side by side are the scenes solved one by one."""

import math

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactError, ContactProblem, Load, ModalGreens, ModalState, Residual, measures
from impact.runs.batch import ImpactBatch, solve_many

SEAT = ModalGreens(
    np.array([2e4, 9e4, 2.1e5]),
    np.array([0.05, 0.02, 0.3]),
    np.array([[3.0], [-2.0], [4.0]]),
    Residual.exponential(2e-9, 1e-3),
)
DT, DURATION = 5e-7, 6e-4


def thrown(law: impact.Law, side: int = 1) -> ContactProblem:
    striker = impact.rigid_mass(mass=0.01, velocity=-0.5 * side)
    return ContactProblem(striker, contacts=[Contact(Body(SEAT), gap=1e-5, law=law, side=side)])


def released(law: impact.Law) -> ContactProblem:
    reed = impact.cantilever_reed(
        young=2e11, density=7850, length=0.02, width=0.01, thickness=0.0004, n_modes=12, tip_deflection=1e-4
    )
    push = Load(reed.greens.shapes[:, 0], lambda t: -0.1 * np.cos(3000 * t))  # type: ignore[attr-defined]
    return ContactProblem(Body(reed.greens, state=reed.state, loads=(push,)), Body(SEAT), law=law)


def one_by_one(
    problem: ContactProblem, gap: float, velocity: float | None, scale: float, rule: str
) -> impact.ImpactResult:
    body = problem.striker
    state = body.state and ModalState(scale * body.state.displacement, scale * body.state.velocity)
    moving = Body(body.greens, velocity=body.velocity if velocity is None else velocity, state=state, loads=body.loads)
    first = problem.contacts[0]
    contact = Contact(first.target, gap=gap, law=first.law, side=first.side)
    return impact.solve(ContactProblem(moving, contacts=[contact]), dt=DT, duration=DURATION, rule=rule)


def compare(batch: ImpactBatch, s: int, alone: impact.ImpactResult, side: int = 1) -> None:
    """Compare measures to 1e-12, and differences of nearly equal gaps to their own round-off."""
    np.testing.assert_allclose(batch.force[s], alone.force, rtol=0, atol=1e-11 * max(alone.force.max(), 1e-300))
    np.testing.assert_allclose(batch.gap[s], alone.gap, rtol=0, atol=1e-11 * np.abs(alone.gap).max())
    assert batch.peak_force[s] == pytest.approx(measures.peak_force(alone), rel=1e-12)
    assert batch.impulse[s] == pytest.approx(measures.impulse(alone), rel=1e-12)
    assert batch.filtered_peak_force[s] == pytest.approx(measures.filtered_peak_force(alone, 1.3e-6), rel=1e-12)
    groups = measures.contact_groups(alone)
    assert batch.contact_count[s] == len(groups)
    assert batch.in_contact[s] == (alone.force[-1] > 0)
    if len(groups) == 0:
        assert math.isnan(batch.first_contact[s])
        assert math.isnan(batch.contact_duration[s])
        assert math.isnan(batch.impact_velocity[s])
        return
    assert batch.first_contact[s] == pytest.approx(groups[0, 0], rel=1e-12)
    assert batch.contact_duration[s] == pytest.approx(groups[0, 1] - groups[0, 0], rel=1e-12)
    round_off = 1e-15 * np.abs(alone.gap).max() / DT
    approach = alone.target_velocity - alone.striker_velocity
    at_once = groups[0, 0] < 1.5 * DT
    closing = side * approach if at_once else measures.impact_velocity(alone)
    assert batch.impact_velocity[s] == pytest.approx(closing, rel=1e-12, abs=round_off)
    if not math.isinf(alone.striker_mass):
        after = -approach + side * measures.impulse(alone) / alone.striker_mass
        assert batch.rebound_velocity[s] == pytest.approx(side * after, rel=1e-12)
        if side == 1 and alone.force[-1] == 0:
            assert batch.rebound_velocity[s] == pytest.approx(measures.restitution(alone) * approach, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "rule"),
    [
        (impact.Hertz(stiffness=1e9), "passive"),
        (impact.Hertz(stiffness=1e9), "conserving"),
        (impact.LinearSpring(stiffness=1e7), "passive"),
        (impact.HuntCrossley(stiffness=1e9, damping=0.3), "passive"),
        (impact.Signorini(), "passive"),
    ],
)
@pytest.mark.parametrize("side", [1, -1])
def test_throws(law: impact.Law, rule: str, side: int) -> None:
    count = 19  # a full group of lanes and a part of one
    rng = np.random.default_rng(3)
    gaps, speeds = rng.uniform(0, 3e-5, count), -side * rng.uniform(0.1, 2.0, count)
    speeds[4] *= -1  # flies away
    gaps[5] = 0.0  # touches at once
    problem = thrown(law, side)
    batch = solve_many(
        problem, dt=DT, duration=DURATION, gaps=gaps, velocities=speeds, record="force", filter_width=1.3e-6, rule=rule
    )
    assert np.sum(batch.contact_count > 0) >= count - 2
    for s in range(count):
        compare(batch, s, one_by_one(problem, gaps[s], speeds[s], 1.0, rule), side)


def test_releases_under_a_load() -> None:
    problem = released(impact.Hertz(stiffness=1e8))
    scales = np.linspace(0.2, 2.0, 7)
    batch = solve_many(
        problem, dt=DT, duration=DURATION, release_scales=scales, gaps=2e-5, record="force", filter_width=1.3e-6
    )
    assert np.all(np.isnan(batch.rebound_velocity))
    assert np.sum(batch.contact_count > 0) >= 5
    for s, scale in enumerate(scales):
        compare(batch, s, one_by_one(problem, 2e-5, None, scale, "auto"))


def test_number_of_threads_changes_nothing_and_progress_is_told() -> None:
    problem, heard = thrown(impact.Hertz(stiffness=1e9)), []
    speeds = -np.linspace(0.1, 1.0, 50)
    one = solve_many(problem, dt=DT, duration=DURATION, velocities=speeds, workers=1)
    four = solve_many(
        problem, dt=DT, duration=DURATION, velocities=speeds, workers=4, progress=lambda _, done: heard.append(done)
    )
    assert np.array_equal(one.peak_force, four.peak_force)
    assert np.array_equal(one.impulse, four.impulse)
    assert len(one.force) == len(one.gap) == 0
    assert np.isnan(one.filtered_peak_force).all()
    assert heard == sorted(heard)
    assert heard[-1] == 1.0


def test_impossible_batches_are_refused() -> None:
    problem = thrown(impact.Hertz(stiffness=1e9))
    reed = released(impact.Hertz(stiffness=1e9))
    rod = Body(impact.fixed_rod(young=4.0, density=1.0, area=3.0, length=2.0))

    def refuse(words: str, problem: ContactProblem, **more: object) -> None:
        with pytest.raises(ContactError, match=words):
            solve_many(problem, dt=DT, duration=DURATION, **more)  # type: ignore[arg-type]

    refuse(r"gaps \(3,\), velocities \(2,\)", problem, gaps=np.zeros(3), velocities=np.zeros(2))
    refuse("velocities .*finite, 1 ", problem, velocities=[0.1, math.nan])
    refuse("held: use release_scales", reed, velocities=[1.0])
    refuse("give it one: Body", problem, release_scales=[1.0])
    refuse("filter_width = 5e-07 s .*two steps", problem, filter_width=5e-7)
    refuse("engine 'poles' is impossible", ContactProblem(problem.striker, rod))
    refuse("a single contact", ContactProblem(problem.striker, contacts=[*problem.contacts, *problem.contacts]))
