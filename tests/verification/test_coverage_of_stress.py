"""Error bars of stress against finer meshes, bands, modes and steps: benchmarks/coverage_of_stress.py.

Two cheap scenes are run here; those of the committed table are only read.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from seatfem.structures.store import VARIABLE

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
coverage_of_stress = _load("coverage_of_stress")
VERDICTS = coverage_of_runs.read(coverage_of_stress.FILE)


@pytest.mark.parametrize("index", [3, 0])  # a beam on a rod, and on an annular seat
def test_the_true_error_is_inside_the_bar(index: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "restored afterwards")
    verdict = coverage_of_stress.judge(index, coverage_of_stress.SEED)
    assert verdict.values
    assert [name for name in verdict.values if not verdict.inside(name)] == []
    (kept,) = [each for each in VERDICTS if each.index == index]
    assert (verdict.seat, verdict.striker, verdict.target) == (kept.seat, kept.striker, kept.target)
    assert verdict.values["stress"] == pytest.approx(kept.values["stress"], rel=2 * kept.target)


def test_true_errors_are_inside_the_bars() -> None:
    assert len(VERDICTS) >= 20
    assert coverage_of_runs.coverage(VERDICTS)[0] >= coverage_of_runs.COVERED


def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for verdict in VERDICTS:
        text = coverage_of_stress.draw_scene(verdict.index, verdict.seed)
        assert f'kind = "{verdict.seat}"' in text
        assert f'kind = "{verdict.striker}"' in text
        assert f"target = {verdict.target:.5f}" in text
