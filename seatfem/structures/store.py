"""A folder of Green's functions found by the hash of what they were computed from."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

import impact
from impact.files.safe_files import FULL, write_whole
from impact.greens.base import GreensFunction
from seatfem.machine.code import VARIABLE, cache_folder, numerics_version

_KEY = re.compile(r"[0-9a-f]{16,64}")
Tell = Callable[[str], None]
T = TypeVar("T")


class StoreError(ValueError):
    """A store that cannot be used; the message names folder and remedy."""


@dataclass(frozen=True)
class Entry:
    """A stored Green's function.

    Attributes:
        key: the content hash.
        path: its file.
        size: of the file and of what lies beside it [bytes].
        used: when it was last read or written [s since 1970].
    """

    key: str
    path: Path
    size: int
    used: float


def content_key(parts: Mapping[str, object]) -> str:
    """Return the hash (64 hex digits) of everything a Green's function depends on, the code that computes it included.

    ``parts``: JSON values, bytes, paths (their content counts, not their name) and arrays (dtype, shape and values), in
    mappings and sequences of any depth; the order of keys does not count. Raises `TypeError` for anything else.
    """
    text = json.dumps({"code": numerics_version(), "parts": _plain(parts)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def content_hash(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class Store:
    """Green's functions by content hash, one file each; safe for several programs at once.

    A file is written whole under a temporary name and renamed, so a reader meets an old or a new one, never half of
    one; two writers of the same key write the same function, and the last one stays.

    Attributes:
        folder: made when first written to.
        tell: receives a line when a damaged entry is set aside.
    """

    folder: Path
    tell: Tell | None = None

    @staticmethod
    def default(tell: Tell | None = None) -> Store:
        """Return the folder of the environment variable SEATFEM_STORE, or the user's cache (XDG_CACHE_HOME)."""
        return Store(cache_folder(), tell)

    def path(self, key: str) -> Path:
        """Return the file of a key; raises `StoreError` for what is no content hash."""
        if not _KEY.fullmatch(key):
            raise StoreError(f"{key!r} must be a content hash (16 to 64 digits 0-9, a-f)")
        return self.folder / f"{key}.h5"

    def get(self, key: str) -> GreensFunction | None:
        """Return the function; ``None`` if it is not there or is damaged, without a seal, of another key.

        The latter is reported; the next `put` replaces it.
        """
        return self.find(key, lambda path: impact.load_greens(path, key=key), "stored Green's function")  # with h5py

    def find(self, key: str, load: Callable[[Path], T], what: str) -> T | None:
        """Return what ``load`` makes of the file of a key, as `get` does; ``what`` it is called in reports."""
        path = self.path(key)
        try:
            exists = path.is_file()
        except OSError:  # a folder that may not be looked into
            exists = False
        if not exists:
            return None
        try:
            found = load(path)
        except (impact.StorageError, OSError) as problem:
            if self.tell is not None and os.path.lexists(path):
                self.tell(f"{what} set aside, it will be computed again: {problem}")
            return None
        with suppress(OSError):
            os.utime(path)  # read now: the last to be pruned
        return found

    def put(self, key: str, greens: GreensFunction) -> Path:
        """Keep ``greens``; return the file's path. Raises `StoreError` if the folder cannot be written to."""
        path = self.path(key)
        try:
            impact.save_greens(greens, path, key=key)
        except OSError as problem:
            raise self._unwritable(problem) from problem
        return path

    def keep(self, key: str, file: Path) -> None:
        """Keep a copy of ``file``, such as a picture, beside the function; it goes when the function is pruned."""
        try:
            write_whole(self.path(key).with_name(f"{key}.{file.name}"), file.read_bytes())
        except OSError as problem:
            raise self._unwritable(problem) from problem

    def _unwritable(self, problem: OSError) -> StoreError:
        remedy = f"{'free space there, or ' if problem.errno in FULL else ''}set {VARIABLE} to a folder of your own"
        return StoreError(f"{self.folder}: cannot be written to ({problem}); {remedy}")

    def fetch(self, key: str, folder: Path) -> tuple[Path, ...]:
        """Return copies in ``folder``, under their own names, of the files beside the function."""
        copies = []
        for file in self._beside(key):
            target = folder / file.name.partition(".")[2]
            with suppress(FileNotFoundError):  # pruned by another program
                write_whole(target, file.read_bytes())
                copies.append(target)
        return tuple(copies)

    def _beside(self, key: str) -> list[Path]:
        own = self.path(key)
        return sorted(file for file in self.folder.glob(f"{key}.*") if file != own)

    def entries(self) -> tuple[Entry, ...]:
        """Return the functions in the store, the last used first."""
        entries = []
        for path in self.folder.glob("*.h5") if self.folder.is_dir() else ():
            if _KEY.fullmatch(path.stem):
                with suppress(FileNotFoundError):  # pruned by another program
                    status = path.stat()
                    size = status.st_size + sum(file.stat().st_size for file in self._beside(path.stem))
                    entries.append(Entry(path.stem, path, size, status.st_mtime))
        return tuple(sorted(entries, key=lambda entry: -entry.used))

    def prune(self, *, most_bytes: int) -> tuple[Entry, ...]:
        """Delete the longest unused beyond a total size; return the deleted entries."""
        gone, total = [], 0
        for entry in self.entries():
            total += entry.size
            if total > most_bytes:
                for file in (entry.path, *self._beside(entry.key)):
                    file.unlink(missing_ok=True)
                gone.append(entry)
                total -= entry.size
        return tuple(gone)


def _plain(value: object) -> object:
    """Return JSON values that differ where the content does."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bytes):
        return {"bytes": hashlib.sha256(value).hexdigest()}
    if isinstance(value, Path):
        return {"file": content_hash(value)}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return {"array": [value.dtype.str, list(value.shape), digest]}
    raise TypeError(f"a key cannot be made of a {type(value).__name__}: give JSON values, bytes, paths or arrays")
