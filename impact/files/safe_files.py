"""Files that are complete or absent when they are written, and limited in size and checked when they are read."""

import errno
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from impact.notices import SeatfemError

FULL = (errno.ENOSPC, errno.EFBIG, *(getattr(errno, name) for name in ("EDQUOT",) if hasattr(errno, name)))
"""Error numbers for an exhausted disk, quota or file size."""


class OutputError(SeatfemError, ValueError):
    """Error of a path that cannot be written to; the message names it, the reason and a remedy."""


class MissingFileError(SeatfemError, FileNotFoundError):
    """Error of a file that does not exist; the message names it."""


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path``, renamed to it if the block succeeds, and removed otherwise.

    The temporary name keeps the suffix, for writers that choose the format by it. The folder is made if missing. The
    content is flushed to the disk before it is renamed. An `OSError` names ``path``.
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
        temporary.chmod(0o666 & ~mask)  # mkstemp makes it private; these are the permissions of open()
        temporary.replace(final)
    except OSError as problem:
        is_temporary = problem.filename is None or Path(str(problem.filename)).name.startswith(prefix)
        if problem.errno is None or not is_temporary:
            raise
        raise OSError(problem.errno, problem.strerror, str(final)) from problem
    finally:
        if temporary is not final:
            with suppress(OSError):
                temporary.unlink()


def write_whole(path: str | os.PathLike[str], *parts: bytes) -> None:
    """Write a file from its parts, complete or not at all. Raises `OSError` that names ``path``."""
    with whole_file(path) as temporary, temporary.open("wb") as file:
        for part in parts:
            file.write(part)


def check_writable(*paths: str | os.PathLike[str]) -> None:
    """Test, before expensive work, whether files could be written at ``paths``; no file remains.

    A few kilobytes are written to the folder of each path, or to the nearest existing one above. Raises `OutputError`.
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
"""Largest size of a table of numbers [bytes]: some five million lines."""

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def opened_file(path: Path, most: int, error: type[Exception]) -> BinaryIO:
    """Return the file, opened for reading bytes.

    Raises:
        MissingFileError: there is no such file.
        error: the path is not a regular file, cannot be read, or is larger than ``most`` bytes; the message names the
            file, its size, the limit and a remedy.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise MissingFileError(f"{path}: no such file; check the path") from None
    except (OSError, ValueError) as problem:
        raise error(f"{path}: cannot be read: {getattr(problem, 'strerror', None) or problem}") from None
    try:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            kind = next((name for test, name in _KINDS if test(status.st_mode)), "something else")
            raise error(f"{path}: is {kind}; a regular file is needed")
        if status.st_size > most:
            raise error(
                f"{path}: has {status.st_size / MB:.7g} MB; such a file is read up to {most / MB:g} MB. "
                "Is it the right file? If so, make it coarser, or leave out what is not needed"
            )
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def check_file(path: Path, most: int, error: type[Exception]) -> None:
    """Raise the errors of `opened_file`."""
    opened_file(path, most, error).close()


def read_bytes(path: Path, most: int, error: type[Exception]) -> bytes:
    """Return all bytes of a file; raises as `opened_file`, also if it grows beyond ``most`` during reading."""
    with opened_file(path, most, error) as file:
        data = file.read(os.fstat(file.fileno()).st_size)
        while block := file.read(MB):
            data += block
            if len(data) > most:
                raise error(f"{path}: goes on after {most / MB:g} MB, the most that is read of such a file")
    return data


def read_text(path: Path, most: int, error: type[Exception], encoding: str = "utf-8", errors: str = "strict") -> str:
    r"""Return the text of a file, line ends as ``\n``; raises as `read_bytes`, and `UnicodeDecodeError`."""
    text = read_bytes(path, most, error).decode(encoding, errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")
