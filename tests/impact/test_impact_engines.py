"""The engines agree, runs can be split, fed step by step and solved side by side; a fall does not cancel a lift."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import (
    Body,
    Contact,
    ContactError,
    ContactProblem,
    ContactStepper,
    Load,
    ModalGreens,
    ModalState,
    Residual,
    measures,
)
from impact.march import history
from impact.march.prepared import BLOCK, Prepared
from impact.runs.batch import ImpactBatch, solve_many
from impact.storage import hdf5 as files
from impact.storage.hdf5 import StorageError


def contacts(count: int, law: impact.Law | None = None) -> ContactProblem:
    """Return a free random body thrown on yielding supports, each with its own gap: with rigid, light, critical and
    heavy modes, relaxations, a dashpot and a bare compliance."""
    rng = np.random.default_rng(8)
    omega = np.concatenate([[0.0], rng.uniform(0.5, 150.0, 8)])
    shapes = rng.normal(size=(count, count))
    residual = Residual(rng.normal(size=(2, count)) / 5, np.array([0.0, 40.0]), 1e-3 * shapes @ shapes.T)
    zeta, names = rng.choice([0.0, 0.02, 0.5, 1.0, 1.7], 9), tuple(str(k) for k in range(count))
    striker = ModalGreens(omega, zeta, rng.normal(size=(9, count)), residual, names)
    support = ModalGreens(np.array([7.0]), np.array([0.1]), np.array([[0.5]]), Residual.exponential(0.02, 0.1))
    places = [
        Contact(Body(support), gap=0.01 * k, law=law or impact.Hertz(stiffness=40.0), striker_port=k)
        for k in range(count)
    ]
    rigid = np.zeros(9)
    rigid[0] = -np.sign(striker.shapes[0, 0])
    return ContactProblem(Body(striker, state=impact.ModalState(np.zeros(9), rigid)), contacts=places)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_engines_give_the_same_impact(count: int) -> None:
    """All engines agree to round-off under Hertz's law, which is smooth and does not amplify it."""
    results = {
        engine: impact.solve(contacts(count), dt=0.01, duration=8.0, engine=engine, block=64)  # type: ignore[arg-type]
        for engine in ("poles", "direct", "fft")
    }
    poles = results["poles"]
    assert poles.force.max() > 0.1
    for engine, words in (("direct", "direct sum"), ("fft", "FFT in blocks of 64 steps")):
        other = results[engine]
        assert words in other.engine
        assert "step weights of 11 poles" in other.engine
        np.testing.assert_allclose(other.force, poles.force, atol=1e-9 * poles.force.max(), rtol=0)
        # the ledger comes from the poles whatever marched: nothing is known by work only
        assert other.energy.by_work == ()
        assert other.energy.residual < 1e-10
        np.testing.assert_allclose(other.energy.stored, poles.energy.stored, rtol=1e-8)


def test_a_kernel_without_poles_refuses_the_pole_engine() -> None:
    rod = Body(impact.fixed_rod(young=4.0, density=1.0, area=3.0, length=2.0))
    problem = ContactProblem(impact.rigid_mass(mass=6.0, velocity=-1.0), rod)
    with pytest.raises(ContactError, match=r"'poles'.*'fft', 'direct' or 'auto'"):
        impact.solve(problem, dt=0.01, duration=1.0, engine="poles")
    with pytest.raises(ContactError, match="engine 'fast' is unknown"):
        impact.solve(problem, dt=0.01, duration=1.0, engine="fast")  # type: ignore[arg-type]
    with pytest.raises(ContactError, match="block = -1"):
        impact.solve(problem, dt=0.01, duration=1.0, block=-1)


def kernel(poles: int) -> impact.StepKernel:
    omega = np.linspace(1.0, 2.0, poles)
    greens = ModalGreens(omega, np.zeros(poles), np.ones((poles, 1)), Residual.spring(1e-3))
    return greens.step_kernel(1e-3, 10)


def test_the_cost_model_chooses() -> None:
    sampled = impact.StepKernel(None, np.ones((1, 1, 10)), "samples")
    few, many = kernel(40), kernel(20_000)
    assert history.choose([few, few], 1, 1_000_000).by_poles == (True, True)
    # 20,000 poles cost more than forming their weights once and the FFT
    assert not history.choose([few, many], 1, 1_000_000).by_poles[1]
    assert history.choose([few, sampled], 1, 300).block == 300
    assert history.choose([few, sampled], 1, 1_000_000).block < 10_000


@pytest.mark.slow(but="3-fft")
@pytest.mark.parametrize("engine", ["poles", "fft"])
@pytest.mark.parametrize("count", [1, 3])
def test_split_runs_are_single_runs_bit_for_bit_through_a_file(
    engine: history.Engine, count: int, tmp_path: Path
) -> None:
    def fresh() -> ContactStepper:
        return ContactStepper(impact.prepare(contacts(count), 0.01, 9.0, engine=engine, block=64))

    single = fresh()
    single.advance(1000)
    assert single.force.max() > 0.1
    part = fresh()
    np.testing.assert_array_equal(part.step().force, single.force[0])
    for number, steps in enumerate((63, 100, 333, 1000)):
        part.advance(steps)
        files.save_checkpoint(part, tmp_path / f"{number}.h5")
        part = fresh()
        files.restore_checkpoint(part, tmp_path / f"{number}.h5")
    assert part.done == 900
    assert np.array_equal(part.force, single.force)
    assert np.array_equal(part.gap, single.gap)


@pytest.mark.slow
def test_a_checkpoint_of_another_problem_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    stepper = ContactStepper(impact.prepare(contacts(2), 0.01, 5.0))
    stepper.advance(100)
    files.save_checkpoint(stepper, path)
    others = {
        "step dt": impact.prepare(contacts(2), 0.011, 5.0),
        "duration": impact.prepare(contacts(2), 0.01, 6.0),
        "contacts": impact.prepare(contacts(3), 0.01, 5.0),
        "laws": impact.prepare(contacts(2, impact.Hertz(stiffness=41.0)), 0.01, 5.0),
        "history engine": impact.prepare(contacts(2), 0.01, 5.0, engine="fft"),
    }
    moved = contacts(2)
    faster = impact.ModalState(moved.striker.state.displacement, 1.001 * moved.striker.state.velocity)
    others["free motion"] = impact.prepare(
        ContactProblem(Body(moved.striker.greens, state=faster), contacts=moved.contacts), 0.01, 5.0
    )
    for word, prepared in others.items():
        with pytest.raises(StorageError, match=f"run.h5:.*{word}"):
            files.restore_checkpoint(ContactStepper(prepared), path)
    with pytest.raises(ContactError, match="already done 100 steps"):
        files.restore_checkpoint(stepper, path)
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(StorageError, match="truncated or damaged"):
        files.restore_checkpoint(ContactStepper(impact.prepare(contacts(2), 0.01, 5.0)), path)


def loaded_reed(course: object) -> ContactProblem:
    reed = impact.cantilever_reed(
        young=2e11, density=7850, length=0.0254, width=0.01, thickness=0.0003, n_modes=8, tip_deflection=2e-4
    )
    pressure = Load(reed.greens.shapes[:, 0] * 0.4, course)  # type: ignore[attr-defined, arg-type]
    reed = Body(reed.greens, state=reed.state, loads=(pressure,))
    seat = Body(ModalGreens(np.array([2e4]), np.array([0.1]), np.array([[5.0]]), Residual.exponential(1e-8, 1e-3)))
    return ContactProblem(reed, seat, law=impact.Hertz(stiffness=1e9))


@pytest.mark.parametrize("engine", ["poles", "fft"])
def test_loads_given_step_by_step_are_the_loads_given_in_advance(engine: history.Engine, tmp_path: Path) -> None:
    def course(t: np.ndarray) -> np.ndarray:
        return 0.3 * np.sin(4000.0 * t)

    dt, duration = 1e-6, 3e-3
    expected = impact.solve(loaded_reed(course), dt=dt, duration=duration, engine=engine)

    def fresh() -> ContactStepper:
        return ContactStepper(impact.prepare(loaded_reed(np.zeros_like), dt, duration, engine=engine))

    stepper = fresh()
    for wrong in (np.zeros(2), np.array([np.nan])):
        with pytest.raises(ContactError, match="1 finite load"):
            stepper.step(wrong)
    given = course((np.arange(3000) + 0.5) * dt)
    for amplitude in given[:1500]:
        state = stepper.step(np.array([amplitude]))
    assert state.time == pytest.approx(1.5e-3)
    files.save_checkpoint(stepper, tmp_path / "half.h5")
    stepper = fresh()
    files.restore_checkpoint(stepper, tmp_path / "half.h5")
    for amplitude in given[1500:]:
        stepper.step(np.array([amplitude]))
    stepped = impact.collect(stepper)
    assert expected.force.max() > 1.0
    assert np.ptp(expected.energy.input) > 1e-6  # the load does work, and the ledger knows it
    np.testing.assert_allclose(stepped.force, expected.force, atol=1e-9 * expected.force.max(), rtol=0)
    np.testing.assert_allclose(stepped.energy.input, expected.energy.input, rtol=1e-9)
    assert stepped.energy.residual < 1e-10
    with pytest.raises(ContactError, match="3000 steps"):
        stepper.step()


def ball(ports: int, modes: int, mass: float = 2.0) -> Body:
    """Return a mass (with elastic modes) under its weight of 1 N, thrown down at 1 m/s."""
    omega = np.concatenate([[0.0], 3.0 + np.arange(modes)])
    shapes = np.full((1 + modes, ports), 1 / np.sqrt(mass)) * (1 + 0.1 * np.arange(ports))
    names = tuple(str(k) for k in range(ports))
    greens = ModalGreens(omega, np.zeros(1 + modes), shapes, Residual.spring(1e-3 * np.eye(ports)), names)
    state = ModalState(np.zeros(1 + modes), np.concatenate([[-np.sqrt(mass)], np.zeros(modes)]))
    weight = Load(shapes[:, 0].copy(), lambda t: np.full(t.shape, -1.0))
    return Body(greens, state=state, loads=(weight,))


def seat(ports: int) -> Body:
    names = tuple(str(k) for k in range(ports))
    greens = ModalGreens(np.array([5.0]), np.array([0.01]), np.ones((1, ports)), Residual.spring(np.eye(ports)), names)
    return Body(greens)


def problem(ports: int, modes: int) -> ContactProblem:
    target = seat(ports)
    contacts = [Contact(target, port=k, gap=0.01 * k, striker_port=k) for k in range(ports)]
    return ContactProblem(ball(ports, modes), contacts=contacts)


@pytest.mark.slow(but="0-1")
@pytest.mark.parametrize("ports", [1, 2])
@pytest.mark.parametrize("modes", [0, 3])
def test_the_march_follows_the_replay_of_its_forces(ports: int, modes: int) -> None:
    """The replay sums the forces with their round-off; superposed, the gaps are fifty times as far from it."""
    prepared = impact.prepare(problem(ports, modes), 1e-2, 1000.0)
    assert prepared.flight is not None
    assert np.count_nonzero(deviation(prepared)[1]) > 100
    assert deviation(prepared)[0] < 1e-10
    assert deviation(replace(prepared, flight=None))[0] > 1e-9


def deviation(prepared: Prepared) -> tuple[float, np.ndarray]:
    """Return how far the march's gaps are from those of the bodies under its forces, and these forces."""
    stepper = ContactStepper(prepared)
    stepper.advance(prepared.steps)
    replayed = impact.collect(stepper).gap.reshape(stepper.gap.shape)
    return float(np.abs(stepper.gap - replayed).max()), stepper.force


@pytest.mark.parametrize(
    ("ports", "stop"), [(1, 3), (2, BLOCK - 1), (1, BLOCK), (2, BLOCK + 1), (1, 2 * BLOCK), (2, 2 * BLOCK + 77)]
)
def test_split_marches_equal_single_ones(ports: int, stop: int) -> None:
    prepared = impact.prepare(problem(ports, 2), 1e-2, 3 * BLOCK * 1e-2)
    whole, first, second = (ContactStepper(prepared) for _ in range(3))
    whole.advance(prepared.steps)
    first.advance(stop)
    second.restore(first.checkpoint())
    second.advance(prepared.steps)
    assert np.array_equal(whole.force, second.force)
    assert np.array_equal(whole.gap, second.gap)


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
