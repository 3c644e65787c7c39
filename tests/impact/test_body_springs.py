"""Bodies on springs to the ground: frequencies and deflections in closed form, energies, and the way back."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import impact
from impact.after.loads import spring_displacements, without_springs
from impact.bodies.body import Body, Load
from impact.bodies.loads import SprungBody, hold_on_springs
from impact.greens.base import GreensFunctionError
from impact.march.motion import modal_coordinates

REED = {"young": 2e11, "density": 7850.0, "length": 25e-3, "width": 10e-3, "thickness": 0.3e-3}
RIGIDITY = REED["young"] * REED["width"] * REED["thickness"] ** 3 / 12
TIP = 3 * RIGIDITY / REED["length"] ** 3  # 230 N/m
OF_MODE = RIGIDITY / (REED["density"] * REED["width"] * REED["thickness"] * REED["length"] ** 4)
OFF = 1.03  # a coefficient that is wrong by so much must show


def first_frequency(stiffness: float) -> float:
    """Return the frequency [rad/s] of a cantilever with a spring k at its tip, the first root of (1 + cos x cosh x) x^3
    EI/L^3 + k (sin x cosh x - cos x sinh x) = 0."""

    def characteristic(x: float) -> float:
        swings = math.sin(x) * math.cosh(x) - math.cos(x) * math.sinh(x)
        return (1 + math.cos(x) * math.cosh(x)) * x**3 * TIP / 3 + stiffness * swings

    return float(brentq(characteristic, 1.0, 3.9, xtol=1e-14)) ** 2 * math.sqrt(OF_MODE)


def sprung_reed(n_modes: int, stiffness: float, damping_ratio: float = 0.0) -> SprungBody:
    reed = impact.cantilever_reed(**REED, n_modes=n_modes, damping_ratio=damping_ratio)
    return hold_on_springs(reed, reed.greens.modal.shapes, stiffness)


def omega_of(body: Body) -> np.ndarray:
    return body.greens.modal.omega


def test_a_mass_on_a_spring() -> None:
    """It swings about its preload's place: x = -v/w sin wt - F/k (1 - cos wt), w = sqrt(k/m); energies close."""
    mass, stiffness, speed, push, t = 2e-3, 3e3, 0.5, 2.0, 1e-3
    free = impact.rigid_mass(mass=mass, velocity=-speed)
    shapes = free.greens.modal.shapes
    loaded = Body(free.greens, free.velocity, loads=(Load(shapes[:, 0], lambda t: np.full(np.shape(t), -push)),))
    body = hold_on_springs(loaded, shapes, stiffness)
    omega = math.sqrt(stiffness / mass)
    assert omega_of(body) == pytest.approx([omega], rel=1e-14)
    result = impact.solve(impact.ContactProblem(body, impact.spring(stiffness=1e6), gap=1e-2), dt=1e-6, duration=t)

    def moved(w: float, k: float) -> float:
        return -speed / w * math.sin(w * t) - push / k * (1 - math.cos(w * t))

    assert result.striker_displacement[-1] == pytest.approx(moved(omega, stiffness), rel=1e-9)
    assert moved(omega, stiffness) != pytest.approx(moved(math.sqrt(OFF) * omega, OFF * stiffness), rel=2e-3)
    assert result.energy.residual < 1e-12


def test_the_first_frequency_of_a_cantilever_with_a_spring_at_its_tip() -> None:
    """The error falls with the third power of the number of modes; with 40, a spring 3 % off is far above it."""
    stiffness = 9 * TIP
    exact = first_frequency(stiffness)
    errors = [omega_of(sprung_reed(n, stiffness))[0] / exact - 1 for n in (5, 10, 20, 40)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([3.0] * 3, abs=0.1)
    assert 0 < errors[-1] < 3e-6
    assert first_frequency(OFF * stiffness) / exact - 1 > 5e-3


def test_its_own_modes_under_the_forces_of_its_springs_move_alike() -> None:
    """A run with springs moves as the reed without them does under their recorded forces: both gaps agree to second
    order in the step."""
    free = impact.cantilever_reed(**REED, n_modes=6, tip_deflection=0.3e-3)
    shapes = np.column_stack([free.greens.modal.shapes, 0.3 * free.greens.modal.shapes])
    body, errors = hold_on_springs(free, shapes, [400.0, 900.0]), []
    for dt in (4e-7, 2e-7):
        problem = impact.ContactProblem(body, impact.spring(stiffness=1e5), gap=0.0)
        result = impact.solve(problem, dt=dt, duration=8e-4)
        assert result.force.max() > 1.0
        assert result.energy.residual < 1e-9
        modes = without_springs(body, result.force, dt)
        assert not isinstance(modes, SprungBody)
        there = modal_coordinates(modes, result.force[None, 1:], dt, 1) @ modes.greens.modal.shapes[:, 0]
        by_springs = spring_displacements(body, result.force, dt)[0]
        errors.append(np.abs(there - by_springs).max() / np.abs(by_springs).max())
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] > 3


@pytest.mark.parametrize(
    ("body", "shapes", "stiffness", "words"),
    [
        (Body(impact.spring(stiffness=1.0)), np.ones((1, 1)), 1.0, "modes.*springs"),
        (impact.rigid_mass(mass=1.0, velocity=0.0), np.ones((2, 1)), 1.0, "a row for each of the 1 modes"),
        (sprung_reed(2, 10.0), np.ones((2, 1)), 1.0, "springs already"),
        (impact.rigid_mass(mass=1.0, velocity=0.0), np.ones((1, 1)), -1.0, "must be positive and finite"),
    ],
)
def test_what_is_wrong(body: Body, shapes: np.ndarray, stiffness: float, words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        hold_on_springs(body, shapes, stiffness)
