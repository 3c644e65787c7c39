"""Errors in words, and as exit codes: what a user is told in place of a traceback."""

from __future__ import annotations

import re
from collections.abc import Sequence
from errno import ENOENT
from pathlib import Path
from typing import Final

from seatfem.faces.output import BAD_INPUT, FAILED

WIDEST: Final = 1000  # characters of a line of a message
MOST_LINES: Final = 40
_KEY: Final = re.compile(r"[a-z_]+(?:\.[a-z_0-9]+)+(?=: | = )")
"""With which messages about a key of a scene begin."""


def _is_ours(error: Exception) -> bool:
    return type(error).__module__.partition(".")[0] in ("seatfem", "impact")


def in_words(error: Exception) -> str:
    """Return what a user can do about an error; an error that is no fault of the user's is called a bug."""
    from impact.files.atomic import FULL
    from seatfem.machine.packages import broken_package

    if isinstance(error, OSError) and error.errno in FULL:
        return f"{error.filename or 'a file'}: {error.strerror}; free space there, or choose another folder (--output)"
    if isinstance(error, FileNotFoundError) and error.errno == ENOENT and error.filename:
        return f"{error.filename}: no such file; check the path"
    if _is_ours(error) or isinstance(error, OSError):
        return str(error)
    if words := broken_package(error):
        return words
    if isinstance(error, MemoryError):
        return f"{str(error) or 'out of memory'}; a coarser mesh (seat.mesh.size) needs less"
    return f"unexpected {type(error).__name__}: {error}; this is a bug, --debug or SEATFEM_DEBUG=1 shows where"


def placed(error: Exception, arguments: Sequence[str]) -> str:
    """Return `in_words` of an error, with the scene's name before what the contact solver says, which knows no scenes,
    and with the lines of the keys before what is wrong with the files that the scene names."""
    scenes = [Path(word) for word in arguments if word.endswith(".toml")]
    if scenes and type(error).__name__ == "SceneError":
        from seatfem.study.scene import SceneError, located

        assert isinstance(error, SceneError)
        error = located(error, scenes[0])
    text = in_words(error)
    is_placed = type(error).__name__ == "SceneError"
    if scenes and not is_placed and _is_ours(error) and (key := _KEY.match(text)):
        text = _with_line(text, key[0], scenes[0])
    if not scenes or type(error).__module__.partition(".")[0] != "impact" or str(scenes[0].absolute().parent) in text:
        return text
    return f"{scenes[0]}: {text}"


def _with_line(text: str, key: str, scene: Path) -> str:
    """Return the text with the line of the key, or of its table, that a message of one line begins with; unchanged if
    the file has neither."""
    from seatfem.study.scene import SceneError, located
    from seatfem.study.scene.problems import Problem

    try:
        error = located(SceneError((Problem(None, 0, "", text, tuple(key.split("."))),)), scene)
    except SceneError:  # of the file itself
        return text
    return str(error) if error.problems[0].line and "\n" not in text else text


def clipped(text: str) -> str:
    """Return the text cut to a readable length: a broken file's own words may be a million characters long."""
    lines = [
        line if len(line) <= WIDEST else f"{line[: WIDEST // 2]} ... {line[-WIDEST // 2 :]}"
        for line in text.split("\n")
    ]
    more = len(lines) - MOST_LINES
    return "\n".join(lines if more <= 0 else [*lines[:MOST_LINES], f"... and {more} more lines"])


def code_of(error: Exception) -> int:
    """Return the exit code of a command that ended with this error."""
    bad_input = isinstance(error, FileNotFoundError) or (_is_ours(error) and isinstance(error, ValueError))
    return BAD_INPUT if bad_input else FAILED
