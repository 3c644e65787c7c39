"""Files that are whole or absent when they are written, and bounded and checked when they are read."""

import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

FULL = (errno.ENOSPC, errno.EFBIG, *(getattr(errno, name) for name in ("EDQUOT",) if hasattr(errno, name)))
"""Errors of the system where a disk, a quota or the largest size of a file is exhausted."""


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


MB: Final = 1 << 20
CSV_LIMIT: Final = 128 * MB
"""Most bytes of a table of numbers: some five million lines."""

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def opened_file(path: Path, most: int, error: type[Exception]) -> BinaryIO:
    """Return the open file, to be read in bytes, at its beginning.

    Raises:
        FileNotFoundError: there is none.
        error: what is there is no regular file, may not be read, or is larger than ``most`` bytes; the message names
            the file, its size, the limit and a remedy.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: no such file; check the path") from None
    except (OSError, ValueError) as problem:
        raise error(f"{path}: cannot be read: {getattr(problem, 'strerror', None) or problem}") from None
    try:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode):
            kind = next((name for test, name in _KINDS if test(found.st_mode)), "something else")
            raise error(f"{path}: is {kind}; a regular file is needed")
        if found.st_size > most:
            raise error(
                f"{path}: has {found.st_size / MB:.7g} MB; such a file is read up to {most / MB:g} MB. "
                "Is it the right file? If so, make it coarser, or leave out what is not needed"
            )
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def check_file(path: Path, most: int, error: type[Exception]) -> None:
    """Raise what `opened_file` raises."""
    opened_file(path, most, error).close()


def read_bytes(path: Path, most: int, error: type[Exception]) -> bytes:
    """Return all bytes of a file; raises as `opened_file`, also where it grows beyond ``most`` while it is read."""
    with opened_file(path, most, error) as file:
        data = file.read(os.fstat(file.fileno()).st_size)
        while more := file.read(MB):
            data += more
            if len(data) > most:
                raise error(f"{path}: goes on after {most / MB:g} MB, the most that is read of such a file")
    return data


def read_text(path: Path, most: int, error: type[Exception], encoding: str = "utf-8", errors: str = "strict") -> str:
    """Return the text of a file, line ends as ``\\n``; raises as `read_bytes`, and `UnicodeDecodeError`."""
    text = read_bytes(path, most, error).decode(encoding, errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")
