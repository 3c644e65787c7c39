"""`seatfem plan --json`: one JSON object, complete and valid."""

import json
import math
import re
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from seatfem.faces.plan_view import judged_line, plan_json
from seatfem.study.runs.forecast import Look, look_at
from tests.steps import DONE, load_scene, run_command

EXAMPLES = Path(__file__).parents[2] / "examples"
SLEEVE = EXAMPLES / "flapper_on_peek_sleeve.toml"
OF_A_PLAN = {"title", "read", "level", "target", "judged", "choices", "error", "scene"}
OF_A_LOOK = {"meets_target", "time_s", "stages_s", "memory_bytes", "left", "notes"}


@pytest.fixture(scope="module")
def look() -> Look:
    return look_at(load_scene(SLEEVE), 1e-3)


@pytest.mark.slow
def test_the_program_prints_one_object_and_nothing_else(
    look: Look, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("seatfem.study.runs.forecast.PURSE", {False: 1e-3, True: 1e-3})
    assert run_command(["plan", str(SLEEVE), "--json"]) == DONE
    out, err = capsys.readouterr()
    printed, expected = json.loads(out), json.loads(plan_json(look.plan, look))
    progress = r"warning: .*|[a-z ,]+: [\d.]+ s(, \d+ % done)?( \(.+\))?"
    assert all(re.fullmatch(progress, line) for line in err.splitlines())
    assert printed.keys() == OF_A_PLAN | OF_A_LOOK
    assert {key: printed[key] for key in OF_A_PLAN} == {key: expected[key] for key in OF_A_PLAN}
    assert run_command(["plan", str(SLEEVE), "--json", "--quiet"]) == DONE
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_every_part_of_the_look_is_there(look: Look) -> None:
    printed, done = json.loads(plan_json(look.plan, look)), look.done
    assert printed["level"] == look.plan.level == "spring"
    assert printed["target"] == load_scene(SLEEVE).accuracy.target
    assert printed["judged"] == judged_line(look.plan)
    assert [choice["key"] for choice in printed["choices"]] == [choice.key for choice in look.plan.choices]
    assert all(choice.keys() == {"key", "value", "reason", "given", "leaves"} for choice in printed["choices"])
    assert printed["error"] == {
        "impulse": done.left.relative("landing_impulse"), "filtered_peak": done.left.relative("landing_filtered_peak"),
    }  # fmt: skip
    assert printed["meets_target"] is done.met is False
    assert printed["stages_s"] == look.stages
    assert printed["left"] == asdict(look.left)
    keys = {"rounds", "seconds", "seat", "contact", "after", "memory", "error", "changes", "why"}
    assert printed["left"].keys() == keys
    spent = sum(printed["stages_s"].values())
    assert printed["time_s"] == pytest.approx(spent + printed["left"]["seconds"] + printed["left"]["after"])
    assert printed["memory_bytes"] == printed["left"]["memory"] >= done.memory > 50e6
    assert any("the reed covers 50 % of the lip" in note for note in printed["notes"])


@pytest.mark.slow
def test_the_scene_is_filled_and_in_si_units(look: Look) -> None:
    scene, plan = json.loads(plan_json(look.plan))["scene"], look.plan
    assert scene["run"]["duration"] == 1.2e-3
    assert scene["run"]["time_step"] == plan.method.time_step
    assert scene["run"]["time_step"] > 0
    assert scene["reed"]["n_modes"] == int(plan.choice("reed.n_modes").value)
    assert scene["seat"]["model"] == plan.level
    assert scene["seat"]["mesh"]["size"] == plan.method.seat.size
    assert scene["seat"]["kind"] == "annular"


@pytest.mark.slow
def test_json_knows_no_infinity(look: Look) -> None:
    endless = replace(look.plan, error={"impulse": math.inf, "stress": math.nan, "filtered_peak": 0.5})
    assert json.loads(plan_json(endless))["error"] == {"impulse": None, "stress": None, "filtered_peak": 0.5}
