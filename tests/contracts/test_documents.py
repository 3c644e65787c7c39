"""What the pages for people name is there: files, tests, places, names; what is made from the code is current."""

import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from badges import badges
from rooms import rooms_svg
from scenes_page import scenes_page
from summary_page import lines_of_page

from seatfem.faces.exchange import FORMATS
from seatfem.structures.formats.writing import WRITTEN
from seatfem.structures.kinds.measured import UNIVERSAL
from seatfem.structures.shapes.cad import BREP_SUFFIXES, STEP_SUFFIXES
from tests.contracts.test_public_names import PUBLIC

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
FOLDERS = ("impact", "seatfem", "tests", "docs", "benchmarks", "examples", "meshes")


def named_paths(page: Path) -> Iterator[str]:
    """Yield the paths of the project that a page names in links, code spans and commands."""
    text = page.read_text(encoding="utf-8")
    yield from (link for link in re.findall(r"\]\(([^)#]+)", text) if "://" not in link)
    for span in re.findall(r"`([^`\n]+)`", text) + re.findall(r"^    .*$", text, re.MULTILINE):
        for word in re.findall(r"[\w./*-]+", span):
            if word.partition("/")[0] in FOLDERS and "/" in word and not word.endswith("/paper"):
                yield word


def exists(page: Path, name: str) -> bool:
    """Return whether a path exists beside the page (links) or at the root; a star stands for anything."""
    return any(any(folder.glob(name.rstrip("/."))) for folder in (ROOT, page.parent) if not name.startswith("../")) or (
        name.startswith("..") and (page.parent / name).resolve().exists()
    )


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    names = list(named_paths(page))
    assert names or page.name not in ("CONTRIBUTING.md", "methods.md")
    assert [name for name in names if not exists(page, name)] == []


def test_every_test_that_a_page_names_is_there() -> None:
    named = {place for page in PAGES for place in re.findall(r"`([\w/.]+)::(\w+)`", page.read_text(encoding="utf-8"))}
    assert len(named) > 15
    assert [
        (file, name)
        for file, name in named
        if not re.search(rf"^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)
    ] == []


def test_every_format_that_is_read_or_written_stands_in_its_table() -> None:
    pages = {name: (DOCS / f"{name}.md").read_text(encoding="utf-8") for name in ("exchange", "mesh_formats")}
    table = pages["exchange"].partition("| format |")[2].partition("## ")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if line.startswith("| ")]
    exports = {(name, "SCENE" in row[3]) for row in rows for name in re.findall(r"--to (\w+)", row[3])}
    assert exports == {(name, how.takes_scenes) for name, how in FORMATS.items()}
    suffixes = {suffix for row in rows if row[2] != "-" for suffix in re.findall(r"\.\w+", row[0])}
    assert {*UNIVERSAL, *STEP_SUFFIXES, *BREP_SUFFIXES, ".dxf", ".csv", ".h5", ".mtx", ".npz", ".npy"} <= suffixes
    assert {*WRITTEN} <= set(re.findall(r"\.\w+", pages["mesh_formats"]))


@pytest.mark.parametrize("package", ["impact", "seatfem"])
def test_every_room_stands_in_the_architecture(package: str) -> None:
    """The first column of a package's table has all of its rooms and no others."""
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    [section] = re.findall(rf"^## {package}$(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    listed = re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)
    rooms = {path.parent.relative_to(ROOT / package).as_posix() for path in (ROOT / package).rglob("*.py")} - {"."}
    assert sorted(listed) == sorted(rooms)


def test_every_place_that_the_architecture_names_is_there() -> None:
    """Each place that the page names like `seatfem.faces.cli:main` is an attribute of its module."""
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    places = re.findall(r"`((?:impact|seatfem)[\w.]*):(\w+)`", text)
    assert len(places) >= 12
    assert [(module, name) for module, name in places if not hasattr(importlib.import_module(module), name)] == []


def test_what_is_made_from_the_code_is_current() -> None:
    drawn = {f"images/badge_{name}.svg": text for name, text in badges().items()}
    pages = {"scenes.md": scenes_page(), "images/rooms.svg": rooms_svg(), **drawn}
    pages["summary.md"] = "\n".join(lines_of_page())
    old = [name for name, text in pages.items() if text != (DOCS / name).read_text(encoding="utf-8")]
    assert old == [], "run: make docs"


def test_a_name_beside_a_file_is_in_that_file() -> None:
    """A name that a page puts beside a file, as in `build` (`seatfem/structures/cache.py`), occurs in that file."""
    named = re.compile(r"`([\w.]+)`\s+(?:\(|in\s+)`([\w/]+\.py)`")
    pairs = {pair for page in PAGES for pair in named.findall(page.read_text(encoding="utf-8"))}
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for _, file in pairs}
    assert pairs
    assert [(name, file) for name, file in pairs if not re.search(rf"\b{name.split('.')[-1]}\b", texts[file])] == []


@pytest.mark.parametrize("package", ["impact", "seatfem"])
def test_every_public_name_stands_once_on_its_page(package: str) -> None:
    """Each public name is listed once on the page of its package and has a docstring."""
    listed = re.findall(r"^   ([\w.]+)$", (DOCS / f"api_{package}.md").read_text(encoding="utf-8"), re.MULTILINE)
    there = {name: member for name, member in PUBLIC.items() if name.partition(".")[0] == package}
    assert sorted(listed) == sorted(there)
    assert [name for name, member in there.items() if not (member.__doc__ or "").strip()] == []
