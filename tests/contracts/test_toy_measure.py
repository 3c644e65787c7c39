"""A new measure is one class: scenes ask for it, and runs give it an error bar that meets the target."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from seatfem.results import rows_of
from seatfem.study.answers.verdict import name_of
from seatfem.study.scene.measures import ContactRecord, Measure
from tests.gallery import load_text
from tests.steps import run_scene

SCENE = """
seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "0.3 ms", filter_width = "10 us" }
accuracy = { target = "10 %", measures = ["toy_square"] }
"""


@pytest.fixture
def toy() -> Iterator[None]:
    class Square(Measure):
        """Integral of the squared force."""

        name, key, words = "toy_square", "force_squared_N2s", "squared force"

        def evaluate(self, blow: ContactRecord) -> float:
            return float(np.sum(blow.force[1:] ** 2)) * blow.dt

    yield
    del Square.name


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_a_toy_measure_is_asked_for(tmp_path: Path) -> None:
    """The square of half a sine of amplitude v sqrt(k m) has the integral k m v^2/2 times the touch's duration."""
    scene = load_text(tmp_path, SCENE)
    assert scene.accuracy.measures == ("toy_square",)
    run_scene(scene, tmp_path / "out", pictures=False)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    k, m = 1e6, 1e-3
    exact = k * m * np.pi * np.sqrt(m / k) / 2
    assert abs(summary["force_squared_N2s"] - exact) <= summary["error_bar_force_squared_N2s"] < 0.1 * exact
    assert summary["accuracy_met"]
    assert name_of("force_squared_N2s", summary) == "squared force"


@pytest.mark.usefixtures("toy")
@pytest.mark.parametrize("value", [2.0, None])
def test_a_toy_measure_has_a_row_where_nobody_asked_for_it(value: float | None) -> None:
    rows = rows_of({"impulse_Ns": 1.0, "force_squared_N2s": value})
    shown = [] if value is None else ["squared force (force_squared_N2s)"]
    assert [row.words for row in rows["run"]] == ["impulse", *shown]
