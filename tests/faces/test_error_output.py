"""What is printed of bad input: one line a problem, with its place and a remedy, and nothing of Python in it."""

import re
from pathlib import Path

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from tests.contracts.test_error_texts import REMEDY
from tests.study import test_scene

NAMES = re.compile(r"(?:'[\w+-]+'(?:, | or )?){4,}|(?:\b\w+, ){4,}\w+")
"""Lists of what is allowed, however long."""
PYTHON = re.compile(r"Traceback|\bNone\b|\bnan\b|<class|<function|Path\(|array\(|np\.float64|Error\(|\bobject at 0x")
WIDEST = 120


def rows() -> list[tuple[str, str]]:
    """What the table of bad scenes puts in place of what."""
    [table] = test_scene.test_bad_scenes.pytestmark  # type: ignore[attr-defined]
    return [(old, new) for old, new, _ in table.args[1]]


@pytest.mark.parametrize(("old", "new"), rows())
def test_a_bad_scene_is_told_with_a_remedy(
    old: str, new: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(test_scene.changed(old, new), encoding="utf-8")
    assert run_command(["plan", str(scene)]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert out == ""
    assert err
    for line in err.splitlines():
        said = line.removeprefix("seatfem: ").removeprefix(f"{tmp_path}/")
        assert re.match(r"scene\.toml(?::\d+)?: ", said)
        assert REMEDY.search(said)
        assert not PYTHON.search(said.replace(f"{new}", ""))
        assert len(NAMES.sub("", said)) <= WIDEST
