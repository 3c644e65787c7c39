"""Nobody asks which kind a structure is: it answers for itself, in its own file."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from seatfem.structures.kinds import kinds_of
from seatfem.structures.shapes import families

ROOT = Path(__file__).parents[2] / "seatfem"
KINDS = ROOT / "structures" / "kinds"
NAMES = {kind.__name__ for kind in kinds_of() if kind.__module__.startswith("seatfem.")}
ROOMS = ("study", "faces", "pictures", "structures")
FILES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py") if not path.is_relative_to(KINDS))


def asked(path: Path) -> Iterator[str]:
    """Kinds that a file imports or asks for."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("seatfem.structures.kinds"):
            yield from (f"{path}:{node.lineno}: {each.name}" for each in node.names if each.name in NAMES)
        if isinstance(node, ast.Attribute) and node.attr in NAMES and ast.unparse(node.value).endswith("kinds"):
            yield f"{path}:{node.lineno}: {node.attr}"


@pytest.mark.parametrize("room", ROOMS)
def test_no_kind_is_known_by_name_outside_its_own_file(room: str) -> None:
    files = [path for path in FILES if path.is_relative_to(ROOT / room)]
    assert files
    assert [place for path in files for place in asked(path)] == []


def test_a_kind_knows_other_kinds_only_to_be_one_of_them() -> None:
    """Within the room: its parents, and the package that gathers all of them."""
    found = [place for path in KINDS.glob("*.py") if path.name != "__init__.py" for place in asked(path)]
    assert found == []


def test_the_rule_guards_something() -> None:
    assert {"Annular", "Cantilever", "Matrices", "GreensFile"} <= NAMES
    assert len(FILES) > 100


def test_no_shape_is_asked_for_its_family() -> None:
    """But for parts from CAD files, which are imported where the others are built."""
    shapes = ROOT / "structures" / "shapes"
    drawn = {family.__name__ for family in families() if family.__module__.startswith("seatfem.")} - {"CadPart"}
    assert {"AnnularSeat", "Bar", "ValvePlate"} <= drawn
    found = []
    for path in sorted(path for path in ROOT.rglob("*.py") if not path.is_relative_to(shapes)):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            asks = isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
            if asks and drawn & {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}:
                found.append(f"{path}:{node.lineno}")
    assert found == []
