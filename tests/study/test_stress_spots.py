"""Hot spots in scenes: their lists, and the histories on file, against known stress and the run's own largest."""

import json
from pathlib import Path

import numpy as np
import pytest

from seatfem.faces.exchange import export
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.stress_spots import load_histories
from tests.gallery import load_text

BEAM = """
seat = { kind = "spring", stiffness = "27.8 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", \
    material = { young = "200 GPa", density = "7850 kg/m^3" }, n_modes = 12, release = { tip_deflection = "0.5 mm" } }
run = { duration = "1 ms", time_step = "0.1 us" }
"""


@pytest.mark.slow
def test_the_history_at_the_root_of_a_beam(tmp_path: Path) -> None:
    """It begins with 3 E (h/2) d/L^2 less 2/(pi n)^2, and has the largest stress of the run, where and when it says."""
    summary = run_scene(load_text(tmp_path, BEAM), tmp_path, pictures=False).summary
    time, places = load_histories(tmp_path / "stress.h5")
    root = places["reed, root, x = 0 mm, xx"]
    assert root[0] == pytest.approx(1.5 * 200e9 * 0.305e-3 * 0.5e-3 / 25.4e-3**2, rel=2 / (np.pi * 12) ** 2 * 1.05)
    spot = json.loads((tmp_path / "summary.json").read_text())["reed_stress_hot_spots"][0]
    assert (spot["part"], spot["component"], spot["at_m"], spot["edge_distance_m"]) == ("root", "xx", [0.0], None)
    touched = time >= spot["time_s"] * (1 - 1e-12)
    assert abs(spot["component_Pa"]) == spot["von_mises_Pa"] == np.abs(root[touched]).max()
    # the summary looks twice a radian of the highest mode, coarsely at half of that: all of an eighth of a period
    assert spot["von_mises_Pa"] == pytest.approx(summary["peak_reed_stress_after_contact_Pa"], rel=0.02)
    (rows,) = [path for path in export(tmp_path, "csv", tmp_path / "csv") if path.name == "stress.csv"]
    table = np.loadtxt(rows, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], root, rtol=1e-12)
