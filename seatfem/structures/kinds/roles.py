"""In which table of a scene a body stands: what its own messages cannot know."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from seatfem.structures.kinds.structure import Structure

HOME = "seat"
"""The table that the messages of a structure speak of, as if it stood there."""


def in_words_of(role: str, structure: Structure, text: str) -> str:
    """A message about keys of [seat], about those of the table ``role``: its own keys, and no file of that name."""
    keys = "|".join(sorted(type(structure).model_fields, key=len, reverse=True))
    return re.sub(rf"\b{HOME}\.(?=(?:{keys})\b)", f"{role}.", text)


@contextmanager
def in_role(role: str, structure: Structure) -> Iterator[None]:
    """What goes wrong with a body that stands in the table ``role`` is told in keys of that table."""
    try:
        yield
    except (ArithmeticError, RuntimeError, ValueError) as problem:
        if role != HOME and problem.args and isinstance(problem.args[0], str):
            problem.args = (in_words_of(role, structure, problem.args[0]), *problem.args[1:])
        raise
