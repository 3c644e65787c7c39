"""Journals of finished work: JSON lines, each written at once, so that a stopped job goes on where it was."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, TypeVar

from impact.files.input_files import MB, read_text

T = TypeVar("T")
MOST: Final = 1024 * MB


class JournalError(ValueError):
    """The file in a journal's place is none."""


def append(path: Path, entry: Mapping[str, object]) -> None:
    """Append one more line, by a single write, so that several programs may share a journal.

    After a line that was cut short it begins on a new one. Raises `OSError` with the name of the file, also where that
    is a link: what it leads to is another's.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with open(path, "ab+", buffering=0, opener=_no_link) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(size - 1, 0))
            whole = size == 0 or file.read(1) == b"\n"
            line = ("" if whole else "\n") + json.dumps(dict(entry)) + "\n"
            data = line.encode("utf-8")
            if (written := file.write(data)) != len(data):  # a disk that has become full
                file.write(data[written:])
    except OSError as problem:
        raise OSError(problem.errno, problem.strerror, str(path)) from problem


def _no_link(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0), 0o666)


def entries(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the lines that are whole; those that a kill cut short, or that are no JSON objects, are passed.

    Raises `JournalError` of what is no regular file of up to `MOST` bytes.
    """
    if not path.exists():
        return
    for line in read_text(path, MOST, JournalError, errors="replace").splitlines():
        with suppress(ValueError, RecursionError):
            entry = json.loads(line)
            if isinstance(entry, dict):
                yield entry


def outcomes(path: Path, key: str, made: Callable[..., T], **same: object) -> dict[str, T]:
    """Return what a journal holds by the names under ``key``: ``made`` of the other fields of each line.

    Lines in which a field of ``same`` is another (the version of the code) are passed, as are those that do not fit.
    """
    results: dict[str, T] = {}
    for entry in entries(path):
        with suppress(KeyError, TypeError):
            name = entry.pop(key)
            if isinstance(name, str) and all(entry.pop(field) == value for field, value in same.items()):
                results[name] = made(**entry)
    return results
