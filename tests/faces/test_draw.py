"""The verb `draw`, and the drawing of a plan."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatfem.faces.cli import DONE, run_command

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = EXAMPLES / "suction_valve.toml"


@pytest.mark.slow
def test_a_scene_is_drawn_beside_the_shell_and_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command(["draw", str(SCENE)]) == DONE
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(
        "reed (cantilever) 34 x 12 x 0.3 mm over a lip of 9.2 to 10.8 mm diameter, gap 0 mm, stopper"
    )
    assert lines[1:] == ["wrote suction_valve-drawing.png"]
    assert [path.name for path in tmp_path.iterdir()] == ["suction_valve-drawing.png"]
    assert (tmp_path / "suction_valve-drawing.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_plan_writes_the_drawing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "plan.svg"
    assert run_command(["plan", str(EXAMPLES / "flapper_on_spring.toml"), "--drawing", str(file)]) == DONE
    assert f"wrote {file}" in capsys.readouterr().out
    assert "spring 27.8 N/um" in file.read_text(encoding="utf-8")
