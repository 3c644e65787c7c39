"""What the program says when it refuses: each refusal that a test provokes names what it refuses, and gives a remedy.

`tests/conftest.py` puts `raises` and `placed` in the places of pytest's and of the command line's: no test need ask.
"""

import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from seatfem.faces import cli
from seatfem.fields import Table, kind_of, kinds_below
from seatfem.structures.kinds import kinds_of
from seatfem.study.scene import Scene
from seatfem.study.scene.problems import SceneError, tables_in

RAISES, PLACED = pytest.raises, cli.placed
NAMED = re.compile(r"\d|['\"`].+['\"`]|\S[._/]\w|\w ?=|--\w|^[\w ]+: |[a-z][A-Z]|\b[B-Z]\b")
"""A number or a text in quotes, a key, an argument, a file, an option, what stands before a colon, or a letter."""
ALLOWED = re.compile(
    r"\b(?:must|should|at most|at least|between|needs?|needed|required|expected|outside|range|limit|known)\b"
    r"|\b(?:none|one) of\b|\bdid you mean\b|\bthere are\b|\b(?:it|file|mesh|model|solid) h(?:as|olds)\b"
    r"|[<>]=? ?[\d.]|\.\.|`seatfem ",
    re.IGNORECASE,
)
"""What must be or may be instead."""
VERBS = (
    "add allow apply apt-get ask average change check choose cite close compute construct convert correct cut delete "
    "draw explode export fill fit fix flatten give heal hold install join keep leave let load lower make march measure "
    "mend mesh move name number open pip prepare put raise read refine release remove rename reorder resample restore "
    "run sample save see select set shorten sort split stack start state straighten strike swap take try turn unpack "
    "update use vary wait write"
)
TO_DO = re.compile(rf"(?:^|[;:,.(?] |\b(?:or|and) )\W?(?:{VERBS.replace(' ', '|')})\b", re.IGNORECASE)
"""A clause that begins with what to do."""


PYTHON = re.compile(
    r"\b(?:impact|seatfem)\.[a-z]\w*\b(?!\.)|\bimpact\.[A-Z]\w+|\b(?:CadPart|MeshSpec)\b|\b[a-z]\w{2,}=(?=[\d.,;)\s]|$)"
)
"""What a scene has not: arguments, functions and classes of the packages."""
STATED = re.compile(r"(?<![\w.-])((?:[a-z]\w*\.)*[a-z]\w+) = (?!=)")
"""A key with its value."""
BODIES = ("seat", "reed", "stopper")


@cache
def keys_below(table: type[BaseModel]) -> frozenset[str]:
    """Return the keys of a table, of its kinds, and of all tables in it."""
    inner = (each for field in table.model_fields.values() for each in tables_in(field.annotation))
    own = {field.alias or name for name, field in table.model_fields.items()}
    return frozenset(own).union(*map(keys_below, (*inner, *kinds_below(table))))


def keys_at(file: Path | None, key: str) -> frozenset[str]:
    """Return the keys of a scene that a message on one of its keys may name: those of the kind that stands there."""
    role = key.partition(".")[0]
    written = role in BODIES and file is not None and file.is_file()  # a text has a name in place of a file
    table = tomllib.loads(file.read_text(encoding="utf-8")).get(role) if written and file else None
    if not isinstance(table, dict):
        return frozenset().union(*map(keys_below, (*Table.__subclasses__(), *kinds_of())))
    kinds = [each for each in kinds_of() if kind_of(each) == table.get("kind", next(iter(table), ""))]
    others = (tables_in(field.annotation) for name, field in Scene.model_fields.items() if name not in BODIES)
    return frozenset(BODIES).union(*map(keys_below, (*(kinds or kinds_of()), *chain.from_iterable(others))))


def foreign(error: SceneError) -> list[str]:
    """Return what messages of a scene name that its tables do not have; another kind's keys where that is named."""
    names = []
    for each in error.problems:
        known = keys_at(None if "kind" in each.message else each.file, each.key)
        stated = {name for name in STATED.findall(each.message) if not each.key.endswith(name)}
        names += PYTHON.findall(each.message) + [name for name in stated if name.rpartition(".")[2] not in known]
    return names


def lacks(text: str) -> list[str]:
    """Return what a refusal does not say."""
    words = " ".join(text.split())
    named, remedy = NAMED.search(words), ALLOWED.search(words) or TO_DO.search(words)
    return [lack for lack, part in (("what is refused", named), ("a remedy", remedy)) if not part]


def judge(error: BaseException) -> None:
    """Fail the test that provoked an error of the packages which lacks something; of a scene each problem is asked."""
    kind = type(error)
    if isinstance(error, Exception) and kind.__module__.partition(".")[0] in ("impact", "seatfem"):
        for text in map(str, getattr(error, "problems", (error,))):
            assert not lacks(text), f"{kind.__name__} does not say {' and '.join(lacks(text))}: {text}"
    if isinstance(error, SceneError):
        assert not foreign(error), f"{foreign(error)} is no key where {error}"


@contextmanager
def raises(*expected: Any, **named: Any) -> Iterator[pytest.ExceptionInfo[Any]]:
    """Do as `pytest.raises`, whose error is judged."""
    with RAISES(*expected, **named) as caught:
        yield caught
    judge(caught.value)


def placed(error: Exception, arguments: Sequence[str]) -> str:
    """Return what the command line prints of an error, judged if it is bad input."""
    if cli.code_of(error) == cli.BAD_INPUT:
        judge(error)
        if any(word.endswith(".toml") for word in arguments) and "--set" not in str(error):
            assert not (names := PYTHON.findall(str(error))), f"{names} is no key where {error}"
    return PLACED(error, arguments)
