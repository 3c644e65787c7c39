"""Nobody asks which kind a structure is: it answers for itself, in its own file."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from seatfem.fields import kind_of
from seatfem.structures.kinds import kinds_of
from seatfem.structures.kinds.structure import HOMES
from seatfem.structures.reduction.greens import reducers
from seatfem.structures.shapes import families
from seatfem.study.scene.laws import laws

ROOT = Path(__file__).parents[2] / "seatfem"
KINDS = ROOT / "structures" / "kinds"
NAMES = {kind.__name__ for kind in kinds_of() if kind.__module__.startswith("seatfem.")}
FILES = sorted(path for path in ROOT.rglob("*.py") if not path.is_relative_to(KINDS))


def test_a_scene_finds_the_module_of_each_kind_that_it_names() -> None:
    stated = {(module, name) for module, names in HOMES.items() for name in names.split()}
    homes = {(kind.__module__.rpartition(".")[2], name) for kind in kinds_of() for name in (kind_of(kind), *kind.also)}
    assert stated == {(module, name) for module, name in homes if (KINDS / f"{module}.py").is_file()}
    assert {kind_of(kind) for kind in kinds_of({"spring", "rigid_mass"})} == {"spring", "rigid_mass"}
    assert kinds_of({"spring", "sprig"}) == kinds_of()


def kinds_asked_for(path: Path) -> Iterator[str]:
    """Yield the kinds that a file imports or asks for."""
    if "kinds" not in (text := path.read_text(encoding="utf-8")):
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("seatfem.structures.kinds"):
            yield from (f"{path}:{node.lineno}: {each.name}" for each in node.names if each.name in NAMES)
        if isinstance(node, ast.Attribute) and node.attr in NAMES and ast.unparse(node.value).endswith("kinds"):
            yield f"{path}:{node.lineno}: {node.attr}"


def test_no_kind_is_known_by_name_outside_its_own_file() -> None:
    """No file asks for a kind by name, but the package of all kinds and those derived from it."""
    assert {"Annular", "Cantilever", "Matrices", "GreensFile"} <= NAMES
    within = [path for path in KINDS.glob("*.py") if path.name != "__init__.py"]
    assert [place for path in (*FILES, *within) for place in kinds_asked_for(path)] == []


def test_no_shape_is_asked_for_its_family() -> None:
    """No file outside the shapes asks with isinstance for a family, parts from CAD files excepted."""
    shapes = ROOT / "structures" / "shapes"
    drawn = {family.__name__ for family in families() if family.__module__.startswith("seatfem.")} - {"CadPart"}
    assert {"AnnularSeat", "Bar", "ValvePlate"} <= drawn
    places = []
    for path in sorted(path for path in ROOT.rglob("*.py") if not path.is_relative_to(shapes)):
        if "isinstance" not in (text := path.read_text(encoding="utf-8")) or not any(name in text for name in drawn):
            continue
        for node in ast.walk(ast.parse(text)):
            asks = isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
            if asks and drawn & {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}:
                places.append(f"{path}:{node.lineno}")
    assert places == []


ASKED = {
    ("faces/verdict.py", "spring"): "a summary, which is text: a spring is its own baseline",
    ("structures/formats/uff.py", "modes"): "what a data set holds, not a kind",
}


def all_names() -> set[str]:
    """Return the kinds, laws and reductions that the program has of its own."""
    kinds = {kind_of(each) for each in (*kinds_of(), *laws()) if each.__module__.startswith("seatfem.")}
    return kinds | {name for name, each in reducers().items() if type(each).__module__.startswith("seatfem.")}


def compared(tree: ast.AST, names: set[str]) -> Iterator[tuple[int, str]]:
    """Yield where a kind is asked for by name or stated: compared with, matched, or the value of "kind"."""
    for node in ast.walk(tree):
        parts: list[ast.AST] = []
        if isinstance(node, ast.Compare | ast.Match):
            text = ast.unparse(node)
            parts = [node] if "kind" in text or ".reduction" in text or "law" in text else []
        elif isinstance(node, ast.Dict):
            pairs = zip(node.keys, node.values, strict=True)
            parts = [value for key, value in pairs if isinstance(key, ast.Constant) and key.value == "kind"]
        for each in (each for part in parts for each in ast.walk(part)):
            if isinstance(each, ast.Constant) and isinstance(each.value, str) and each.value in names:
                yield each.lineno, each.value


@pytest.mark.slow
def test_no_kind_law_or_reduction_is_asked_for_outside_its_own_file() -> None:
    own = (ROOT / "structures" / "reduction", ROOT / "study" / "scene" / "laws.py")
    names, places = all_names(), {}
    for path in FILES:
        text = path.read_text(encoding="utf-8")
        if not any(path.is_relative_to(each) for each in own) and any(f'"{name}"' in text for name in names):
            place = path.relative_to(ROOT).as_posix()
            places |= {(place, name): line for line, name in compared(ast.parse(text), names)}
    assert places.keys() == ASKED.keys(), places


@pytest.mark.parametrize(
    "code",
    ['x.kind == "plate"', 'match law.kind:\n  case "hertz": pass', 'x.reduction in ("krylov",)', '{"kind": "rod"}'],
)
def test_the_question_is_seen_in_every_form(code: str) -> None:
    assert len(list(compared(ast.parse(code), all_names()))) == 1
