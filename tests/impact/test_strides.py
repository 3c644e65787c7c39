"""Long strides through flight: the forces of the march step by step, whatever flies, swings, relaxes, is preloaded."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactProblem, ContactStepper
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march.history import Poles
from impact.march.prepared import Prepared
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
