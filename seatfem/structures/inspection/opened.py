"""Files that are read once in a process: by path, time of the last change, and size."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class FileState(NamedTuple):
    """A file as it is now: equal states are taken for equal contents."""

    path: Path
    changed: int
    size: int


def state_of(path: Path) -> FileState:
    """The state of a file. Raises `OSError`."""
    status = path.stat()
    return FileState(path.resolve(), status.st_mtime_ns, status.st_size)
