"""Work that only one program at a time should do: a lock on a file, which the system releases with its owner."""

from __future__ import annotations

import os
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

if sys.platform != "win32":
    import fcntl

PAUSE: Final = 0.02  # s between two looks at a lock that another program holds


@contextmanager
def claimed(path: Path, patience: float) -> Iterator[bool]:
    """Within the block no other program has claimed ``path``, a file of a lock that is made for it and removed after.

    Gives whether that is so: not where another one still holds the claim after ``patience`` seconds. Where files cannot
    be locked (Windows, folders that cannot be written to), nothing is held and every claim is granted.
    """
    lock = None
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = _locked(path, time.monotonic() + patience)
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


def _locked(path: Path, deadline: float) -> int | None:
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
