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
WITHIN = ("read_abaqus", "read_nastran", "read_unv", "read_by_meshio", "read_cards", "read_blocks", "read_file")
"""Parts of `read_mesh`, whose tests `docs/mesh_formats.md` lists."""
OF_PICTURES = ("write_surface", "load_matrix", "read_columns")
"""Parts of `write_moving`, `read_matrices` and of the fields of a scene."""
BY_VERB = {"write_receptance_uff": "uff", "write_modes_uff": "uff", "write_moving": "vtk", "write_reduced": "reduced"}
SOURCES = (
    "seatfem/structures/formats", "seatfem/pictures/moving.py", "impact/measured", "impact/storage",
    "impact/bodies/time_series.py",
)  # fmt: skip


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


def test_help_and_readme_describe_every_format(capsys: pytest.CaptureFixture[str]) -> None:
    run_command(["export", "--help"])
    words = " ".join(re.sub("[│ ]+", " ", capsys.readouterr().out).split())
    assert all(f"{name}: {each.words}" in words for name, each in FORMATS.items())
    row = next(line for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines() if "`export DIR" in line)
    assert {*re.findall(r"`(?:export DIR --to )?(\w+)`", row)} == {*FORMATS}


def test_every_suffix_that_is_read_stands_there() -> None:
    told = {suffix for row in ROWS if row[2] != "-" for suffix in re.findall(r"\.\w+", row[0])}
    meshes = set(re.findall(r"\.\w+", PAGES["mesh_formats"]))
    assert {*UNIVERSAL, *STEP_SUFFIXES, *BREP_SUFFIXES, ".dxf", ".csv", ".h5", ".mtx", ".npz", ".npy"} <= told
    assert {*WRITTEN} <= meshes


@pytest.mark.parametrize("source", SOURCES)
def test_every_reader_and_writer_is_in_a_test_of_the_table(source: str) -> None:
    """By its name, or by the verb that calls it."""
    files = {name for row in ROWS for name in re.findall(r"`([\w/.]+)::", row[5])}
    tests = "".join((ROOT / file).read_text(encoding="utf-8") for file in files)
    place = ROOT / source
    texts = [path.read_text(encoding="utf-8") for path in ([place] if place.is_file() else place.glob("*.py"))]
    found = {name for text in texts for name in re.findall(r"^def ((?:read|write|load|save)_\w+)", text, re.MULTILINE)}
    missing = [
        name
        for name in found - {*WITHIN, *OF_PICTURES}
        if not re.search(rf"\b{name}\b", tests) and f'"--to", "{BY_VERB.get(name)}"' not in tests
    ]
    assert found
    assert missing == []
