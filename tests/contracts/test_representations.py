"""A Green's function answers for itself: nobody asks it for its class, and every class keeps all promises."""

import ast
import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.greens.base import GreensFunction
from tests.contracts.test_greens import KINDS

ROOT = Path(__file__).parents[2]
REPRESENTATIONS = ("impact/greens/", "impact/storage/")
"""Where a Green's function may be asked for its class: among themselves, and to be made again from a file."""


def below(kind: type) -> Iterator[type]:
    for each in kind.__subclasses__():
        yield from (each, *below(each))


def representations() -> dict[str, type]:
    """Return all classes of Green's functions in both packages, by name."""
    for _, name, _ in pkgutil.walk_packages(impact.__path__, "impact."):
        importlib.import_module(name)
    classes = (GreensFunction, *below(GreensFunction))
    return {kind.__name__: kind for kind in classes if kind.__module__.partition(".")[0] in ("impact", "seatfem")}


def class_questions(tree: ast.AST, names: set[str]) -> Iterator[tuple[int, str]]:
    """Yield where an object is asked for a class among ``names``: isinstance, type(...), match."""
    own = {alias.asname or alias.name: alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
           for alias in node.names if str(node.module).partition(".")[0] == "impact"}  # fmt: skip
    for node in ast.walk(tree):
        text = ast.unparse(node) if isinstance(node, ast.Call | ast.Compare) else ""
        if isinstance(node, ast.MatchClass) or text.startswith(("isinstance(", "issubclass(")) or "type(" in text:
            for each in ast.walk(node):
                name = own.get(each.id) if isinstance(each, ast.Name) else getattr(each, "attr", None)
                if name in names:
                    yield getattr(each, "lineno", 0), str(name)


@pytest.mark.slow
def test_nobody_asks_a_greens_function_for_its_class() -> None:
    class_names = set(representations())
    assert {"ModalGreens", "PoleGreens", "SampledGreens", "SumGreens", "ScaledGreens", "DelayRod"} <= class_names
    askers = [
        f"{path.relative_to(ROOT)}:{line} asks for {name}"
        for folder in ("impact", "seatfem")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if not path.relative_to(ROOT).as_posix().startswith(REPRESENTATIONS)
        if any(name in (text := path.read_text(encoding="utf-8")) for name in class_names)
        for line, name in class_questions(ast.parse(text), class_names)
    ]
    assert askers == []


@pytest.mark.parametrize(
    "code", ["isinstance(g, int | ModalGreens)", "type(g) is impact.ModalGreens", "match g:\n  case ModalGreens(): 1"]
)
def test_the_question_is_seen_in_every_form(code: str) -> None:
    tree = ast.parse(f"from impact.greens.modal import ModalGreens\n{code}")
    assert {name for _, name in class_questions(tree, {"ModalGreens"})} == {"ModalGreens"}


def test_every_representation_goes_through_the_contract() -> None:
    """Each class that can be made stands in `tests/contracts/test_greens.py`, which all promises are tested on."""
    concrete = {name for name, kind in representations().items() if not inspect.isabstract(kind)}
    assert concrete == {type(greens).__name__ for greens, _ in KINDS.values()}
