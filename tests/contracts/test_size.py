"""The product grows only by a decision: limits are lowered where it shrinks, and raised in a commit that says why."""

from __future__ import annotations

import ast
import re

from tests.contracts.test_imports import FILES, statements

MOST_LINES, MOST_FILES, MOST_LOCAL_IMPORTS = 74_806, 356, 56


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


def test_constructors_say_what_they_are_made_from() -> None:
    """A method `of` says nothing where it is called."""
    assert [path for path in FILES if "\n    def of(" in path.read_text(encoding="utf-8")] == []
