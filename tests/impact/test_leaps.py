"""Tests of the integration in steps of different lengths: motion and energies of one body under known forces."""

import numpy as np
import pytest

from impact.bodies.body import ModalState
from impact.greens.modal import ModalGreens, Residual
from impact.march.replay import BodyAtStart, EqualReplay, LeapReplay, find_loads

STEP = 1e-6
OMEGA = np.array([0.0, 10.0, 3e3, 4e4, 2e5, 3e6, 2e4, 5e5])
ZETA = np.array([0.0, 0.0, 1e-3, 0.02, 0.3, 0.01, 1.0, 3.0])


def make_body(seed: int) -> tuple[ModalGreens, ModalState, np.ndarray]:
    """Return modes of all kinds with two ports, a state of theirs, and the shape of a load."""
    random = np.random.default_rng(seed)
    residual = Residual(random.normal(size=(2, 2)), np.array([3e4, 2e5]), np.diag([1e-9, 2e-9]))
    shapes = random.normal(size=(len(OMEGA), 2))
    rates = random.normal(size=len(OMEGA))
    state = ModalState(rates / np.maximum(OMEGA, 100.0), random.normal(size=len(OMEGA)))
    return ModalGreens(OMEGA, ZETA, shapes, residual, ("one", "two")), state, random.normal(size=len(OMEGA))


def replays(
    modal: ModalGreens, state: ModalState, load: np.ndarray, spans: np.ndarray
) -> tuple[LeapReplay, EqualReplay]:
    """Return the body at rest in its residual, in steps of several lengths and in equal ones."""
    body = BodyAtStart(modal, state, np.zeros(2), np.zeros(2), [load], np.eye(2))
    return LeapReplay(body, spans), EqualReplay(body, STEP)


def test_leaps_end_where_equal_steps_do() -> None:
    """Leaps under constant forces and straight loads end with the displacements, energies and work of equal steps."""
    modal, state, shape = make_body(1)
    random, lengths = np.random.default_rng(2), np.array([1, 4, 16])
    levels = random.integers(0, 3, 40)
    ends = np.concatenate([[0], np.cumsum(lengths[levels])])
    force = random.normal(size=(2, len(levels)))
    leaps, equal = replays(modal, state, shape, STEP * lengths)
    load = np.full((1, ends[-1]), 3.0)
    means, rises = find_loads(load, ends)
    long = leaps.advance(force, means, levels, rises)
    fine = equal.advance(np.repeat(force, lengths[levels], axis=1), load)
    last = ends[1:] - 1
    np.testing.assert_allclose(long.displacement, fine.displacement[:, last], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(long.stored, fine.stored[last], rtol=1e-10)
    for name in ("lost", "load_work"):
        whole = np.cumsum(getattr(fine, name))[last]
        np.testing.assert_allclose(np.cumsum(getattr(long, name)), whole, rtol=1e-9, atol=1e-10 * np.abs(whole).max())
    assert leaps.stored == pytest.approx(fine.stored[-1], rel=1e-10)


@pytest.mark.parametrize("wrong", [1.0, 1.03])
def test_energy_balances_under_loads_that_rise(wrong: float) -> None:
    """Stored energy, loss, work of loads and of forces are integrated separately, and their sum vanishes; not with a
    loss, or a rise in the work, that is off by 3 %."""
    modal, state, shape = make_body(3)
    random, lengths = np.random.default_rng(4), np.array([1, 4, 64, 1024])
    levels = random.integers(0, 4, 200)
    leaps, _ = replays(modal, state, shape, STEP * lengths)
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
    fewer, _ = replays(modal, state, shape, STEP * lengths)
    off = change + block.lost - work - fewer.advance(force, means, levels, 1.03 * rises).load_work
    assert np.abs(off).max() > 1e-6 * size


def test_straight_loads_are_seen_as_mean_and_rise() -> None:
    """The mean and the rise over a leap of a straight load, constant over each fine step, are exact."""
    time = np.arange(20) + 0.5
    means, rises = find_loads(np.array([2.0 + 0.5 * time]), np.array([0, 1, 5, 20]))
    np.testing.assert_allclose(means[0], [2.25, 3.5, 8.25])
    np.testing.assert_allclose(rises[0], [0.0, 2.0, 7.5])
