"""What the pages for people name is there: files, functions, numbers."""

import csv
import importlib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from badges import badges
from rooms import place_of, rooms_svg
from scene_pictures import PYTHON
from scenes_page import index_page, scenes_page

from impact.runs.variations import NARROWER, SAFETY, STRESS_SAFETY
from seatfem.structures.finite_elements import MESH_SAFETY
from seatfem.structures.method import COARSENING
from seatfem.study.safety import AIM, FEWER, FREE, LEVEL_SHARE, MANY, SPARE

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
SUFFIXES = (".py", ".md", ".csv", ".toml", ".step", ".msh", ".png")
FOLDERS = ("impact", "seatfem", "tests", "docs", "benchmarks", "examples", "meshes")
METHODS = (ROOT / "docs" / "methods.md").read_text(encoding="utf-8")
SOURCES = [path.read_text(encoding="utf-8") for name in ("impact", "seatfem") for path in (ROOT / name).rglob("*.py")]


def named_paths(page: Path) -> Iterator[str]:
    """What a page calls a file or folder of the project: links, code spans, commands."""
    text = page.read_text(encoding="utf-8")
    yield from (link for link in re.findall(r"\]\(([^)#]+)", text) if "://" not in link)
    for span in re.findall(r"`([^`\n]+)`", text) + re.findall(r"^    .*$", text, re.MULTILINE):
        for word in re.findall(r"[\w./*-]+", span):
            if word.partition("/")[0] in FOLDERS and "/" in word and not word.endswith("/paper"):
                yield word


def exists(page: Path, name: str) -> bool:
    """Relative to the page (links) or to the root; a star stands for anything."""
    return any(any(folder.glob(name.rstrip("/."))) for folder in (ROOT, page.parent) if not name.startswith("../")) or (
        name.startswith("..") and (page.parent / name).resolve().exists()
    )


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    assert [name for name in named_paths(page) if not exists(page, name)] == []


def test_the_pages_name_files_at_all() -> None:
    """The rule guards something."""
    found = {page.name: len(set(named_paths(page))) for page in PAGES}
    assert found["CONTRIBUTING.md"] > 8
    assert found["methods.md"] > 5


@pytest.mark.parametrize("package", ["impact", "seatfem"])
def test_every_room_stands_in_the_architecture(package: str) -> None:
    """The first column of the package's table: its rooms, all of them and no others."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    [section] = re.findall(rf"^## {package}$(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    told = re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)
    rooms = {path.parent.relative_to(ROOT / package).as_posix() for path in (ROOT / package).rglob("*.py")} - {"."}
    assert sorted(told) == sorted(rooms)


def test_every_module_has_a_place_in_the_picture_of_rooms() -> None:
    modules = [path for package in ("impact", "seatfem") for path in (ROOT / package).rglob("[!_]*.py")]
    assert [path for path in modules if place_of(path.relative_to(ROOT).with_suffix("").parts) is None] == []


def test_every_place_of_the_table_where_is_has_its_name() -> None:
    """Modules can be imported and have what the table says; each row names such a place."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    [section] = re.findall(r"^## Where is \.\.\.$(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    rows = [line for line in section.splitlines() if line.startswith("| ")][1:]
    places = [re.findall(r"`((?:impact|seatfem)[\w.]*):(\w+)`", row) for row in rows]
    assert len(rows) >= 12
    assert [row for row, named in zip(rows, places, strict=True) if not named] == []
    flat = [place for named in places for place in named]
    assert [(module, name) for module, name in flat if not hasattr(importlib.import_module(module), name)] == []


def test_what_is_made_from_the_code_is_current() -> None:
    drawn = ((text, f"images/badge_{name}.svg") for name, text in badges().items())
    for made, name in (
        (scenes_page(), "scenes.md"),
        (index_page(), "index.md"),
        (rooms_svg(), "images/rooms.svg"),
        *drawn,
    ):
        assert made == (ROOT / "docs" / name).read_text(encoding="utf-8"), "run: make docs"


def test_every_example_has_a_card_and_a_picture() -> None:
    """On the first page, before all other pages are listed; the pictures are small, and no other ones lie there."""
    examples = {path.stem for suffix in ("toml", "py") for path in (ROOT / "examples").glob(f"*.{suffix}")}
    before, _, _ = (ROOT / "docs" / "index.md").read_text(encoding="utf-8").partition("## Pages")
    cards = re.findall(r"^- \[!\[.+\]\(images/scenes/(\w+)\.png\)\]\(.+\)\n  \*\*.+\*\*$", before, re.MULTILINE)
    assert sorted(cards) == sorted(examples)
    pictures = {path.stem: path.stat().st_size for path in (ROOT / "docs" / "images" / "scenes").iterdir()}
    assert {*pictures} == examples, "run: .venv/bin/python docs/scene_pictures.py"
    assert max(pictures.values()) <= 40_000
    assert {*PYTHON} == {path.stem for path in (ROOT / "examples").glob("*.py")}


def test_badges_say_what_holds() -> None:
    """Of pyproject.toml and of the table of damaged files; from this folder, with no address of anyone."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[([^]]*)\]\(docs/images/badge_(\w+)\.svg\)", readme)
    assert [name for _, name in shown] == list(badges())
    words, made = {name: text for text, name in shown}, badges()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    told = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    assert f">{', '.join(told)}<" in made["python"]
    assert project["requires-python"] == f">={told[0]}"
    assert words["python"] == f"Python {told[0]} to {told[-1]}"
    assert f">{project['license']}<" in made["licence"]
    assert project["license"] in words["licence"]
    table = (ROOT / "benchmarks" / "results" / "fuzz.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(table.splitlines()))
    assert f">{sum(int(row['cases']) for row in rows):,}, 0 defects<" in made["fuzz"]
    assert sum(int(row["ran"]) + int(row["refused"]) + int(row["drawn"]) for row in rows) == sum(
        int(row["cases"]) for row in rows
    )
    assert all(text.count("://") == 1 for text in made.values())  # of the name space


def test_every_name_in_contributing_is_in_the_code() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    names = {name for name in re.findall(r"`([A-Za-z_][\w.]*?)(?:\(\))?`", text) if not name.endswith(SUFFIXES)}
    names -= {*FOLDERS, "docs/scene.md"}
    assert {"GreensFunction", "Structure"} <= names
    last = {name: name.rpartition(".")[2] for name in names}
    defined = re.compile(r"(?:def|class) (\w+)|^\s*(\w+)\s*(?::[^=\n]*)?=", re.MULTILINE)
    known = {a or b for source in SOURCES for a, b in defined.findall(source)}
    known |= set(re.findall(r"\b(\w+): [\w\[\] |.]+$", "\n".join(SOURCES), re.MULTILINE)) | {"seatfem", "impact"}
    assert sorted(name for name, short in last.items() if short not in known) == []


def test_a_name_beside_a_file_is_in_that_file() -> None:
    """As in: `build` (`seatfem/structures/cache.py`)."""
    pairs = [
        (page.name, name, file)
        for page in PAGES
        for name, file in re.findall(r"`([\w.]+)`\s+(?:\(|in\s+)`([\w/]+\.py)`", page.read_text(encoding="utf-8"))
    ]
    assert pairs
    wrong = [
        pair
        for pair in pairs
        if not re.search(rf"\b{pair[1].rpartition('.')[2]}\b", (ROOT / pair[2]).read_text(encoding="utf-8"))
    ]
    assert wrong == []


@pytest.mark.parametrize(
    "words",
    [
        f"a mesh {COARSENING:g} times as coarse", f"a safety of {MESH_SAFETY:g}", f"within {AIM:g} of the target",
        f"up to {FREE:.0%} of the cost", f"within {SPARE:g} times the least error",
        f"multiplied by\n{SAFETY:g} (stress: {STRESS_SAFETY:g},", f"the mesh by {COARSENING:g}, the highest",
        f"(down to {NARROWER:g} below the last)", f"reed's modes by {FEWER:g} and 2", f"what {MANY} would change",
        f"1/{LEVEL_SHARE} of the accuracy target",
    ],
)  # fmt: skip
def test_the_numbers_of_the_methods_page_are_those_of_the_code(words: str) -> None:
    assert " ".join(words.split()) in " ".join(METHODS.split()).replace(" %", "%")
