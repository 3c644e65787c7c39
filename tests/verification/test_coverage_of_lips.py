"""Error bars of contacts along a lip against runs with more arcs, modes, band, mesh and steps.

benchmarks/coverage_of_lips.py; its committed table is read here.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def _load(name: str) -> ModuleType:
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # those that come later import it by name
    spec.loader.exec_module(module)
    return module


_load("coverage_of_seats")
coverage_of_runs = _load("coverage_of_runs")
coverage_of_lips = _load("coverage_of_lips")
VERDICTS = coverage_of_runs.read(coverage_of_lips.FILE)
SEEDS = sorted({verdict.seed for verdict in VERDICTS})


@pytest.mark.parametrize("seed", SEEDS)
def test_true_errors_are_inside_the_bars(seed: int) -> None:
    verdicts = [verdict for verdict in VERDICTS if verdict.seed == seed]
    assert len(verdicts) >= 25
    assert coverage_of_runs.coverage(verdicts)[0] >= coverage_of_runs.COVERED


def test_a_met_target_is_met_in_truth() -> None:
    met = [
        verdict.true[name] <= verdict.target * abs(verdict.values[name])
        for verdict in VERDICTS
        for name in verdict.values
        if verdict.bars[name] <= verdict.target * abs(verdict.values[name])
    ]
    assert len(met) > 70
    assert sum(met) >= coverage_of_runs.COVERED * len(met)


def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for verdict in VERDICTS:
        text = coverage_of_lips.draw_scene(verdict.index, verdict.seed)
        assert f"target = {verdict.target:.5f}" in text
