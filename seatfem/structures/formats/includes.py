"""Files that a mesh file brings in: they belong to its content."""

from __future__ import annotations

import re
from pathlib import Path

from impact.files.input_files import read_text
from seatfem.structures.formats.abaqus_deck import MOST_BYTES, MOST_FILES
from seatfem.structures.mesh.io import MeshError

_ABAQUS = re.compile(r'^\*[ \t]*INCLUDE[ \t]*,\s*INPUT[ \t]*=[ \t]*"?([^",\r\n]+)', re.IGNORECASE | re.MULTILINE)


def with_included(path: Path) -> tuple[Path, ...]:
    """``path`` and, of an Abaqus input file, every file that it brings in by *INCLUDE, those within those too.

    Files that are not there are left out. Nastran's INCLUDE is refused by `read_nastran`.
    """
    found: dict[Path, None] = {}  # in order
    waiting = [path]
    while waiting and len(found) <= MOST_FILES:  # a deck of more is refused when it is read
        file = waiting.pop().resolve()
        if file in found or not file.is_file():
            continue
        found[file] = None
        if path.suffix.lower() == ".inp":
            text = read_text(file, MOST_BYTES, MeshError, errors="replace")
            waiting += [file.parent / name.strip() for name in _ABAQUS.findall(text)[:MOST_FILES]]
    return tuple(found)
