"""docs/exchange.md: every format that is read or written stands there, with a test that takes it both ways."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from seatfem.faces.cli import run_command
from seatfem.faces.exchange import FORMATS
from seatfem.structures.formats.writing import WRITTEN
from seatfem.structures.kinds.measured import UNIVERSAL
from seatfem.structures.shapes.cad import BREP_SUFFIXES, STEP_SUFFIXES

ROOT = Path(__file__).parents[2]
PAGES = {name: (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("exchange", "mesh_formats")}
ROWS = [
    [cell.strip() for cell in line.split("|")[1:-1]]
    for line in PAGES["exchange"].partition("| format |")[2].partition("## ")[0].splitlines()[2:]
    if line.startswith("|")
]


def test_every_test_of_the_table_is_there() -> None:
    wrong = [] if len(ROWS) > 15 else ["too few rows"]
    for row in ROWS:
        file, name = re.fullmatch(r"`([\w/.]+)::(\w+)`", row[5]).groups()  # type: ignore[union-attr]
        if not re.search(rf"^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE):
            wrong.append(row[5])
    assert wrong == []


def test_what_export_writes_is_what_the_table_says() -> None:
    assert {name for row in ROWS for name in re.findall(r"--to (\w+)", row[3])} == {*FORMATS}
    of_scenes = {name for row in ROWS for name in re.findall(r"--to (\w+)", row[3]) if "SCENE" in row[3]}
    assert of_scenes == {name for name, how in FORMATS.items() if how.takes_scenes}


def test_help_and_readme_name_every_format(capsys: pytest.CaptureFixture[str]) -> None:
    run_command(["export", "--help"])
    assert {*FORMATS} <= {*re.findall(r"\w+", capsys.readouterr().out)}
    row = next(line for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines() if "`export DIR" in line)
    assert {*re.findall(r"`(?:export DIR --to )?(\w+)`", row)} == {*FORMATS}


def test_every_suffix_that_is_read_stands_there() -> None:
    suffixes = {suffix for row in ROWS if row[2] != "-" for suffix in re.findall(r"\.\w+", row[0])}
    meshes = set(re.findall(r"\.\w+", PAGES["mesh_formats"]))
    assert {*UNIVERSAL, *STEP_SUFFIXES, *BREP_SUFFIXES, ".dxf", ".csv", ".h5", ".mtx", ".npz", ".npy"} <= suffixes
    assert {*WRITTEN} <= meshes
