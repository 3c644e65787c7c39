"""Green's function of a structure by a method: computed, or loaded from the run's file or from the cache folder.

The cache folder is addressed by the hash of all on which the Green's function depends.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

import impact
from impact import notices
from impact.files.safe_files import FULL, write_whole
from impact.greens.base import GreensFunction
from impact.notices import SeatfemError, ignore
from impact.storage import hdf5
from seatfem.jobs.folders import claimed
from seatfem.machine.code import VARIABLE, cache_folder, numerics_version, sources_from_elsewhere
from seatfem.machine.resources import Stopwatch
from seatfem.structures import rings
from seatfem.structures.formats import mesh_files
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.method import AUTO, Method, Solved, Task
from seatfem.structures.reduction import reducer

_KEY = re.compile(r"[0-9a-f]{16,64}")
Tell = Callable[[str], None]
T = TypeVar("T")


class StoreError(SeatfemError, ValueError):
    """Error of a store that cannot be used; the message names folder and remedy."""


@dataclass(frozen=True)
class Entry:
    """Stored Green's function.

    Attributes:
        key: content hash.
        path: file of the function.
        size: total size of this file and of the files beside it [bytes].
        used: time of the last reading or writing [s since 1970].
    """

    key: str
    path: Path
    size: int
    used: float


def content_key(parts: Mapping[str, object]) -> str:
    """Return the hash (64 hex digits) of all on which a Green's function depends, including the code that computes it.

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

    A file is written under a temporary name and then renamed, so that a reader finds the old or the new one, never a
    part; two writers of the same key write the same function, of which the last remains.

    Attributes:
        folder: folder of the files, made at the first writing.
        tell: function that receives a message when a damaged file is ignored.
    """

    folder: Path
    tell: Tell = ignore

    @staticmethod
    def default(tell: Tell = ignore) -> Store:
        """Return the folder of the environment variable SEATFEM_STORE, or the user's cache (XDG_CACHE_HOME)."""
        return Store(cache_folder(), tell)

    def path(self, key: str) -> Path:
        """Return the file of a key; raises `StoreError` for a key that is no content hash."""
        if not _KEY.fullmatch(key):
            raise StoreError(f"{key!r} must be a content hash (16 to 64 digits 0-9, a-f)")
        return self.folder / f"{key}.h5"

    def get(self, key: str) -> GreensFunction | None:
        """Return the function; ``None`` if it is missing, damaged, without a seal, or of another key.

        Except for a missing one, this is reported, and the next `put` replaces the file.
        """
        return self.find(key, lambda path: impact.load_greens(path, key=key), "stored Green's function")  # with h5py

    def find(self, key: str, load: Callable[[Path], T], what: str) -> T | None:
        """Return ``load`` of the file of a key, or ``None`` as in `get`; ``what``: name of the content in reports."""
        content = _load(self.path(key), load, what, self.tell)
        if content is not None:
            with suppress(OSError):
                os.utime(self.path(key))  # mark as read, so that it is pruned last
        return content

    def put(self, key: str, greens: GreensFunction) -> Path:
        """Store ``greens``; return the file's path. Raises `StoreError` if the folder cannot be written to."""
        path = self.path(key)
        try:
            impact.save_greens(greens, path, key=key)
        except OSError as problem:
            raise self._unwritable(problem) from problem
        return path

    def keep(self, key: str, file: Path) -> None:
        """Store a copy of ``file``, such as a picture, beside the function; it is pruned with the function."""
        try:
            write_whole(self.path(key).with_name(f"{key}.{file.name}"), file.read_bytes())
        except OSError as problem:
            raise self._unwritable(problem) from problem

    def _unwritable(self, problem: OSError) -> StoreError:
        remedy = f"{'free space there, or ' if problem.errno in FULL else ''}set {VARIABLE} to a folder of your own"
        return StoreError(f"{self.folder}: cannot be written to ({problem}); {remedy}")

    def fetch(self, key: str, folder: Path) -> tuple[Path, ...]:
        """Return copies in ``folder``, with their original names, of the files beside the function."""
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
        """Delete the least recently used functions beyond a total size [bytes]; return the deleted entries."""
        gone, total = [], 0
        for entry in self.entries():
            total += entry.size
            if total > most_bytes:
                for file in (entry.path, *self._beside(entry.key)):
                    file.unlink(missing_ok=True)
                gone.append(entry)
                total -= entry.size
        return tuple(gone)


def _load(path: Path, load: Callable[[Path], T | None], what: str, tell: Tell) -> T | None:
    """Return ``load`` of a file; ``None`` if it is missing or, which is reported, cannot be used."""
    try:
        return load(path) if path.is_file() else None
    except (impact.StorageError, OSError) as problem:  # of a folder, too, that cannot be read
        if os.path.lexists(path):
            tell(f"{what} set aside, it will be computed again: {problem}")
        return None


def _plain(value: object) -> object:
    """Return JSON values that differ if the contents differ."""
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


PATIENCE: Final = 3600.0  # longest wait for another program that computes the same function [s]


class CacheWarning(UserWarning):
    """Warning of a cache file that could not be used or written; it costs time, but changes no result."""


def warn(text: str) -> None:
    """Warn by a `CacheWarning`."""
    warnings.warn(text, CacheWarning, stacklevel=4)


def load_or_compute(
    folder: str,
    key: str,
    compute: Callable[[], T],
    *,
    content: str,
    read: Callable[[Any], T],
    write: Callable[[Any, T], None],
    most_bytes: int,
) -> T:
    """Return what is on file under a key in a ``folder`` of the store, else what ``compute`` returns, which is then
    stored and read back: the order of an array in memory changes the last digits of its products, and numbers of later
    runs are found by those of this one.

    A folder that cannot be written to, and a file that is damaged, cost a `CacheWarning` and the time to compute.

    Args:
        content: name of the content, in the file and in warnings.
        read, write: functions that read the content from an open HDF5 file, and write it.
        most_bytes: most bytes of all files in the folder; the least recently used are deleted.
    """

    def load(path: Path) -> T:
        with hdf5.opened(path, content, sealed=True) as file:
            if (stated := str(file.attrs.get("key", ""))) != key:
                raise hdf5.OtherKeyError(f"{path}: belongs to the key {stated!r}, not to {key!r}; compute it again")
            return read(file)

    store = Store(cache_folder() / folder, warn)
    if (found := store.find(key, load, f"{content} on file")) is not None:
        return found
    computed = compute()
    try:
        with hdf5.written(store.path(key), content) as file:
            file.attrs["key"] = key
            write(file, computed)
        store.prune(most_bytes=most_bytes)
    except (OSError, MemoryError) as problem:
        warn(f"{content}: not kept for later runs ({problem})")
        return computed
    stored = store.find(key, load, f"{content} on file")
    return computed if stored is None else stored


def key_of(structure: Structure, method: Method, *, mesh_error: bool = True) -> str:
    """Return a hash of all on which a Green's function depends, including the code and whether its mesh error is known.

    Files count by content, not by name, with all that they include. Open settings of the method do not count.
    For a kind, a shape or a reduction of another package, the file that defines it counts.
    """
    return next(keys_of(structure, (method,), mesh_error=mesh_error))


def keys_of(structure: Structure, methods: Iterable[Method], *, mesh_error: bool = True) -> Iterator[str]:
    """Yield `key_of` a structure for each of several methods; the structure and its files are read once."""
    inputs, code = structure.inputs(), dict[str, list[str]]()
    parts: dict[str, object] = {**inputs.content} | ({} if mesh_error else {"mesh_error": False})
    for key in type(structure).model_fields:
        if isinstance(file := getattr(structure, key), Path):
            parts[key] = sorted(content_hash(part) for part in mesh_files.all_files(file))
    for method in methods:
        how = {key: value for key, value in vars(method).items() if value is not None}
        if how.get("rings") == 1:
            del how["rings"]
        how |= {name: lip.content for name in ("lip", "behind") if (lip := getattr(method, name)) is not None}
        if method.reduction not in code:
            classes = (*inputs.classes, *_reductions(structure, method))
            code[method.reduction] = sources_from_elsewhere(*classes)
        own = {"code": code[method.reduction]} if code[method.reduction] else {}
        yield content_key(parts | {"method": how} | own)


def _reductions(structure: Structure, method: Method) -> list[type]:
    """Return the reductions that a method names or may choose; empty if only those of this program are known."""
    if not structure.traits.is_reduced or "seatfem.structures.reduction.reducer" not in sys.modules:
        return []
    return [each for each in reducer.defined() if method.reduction in (AUTO, each.name)]


def _serving(greens: GreensFunction | None, key: str, duration: float) -> GreensFunction | None:
    """Return ``greens`` if it is not ``None``, has this key and is known for a run of ``duration`` [s]."""
    if greens is None or greens.provenance.get("seat_key") != key:
        return None
    return greens if greens.valid_for >= duration * (1 - 1e-9) else None


@dataclass(frozen=True)
class Cache:
    """Cache of computed structures in the file of a run and in the store.

    A folder that cannot be written to causes a warning, and so does a function without a seal, damaged, or of another
    key, which is computed again.

    Attributes:
        path: file of the run, in which the function is stored, whatever its origin; ``None``: only the store is used.
            The function on the coarser mesh is stored beside it.
        store: functions by hash; default: the user's. Those of finite elements are stored there, after the function on
            the coarser mesh and of the patch in rings, so that error bars remain known.
    """

    path: Path | None
    store: Store = field(default_factory=lambda: Store.default(warn))

    def find(self, structure: Structure, key: str, duration: float) -> Solved | None:
        """Return the cached function that is valid for a run of ``duration`` [s]."""

        def load(path: Path) -> GreensFunction | None:
            with suppress(hdf5.OtherKeyError):  # that of another seat
                return _serving(hdf5.load_greens(path, key=key), key, duration)
            return None

        tell = ignore if self._is_own(structure) else warn
        stored = None if self.path is None else _load(self.path, load, "the run's Green's function", tell)
        solved = stored if stored is not None else _serving(self.store.get(key), key, duration)
        if solved is None:
            return None
        beside = self._model_beside(key)
        if solved is not stored:
            self.write(solved, key, beside)
        where = "the store" if self.path is None else self.path.name
        about: dict[str, object] = {"seat_model": f"kept in {where}"}
        if isinstance(size := solved.provenance.get("dof"), int):
            about["seat_dof"] = size
        return replace(_with_errors(solved, beside, about), plane=structure.traits.plane)

    @contextmanager
    def claimed(self, structure: Structure, key: str) -> Iterator[bool]:
        """Keep other programs, within the block, from computing the same function for the store.

        Yields whether another program has stored it since it was searched.
        """
        if not structure.traits.needs_gmsh:
            yield False
            return
        path = self.store.path(key)
        before = _age(path)
        with claimed(path.parent / "claims" / path.stem, PATIENCE):
            yield _age(path) != before

    def keep(self, structure: Structure, key: str, solved: Solved) -> Solved:
        """Return ``solved`` after storing its function with its key."""
        greens = solved.greens
        if not greens.closed_form:  # closed forms are computed again at no cost
            greens = greens.with_error(greens.error_estimate, {**greens.provenance, "seat_key": key})
        if structure.traits.needs_gmsh and not greens.closed_form:
            try:
                if solved.in_rings is not None:  # first, since without it the function would lose its error bars
                    self.store.put(_beside(key), solved.in_rings)
                self.store.put(key, greens)
            except StoreError as problem:
                warn(f"the seat is not kept for later runs: {problem}")
        if not self._is_own(structure):
            self.write(greens, key, solved.in_rings)
        return replace(solved, greens=greens)

    def write(self, greens: GreensFunction, key: str, beside: GreensFunction | None) -> None:
        """Write the file of the run, and beside it the model ``beside``, which gives its errors of mesh and patch."""
        if self.path is not None:
            hdf5.save_greens(greens, self.path, key=key)
            if beside is not None:
                hdf5.save_greens(beside, coarser_file(self.path), key=_beside(key))
            else:
                coarser_file(self.path).unlink(missing_ok=True)  # that of an earlier seat

    def _model_beside(self, key: str) -> GreensFunction | None:
        """Return the model in rings, on a coarser mesh, from the store or else from the folder of the run."""
        stored = self.store.get(_beside(key))
        with suppress(hdf5.StorageError, OSError):
            if stored is None and self.path is not None and coarser_file(self.path).is_file():
                return hdf5.load_greens(coarser_file(self.path), key=_beside(key))
        return stored

    def _is_own(self, structure: Structure) -> bool:
        """Return whether the file of the run is an input file of the structure."""
        return self.path is not None and self.path.resolve() in structure.files()


def _age(path: Path) -> int:
    """Return the time when a file was written [ns]; 0 if there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def coarser_file(path: Path) -> Path:
    """Return the file of the function on the coarser mesh, beside that of the run's function."""
    return path.with_name(f"{path.stem}_coarser.h5")


def _beside(key: str) -> str:
    """Return the key of the model that gives the errors of mesh and patch."""
    return hashlib.sha256(f"beside {key}".encode()).hexdigest()


def _with_errors(found: GreensFunction, beside: GreensFunction | None, about: Mapping[str, object]) -> Solved:
    """Return the function with the errors by the model in rings, on a coarser mesh if it states a refinement."""
    stated = None if beside is None else beside.provenance.get("refinement")
    if beside is None or not (isinstance(stated, int | float) and 1.0 < stated < math.inf):
        return Solved(found, in_rings=beside, about=about, reused=True)
    coarser = rings.divided_less(beside, rings.Division.from_greens(found))
    return Solved(found, coarser, about=about, refinement=float(stated), in_rings=beside, reused=True)


def build(
    structure: Structure,
    method: Method,
    duration: float,
    cache: Cache | None = None,
    *,
    watch: Stopwatch | None = None,
    progress: notices.Progress = notices.silent,
    mesh_error: bool = True,
) -> Solved:
    """Return a structure's Green's function. If several programs need the same one, only one computes it.

    Args:
        duration: duration of the runs for which it must be known [s].
        cache: cache in which it may be, and is stored; ``None``: it is computed.
        mesh_error: whether a drawn body is also solved on a coarser mesh.

    Raises:
        LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError: errors of the stages.
    """
    task = Task(method, duration, watch or Stopwatch(), progress, mesh_error)
    if cache is None:
        return structure.solve(task)
    key = key_of(structure, method, mesh_error=mesh_error)
    if (cached := cache.find(structure, key, duration)) is not None:
        return cached
    with cache.claimed(structure, key) as made_meanwhile:
        if made_meanwhile and (cached := cache.find(structure, key, duration)) is not None:
            return cached
        return cache.keep(structure, key, structure.solve(task))
