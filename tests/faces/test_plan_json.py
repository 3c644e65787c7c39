"""`seatfem plan --json`: one JSON object, complete and valid; and what a plan does without."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatfem.faces.plan_view import plan_json
from seatfem.study.scene.measures import asked_name
from tests.steps import DONE, Plan, load_scene, plan_scene, run_command

EXAMPLES = Path(__file__).parents[2] / "examples"
SLEEVE = EXAMPLES / "flapper_on_peek_sleeve.toml"


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_scene(load_scene(SLEEVE))


@pytest.mark.slow
def test_the_program_prints_one_object_and_nothing_else(plan: Plan, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["plan", str(SLEEVE), "--json"]) == DONE
    out, err = capsys.readouterr()
    told = json.loads(out)
    assert err == ""
    assert told["choices"] == json.loads(plan_json(plan))["choices"]
    assert run_command(["plan", str(SLEEVE), "--json", "--quiet"]) == DONE
    assert capsys.readouterr() == ("", "")


@pytest.mark.slow
def test_every_part_of_the_plan_is_there(plan: Plan) -> None:
    told = json.loads(plan_json(plan))
    assert told["level"] == plan.level == "axisymmetric"
    assert told["kept"] is False
    assert told["target"] == load_scene(SLEEVE).accuracy.target
    assert told["meets_target"] is plan.meets_target
    assert [choice["key"] for choice in told["choices"]] == [choice.key for choice in plan.choices]
    assert all(choice.keys() == {"key", "value", "reason", "given", "leaves"} for choice in told["choices"])
    assert told["time_s"] == plan.cost.seconds == pytest.approx(sum(told["stages_s"].values()))
    assert told["memory_bytes"] == plan.cost.memory
    assert told["error"] == {asked_name(name): error for name, error in plan.error.items()}
    assert told["error"].keys() == {"impulse", "filtered_peak"}
    assert told["shares"].keys() == plan.shares.keys()
    assert told["alternatives"][0]["what"] == plan.alternatives[0].what
    assert told["alternatives"][0]["time_s"] == plan.alternatives[0].cost.seconds
    assert told["notes"] == list(plan.notes)


@pytest.mark.slow
def test_the_scene_is_filled_and_in_si_units(plan: Plan) -> None:
    scene = json.loads(plan_json(plan))["scene"]
    assert scene["run"]["duration"] == 1.2e-3
    assert scene["run"]["time_step"] == plan.method.time_step
    assert scene["run"]["time_step"] > 0
    assert scene["reed"]["n_modes"] == int(plan.choice("reed.n_modes").value)
    assert scene["seat"]["model"] == plan.level
    assert scene["seat"]["mesh"]["size"] == plan.method.seat.size
    assert scene["seat"]["kind"] == "annular"


@pytest.mark.slow
def test_json_knows_no_infinity(plan: Plan) -> None:
    endless = replace(plan, error={"impulse": math.inf, "stress": math.nan, "filtered_peak": 0.5})
    assert json.loads(plan_json(endless))["error"] == {"impulse": None, "stress": None, "filtered_peak": 0.5}
