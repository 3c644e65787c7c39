"""Files that a mesh file brings in: they belong to its content."""

from __future__ import annotations

import re
from pathlib import Path

_ABAQUS = re.compile(r'^\*\s*INCLUDE\s*,\s*INPUT\s*=\s*"?([^",\r\n]+)', re.IGNORECASE | re.MULTILINE)


def with_included(path: Path) -> tuple[Path, ...]:
    """``path`` and, of an Abaqus input file, every file that it brings in by *INCLUDE, those within those too.

    Files that are not there are left out. Nastran's INCLUDE is refused by `read_nastran`.
    """
    found: list[Path] = []
    waiting = [path]
    while waiting:
        file = waiting.pop().resolve()
        if file in found or not file.is_file():
            continue
        found.append(file)
        if path.suffix.lower() == ".inp":
            text = file.read_text(encoding="utf-8", errors="replace")
            waiting += [file.parent / name.strip() for name in _ABAQUS.findall(text)]
    return tuple(found)
