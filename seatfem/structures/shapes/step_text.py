"""The statements of a STEP file (ISO 10303-21), found in one pass however the text is made."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from impact.files.input_files import MB, read_text
from seatfem.structures.errors import GeometryError

LIMIT: Final = 512 * MB
_COMMENT: Final = r"/\*(?:[^*]++|\*(?!/))*+\*/"
_STATEMENT: Final = re.compile(
    rf"(?:\s++|{_COMMENT})*+"
    r"(?:(#\d++)\s*+=\s*+([A-Z][A-Z_0-9]*+)?+\s*+\()?+"
    rf"((?:[^';/]++|'[^']*+'|{_COMMENT}|/)*+);"
)
"""Number, keyword and the rest of a statement; possessive, so that no text makes it slow."""


def cad_text(path: Path) -> str:
    """The text of a STEP or BREP file; raises `GeometryError` for what is no regular file, or too large."""
    return read_text(path, LIMIT, GeometryError, "latin-1")


def entities(text: str) -> Iterator[tuple[str, str, str]]:
    """Number, keyword ("" of several at once) and what follows the first bracket, of every entity instance."""
    at = 0
    while statement := _STATEMENT.match(text, at):
        at = statement.end()
        if statement[1]:
            yield statement[1], statement[2] or "", statement[3]
