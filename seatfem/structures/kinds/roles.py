"""The table of a scene in which a body stands: what its own messages cannot know."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from seatfem.structures.kinds.structure import Structure

_AS_IF = r"(?<![\w/\\.])(?:seat|reed)\."
"""The tables that the messages of structures speak of, as if the body stood there."""


def in_words_of(role: str, structure: Structure, text: str) -> str:
    """Return a structure's message, its keys those of the table ``role``; files of such names stay what they are."""
    if role == "stopper":  # its face is divided by keys of its own table
        text = text.replace("contact.ports", "stopper.arcs").replace("contact.rings", "stopper.rings")
    keys = "|".join(sorted(type(structure).model_fields, key=len, reverse=True))
    return re.sub(rf"{_AS_IF}(?=(?:{keys})\b)", f"{role}.", text)


@contextmanager
def in_role(role: str, structure: Structure) -> Iterator[None]:
    """Tell what goes wrong with a body that stands in the table ``role`` in keys of that table."""
    try:
        yield
    except (ArithmeticError, RuntimeError, ValueError) as problem:
        if problem.args and isinstance(problem.args[0], str):
            problem.args = (in_words_of(role, structure, problem.args[0]), *problem.args[1:])
        raise
