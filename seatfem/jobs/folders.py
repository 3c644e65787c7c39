"""Files shared by programs: private folders, journals of finished work, and claims held by one program at a time.

The owner of a folder holds a lock on a file in it, which the system releases when the process ends for any reason. A
folder whose lock is free has lost its owner; the next program that starts removes it.
"""

import json
import os
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final, TypeVar

from impact.files.safe_files import MB, read_text
from impact.notices import SeatfemError

if sys.platform != "win32":
    import fcntl


PREFIX: Final = "seatfem-"
LOCK: Final = "owner.lock"


@contextmanager
def private_folder(purpose: str) -> Iterator[Path]:
    """Yield a new folder for this user alone, removed at the end of the block; remove folders of ended programs."""
    sweep()
    folder = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{purpose}-"))
    lock = _locked(folder)
    try:
        yield folder
    finally:
        os.close(lock)
        shutil.rmtree(folder, ignore_errors=True)


def sweep(among: Path | None = None) -> tuple[Path, ...]:
    """Remove the private folders whose owners have ended, and return their paths.

    They are folders of this user with our prefix and our lock, free, directly in ``among`` (default: the folder for
    temporary files). Links are neither followed nor removed. Folders that cannot be read or removed remain.
    """
    removed = []
    with suppress(OSError), os.scandir(tempfile.gettempdir() if among is None else among) as entries:
        for entry in entries:
            if entry.name.startswith(PREFIX) and _is_ours(entry) and _removed(Path(entry.path)):
                removed.append(Path(entry.path))
    return tuple(removed)


def _locked(folder: Path) -> int:
    """Return the descriptor of the folder's lock. It is named after it is locked: a free lock has lost its owner."""
    final = folder / LOCK
    new = final if sys.platform == "win32" else folder / "new.lock"
    lock = os.open(new, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    if sys.platform != "win32":
        with suppress(OSError):  # on a file system without locks the folder is never removed
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            new.rename(final)
    return lock


def _is_ours(entry: os.DirEntry[str]) -> bool:
    with suppress(OSError):
        return entry.is_dir(follow_symlinks=False) and _owned(entry.stat(follow_symlinks=False))
    return False


def _owned(status: os.stat_result) -> bool:
    return sys.platform == "win32" or status.st_uid == os.geteuid()


def _removed(folder: Path) -> bool:
    """Remove a folder whose lock is free, and return whether it is gone."""
    path = folder / LOCK
    if sys.platform == "win32":
        try:
            path.unlink()  # fails while its owner has it open
        except OSError:
            return False
        shutil.rmtree(folder, ignore_errors=True)
        return True
    try:
        lock = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        status = os.fstat(lock)
        if not (stat.S_ISREG(status.st_mode) and _owned(status)):
            return False
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
        return not folder.exists()
    except OSError:
        return False
    finally:
        os.close(lock)


PAUSE: Final = 0.02  # time between two attempts to lock a file that another program has locked [s]


@contextmanager
def claimed(path: Path, patience: float) -> Iterator[bool]:
    """Yield whether this program holds the claim ``path``: a lock file that is made for the block and removed after it.

    The claim fails if another program still holds it after ``patience`` seconds. If files cannot be locked (Windows,
    folders without write permission), nothing is locked and every claim is granted.
    """
    lock = None
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = _lock_before(path, time.monotonic() + patience)
        if lock is None:
            yield False
            return
    try:
        yield True
    finally:
        if lock is not None:
            with suppress(OSError):
                path.unlink()  # while it is locked: a waiting program checks whether it still exists
            os.close(lock)


def _lock_before(path: Path, deadline: float) -> int | None:
    """Return the descriptor that holds the lock; ``None`` after the deadline."""
    if sys.platform == "win32":
        raise OSError("no locks")
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o600)
        try:
            if not stat.S_ISREG(os.fstat(lock).st_mode):
                raise OSError("no regular file")
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.samestat(os.fstat(lock), os.stat(path, follow_symlinks=False)):
                return lock
        except (BlockingIOError, FileNotFoundError):
            pass
        except OSError:
            os.close(lock)
            raise
        os.close(lock)
        if time.monotonic() > deadline:
            return None
        time.sleep(PAUSE)


T = TypeVar("T")
MOST: Final = 1024 * MB


class JournalError(SeatfemError, ValueError):
    """Error of a journal's path that is not a journal file."""


def append(path: Path, entry: Mapping[str, object]) -> None:
    """Append one line by a single write, so that several programs may share a journal.

    After a truncated line it begins on a new one. Raises `OSError` with the name of the file, also for a symbolic link,
    whose target may be another user's.
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
    """Yield the complete lines; lines that were truncated, or are not JSON objects, are skipped.

    Raises `JournalError` if the path is not a regular file of up to `MOST` bytes.
    """
    if not path.exists():
        return
    for line in read_text(path, MOST, JournalError, errors="replace").splitlines():
        with suppress(ValueError, RecursionError):
            entry = json.loads(line)
            if isinstance(entry, dict):
                yield entry


def outcomes(path: Path, key: str, make: Callable[..., T], **same: object) -> dict[str, T]:
    """Return the results in a journal by the names under ``key``: ``make`` of the other fields of each line.

    Lines in which a field of ``same`` differs, such as the version of the code, or with other fields are skipped.
    """
    results: dict[str, T] = {}
    for entry in entries(path):
        with suppress(KeyError, TypeError):
            name = entry.pop(key)
            if isinstance(name, str) and all(entry.pop(field) == value for field, value in same.items()):
                results[name] = make(**entry)
    return results
