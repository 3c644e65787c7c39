"""Copies of the scene and of its plan, stored beside the results of a run."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

from impact.files.safe_files import write_whole
from impact.notices import SeatfemError
from seatfem.faces.plan_view import plan_json
from seatfem.study.plan import Plan

SCENE_COPY: Final = "scene.toml"
SET: Final = "# --set "  # prefix of a line of the copy that holds a change by the command line
PLAN_FILE: Final = "plan.json"
_LITERAL: Final = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"")  # one quoted string, as `repr` writes it
_TEXT: Final = re.compile(r"\"[^\"\\\n]+\"|'[^'\n]+'")  # a string of the scene file, without escapes


class AskedError(SeatfemError, ValueError):
    """Error of a "# --set" line in the copy of a scene that cannot be read."""


def keep_asked(
    content: bytes, files: Collection[Path], home: Path, plan: Plan, folder: Path, changes: Sequence[str] = ()
) -> tuple[Path, ...]:
    """Write the scene file's ``content`` below its ``changes`` as comments, and the ``plan`` of the last round, into
    ``folder``; return the files written, in this order. Paths of the scene's ``files`` relative to ``home``, the folder
    of the scene file, become absolute, so that the copy still refers to them."""
    head = "".join(f"{SET}{each!r}\n" for each in changes).encode("utf-8")
    copy = head + _with_absolute_paths(content, files, home)
    written = {SCENE_COPY: copy, PLAN_FILE: plan_json(plan).encode("utf-8")}
    for name, content in written.items():
        write_whole(folder / name, content)
    return tuple(folder / name for name in written)


def changes_in(text: str) -> list[str]:
    """Return the --set changes in the copy of a scene. Raises `AskedError` for a line that is not one quoted string."""
    changes = []
    for line in text.splitlines():
        if not line.startswith(SET):
            continue
        literal = line.removeprefix(SET).strip()
        try:
            change = ast.literal_eval(literal) if _LITERAL.fullmatch(literal) else None
        except (SyntaxError, ValueError):
            change = None
        if not isinstance(change, str):
            raise AskedError(f"{SCENE_COPY}: {line[:80]!r}: a change must be one text in quotes; remove the line")
        changes.append(change)
    return changes


def _with_absolute_paths(content: bytes, files: Collection[Path], home: Path) -> bytes:
    """Return the content with absolute paths for strings that name one of the ``files`` relative to ``home``."""

    def whole(quoted: re.Match[str]) -> str:
        path = (home / quoted[0][1:-1]).resolve()
        return json.dumps(path.as_posix(), ensure_ascii=False) if path in files else quoted[0]

    return _TEXT.sub(whole, content.decode("utf-8")).encode("utf-8")
