"""Files that a user opens may be hostile: regular files only, of a size that is known before memory is taken."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO, Final

MB: Final = 1 << 20
CSV_LIMIT: Final = 128 * MB
"""Bytes of a table of numbers: some five million lines."""

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
