"""The first run on a machine compiles: known before it begins."""

import importlib
import sys
from pathlib import Path

import pytest

from impact.march.loop.compiled import on_file
from seatfem.machine import compiling, rates
from seatfem.study.planning import planner
from tests.steps import load_scene

SOURCE = """
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""


def test_compiled_code_is_found_on_file_until_its_source_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "doubled.py").write_text(SOURCE, encoding="utf-8")
    made = importlib.import_module("doubled").twice
    assert not on_file(made)
    assert made(2) == 4
    assert on_file(made)
    (tmp_path / "doubled.py").write_text(f"{SOURCE}# another\n", encoding="utf-8")
    del sys.modules["doubled"]
    assert not on_file(importlib.import_module("doubled").twice)


def test_a_plan_tells_what_is_still_to_be_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "on_file", lambda march: march is compiling.march_one)
    assert compiling.compilation() == pytest.approx(rates.START * compiling.EACH)
    monkeypatch.setattr(compiling, "on_file", lambda march: True)
    assert compiling.compilation() == 0.0


@pytest.mark.slow
def test_it_stands_in_the_predicted_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Asked for once a plan, as a part of its own; the other parts of two plans may differ by what was measured."""
    scene = load_scene(Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml")
    for seconds in (0.0, 7.0):
        asked: list[float] = []
        monkeypatch.setattr(planner, "compilation", lambda s=seconds, asked=asked: asked.append(s) or s)
        cost = planner.plan_scene(scene).cost
        assert len(asked) == 1
        assert cost.parts.get("compilation", 0.0) == seconds
        assert cost.seconds == pytest.approx(sum(cost.parts.values()))
