"""What was read of a scene, its drawing and its plan as JSON: told before anything is computed."""

import json
import math
import re
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from seatfem.faces.plan_view import judged_line, plan_json, read_back
from seatfem.study.runs.forecast import Look, look_at
from tests.gallery import Patch, Told
from tests.steps import DONE, begin_plan, load_scene, run_command

EXAMPLES = Path(__file__).parents[2] / "examples"


def read(name: str, **changed: object) -> dict[str, str]:
    return dict(read_back(load_scene(EXAMPLES / name, changed)))


def test_a_record_is_told_with_its_heads_rows_and_ranges() -> None:
    parts = read("suction_flapper.toml")
    rows = (EXAMPLES / "suction_cycle.csv").read_text(encoding="utf-8").splitlines()
    numbers = [tuple(map(float, row.split(","))) for row in rows if re.match(r"-?\d", row)]
    low, high = min(p for _, p in numbers), max(p for _, p in numbers)
    words = (
        f"suction_cycle.csv ({len(numbers)} rows, divided by commas, decimal point: angle [deg] 0 to 360, pressure "
        f"[bar] {low:g} to {high:g}), rpm 3000"
    )
    course = f"read as pressure {low / 10:g} MPa to {100 * high:g} kPa repeated every 20 ms"
    assert f"pressure (file {words}, angle 30 deg, {course})" in parts["load 1"]
    assert "area [95 mm^2, 85 mm^2, 60 mm^2]" in parts["load 1"]
    assert parts["load 2"] == "gravity -9.81 m/s^2"
    assert parts["stopper"] == "spring, stiffness 20 N/um, lift 2 mm"


@pytest.mark.slow(only=("cad_assembly.toml", "mass_on_meshed_seat.toml"))
@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.toml") if "study" not in path.name))
def test_every_example_is_told_in_short(name: str) -> None:
    parts = read(name)
    assert {"seat", "reed"} <= parts.keys()
    assert all(0 < len(words) < 700 and "None" not in words and "Path(" not in words for words in parts.values())


@pytest.mark.slow
def test_plan_run_and_json_begin_with_it(capsys: Told, tmp_path: Path) -> None:
    """Plan, run and JSON begin with what was read from files; a scene without files has no such part."""
    scene = tmp_path / "scene.toml"
    plain = (EXAMPLES / "flapper_on_spring.toml").read_text(encoding="utf-8")
    scene.write_text(plain, encoding="utf-8")
    assert run_command(["plan", str(scene)]) == DONE
    assert "what was read" not in capsys.readouterr().out
    (tmp_path / "push.csv").write_text("time [ms],pressure [bar]\n0,0\n1,-0.01\n2,0\n", encoding="utf-8")
    load = '\n[[load]]\npressure = { file = "push.csv" }\narea = "80 mm^2"\n'
    scene.write_text(plain + load, encoding="utf-8")
    assert run_command(["plan", str(scene)]) == DONE
    planned = " ".join(capsys.readouterr().out.split())
    assert "what was read" in planned
    assert planned.index("thickness 0.305 mm") < planned.index("push.csv (3 rows") < planned.index("key")
    assert json.loads(plan_json(begin_plan(load_scene(scene))))["read"] == dict(read_back(load_scene(scene)))
    assert run_command(["run", str(scene), "--no-pictures", "-o", str(tmp_path / "out")]) == DONE
    ran = " ".join(capsys.readouterr().err.split())
    assert ran.index("thickness 0.305 mm") < ran.index("stepping")


@pytest.mark.slow
def test_a_scene_is_drawn_and_told_in_a_sentence(tmp_path: Path, monkeypatch: Patch, capsys: Told) -> None:
    """Draw writes beside the shell, a plan where it is asked to."""
    monkeypatch.chdir(tmp_path)
    assert run_command(["draw", str(EXAMPLES / "suction_valve.toml")]) == DONE
    told, wrote = capsys.readouterr().out.splitlines()
    words = "reed (cantilever) 34 x 12 x 0.3 mm over a lip of 9.2 to 10.8 mm diameter, gap 0 mm, stopper"
    assert told.startswith(words)
    assert wrote == "wrote suction_valve-drawing.png"
    assert [path.name for path in tmp_path.iterdir()] == ["suction_valve-drawing.png"]
    assert (tmp_path / "suction_valve-drawing.png").read_bytes().startswith(b"\x89PNG")
    assert run_command(["plan", str(EXAMPLES / "flapper_on_spring.toml"), "--drawing", "plan.svg"]) == DONE
    assert "wrote plan.svg" in capsys.readouterr().out
    assert "spring 27.8 N/um" in Path("plan.svg").read_text(encoding="utf-8")


SLEEVE = EXAMPLES / "flapper_on_peek_sleeve.toml"
OF_A_PLAN = {"title", "read", "level", "target", "judged", "choices", "error", "scene"}
OF_A_LOOK = {"meets_target", "time_s", "stages_s", "memory_bytes", "left", "notes"}


@pytest.fixture(scope="module")
def look() -> Look:
    return look_at(load_scene(SLEEVE), 1e-3)


@pytest.mark.slow
def test_the_program_prints_one_object_and_nothing_else(look: Look, monkeypatch: Patch, capsys: Told) -> None:
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
    assert printed["error"] == {name: done.budget.relative(f"landing_{name}") for name in ("impulse", "filtered_peak")}
    assert printed["meets_target"] is done.met is False
    assert printed["stages_s"] == look.stages
    assert printed["left"] == asdict(look.left)
    keys = {"rounds", "seconds", "seat", "contact", "after", "memory", "error", "changes", "why"}
    assert printed["left"].keys() == keys
    spent = sum(printed["stages_s"].values())
    assert printed["time_s"] == pytest.approx(spent + printed["left"]["seconds"] + printed["left"]["after"])
    assert printed["memory_bytes"] == printed["left"]["memory"] >= done.memory > 50e6
    assert any("the reed covers 50 % of the lip" in note for note in printed["notes"])
    endless = replace(look.plan, error={"impulse": math.inf, "stress": math.nan, "filtered_peak": 0.5})
    assert json.loads(plan_json(endless))["error"] == {"impulse": None, "stress": None, "filtered_peak": 0.5}
    scene, plan = printed["scene"], look.plan  # filled, in SI units
    assert scene["run"]["duration"] == 1.2e-3
    assert scene["run"]["time_step"] == plan.method.time_step > 0
    assert scene["reed"]["n_modes"] == int(plan.choice("reed.n_modes").value)
    assert (scene["seat"]["kind"], scene["seat"]["model"]) == ("annular", plan.level)
    assert scene["seat"]["mesh"]["size"] == plan.method.seat.size
