"""Files that are either whole or absent."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

FULL = (errno.ENOSPC, errno.EFBIG, *(getattr(errno, name) for name in ("EDQUOT",) if hasattr(errno, name)))
"""What the system says where a disk, a quota or the largest size of a file is exhausted."""


class OutputError(ValueError):
    """A place that cannot be written to; the message names it, the reason and a remedy."""


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, renamed to it when the block ends well and removed when it does not.

    The temporary name keeps the suffix, for writers that choose the format by it. The folder is made if missing. The
    content is on the disk before it gets its name. An `OSError` names ``path``.
    """
    final = Path(path)
    temporary, prefix = final, f".{final.stem}-"
    try:
        final.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=final.suffix, dir=final.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)  # mkstemp makes it private; give it what open() would have given
        temporary.replace(final)
    except OSError as problem:
        own = problem.filename is None or Path(str(problem.filename)).name.startswith(prefix)
        if problem.errno is None or not own:
            raise
        raise OSError(problem.errno, problem.strerror, str(final)) from problem
    finally:
        if temporary is not final:
            with suppress(OSError):
                temporary.unlink()


def write_whole(path: str | os.PathLike[str], *parts: bytes) -> None:
    """Write a file from its parts; whole or absent. Raises `OSError` that names ``path``."""
    with whole_file(path) as temporary, temporary.open("wb") as file:
        for part in parts:
            file.write(part)


def check_writable(*paths: str | os.PathLike[str]) -> None:
    """Try, before anything expensive, whether files could be written at ``paths``; nothing is left behind.

    A few kilobytes are written to the folder of each, or to the nearest one above it that is there. Raises
    `OutputError`.
    """
    for path in map(Path, paths):
        folder = path.absolute().parent
        while not os.path.lexists(folder) and folder != folder.parent:
            folder = folder.parent
        try:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a folder, a file is to be written there", str(path))
            with tempfile.TemporaryFile(prefix=".try-", dir=folder) as file:
                file.write(bytes(4096))
                file.flush()
                os.fsync(file.fileno())
        except OSError as problem:
            reason = problem.strerror or str(problem)
            remedy = "free space there, or choose" if problem.errno in FULL else "choose"
            message = f"{path}: cannot be written ({reason}); {remedy} another place with --output"
            raise OutputError(message) from problem
