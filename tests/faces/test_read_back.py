"""What was read of a scene is told before anything is computed: quantities with units, records with their ranges."""

import json
import re
from pathlib import Path

import pytest

from seatfem.faces.plan_view import plan_json, read_back
from tests.steps import DONE, Scene, SceneError, begin_plan, load_scene, run_command

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
def test_plan_run_and_json_begin_with_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
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


def test_a_wrong_file_is_told_by_its_key(tmp_path: Path) -> None:
    (tmp_path / "seat.step").write_text("no part", encoding="utf-8")
    scene: Scene = load_scene(EXAMPLES / "flapper_on_valve_body.toml", {"seat.file": str(tmp_path / "seat.step")})
    with pytest.raises(SceneError, match=r"seat\.file: .*seat\.step"):
        read_back(scene)


@pytest.mark.slow
def test_a_scene_is_drawn_and_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
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
