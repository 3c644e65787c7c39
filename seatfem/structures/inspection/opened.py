"""Files that are opened before anything is planned: each once in a process, and what is wrong, by key."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from seatfem.structures.kinds.structure import Finding


class FileState(NamedTuple):
    """A file as it is now: equal states are taken for equal contents."""

    path: Path
    changed: int
    size: int


def state_of(path: Path) -> FileState:
    """Return the state of a file. Raises `OSError`."""
    status = path.stat()
    return FileState(path.resolve(), status.st_mtime_ns, status.st_size)


def opened(read: Callable[[], object], files: Mapping[str, Path | None]) -> Iterator[Finding]:
    """Yield what a reader says, at the key of the file that it speaks of; of none, at the last."""
    try:
        read()
    except (ValueError, OSError) as error:
        key = next((key for key, file in files.items() if file is not None and str(file) in str(error)), [*files][-1])
        yield (key,), str(error)


def naming(file: Path, message: str) -> str:
    """Return the message, with the file's name in front where it lacks it."""
    return message if file.name in message else f"{file}: {message}"


def listed(names: Collection[str]) -> str:
    """Return the names, one after the other."""
    return ", ".join(map(repr, names)) or "none"
