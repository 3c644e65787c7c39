"""What the march remembers, one replay for all uses, and means of forces along a closed line."""

import importlib
import pkgutil
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import impact
from impact.after import histories
from impact.after.histories import average_over_arcs, line_force_peak, line_impulse_peak
from impact.greens.base import Array
from impact.march import history
from impact.march.history import Poles
from impact.march.loop.compiled import STAMP
from impact.march.motion import DiscreteBody, PortForces, modal_coordinates

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


def test_poles_seen_alike_are_marched_by_their_sums(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five waves of 30 modes; the forces are those of the march that knows nothing of it, and not one wave is lost."""
    # a held body with waves cos(m t) and sin(m t) around its ports, each the shape of several modes
    ports, rng = 12, np.random.default_rng(2)
    places = 2 * np.pi * np.arange(ports) / ports
    waves = [np.cos(m * places) for m in range(3)] + [np.sin(m * places) for m in (1, 2)]
    shapes = np.array([rng.normal() * wave for wave in waves for _ in range(6)])
    omega, names = rng.uniform(20.0, 150.0, 30), tuple(f"arc_{c}" for c in range(ports))
    greens = impact.ModalGreens(omega, np.full(30, 0.02), shapes, impact.Residual.spring(0.001 * np.eye(ports)), names)
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


def thrown() -> impact.Body:
    """Return a body that is free, bent, damped, loaded, with two ports, relaxations and a bare compliance."""
    rng = np.random.default_rng(11)
    omega = np.sort(rng.uniform(6e3, 5e5, 9))
    omega[:2] = 0.0
    rest = impact.Residual(rng.normal(size=(2, 2)) * 1e-2, np.array([1e4, 1e6]), 1e-9 * np.eye(2))
    greens = impact.ModalGreens(omega, np.full(9, 0.03), rng.normal(size=(9, 2)), rest, ("left", "right"))
    state = impact.ModalState(1e-6 * rng.normal(size=9), 1e-2 * rng.normal(size=9))
    loads = (impact.Load(rng.normal(size=9), np.cos), impact.Load(rng.normal(size=9), lambda t: np.sin(1e4 * t)))
    return impact.Body(greens, -0.3, state, loads)


@pytest.mark.parametrize("stride", [1, 7])
def test_coordinates_make_the_displacement_of_the_ports(stride: int) -> None:
    """The coordinates of a loaded body of modes, free ones among them, make its displacement at two struck ports."""
    steps = 700
    bare = thrown()
    assert isinstance(bare.greens, impact.ModalGreens)
    body = replace(bare, greens=replace(bare.greens, residual=impact.Residual.none(2)))
    force = np.maximum(np.random.default_rng(5).normal(size=(2, steps)).cumsum(axis=1), 0.0)
    coordinates = modal_coordinates(body, force, STEP, stride)
    assert len(coordinates) == steps // stride + 1
    forces = PortForces.at_ports(force, STEP)
    expected = DiscreteBody.from_body(body, STEP, steps).motion(forces).displacement[:, ::stride]
    # two orders of the same sums
    np.testing.assert_allclose(coordinates @ body.greens.modal.shapes, expected.T, atol=1e-11 * np.abs(expected).max())


LENGTH, SAMPLE = 0.03, 1e-7


def test_no_part_of_the_line_has_a_larger_mean() -> None:
    """Brute force over parts that begin anywhere finds no larger mean, on a closed line and on an open one."""
    rng = np.random.default_rng(5)
    lengths, force, fine = rng.uniform(0.5, 2, 9), rng.uniform(0, 1, 9), 20_000
    borders = np.concatenate([[0], np.cumsum(lengths)])
    for share, closed in ((0.3, True), (0.3, False), (0.47, True)):
        width, whole = share * borders[-1], borders[-1]
        running = np.concatenate([[0], np.cumsum(np.tile(force, 2))])
        places = np.concatenate([borders, whole + borders[1:]])
        starts = np.linspace(0, whole if closed else whole - width, fine)
        each = np.interp(starts + width, places, running) - np.interp(starts, places, running)
        largest = average_over_arcs(force[None], share, lengths, ((9, closed),)).max()
        assert each.max() / width <= largest * (1 + 1e-12)
        assert largest == pytest.approx(each.max() / width, rel=1e-3)


def test_where_it_is_largest() -> None:
    """A force 1 + cos(th - t0) per radian has its largest mean about t0: 1 + sin(a)/a over a quarter, a = pi/4; arcs of
    2 pi/64 leave an eighth of the square of half of one."""
    arcs, top = 64, 2 * np.pi * 40 / 64
    th = 2 * np.pi * (np.arange(arcs) + 0.5) / arcs
    force = np.zeros((50, arcs))
    force[10:20] = (1 + np.cos(th - top)) * LENGTH / arcs
    expected = 1 + np.sin(np.pi / 4) / (np.pi / 4)
    peak, place = line_force_peak(force, SAMPLE, 10 * SAMPLE, LENGTH, 0.25)
    assert peak == pytest.approx(expected, rel=1e-3)
    assert place == pytest.approx(40 / 64, abs=1e-12)
    impulse, where = line_impulse_peak(force, SAMPLE, LENGTH, 0.25)
    assert impulse == pytest.approx(expected * 10 * SAMPLE, rel=1e-3)
    assert where == pytest.approx(40 / 64, abs=1e-12)


def test_a_long_run_is_averaged_in_blocks_and_its_memory_stays_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks take less memory than the force of 24 arcs and give the mean of all at once."""
    rng = np.random.default_rng(3)
    force, edges = rng.uniform(0, 1, (50_000, 24)), np.cumsum(rng.uniform(0.5, 2, 50_001)) * SAMPLE
    tracemalloc.start()
    largest = line_force_peak(force, edges, 300 * SAMPLE, LENGTH, 0.1)
    assert tracemalloc.get_traced_memory()[1] < force.nbytes
    tracemalloc.stop()
    monkeypatch.setattr(histories, "TOGETHER", 10**9)
    assert line_force_peak(force, edges, 300 * SAMPLE, LENGTH, 0.1) == pytest.approx(largest, rel=1e-13)


def test_uneven_arcs_are_weighed_by_their_lengths() -> None:
    """An even force per length is one, whatever the arcs and the part; arcs in halves change no whole ones."""
    lengths = np.array([1.0, 3.0, 2.0, 0.5, 1.5]) * 1e-3
    even = np.tile(lengths, (3, 1))
    for share in (0.01, 0.4, 0.77, 1.0):
        np.testing.assert_allclose(average_over_arcs(even, share, lengths), 1.0, rtol=1e-12)
    force = np.array([[1.0, 2.0, 4.0, 8.0, 16.0]])
    by_hand = np.array([[1 + 2, 2 + 4 / 2, 4 + 8 + 16, 8 + 16 + 1 + 2 / 3, 16 + 1 + 2 / 2]]) / 4e-3
    np.testing.assert_allclose(average_over_arcs(force, 0.5, lengths)[:, :5], by_hand, rtol=1e-12)
    halves = np.repeat(force / 2, 2, axis=1), np.repeat(lengths / 2, 2)
    np.testing.assert_allclose(average_over_arcs(halves[0], 0.5, halves[1])[:, :10:2], by_hand, rtol=1e-12)
    peak, place = line_force_peak(np.repeat(force, 3, axis=0), SAMPLE, SAMPLE, lengths, 0.5)
    assert peak == pytest.approx(by_hand.max(), rel=1e-12)
    assert place == pytest.approx((4 + 2) / 8, rel=1e-12)
