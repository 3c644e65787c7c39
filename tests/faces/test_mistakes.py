"""The sheet of mistakes: what a user of valves gets wrong, and that the answer names line, key, value and remedy."""

import re
from pathlib import Path

import pytest

from tests.mistakes import MISTAKES, SHEET, Mistake
from tests.steps import BAD_INPUT, FAILED, load_scene

PAGE = Path(__file__).parents[2] / "docs" / "mistakes.md"
COMMANDS = 20
"""Most mistakes that are answered without a file and a line: those of commands."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def test_the_sheet_is_long_and_each_mistake_stands_in_it_once() -> None:
    names = [each.name for each in MISTAKES]
    assert len(names) == len(set(names)) >= 120
    assert all(each.key and each.value and each.remedy for each in MISTAKES)
    assert sum(not each.at for each in MISTAKES) <= COMMANDS


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda each: each.name)
def test_a_mistake_is_answered(mistake: Mistake, folder: Path) -> None:
    """A mistake is refused with exit code 2, or warned of before anything is computed; one line of the answer names
    file, line, key, value and remedy. There is no traceback and no new file, and the page shows the answer."""
    written = mistake.write()
    code, answer = mistake.answer()
    line = mistake.line_of(answer)
    assert code == (FAILED if mistake.warned else BAD_INPUT), answer
    assert line, answer
    told = line.partition(f"{mistake.at}: {mistake.key}")[2] if mistake.at else line
    assert [words for words in (mistake.value, *mistake.remedy) if words not in told] == [], answer
    assert [words for words in ("Traceback", "pydantic", "input should be", "tuple") if words in answer] == []
    assert {path.name for path in folder.iterdir()} == written
    assert " ".join(line.split()) in " ".join(PAGE.read_text(encoding="utf-8").split()), "run docs/mistakes_page.py"


@pytest.mark.parametrize("verb", ["draw", "run"])
@pytest.mark.parametrize("mistake", [each for each in MISTAKES if each.warned], ids=lambda each: each.name)
def test_other_verbs_warn_as_plan_does(mistake: Mistake, verb: str) -> None:
    mistake.write()
    (_, warned), (_, also) = mistake.answer(), mistake.answer(verb)
    assert mistake.line_of(also) == mistake.line_of(warned) != ""


@pytest.mark.parametrize("scene", SHEET["scene"])
def test_the_scenes_of_the_sheet_are_right(scene: str) -> None:
    """The sheet's scenes have no mistake and raise no doubt, with the speed of the crank as a number or with a unit."""
    for rpm in ("3000", '"3000 1/min"', '"3000 rpm"', '"50 1/s"'):
        Mistake("", "", "", [], scene=scene).write()
        text = Path("scene.toml").read_text(encoding="utf-8").replace("rpm = 3000", f"rpm = {rpm}")
        Path("scene.toml").write_text(text, encoding="utf-8")
        loaded = load_scene("scene.toml")
        assert loaded.find_doubts() == ()
        assert all(load.pressure.rpm == pytest.approx(3000.0, rel=1e-15) for load in loaded.load)


@pytest.mark.parametrize("path", sorted(Path(__file__).parents[2].glob("examples/*.toml")), ids=lambda path: path.stem)
def test_examples_have_usual_values(path: Path) -> None:
    """No value of the examples is beyond the usual ranges; some of their beams do not cover the whole lip."""
    if re.search(r"^\[(vary|fit)\b", path.read_text(encoding="utf-8"), re.MULTILINE):
        return
    assert [str(doubt) for doubt in load_scene(path).find_doubts() if "covers" not in doubt.message] == []
