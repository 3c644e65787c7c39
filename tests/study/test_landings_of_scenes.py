"""Which landing comes first in an answer, how many are known, statistics of the others, and scenes that do not land."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import pytest

from impact.after.landings import Landing
from seatfem import results
from seatfem.results import result_of, words_of
from seatfem.study.answers.verdict import horizon
from seatfem.study.runs.horizon import ensemble_keys
from tests.gallery import load_text, read_summary, summary_of
from tests.steps import Limits, run_command, run_scene

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


@pytest.mark.slow
def test_the_landing_of_a_valve_is_not_the_gas_that_presses_it(tmp_path: Path) -> None:
    """15 bar on 60 mm2 press the closed valve with 90 N; what is judged is the blow with which it closes before."""
    (tmp_path / "pulse.csv").write_text(PULSE)
    run_scene(load_text(tmp_path, VALVE), tmp_path / "out", pictures=False, limits=Limits(rounds=1))
    summary = read_summary(tmp_path / "out")
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


SHAKEN = (
    '\nseat = {{ kind = "spring", stiffness = "100 kN/m" }}\n'
    'reed = {{ kind = "rigid_mass", mass = "10 g", velocity = "-0.2 m/s" }}\n'
    'contact = {{ law = {{ kind = "hunt_crossley", stiffness = "50 MN/m^1.5", damping = "1 s/m" }} }}\n'
    'run = {{ duration = "{duration}", time_step = "20 us", filter_width = "100 us"{more} }}\n[[load]]\n'
    'gravity = "-9.81 m/s^2"\n[[base]]\nof = "seat"\nacceleration = "table.csv"\n'
)


def shaken(folder: Path, duration: str, more: str = "") -> dict[str, Any]:
    """Return the summary of a ball on a table that shakes with 5 g at 50 Hz."""
    rows = (f"{t / 4000:.5f},{49.05 * math.cos(100 * math.pi * t / 4000):.6f}" for t in range(12001))
    (folder / "table.csv").write_text("\n".join(["time [s],acceleration [m/s^2]", *rows]) + "\n", encoding="utf-8")
    scene = load_text(folder, SHAKEN.format(duration=duration, more=more and f", {more}"))
    return summary_of(scene, folder / "out", limits=Limits(rounds=1))


@pytest.mark.slow
def test_a_shaken_ball_is_known_for_some_landings_only(tmp_path: Path) -> None:
    summary = shaken(tmp_path, "1.6 s", "ensemble = 4")
    known, inputs = summary[results.KNOWN_LANDINGS], summary[results.KNOWN_OF_INPUTS]
    assert 1 <= inputs < known < len(summary["landings"])
    assert summary[results.LANDING_GROWTH] > 2
    assert summary[results.ENSEMBLE] == 4
    of = results.ENSEMBLE_SPEED
    speed, bar, spread = (summary[key] for key in (of, f"error_bar_{of}", results.spread_of(of)))
    assert 0 < bar < speed
    assert 0 < spread < speed
    words = horizon(summary)
    assert f"landings 1 to {known} can be predicted, from {known + 1} on only statistics" in words
    assert "Mean of the others over 4 runs: closing speed" in words


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "number"), [("30 ms", 1), ("70 ms", 2)])
def test_restitution_on_a_shaken_table_is_that_of_the_only_landing(tmp_path: Path, duration: str, number: int) -> None:
    """Impulses of all blows over the first approach would be above 1: the table and gravity give speed in between."""
    summary = shaken(tmp_path, duration)
    assert len(summary["landings"]) == number
    assert 0.5 < summary["landing_restitution"] < 1
    assert summary["restitution"] == (summary["landing_restitution"] if number == 1 else None)


def landing(speed: float) -> Landing:
    return Landing(0.0, 1.0, 0.5, 0, speed, 10 * speed, 0.0, 10 * speed, speed, False, False)


def test_bars_are_of_the_members_and_spreads_of_single_landings() -> None:
    """Means of 2, 4 and 6 m/s: their standard error is 2/sqrt(3); single landings of 1, 3, 4, 6 scatter by more."""
    keys = ensemble_keys([[landing(1.0), landing(3.0)], [landing(4.0)], [landing(6.0)], []])
    assert keys[results.ENSEMBLE] == 4
    assert keys[results.ENSEMBLE_LANDINGS] == 4
    assert keys[results.ENSEMBLE_SPEED] == pytest.approx(4.0)
    assert keys[f"error_bar_{results.ENSEMBLE_SPEED}"] == pytest.approx(2 * 2 / math.sqrt(3))
    assert keys[results.spread_of(results.ENSEMBLE_SPEED)] == pytest.approx(math.sqrt(13 / 3))
    assert keys[results.ENSEMBLE_PEAK] == pytest.approx(40.0)


def test_a_difference_that_stays_is_said_to_hardly_grow() -> None:
    summary = {"landings": [{}, {}, {}], results.KNOWN_LANDINGS: 3, results.LANDING_GROWTH: 1.02}
    difference = "a small difference, of round-off or inputs and not of the step, hardly grows"
    words = f"all 3 landings can be predicted: {difference} from one to the next"
    assert horizon(summary) == words
    alone = summary | {results.ENSEMBLE: 1, results.ENSEMBLE_LANDINGS: 0}
    nothing = "No landing is left to an ensemble (run.ensemble): it was not marched"
    assert horizon(alone) == f"{words}. {nothing}"
    assert horizon({key: alone[key] for key in (results.ENSEMBLE, results.ENSEMBLE_LANDINGS)}) == nothing
