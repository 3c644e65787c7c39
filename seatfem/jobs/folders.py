"""Private temporary folders that do not outlive their owner for long.

The owner holds a lock on a file inside, which the system releases when the process ends, by whatever cause. A folder
whose lock nobody holds is left over; the next program that starts removes it.
"""

from __future__ import annotations

import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

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
    """Remove the private folders whose owners have ended, and say which.

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
