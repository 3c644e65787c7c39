"""Product and tests grow only by a decision: limits fall where they shrink, and rise in a commit that says why."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.contracts.test_imports import FILES, statements

MOST_LINES, MOST_FILES, MOST_LOCAL_IMPORTS = 74_955, 320, 55
MOST_OF_A_SCENE = 53  # functions that take a whole scene


def test_the_product_has_no_more_lines_and_files_than_before() -> None:
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in FILES)
    assert (lines <= MOST_LINES, len(FILES) <= MOST_FILES) == (True, True), (lines, len(FILES))


def test_no_more_imports_hide_in_functions() -> None:
    local = {
        id(node)
        for path in FILES
        if re.search(r"^ +(?:from|import) ", text := path.read_text(encoding="utf-8"), re.MULTILINE)
        for function in ast.walk(ast.parse(text))
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for node, _ in statements(function, True)
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert len(local) <= MOST_LOCAL_IMPORTS


def test_functions_take_the_tables_that_they_ask() -> None:
    """A function that asks one table of a scene, or the geometry of its contacts, takes no whole scene."""
    whole = [
        f"{path.stem}.{node.name}"
        for path in FILES
        if "Scene" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        for taken in [[each.annotation for each in (*node.args.args, *node.args.kwonlyargs) if each.annotation]]
        if any(re.search(r"\bScene\b", ast.unparse(annotation)) for annotation in taken)
    ]
    assert len(whole) <= MOST_OF_A_SCENE, whole


def test_constructors_say_what_they_are_made_from() -> None:
    """A method `of` says nothing where it is called."""
    assert [path for path in FILES if "\n    def of(" in path.read_text(encoding="utf-8")] == []


MOST_LINES_OF_TESTS = 51_604
TESTS = sorted(Path(__file__).parents[1].rglob("*.py"))


def test_the_tests_have_no_more_lines_than_before() -> None:
    """Known answers, frozen numbers, extremes and fuzz included."""
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in TESTS)
    assert lines <= MOST_LINES_OF_TESTS, lines
