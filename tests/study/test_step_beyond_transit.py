"""A stated time step within which waves cross a rod: the error bar holds what it leaves."""

import json
from pathlib import Path

import pytest

from seatfem.study.runs.pipeline import run_scene
from tests.gallery import load_text

SCENE = """
seat = {{ kind = "rod", length = "10 mm", area = "10 mm^2", young = "200 GPa", density = "7850 kg/m^3", \
    damping_ratio = 0.01 }}
reed = {{ kind = "rigid_mass", mass = "0.2 g", velocity = "-1 m/s" }}
run = {{ duration = "80 us", time_step = "{step} us", filter_width = "10 us" }}
accuracy = {{ target = 0.5, measures = ["impulse", "filtered_peak"] }}
"""
KEYS = ("impulse_Ns", "filtered_peak_force_N")


def run(folder: Path, step: float) -> dict[str, float]:
    run_scene(load_text(folder, SCENE.format(step=step)), folder, pictures=False)
    return dict(json.loads((folder / "summary.json").read_text(encoding="utf-8")))


@pytest.mark.slow
def test_the_bar_holds_what_a_step_beyond_the_transit_leaves(tmp_path: Path) -> None:
    """The bar of a step of 5 us holds the waves of 1.98 us transit that neither half nor twice of it sees."""
    long, fine = run(tmp_path, 5.0), run(tmp_path, 0.02)
    errors = {key: abs(long[key] - fine[key]) for key in KEYS}
    assert max(errors[key] / fine[key] for key in KEYS) > 0.05
    for key in KEYS:
        assert long[f"error_bar_{key}"] >= errors[key], key
    assert fine["error_bar_impulse_Ns"] == pytest.approx(0.0, abs=0.02 * fine["impulse_Ns"])
