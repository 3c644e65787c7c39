"""The sheet of mistakes: what a user of valves gets wrong, and that the answer names it, its limit and the remedy."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command

SHEET = tomllib.loads((Path(__file__).with_name("mistakes.toml")).read_text(encoding="utf-8"))
RECORD = "angle [deg],pressure [bar]\n0,-1\n90,0.1\n180,0.1\n270,-1\n360,-1\n"


def test_the_sheet_is_long_and_each_mistake_stands_in_it_once() -> None:
    names = [each["name"] for each in SHEET["mistake"]]
    assert len(names) == len(set(names)) >= 25


@pytest.mark.parametrize("mistake", SHEET["mistake"], ids=lambda each: each["name"])
def test_a_mistake_is_answered(
    mistake: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A mistake ends with exit code 2, the texts of its answer, no traceback and no new file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    texts = {"pressure.csv": RECORD, "scene.toml": SHEET["scene"], "strength.toml": SHEET["strength"]}
    for file, changes in (("scene.toml", mistake.get("change", ())), ("strength.toml", mistake.get("swap", ()))):
        for old, new in changes:
            assert old in texts[file]
            texts[file] = texts[file].replace(old, new, 1)
    texts |= mistake.get("files", {})
    for name, text in texts.items():
        Path(name).write_text(text, encoding="utf-8")
    assert run_command(mistake.get("command", ["plan", "scene.toml"])) == BAD_INPUT
    answer = " ".join(capfd.readouterr().err.replace("│", " ").split())  # a box of whatever width
    assert [words for words in mistake["answer"] if words not in answer] == [], answer
    assert [words for words in (*mistake.get("never", ()), "Traceback", "pydantic") if words in answer] == []
    assert {path.name for path in tmp_path.iterdir()} == set(texts)


def test_the_scene_of_the_sheet_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sheet's scene has no mistake itself, with the speed of the crank as a number or with a unit."""
    monkeypatch.chdir(tmp_path)
    Path("pressure.csv").write_text(RECORD, encoding="utf-8")
    from seatfem.study.scene import load_scene

    for rpm in ("3000", '"3000 1/min"', '"3000 rpm"', '"50 1/s"'):
        Path("scene.toml").write_text(SHEET["scene"].replace("rpm = 3000", f"rpm = {rpm}"), encoding="utf-8")
        assert load_scene("scene.toml").load[0].pressure.rpm == pytest.approx(3000.0, rel=1e-15)
