"""Scenes whose largest force is not their landing, and scenes that do not land: what comes first in their answers."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from seatfem.results import result_of, words_of
from tests.steps import Limits, load_scene, run_command, run_scene

SEAT = """
seat = { kind = "rod", young = "206 GPa", density = "7850 kg/m^3", length = "30 mm", area = "20 mm^2", \
    damping_ratio = 0.05 }
"""
REED = """
reed = { kind = "cantilever", length = "30 mm", width = "10 mm", thickness = "0.3 mm", material = "steel", \
    damping_ratio = 0.05, n_modes = 4 }
"""
PULSE = "time [ms],pressure [bar]\n0,-1\n0.2,-1\n0.4,0.4\n1.0,0.4\n1.4,-0.1\n3.5,-0.5\n6,-15\n8,-15\n"
VALVE = (
    'title = "valve"\n' + SEAT + REED + "[[load]]\n"
    'pressure = { file = "pulse.csv" }\narea = "60 mm^2"\n'
    '[contact]\npreload = true\n[run]\nduration = "8 ms"\nfilter_width = "10 us"\n[accuracy]\ntarget = "20 %"\n'
)
MASS = SEAT + '[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-1 m/s"\n[contact]\ngap = "0.1 mm"\n'


def run(tmp_path: Path, text: str, **changed: object) -> tuple[dict[str, Any], bool | None]:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    (tmp_path / "pulse.csv").write_text(PULSE)
    changes = {name.replace("__", "."): value for name, value in changed.items()}
    outcome = run_scene(load_scene(path, changed=changes), tmp_path / "out", pictures=False, limits=Limits(rounds=1))
    return json.loads((tmp_path / "out" / "summary.json").read_text()), outcome.met


@pytest.mark.slow
def test_the_landing_of_a_valve_is_not_the_gas_that_presses_it(tmp_path: Path) -> None:
    """15 bar on 60 mm2 press the closed valve with 90 N; what is judged is the blow with which it closes before."""
    summary, _ = run(tmp_path, VALVE)
    assert summary["landing_status"] == "landed"
    assert summary["filtered_peak_force_N"] == pytest.approx(90.0, rel=0.05)
    assert summary["pressed_on_largest_load_N"] == pytest.approx(90.0, rel=0.05)
    assert summary["landing_filtered_peak_force_N"] < 0.8 * 90.0
    assert 0.4e-3 < summary["landing_time_s"] < 6e-3
    assert summary["landing_closing_speed_m_per_s"] > 0.1
    assert summary["landing_excess_peak_force_N"] == pytest.approx(
        summary["landing_filtered_peak_force_N"] - summary["landing_static_load_N"], rel=1e-9
    )
    assert summary["accuracy_judged_keys"] == "landing_impulse_Ns, landing_filtered_peak_force_N"
    assert summary["error_bar_landing_filtered_peak_force_N"] > 0
    assert summary["spring_landing_filtered_peak_force_N"] > 0
    # what the gas presses before and after is in the impulse of the run, and in no landing
    of_landings = sum(each["impulse_Ns"] for each in summary["landings"])
    assert summary["impulse_Ns"] > 2 * of_landings > 0
    hardest = max(summary["landings"], key=lambda each: each["excess_peak_force_N"])
    assert hardest["time_s"] == summary["landing_time_s"]
    rows = list(csv.DictReader((tmp_path / "out" / "landings.csv").read_text().splitlines()))
    assert [float(row["time_s"]) for row in rows] == [each["time_s"] for each in summary["landings"]]


@pytest.mark.slow(but="text0")
@pytest.mark.parametrize(
    ("text", "status"),
    [
        (MASS + '[run]\nduration = "0.05 ms"\n', "no landing"),
        (MASS + '[run]\nduration = "0.11 ms"\n', "cut off"),
        (VALVE.replace("pulse.csv", "pressed.csv"), "never opened"),
    ],
)
def test_scenes_that_do_not_land_are_neither_met_nor_failed(tmp_path, text, status, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    (tmp_path / "pressed.csv").write_text("time [ms],pressure [bar]\n0,-1\n8,-2\n")
    code = run_command(["run", str(path), "-o", str(tmp_path / "out"), "--no-pictures", "--rounds", "1"])
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["landing_status"] == status
    if status == "cut off":
        assert summary["landings"][0]["cut_off"]
        assert summary["contact_cut_off"]
        assert summary["contact_duration_s"] > 0
        assert summary["error_bar_contact_duration_s"] is None
        assert words_of(result_of("contact_duration_s"), summary) == "  contact duration, cut off by the end of the run"
        return
    assert code == 0
    assert summary["accuracy_met"] is None
    assert summary["landings"] == []
    assert summary["landing_impulse_Ns"] is None
    said = capsys.readouterr().out
    assert said.index("No landing" if status == "no landing" else "Never opened") < said.index("whole run")
    assert " 0 ± 0" not in said
    assert ", reached" not in said
