"""Flight: strides give the forces of every step; the fall of a free body does not cancel the lift of its contacts."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactProblem, ContactStepper, LinearSpring, Signorini, prepare
from impact.bodies.body import Load, ModalState
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march.history import Poles
from impact.march.prepared import BLOCK, Prepared
from impact.march.stepper import Strides

SEAT = ModalGreens(
    2 * np.pi * np.array([8e3, 31e3, 9e4]),
    np.array([0.02, 0.05, 0.1]),
    np.array([[4.0, 0.4], [6.0, 1.0], [9.0, 3.0]]),
    Residual.relaxing(np.eye(2) * 2e-9, 2 * np.pi * 4e5),
    port_names=("inner", "outer"),
)


def reed(*loads: impact.Pressure, tip: float = 0.8e-3) -> Body:
    return impact.cantilever_reed(
        young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.305e-3, damping_ratio=0.02, n_modes=20,
        tip_deflection=tip, loads=loads,
    )  # fmt: skip


def between_stops() -> tuple[ContactProblem, float, float]:
    wave = impact.Pressure(lambda t: 1500 * np.sin(2 * np.pi * t / 4e-3))
    seat = Body(SEAT)
    contacts = [
        Contact(seat, port=0),
        Contact(seat, port=1),
        Contact(impact.spring(stiffness=5e6), gap=1.2e-3, side=-1),
    ]
    return ContactProblem(reed(wave), contacts=contacts), 2e-7, 12e-3


def preloaded() -> tuple[ContactProblem, float, float]:
    blow = impact.Pressure(lambda t: -400 + 3000 * np.sin(2 * np.pi * t / 3e-3) ** 2)
    return ContactProblem(reed(blow, tip=0.0), Body(SEAT), law=impact.LinearSpring(5e7), preload=True), 2e-7, 8e-3


def bouncing() -> tuple[ContactProblem, float, float]:
    """A ball under its weight, whose flight is laid ahead in blocks."""
    ball = impact.rigid_mass(mass=1e-4, velocity=-0.5)
    g = ball.greens.modal
    weight = impact.Load(g.shapes[:, 0], lambda t: np.full(len(t), -0.05))
    return ContactProblem(replace(ball, loads=(weight,)), Body(SEAT), law=impact.Hertz(1e9), gap=1e-4), 2e-7, 12e-3


def marched(prepared: Prepared, *, flying: bool) -> ContactStepper:
    stepper = ContactStepper(prepared, flying=flying)
    stepper.advance(prepared.steps)
    return stepper


@pytest.mark.parametrize("case", [between_stops, preloaded, bouncing])
def test_the_forces_are_those_of_every_step(case: object) -> None:
    """Contacts and openings again and again; what is flown over is seen by its gap, which is a line there."""
    problem, dt, duration = case()  # type: ignore[operator]
    prepared = impact.prepare(problem, dt, duration, engine="poles")
    every, flown = (marched(prepared, flying=flying) for flying in (False, True))
    closed = np.any(every.force > 0, axis=1)
    assert np.count_nonzero(np.diff(closed.astype(int)) == 1) >= 3
    # contact after contact makes round-off grow: by 1.4e-9 of the largest force at two of 180,000 instants
    np.testing.assert_allclose(flown.force, every.force, rtol=0, atol=5e-9 * every.force.max())
    other = np.any(np.abs(flown.gap - every.gap) > 1e-15, axis=1)
    assert np.count_nonzero(other) > 0.1 * len(other)
    assert not np.any(other[1:] & closed)
    assert np.all((flown.gap > 0)[1:][~closed] | (every.gap <= 0)[1:][~closed])


def test_one_stride_is_many_steps() -> None:
    """To round-off, of all poles, under a constant drive; and none strays further from the line than it is said to."""
    poles = Poles.from_modes([(SEAT, np.array([[1.0], [0.0]]))], 2e-7, 1)
    count = poles.steps.shape[1]
    drive = np.linspace(0.5, 2.0, count)
    strides = Strides.from_poles(poles.steps, drive, 10**6)
    a11, a21, a22, c1, c2 = poles.steps
    rest = strides.swing[:2]
    for power, length in zip(strides.powers, strides.lengths, strict=True):
        rng = np.random.default_rng(int(length))
        start = rest + rng.normal(size=(2, count)) * np.abs(rest).max(axis=0)
        start[1, a21 == 0] = 0.0
        q, p = start
        steps: list[Array] = [q]
        for _ in range(length):
            q, p = a11 * q + p + c1 * drive, a21 * q + a22 * p + c2 * drive
            steps.append(q)
        b11, b12, b21, b22, err = power
        x, y = start - rest
        np.testing.assert_allclose(rest[0] + b11 * x + b12 * y, q, rtol=0, atol=1e-10 * np.abs(steps).max())
        np.testing.assert_allclose(rest[1] + b21 * x + b22 * y, p, rtol=0, atol=1e-10 * np.abs(steps).max())
        amplitude = np.hypot(x, strides.swing[3] * y + strides.swing[2] * x)
        share = np.linspace(0.0, 1.0, length + 1)[:, None]
        strayed = np.abs(np.array(steps) - (1 - share) * steps[0] - share * q).max(axis=0)
        assert np.all(strayed <= err * amplitude * (1 + 1e-6) + 1e-12 * np.abs(steps).max(axis=0))
        if length == strides.lengths[0]:  # of the slowest, the bound is near
            assert strayed[0] > 0.05 * err[0] * amplitude[0]


def test_a_stopped_march_goes_on() -> None:
    """Strides end where the march is stopped: the forces stay the same."""
    problem, dt, duration = between_stops()
    prepared = impact.prepare(problem, dt, duration, engine="poles")
    whole, first, second = marched(prepared, flying=True), *(ContactStepper(prepared, flying=True) for _ in range(2))
    first.advance(7777)
    second.restore(first.checkpoint())
    second.advance(prepared.steps)
    np.testing.assert_allclose(second.force, whole.force, rtol=0, atol=5e-9 * whole.force.max())


def ball(*, ports: int = 1, modes: int = 0, mass: float = 2.0) -> Body:
    """A mass (with elastic modes) under its weight of 1 N, thrown down at 1 m/s."""
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
    """Of the march's gaps from those of the bodies under its forces; and these."""
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
