"""One replay: the same for every length of its blocks, and without the energies the same displacement."""

from dataclasses import replace

import numpy as np
import pytest

from impact import Body, Load, ModalGreens, ModalState, Residual
from impact.march.motion import Discrete, mean_displacement, modal_coordinates

DT, STEPS = 2e-6, 3000


@pytest.mark.parametrize("ports", [1, 3, 16])
def test_mean_displacement_of_the_parts_of_a_lip(ports: int) -> None:
    """By the modes alone that the mean shows: of those around a lip, with the shapes cos(m t), only m = 0."""
    rng, around = np.random.default_rng(3), 2 * np.pi * np.arange(ports) / ports
    shapes = np.array([rng.normal() * np.cos(k % 3 * around) for k in range(25)])
    omega = np.sort(rng.uniform(6e3, 5e5, 25))
    rest = Residual.exponential(3e-9 * np.eye(ports) + 1e-9, 2e-2 * np.eye(ports))
    rest = replace(rest, compliance=1e-10 * np.eye(ports) + 1e-11)
    greens = ModalGreens(omega, np.full(25, 0.02), shapes, rest, tuple(f"arc_{c}" for c in range(ports)))
    body = Discrete.from_body(Body(greens), DT, STEPS)
    force = np.maximum(rng.normal(size=(ports, STEPS)).cumsum(axis=1), 0.0)
    expected = body.motion(force).displacement
    for shares in (np.full(ports, 1 / ports), np.arange(1.0, ports + 1)):
        found = mean_displacement(body, force, shares)
        # two orders of the same sums over 3,000 steps
        np.testing.assert_allclose(found, shares @ expected, atol=1e-12 * np.abs(expected).max() * shares.sum())


def thrown() -> Body:
    """Free, bent, damped, loaded, with two ports, relaxations and a bare compliance."""
    rng = np.random.default_rng(11)
    omega = np.sort(rng.uniform(6e3, 5e5, 9))
    omega[:2] = 0.0
    rest = Residual(rng.normal(size=(2, 2)) * 1e-2, np.array([1e4, 1e6]), 1e-9 * np.eye(2))
    greens = ModalGreens(omega, np.full(9, 0.03), rng.normal(size=(9, 2)), rest, ("left", "right"))
    state = ModalState(1e-6 * rng.normal(size=9), 1e-2 * rng.normal(size=9))
    loads = (Load(rng.normal(size=9), np.cos), Load(rng.normal(size=9), lambda t: np.sin(1e4 * t)))
    return Body(greens, -0.3, state, loads)


@pytest.mark.parametrize("stride", [1, 7])
def test_coordinates_make_the_displacement_of_the_ports(stride: int) -> None:
    """Of a body of modes alone, free ones among them, bent, loaded and struck at two ports."""
    steps = 700
    bare = thrown()
    assert isinstance(bare.greens, ModalGreens)
    body = replace(bare, greens=replace(bare.greens, residual=Residual.none(2)))
    force = np.maximum(np.random.default_rng(5).normal(size=(2, steps)).cumsum(axis=1), 0.0)
    found = modal_coordinates(body, force, DT, stride)
    assert len(found) == steps // stride + 1
    expected = Discrete.from_body(body, DT, steps).motion(force).displacement[:, ::stride]
    # two orders of the same sums
    np.testing.assert_allclose(found @ body.greens.modal.shapes, expected.T, atol=1e-11 * np.abs(expected).max())
