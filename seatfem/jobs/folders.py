"""Files that programs share: private folders, journals of finished work, and claims that one program at a time
holds.

The owner holds a lock on a file inside, which the system releases when the process ends, by whatever cause. A folder
whose lock nobody holds is left over; the next program that starts removes it.
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

if sys.platform != "win32":
    import fcntl


PREFIX: Final = "seatfem-"
LOCK: Final = "owner.lock"


@contextmanager
def private_folder(purpose: str) -> Iterator[Path]:
    """Make a folder for this user alone, removed with all it holds when the block ends; what others left is swept."""
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

    Only folders of this user that carry our prefix and our lock, with the lock free, directly in ``among`` (default:
    the folder for temporary files). Links are neither followed nor removed. What cannot be read or removed is left.
    """
    gone = []
    with suppress(OSError), os.scandir(tempfile.gettempdir() if among is None else among) as entries:
        for entry in entries:
            if entry.name.startswith(PREFIX) and _is_ours(entry) and _removed(Path(entry.path)):
                gone.append(Path(entry.path))
    return tuple(gone)


def _locked(folder: Path) -> int:
    """Return the descriptor of the folder's lock. It gets its name once it is locked: a free lock is a dead owner's."""
    final = folder / LOCK
    new = final if sys.platform == "win32" else folder / "new.lock"
    lock = os.open(new, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    if sys.platform != "win32":
        with suppress(OSError):  # a file system without locks: the folder is not swept
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
    """Remove a folder whose lock nobody holds, and return whether it is gone."""
    path = folder / LOCK
    if sys.platform == "win32":
        try:
            path.unlink()  # refused while its owner has it open
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


PAUSE: Final = 0.02  # time [s] between two tries of a lock that another program holds


@contextmanager
def claimed(path: Path, patience: float) -> Iterator[bool]:
    """Within the block no other program has claimed ``path``, a file of a lock that is made for it and removed after.

    Gives whether that is so: not where another one still holds the claim after ``patience`` seconds. Where files cannot
    be locked (Windows, folders that cannot be written to), nothing is held and every claim is granted.
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
                path.unlink()  # while it is held: who waits for it looks whether it is still there
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
    """Return the content of a journal by the names under ``key``: ``made`` of the other fields of each line.

    Lines in which a field of ``same`` is another (the version of the code) are passed, as are those that do not fit.
    """
    results: dict[str, T] = {}
    for entry in entries(path):
        with suppress(KeyError, TypeError):
            name = entry.pop(key)
            if isinstance(name, str) and all(entry.pop(field) == value for field, value in same.items()):
                results[name] = made(**entry)
    return results
