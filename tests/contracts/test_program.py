"""What the program offers is tested: no verb and no option that a test does not use."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from seatfem.faces.cli import app

TESTS = Path(__file__).parents[1]
VERBS = sorted(name for name in app if not name.startswith("-"))


def options(verb: str) -> Iterator[set[str]]:
    """Yield the names of each of its options, long and short."""
    for argument in app[verb].assemble_argument_collection():
        names = {name for name in argument.names if name.startswith("-")}
        if names:
            yield names


@cache
def strings_of_functions() -> list[set[str]]:
    """Return the words that each function of the tests writes between quotes."""
    texts = (path.read_text(encoding="utf-8") for path in TESTS.rglob("*.py"))
    trees = [ast.parse(text) for text in texts if '"-' in text or (" -" in text and "run_command" in text)]
    return [
        {word for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)
         for word in part.value.split()}
        for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
    ]  # fmt: skip


SHARED = {"--debug", "--quiet", "--verbose"}  # read in one place: a test of one verb is a test of all


@pytest.mark.slow(only=("completion",))
@pytest.mark.parametrize("verb", VERBS)
def test_every_option_of_every_verb_is_tested(verb: str) -> None:
    all_said = strings_of_functions()
    assert any(verb in said for said in all_said)
    missing = [
        names
        for names in options(verb)
        if not any(names & said and (verb in said or names & SHARED) for said in all_said)
    ]
    assert not missing, f"seatfem {verb}: no test uses {missing}"
