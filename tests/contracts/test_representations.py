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

ROOT = Path(__file__).parents[2]
REPRESENTATIONS = ("impact/greens/", "impact/storage/")
"""Where a Green's function may be asked for its class: among themselves, and to be made again from a file."""


def files(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def representations() -> set[str]:
    """Names of all classes of Green's functions in both packages."""
    for _, name, _ in pkgutil.walk_packages(impact.__path__, "impact."):
        importlib.import_module(name)
    found, waiting = set(), [GreensFunction]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        if kind.__module__.partition(".")[0] in ("impact", "seatfem"):
            found.add(kind.__name__)
    return found


def asked(tree: ast.AST, known: set[str]) -> Iterator[tuple[int, str]]:
    """Line and class, wherever the code asks an object for a class among ``known`` that it imports from `impact`."""
    own = {alias.asname or alias.name: alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
           for alias in node.names if str(node.module).partition(".")[0] == "impact"}  # fmt: skip

    def named(part: ast.AST) -> Iterator[str]:
        for node in ast.walk(part):
            if isinstance(node, ast.Name) and own.get(node.id) in known:
                yield node.id
            elif isinstance(node, ast.Attribute) and node.attr in known:
                yield node.attr

    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 2:
            if node.func.id in ("isinstance", "issubclass"):
                yield from ((node.lineno, name) for name in named(node.args[1]))
        elif isinstance(node, ast.Compare) and "type(" in ast.unparse(node):
            yield from ((node.lineno, name) for part in node.comparators for name in named(part))
        elif isinstance(node, ast.MatchClass):
            yield from ((node.cls.lineno, name) for name in named(node.cls))


def test_nobody_asks_a_greens_function_for_its_class() -> None:
    known = representations()
    assert {"ModalGreens", "PoleGreens", "SampledGreens", "SumGreens", "ScaledGreens", "DelayRod"} <= known
    askers = [
        f"{path.relative_to(ROOT)}:{line} asks for {name}"
        for path in files("impact", "seatfem")
        if not path.relative_to(ROOT).as_posix().startswith(REPRESENTATIONS)
        if any(name in (text := path.read_text(encoding="utf-8")) for name in known)
        for line, name in asked(ast.parse(text), known)
    ]
    assert askers == []


@pytest.mark.parametrize(
    "code",
    [
        "isinstance(g, ModalGreens)", "isinstance(g, int | ModalGreens)", "issubclass(type(g), (int, ModalGreens))",
        "type(g) is ModalGreens", "isinstance(g, impact.ModalGreens)", "match g:\n  case ModalGreens(): pass",
    ],
)  # fmt: skip
def test_the_question_is_seen_in_every_form(code: str) -> None:
    tree = ast.parse(f"from impact.greens.modal import ModalGreens\n{code}")
    assert [name for _, name in asked(tree, {"ModalGreens"})] == ["ModalGreens"]


def test_every_representation_goes_through_the_contract() -> None:
    """Each class that can be made stands in `tests/contracts/test_greens.py`, which all promises are tested on."""
    tested = {type(greens).__name__ for greens, _ in importlib.import_module("test_greens").KINDS.values()}
    abstract = {kind.__name__ for kind in _all(GreensFunction) if inspect.isabstract(kind)}
    assert representations() - abstract == tested


def _all(kind: type) -> Iterator[type]:
    yield kind
    for below in kind.__subclasses__():
        yield from _all(below)
