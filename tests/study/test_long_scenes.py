"""Twenty drawn long scenes: the landings of a run in steps of different lengths are those of equal steps."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactProblem
from impact.after.landings import Landing, pair_landings
from impact.bodies.body import Load, ModalState
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march.ladder import LadderMarch, finish_march, march, prepare_levels
from impact.march.prepared import discretise
from impact.march.rows import MarchRun
from impact.runs.solver import collect
from seatfem.study.impacts.landings import Landings, landings_of_march, landings_of_result

STEP, WIDTH = 100e-9, 5e-6
NAMES = ("start", "closing_speed", "filtered_peak", "impulse")
BAR = 0.015  # a bar's part that is not of the step: few landings of a scene have less
FELT = 0.2  # least peak of a landing that is compared, over the hardest one's


def modes(random: np.random.Generator, count: int, low: float, high: float, parts: int, size: float) -> ModalGreens:
    """Return modes with frequencies that grow like squares [Hz] and a passive residual."""
    frequencies = np.linspace(np.sqrt(low), np.sqrt(high), count) ** 2
    shapes = size * random.normal(1.0, 0.3, (count, parts)) * (-1.0) ** np.arange(count)[:, None]
    rest = Residual.relaxing(3e-9 * np.eye(parts), 2 * np.pi * high)
    zeta = np.full(count, random.uniform(0.01, 0.05))
    return ModalGreens(2 * np.pi * frequencies, zeta, shapes, rest, tuple(f"part {k}" for k in range(parts)))


def draw_problem(seed: int) -> tuple[ContactProblem, float]:
    """Return a scene and its duration [s]: a reed in gas or released, tilted or not, with or without stopper, film,
    preload and moving base, on a seat of modes with one of the laws."""
    random = np.random.default_rng(seed)
    parts = int(random.choice([1, 1, 2, 4]))
    reed, seat = modes(random, 10, 250.0, 6e4, parts, 25.0), Body(modes(random, 12, 3e4, 6e5, parts, 5.0))
    lift, rate = random.uniform(0.5e-4, 1.5e-4), random.uniform(100.0, 300.0)
    preload = seed % 5 == 4
    push = random.uniform(2.0, 6.0)
    gas = Load(reed.shapes.mean(axis=1), lambda t: -push * np.cos(2 * np.pi * rate * t) * (1 if preload else 0.6))
    state = None if preload else ModalState(np.eye(10)[0] * random.uniform(1e-6, 4e-6), np.zeros(10))
    striker = Body(reed, loads=(gas,), state=state)
    law = [impact.Signorini(), impact.LinearSpring(2e7), impact.Hertz(1e10), impact.HuntCrossley(1e10, 0.1)][seed % 4]
    if preload:
        law = impact.LinearSpring(2e7)
    film = impact.SqueezeFilm(coefficient=4e-16, floor=2e-6) if seed % 7 == 3 else None
    if seed % 6 == 5 and not preload:
        seat = replace(seat, base=lambda t: 1e-5 * np.sin(2 * np.pi * 150 * t))
    gaps = np.zeros(parts) if preload else lift / 4 + 3e-6 * np.arange(parts)
    contacts = [Contact(seat, port=k, striker_port=k, gap=float(gaps[k]), law=law, film=film) for k in range(parts)]
    if seed % 3 == 1:
        contacts.append(Contact(impact.spring(stiffness=5e6), gap=1.2 * lift, side=-1))
    return ContactProblem(striker, contacts=contacts, preload=preload), random.uniform(5e-3, 9e-3)


def in_long_steps(problem: ContactProblem, duration: float) -> MarchRun:
    """Return the run in steps of different lengths, whatever they save."""
    one = discretise(problem, STEP, duration)
    levels = prepare_levels(one)
    return finish_march(LadderMarch(one, levels))


def numbers(landings: Landings, like: Landings) -> list[tuple[Landing, Array]]:
    """Return the landings of ``like`` that are felt, with the numbers of their partners."""
    pairs = []
    for face in ("seat", "stopper"):
        own = like.on(face)
        hardest = max((one.filtered_peak for one in own), default=0.0)
        for one, partner in zip(own, pair_landings(own, landings.on(face)), strict=True):
            if one.filtered_peak >= FELT * hardest and not one.cut_off:
                assert partner is not None
                pairs.append((one, np.array([getattr(partner, name) for name in NAMES])))
    return pairs


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_landings_are_those_of_equal_steps(seed: int) -> None:
    """Start, closing speed, peak and impulse of each landing are apart by at most a tenth of a bar: of three times what
    half the step changes, as error budgets have it, and 1.5 % of the value (of a start: of the filter's width)."""
    problem, duration = draw_problem(seed)
    run = in_long_steps(problem, duration)
    equal, finer = (march(problem, STEP / part, duration, equal_steps=True) for part in (1, 2))
    like = landings_of_march(equal, WIDTH)
    assert like.seat or like.stopper or problem.preload
    impulses = [float(each.rows.spans @ each.rows.force[1:].sum(axis=1)) for each in (run, equal)]
    assert impulses[0] == pytest.approx(impulses[1], rel=3e-4)
    long = numbers(landings_of_march(run, WIDTH), like)
    for (one, other), (_, half) in zip(long, numbers(landings_of_march(finer, WIDTH), like), strict=True):
        exact = np.array([getattr(one, name) for name in NAMES])
        size = np.array([WIDTH, *np.abs(exact[1:])])
        whole = np.array([2.01 * STEP, 0.0, 0.0, 0.0])  # starts are whole steps, of both runs
        assert np.all(np.abs(other - exact) <= 0.1 * (3 * np.abs(half - exact) + BAR * size) + whole), one
    assert len(run.rows.ends) < 0.6 * run.steps


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 20, 3))
def test_energies_of_long_steps_balance(seed: int) -> None:
    """Each term is integrated by itself; landings found by energies have the same restitution."""
    problem, duration = draw_problem(seed)
    run = in_long_steps(problem, duration)
    result = collect(run)
    assert not result.rows.is_uniform
    assert result.rows.energy.residual < 1e-10
    by_energy, by_motion = landings_of_result(problem, result, WIDTH), landings_of_march(run, WIDTH)
    for one, other in zip(by_energy.seat, by_motion.seat, strict=True):
        pair = np.array([one.restitution, other.restitution], dtype=float)  # of some unknown
        np.testing.assert_allclose(*pair, rtol=1e-9)
        assert one.impulse == pytest.approx(other.impulse, rel=1e-9)
