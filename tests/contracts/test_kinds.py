"""Nobody asks which kind a body, a shape or a Green's function is: it answers for itself, in its own file."""

import ast
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.greens.base import GreensFunction
from seatfem.fields import kind_of
from seatfem.structures.kinds import kinds_of
from seatfem.structures.kinds.structure import HOMES
from seatfem.structures.reduction.greens import reducers
from seatfem.structures.shapes import families
from seatfem.study.scene.laws import laws
from tests.contracts.test_greens import KINDS

ROOT = Path(__file__).parents[2]
HOMES_OF_KINDS = ROOT / "seatfem" / "structures" / "kinds"


def ours(classes: set[type]) -> set[str]:
    return {each.__name__ for each in classes if each.__module__.partition(".")[0] in ("impact", "seatfem")}


def representations() -> set[type]:
    """Return all classes of Green's functions."""
    for _, name, _ in pkgutil.walk_packages(impact.__path__, "impact."):
        importlib.import_module(name)
    return {GreensFunction, *below(GreensFunction)}


def below(kind: type) -> set[type]:
    return {one for each in kind.__subclasses__() for one in (each, *below(each))}


def all_names() -> set[str]:
    """Return the kinds, laws and reductions that the program has of its own."""
    kinds = {kind_of(each) for each in (*kinds_of(), *laws()) if each.__module__.startswith("seatfem.")}
    return kinds | {name for name, each in reducers().items() if type(each).__module__.startswith("seatfem.")}


def test_a_scene_finds_the_module_of_each_kind_that_it_names() -> None:
    stated = {(module, name) for module, names in HOMES.items() for name in names.split()}
    homes = {(kind.__module__.rpartition(".")[2], name) for kind in kinds_of() for name in (kind_of(kind), *kind.also)}
    assert stated == {(module, name) for module, name in homes if (HOMES_OF_KINDS / f"{module}.py").is_file()}
    assert {kind_of(kind) for kind in kinds_of({"spring", "rigid_mass"})} == {"spring", "rigid_mass"}
    assert kinds_of({"spring", "sprig"}) == kinds_of()


def test_every_representation_goes_through_the_contract() -> None:
    """Each class that can be made stands in `tests/contracts/test_greens.py`, which all promises are tested on."""
    concrete = ours({kind for kind in representations() if not inspect.isabstract(kind)})
    assert concrete == {type(greens).__name__ for greens, _ in KINDS.values()}


def classes_asked_for(tree: ast.AST, names: set[str]) -> Iterator[str]:
    """Yield each of ``names`` that an object is asked for by isinstance, type(...) or match."""
    own = {alias.asname or alias.name: alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
           for alias in node.names}  # fmt: skip
    for node in ast.walk(tree):
        text = ast.unparse(node) if isinstance(node, ast.Call | ast.Compare) else ""
        if isinstance(node, ast.MatchClass) or text.startswith(("isinstance(", "issubclass(")) or "type(" in text:
            for each in ast.walk(node):
                name = own.get(each.id) if isinstance(each, ast.Name) else getattr(each, "attr", None)
                if name in names:
                    yield f"{getattr(each, 'lineno', 0)}: {name}"


def kinds_imported(tree: ast.AST, names: set[str]) -> Iterator[str]:
    """Yield each of ``names`` that is imported from the package of kinds."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("seatfem.structures.kinds"):
            yield from (f"{node.lineno}: {each.name}" for each in node.names if each.name in names)


def names_compared(tree: ast.AST, names: set[str]) -> Iterator[str]:
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
                yield f"{each.lineno}: {each.value}"


QUESTIONS = {
    "the class of a Green's function": (
        classes_asked_for, lambda: ours(representations()), ("impact/greens/", "impact/storage/")
    ),
    "the family of a shape": (
        classes_asked_for, lambda: ours(set(families())) - {"CadPart"}, ("seatfem/structures/shapes/",)
    ),
    "the class of a kind": (kinds_imported, lambda: ours(set(kinds_of())), ("seatfem/structures/kinds/__init__.py",)),
    "the name of a kind, law or reduction": (
        names_compared, all_names,
        ("impact/", "seatfem/structures/kinds/", "seatfem/structures/reduction/", "seatfem/study/scene/laws.py",
         "seatfem/study/answers/verdict.py",  # asks a summary, which is text
         "seatfem/structures/formats/uff.py"),  # what a data set holds, not a kind
    ),
}  # fmt: skip
"""How each is seen, the names that are asked for, and where they may be."""


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
def test_nobody_asks_for_it_outside_its_own_file(question: str) -> None:
    look, names_of, own = QUESTIONS[question]
    names, places = names_of(), []
    assert len(names) > 5
    for path in sorted([*(ROOT / "impact").rglob("*.py"), *(ROOT / "seatfem").rglob("*.py")]):
        text, place = path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix()
        if not place.startswith(own) and any(name in text for name in names):
            places += [f"{place}:{found}" for found in look(ast.parse(text), names)]
    assert places == []


@pytest.mark.parametrize(
    "code", ["isinstance(g, int | ModalGreens)", "type(g) is impact.ModalGreens", "match g:\n  case ModalGreens(): 1"]
)
def test_a_question_for_a_class_is_seen_in_every_form(code: str) -> None:
    tree = ast.parse(f"from impact.greens.modal import ModalGreens\n{code}")
    assert list(classes_asked_for(tree, {"ModalGreens"}))


@pytest.mark.parametrize(
    "code",
    ['x.kind == "plate"', 'match law.kind:\n  case "hertz": pass', 'x.reduction in ("krylov",)', '{"kind": "rod"}'],
)
def test_a_question_for_a_name_is_seen_in_every_form(code: str) -> None:
    assert len(list(names_compared(ast.parse(code), all_names()))) == 1
