"""What the program says when it refuses: each refusal that a test provokes names what it refuses, and gives a remedy.

`tests/conftest.py` puts `raises` and `placed` in the places of pytest's and of the command line's: no test need ask.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from seatfem.faces import cli

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
    "run sample save see select set shorten split stack start state straighten strike take try turn unpack update use "
    "vary wait write"
)
TO_DO = re.compile(rf"(?:^|[;:,.(?] |\b(?:or|and) )\W?(?:{VERBS.replace(' ', '|')})\b", re.IGNORECASE)
"""A clause that begins with what to do."""


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
    return PLACED(error, arguments)
