"""The way from a structure and a method to its Green's function: computed, or found where it was computed before.

It lies in a file of the run, or in the cache folder, by the hash of all that it depends on.
"""

import hashlib
import math
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final

from impact import notices, storage
from impact.greens.base import GreensFunction
from seatfem.jobs.folders import claimed
from seatfem.machine.code import sources_from_elsewhere
from seatfem.machine.resources import Stopwatch
from seatfem.structures import formats, reduction, rings
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.method import AUTO, Method, Solved
from seatfem.structures.store import Store, StoreError, Tell, content_hash, content_key

PATIENCE: Final = 3600.0  # longest wait [s] for another program that computes the same function


class CacheWarning(UserWarning):
    """A file of the cache that could not be used or written; it costs time, but changes no result."""


def warn(text: str) -> None:
    """Warn by a `CacheWarning`."""
    warnings.warn(text, CacheWarning, stacklevel=4)


def key_of(structure: Structure, method: Method, *, mesh_error: bool = True) -> str:
    """Return a hash of all that a Green's function depends on: the code, too, and whether its mesh error is known.

    Files count by content, not by name, with all that they include; what the method leaves open counts not at all, nor
    does its backend, which changes g by less than the tolerance, as another sparse factorization does. Of a kind, a
    shape or a reduction from elsewhere the file counts in which it is written.
    """
    return next(keys_of(structure, (method,), mesh_error=mesh_error))


def keys_of(structure: Structure, methods: Iterable[Method], *, mesh_error: bool = True) -> Iterator[str]:
    """Yield `key_of` a structure by each of some methods; the structure and its files are looked at once."""
    inputs, code = structure.inputs(), dict[str, list[str]]()
    parts: dict[str, object] = {**inputs.content} | ({} if mesh_error else {"mesh_error": False})
    for key in type(structure).model_fields:
        if isinstance(file := getattr(structure, key), Path):
            parts[key] = sorted(content_hash(part) for part in formats.meshio_files.all_files(file))
    for method in methods:
        how = {key: value for key, value in vars(method).items() if value is not None and key != "backend"}
        if how.get("rings") == 1:
            del how["rings"]
        how |= {name: lip.content for name in ("lip", "behind") if (lip := getattr(method, name)) is not None}
        if method.reduction not in code:
            classes = (*inputs.classes, *_reductions(structure, method))
            code[method.reduction] = sources_from_elsewhere(*classes)
        own = {"code": code[method.reduction]} if code[method.reduction] else {}
        yield content_key(parts | {"method": how} | own)


def _reductions(structure: Structure, method: Method) -> list[type]:
    """Return the reductions that are asked for or may be chosen; none where all that are known are ours."""
    if not structure.traits.is_reduced or "seatfem.structures.reduction.reducer" not in sys.modules:
        return []
    return [each for each in reduction.reducer.defined() if method.reduction in (AUTO, each.name)]


def load_cached(path: Path, key: str, duration: float, tell: Tell | None = None) -> GreensFunction | None:
    """Return the function at ``path``, if it has this key, is sealed and sound, and is known for ``duration`` [s].

    What is sound and another's is no news.
    """
    if not path.is_file():
        return None
    try:
        return _serving(storage.hdf5.load_greens(path, key=key), key, duration)
    except storage.hdf5.OtherKeyError:
        return None
    except (storage.hdf5.StorageError, OSError) as problem:
        if tell is not None:
            tell(f"not used again: {problem}")
        return None


def key_at(path: Path) -> str:
    """Return the structure's key that the function at ``path`` states; "" where none can be read."""
    try:
        return str(storage.hdf5.load_greens(path).provenance.get("seat_key", ""))
    except (storage.hdf5.StorageError, OSError):
        return ""


def _serving(greens: GreensFunction | None, key: str, duration: float) -> GreensFunction | None:
    """Return ``greens``, if it is there, has this key and is known for a run of ``duration`` [s]."""
    if greens is None or greens.provenance.get("seat_key") != key:
        return None
    return greens if greens.valid_for >= duration * (1 - 1e-9) else None


@dataclass(frozen=True)
class Cache:
    """The place where computed structures are looked for and written to.

    A folder that cannot be written to costs a warning, and so does a function that carries no seal, is damaged, or is
    of another key: it is computed again.

    Attributes:
        path: file of the run, which holds the function afterwards, whatever its origin; ``None``: the folder alone. The
            function of the coarser mesh lies next to it.
        store: of functions by hash; default: the user's. Those of finite elements go there, behind the function of the
            coarser mesh and of the patch in rings, so that error bars stay known.
    """

    path: Path | None
    store: Store = field(default_factory=lambda: Store.default(warn))

    def find(self, structure: Structure, key: str, duration: float) -> Solved | None:
        """Return the cached function that is valid for a run of ``duration`` [s]."""
        own = self._is_own(structure)
        stored = None if self.path is None else load_cached(self.path, key, duration, None if own else warn)
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
        return _with_errors(solved, beside, about)

    @contextmanager
    def claimed(self, structure: Structure, key: str) -> Iterator[bool]:
        """Keep other programs, within the block, from computing the same function for the store.

        Gives whether one has put it there before the block began, since it was looked for.
        """
        if not structure.traits.is_kept:
            yield False
            return
        path = self.store.path(key)
        before = _age(path)
        with claimed(path.parent / "claims" / path.stem, PATIENCE):
            yield _age(path) != before

    def keep(self, structure: Structure, key: str, solved: Solved) -> Solved:
        """Return ``solved``, its function marked with its key and on file."""
        greens = solved.greens
        if not greens.closed_form:  # one costs nothing to make again
            greens = greens.with_error(greens.error_estimate, {**greens.provenance, "seat_key": key})
        if structure.traits.is_kept and not greens.closed_form:
            try:
                if solved.in_rings is not None:  # first: a function without it would lose its error bars
                    self.store.put(_beside(key), solved.in_rings)
                self.store.put(key, greens)
            except StoreError as problem:
                warn(f"the seat is not kept for later runs: {problem}")
        if not self._is_own(structure):
            self.write(greens, key, solved.in_rings)
        return replace(solved, greens=greens)

    def write(self, greens: GreensFunction, key: str, beside: GreensFunction | None) -> None:
        """Write the file of the run, and next to it the model ``beside``, which gives its errors of mesh and patch."""
        if self.path is not None:
            storage.hdf5.save_greens(greens, self.path, key=key)
            if beside is not None:
                storage.hdf5.save_greens(beside, coarser_file(self.path), key=_beside(key))
            else:
                coarser_file(self.path).unlink(missing_ok=True)  # of an earlier seat

    def _model_beside(self, key: str) -> GreensFunction | None:
        """Return the model in rings, on a coarser mesh, from the store or else from the folder of the run."""
        stored = self.store.get(_beside(key))
        with suppress(storage.hdf5.StorageError, OSError):
            if stored is None and self.path is not None and coarser_file(self.path).is_file():
                return storage.hdf5.load_greens(coarser_file(self.path), key=_beside(key))
        return stored

    def _is_own(self, structure: Structure) -> bool:
        """Return whether the file of the run is one that the structure itself is read from."""
        return self.path is not None and self.path.resolve() in structure.files()


def _age(path: Path) -> int:
    """Return when a file was written [ns]; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def coarser_file(path: Path) -> Path:
    """Return the file next to that of a run's function, of the coarser mesh."""
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
    """Return a structure's Green's function. Of several programs that ask for the same one, one computes it.

    Args:
        duration: of the runs that it must cover [s].
        cache: where it may be, and is kept; ``None``: it is computed.
        mesh_error: whether a drawn body is solved on a coarser mesh, too.

    Raises:
        What the stages raise: LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    solve = partial(structure.solve, method, duration, watch or Stopwatch(), progress, mesh_error=mesh_error)
    if cache is None:
        return solve()
    key = key_of(structure, method, mesh_error=mesh_error)
    if (cached := cache.find(structure, key, duration)) is not None:
        return cached
    with cache.claimed(structure, key) as made_meanwhile:
        if made_meanwhile and (cached := cache.find(structure, key, duration)) is not None:
            return cached
        return cache.keep(structure, key, solve())
