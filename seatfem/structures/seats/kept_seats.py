"""Seats computed before: in the folder of the run, or in the store, by the hash of all they depend on."""

from __future__ import annotations

import hashlib
import math
import warnings
from dataclasses import replace
from pathlib import Path

from impact.greens.base import GreensFunction
from impact.progress import Progress
from impact.storage.hdf5 import save_greens
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.rings import rings_of, with_fewer_rings
from seatfem.structures.seats.kept_files import kept_at
from seatfem.structures.seats.needs import serves
from seatfem.structures.seats.seat import SeatAnswer, build_seat
from seatfem.structures.seats.store import Store, StoreError
from seatfem.study.scene import ElasticSeat, GreensFile, Scene


class KeptSeatWarning(UserWarning):
    """Something kept that could not be used, or not be kept; it costs time, no result."""


def seat_of(
    scene: Scene, path: Path, watch: Stopwatch, progress: Progress, store: Store | None = None
) -> tuple[SeatAnswer, bool]:
    """The scene's seat and whether it was there already: at ``path``, or in the store; else it is computed.

    Whatever its origin, it is at ``path`` afterwards. Seats of finite elements also go into the store, behind the
    function of the coarser mesh and of the patch in rings, so that error bars stay known. A store that cannot be
    written to costs a warning, and so does a kept function that carries no seal, is damaged, or is of another key: it
    is computed again.
    """
    key, kept_in = scene.seat_key(), Store.default(_warn) if store is None else store
    here = kept_at(path, key, scene, _warn)
    found = kept_in.get(key) if here is None else here
    if found is not None and serves(found, key, scene):
        if found is not here:
            save_greens(found, path, key=key)
        return _with_errors(found, kept_in.get(_beside(key)), {"seat_model": f"kept in {path.name}"}), True
    answer = build_seat(scene, watch, progress)
    greens = answer.greens
    if not greens.closed_form:  # one costs nothing to make again
        greens = greens.with_error(greens.error_estimate, {**greens.provenance, "seat_key": key})
    if isinstance(scene.seat, ElasticSeat) and not greens.closed_form:
        try:
            if answer.in_rings is not None:  # first: a function without it would lose its error bars
                kept_in.put(_beside(key), answer.in_rings)
            kept_in.put(key, greens)
        except StoreError as problem:
            _warn(f"the seat is not kept for later runs: {problem}")
    if not (isinstance(scene.seat, GreensFile) and path.resolve() == scene.seat.file):
        save_greens(greens, path, key=key)
    return replace(answer, greens=greens), False


def _beside(key: str) -> str:
    """The key of the model that tells the errors of mesh and patch."""
    return hashlib.sha256(f"beside {key}".encode()).hexdigest()


def _with_errors(found: GreensFunction, beside: GreensFunction | None, about: dict[str, object]) -> SeatAnswer:
    """With the model in rings; one that states a ratio of the two meshes' sizes is of a coarser mesh."""
    stated = None if beside is None else beside.provenance.get("refinement")
    if beside is None or not (isinstance(stated, int | float) and 1.0 < stated < math.inf):
        return SeatAnswer(found, in_rings=beside, about=about)
    coarser = with_fewer_rings(beside, rings_of(found))
    return SeatAnswer(found, coarser, about=about, refinement=float(stated), in_rings=beside)


def _warn(text: str) -> None:
    warnings.warn(text, KeptSeatWarning, stacklevel=3)
