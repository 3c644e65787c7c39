"""Flight: the fall of a free body does not cancel the lift of its contacts."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactProblem, ContactStepper, LinearSpring, Signorini, prepare
from impact.bodies.body import Load, ModalState
from impact.greens.modal import ModalGreens, Residual
from impact.march.prepared import BLOCK, Prepared


def ball(*, ports: int = 1, modes: int = 0, mass: float = 2.0) -> Body:
    """Return a mass (with elastic modes) under its weight of 1 N, thrown down at 1 m/s."""
    omega = np.concatenate([[0.0], 3.0 + np.arange(modes)])
    shapes = np.full((1 + modes, ports), 1 / np.sqrt(mass)) * (1 + 0.1 * np.arange(ports))
    names = tuple(str(k) for k in range(ports))
    greens = ModalGreens(omega, np.zeros(1 + modes), shapes, Residual.spring(1e-3 * np.eye(ports)), names)
    state = ModalState(np.zeros(1 + modes), np.concatenate([[-np.sqrt(mass)], np.zeros(modes)]))
    weight = Load(shapes[:, 0].copy(), lambda t: np.full(t.shape, -1.0))
    return Body(greens, state=state, loads=(weight,))


def seat(ports: int = 1) -> Body:
    names = tuple(str(k) for k in range(ports))
    greens = ModalGreens(np.array([5.0]), np.array([0.01]), np.ones((1, ports)), Residual.spring(np.eye(ports)), names)
    return Body(greens)


def problem(ports: int = 1, modes: int = 0, law: LinearSpring | Signorini | None = None) -> ContactProblem:
    target = seat(ports)
    contacts = [Contact(target, k, 0.01 * k, law or Signorini(), 1, k) for k in range(ports)]
    return ContactProblem(ball(ports=ports, modes=modes), contacts=contacts)


@pytest.mark.slow(but="0-1")
@pytest.mark.parametrize("ports", [1, 2])
@pytest.mark.parametrize("modes", [0, 3])
def test_the_march_follows_the_replay_of_its_forces(ports: int, modes: int) -> None:
    """The replay sums the forces with their round-off; superposed, the gaps are fifty times as far from it."""
    prepared = prepare(problem(ports, modes), 1e-2, 1000.0)
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
    prepared = prepare(problem(ports, 2), 1e-2, 3 * BLOCK * 1e-2)
    whole, first, second = (ContactStepper(prepared) for _ in range(3))
    whole.advance(prepared.steps)
    first.advance(stop)
    second.restore(first.checkpoint())
    second.advance(prepared.steps)
    assert np.array_equal(whole.force, second.force)
    assert np.array_equal(whole.gap, second.gap)
