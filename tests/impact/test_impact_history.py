"""What the march remembers: compiled functions are renewed, poles of one shape are summed; one replay for all uses."""

import importlib
import pkgutil
from dataclasses import replace

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import impact
from impact import Body, Load, ModalGreens, ModalState, Residual
from impact.greens.base import Array
from impact.march import history
from impact.march.history import Poles
from impact.march.loop.compiled import STAMP
from impact.march.motion import Discrete, PortForces, modal_coordinates

DT = 0.01


def test_compiled_functions_call_their_own_file_or_are_renewed_with_the_others() -> None:
    """The compiled cache does not notice a change in another file: an edited law would silently not be used."""
    names = [name for _, name, _ in pkgutil.walk_packages(impact.__path__, "impact.")]
    across = 0
    for module in map(importlib.import_module, names):
        for function in [f for f in vars(module).values() if isinstance(f, Dispatcher)]:
            scope = function.py_func.__globals__
            called = [scope[name] for name in function.py_func.__code__.co_names if name in scope]
            for other in [f for f in called if isinstance(f, Dispatcher)]:
                if other.py_func.__module__ != function.py_func.__module__:
                    across += 1
                    assert function._cache._cache_file._source_stamp == STAMP
                    assert other._cache._cache_file._source_stamp == STAMP
    assert across >= 3  # the march calls the advance and the law


def around_a_lip(ports: int) -> ModalGreens:
    """Return a held body with waves cos(m t) and sin(m t) around its ports, each the shape of several modes."""
    rng, places = np.random.default_rng(2), 2 * np.pi * np.arange(ports) / ports
    waves = [np.cos(m * places) for m in range(3)] + [np.sin(m * places) for m in (1, 2)]
    shapes = np.array([rng.normal() * wave for wave in waves for _ in range(6)])
    omega, names = rng.uniform(20.0, 150.0, 30), tuple(f"arc_{c}" for c in range(ports))
    return ModalGreens(omega, np.full(30, 0.02), shapes, Residual.spring(0.001 * np.eye(ports)), names)


def test_poles_seen_alike_are_marched_by_their_sums(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five waves of 30 modes; the forces are those of the march that knows nothing of it, and not one wave is lost."""
    ports, greens = 12, around_a_lip(12)
    poles = Poles.from_modes([(greens, np.eye(ports))], DT, ports)
    group, size, directions = poles.along()
    assert directions.shape == (ports, 5)
    assert np.abs(directions[:, group] * size - poles.psi).max() < 1e-14 * np.abs(poles.psi).max()

    def force() -> Array:
        striker = impact.rigid_mass(mass=0.02, velocity=-1.0)
        gaps = 0.0005 * (1 - np.cos(2 * np.pi * np.arange(ports) / ports))
        contacts = [impact.Contact(seat, port=c, gap=float(gap)) for c, gap in enumerate(gaps)]
        return impact.solve(impact.ContactProblem(striker, contacts=contacts), dt=DT, duration=5.0).force

    seat = impact.Body(greens)
    by_sums = force()
    monkeypatch.setattr(history, "FEWEST", ports + 1)
    assert np.count_nonzero(by_sums.any(axis=0)) > 3
    np.testing.assert_allclose(by_sums, force(), atol=1e-9 * by_sums.max())


STEP = 2e-6


def thrown() -> Body:
    """Return a body that is free, bent, damped, loaded, with two ports, relaxations and a bare compliance."""
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
    """The coordinates of a loaded body of modes, free ones among them, make its displacement at two struck ports."""
    steps = 700
    bare = thrown()
    assert isinstance(bare.greens, ModalGreens)
    body = replace(bare, greens=replace(bare.greens, residual=Residual.none(2)))
    force = np.maximum(np.random.default_rng(5).normal(size=(2, steps)).cumsum(axis=1), 0.0)
    coordinates = modal_coordinates(body, force, STEP, stride)
    assert len(coordinates) == steps // stride + 1
    forces = PortForces.at_ports(force, STEP)
    expected = Discrete.from_body(body, STEP, steps).motion(forces).displacement[:, ::stride]
    # two orders of the same sums
    np.testing.assert_allclose(coordinates @ body.greens.modal.shapes, expected.T, atol=1e-11 * np.abs(expected).max())
