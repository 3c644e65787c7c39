"""Memory of runs of many contacts: forces and gaps are kept once, motions are made on demand."""

import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.march import ladder
from impact.march.problem import ContactError
from impact.march.rows import Replayed
from impact.runs import solver
from impact.storage.hdf5 import load_results, save_results
from tests.impact.test_ladder import deflected, seat

pytestmark = pytest.mark.slow
STEP, PARTS = 50e-9, 24
MOST = 3.1
"""Most memory of a run, over that of its forces: forces, gaps, and 0.6 of blocks, energies and flags; another copy of
either needs 3.6."""


def on_a_seat(parts: int, body: impact.Body) -> list[impact.Contact]:
    return [impact.Contact(body, port=k, striker_port=k, gap=1e-6 * k) for k in range(parts)]


@pytest.fixture
def long_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every run take long steps, and be as large as those whose displacements are not kept."""
    monkeypatch.setattr(ladder, "WORTHWHILE", 0.0)
    monkeypatch.setattr(solver, "LARGE", 0)


@pytest.fixture
def traced() -> Iterator[Callable[[], int]]:
    """Yield a function of the most memory since the last look [bytes]."""

    def look() -> int:
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        return most

    tracemalloc.start()
    yield look
    tracemalloc.stop()


def test_a_run_of_many_contacts_keeps_forces_and_gaps_once(long_runs: None, traced: Callable[[], int]) -> None:
    problem = impact.ContactProblem(deflected(PARTS), contacts=on_a_seat(PARTS, seat(PARTS)))
    impact.solve(problem, dt=STEP, duration=1e-4)
    before = traced()
    result = impact.solve(problem, dt=STEP, duration=0.04)
    history = 8 * result.rows.force.size
    assert history > 1e7
    assert len(result.rows.ends) < result.rows.ends[-1] / 8
    assert traced() - before < MOST * history


def test_memory_does_not_grow_with_the_number_of_varied_runs(long_runs: None, traced: Callable[[], int]) -> None:
    problem = impact.ContactProblem(deflected(8), contacts=on_a_seat(8, seat(8)))
    result = impact.solve(problem, dt=STEP, duration=0.01)
    others = {f"gap {k}": solver.widen_gaps(problem, k * 1e-9) for k in range(1, 7)}
    measures = {"impulse": lambda one: float(one.rows.spans @ one.rows.force[1:].sum(axis=1))}
    most = []
    for count in (1, 1, 6):
        traced()
        impact.error_budget(problem, result, measures=measures, others=dict(list(others.items())[:count]))
        most.append(traced())
    assert most[2] - most[1] < 0.1 * 8 * result.rows.force.size


@pytest.mark.parametrize("equal_steps", [True, False])
def test_displacements_on_demand_are_those_that_are_kept(
    equal_steps: bool, long_runs: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replayed displacements of all bodies at all contacts, some, and weighted are those that a run keeps."""
    below = replace(seat(3), base=lambda time: 2e-6 * np.sin(3e3 * time))
    above = impact.Contact(impact.spring(stiffness=1e6), side=-1, striker_port=1, gap=2e-4)
    problem = impact.ContactProblem(deflected(3), contacts=[*on_a_seat(3, below), above])
    replayed = impact.solve(problem, dt=STEP, duration=5e-3, equal_steps=equal_steps)
    monkeypatch.setattr(solver, "LARGE", 1e9)
    kept = impact.solve(problem, dt=STEP, duration=5e-3, equal_steps=equal_steps)
    assert replayed.rows.is_uniform == equal_steps
    np.testing.assert_array_equal(replayed.gap, kept.gap)
    shares = np.array([0.2, 0.5, 0.1, 0.3])
    for name in ("striker_displacement", "target_displacement"):
        lazy, whole = getattr(replayed.rows, name), getattr(kept.rows, name)
        assert isinstance(lazy, Replayed)
        size = 1e-11 * np.abs(whole).max()
        np.testing.assert_allclose(lazy, whole, rtol=0, atol=size)
        np.testing.assert_allclose(lazy[:, 1:3], whole[:, 1:3], rtol=0, atol=size)
        np.testing.assert_allclose(lazy[:, 3], whole[:, 3], rtol=0, atol=size)
        np.testing.assert_allclose(lazy @ shares, whole @ shares, rtol=0, atol=size)
        np.testing.assert_allclose(getattr(replayed, name), getattr(kept, name), rtol=0, atol=size)


def test_a_file_without_displacements_says_so(long_runs: None, tmp_path: Path) -> None:
    problem = impact.ContactProblem(deflected(2), contacts=on_a_seat(2, seat(2)))
    result = impact.solve(problem, dt=STEP, duration=1e-3)
    save_results(tmp_path / "r.h5", {"lip": result}, {})
    read = load_results(tmp_path / "r.h5")["lip"]
    np.testing.assert_array_equal(read.force, result.force)
    np.testing.assert_array_equal(read.gap, result.gap)
    with pytest.raises(ContactError, match=r"displacements at 2 contacts.*not on file.*whole face"):
        read.striker_displacement  # noqa: B018
    assert impact.measures.impulse(read, contact=1) == impact.measures.impulse(result, contact=1)
