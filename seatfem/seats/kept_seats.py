"""Seats computed before: in the folder of the run, or in the store, by the hash of all they depend on."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

from impact.greens import GreensFunction
from impact.progress import Progress
from impact.storage import StorageError, load_greens, save_greens
from seatfem.runs.stopwatch import Stopwatch
from seatfem.scene import ElasticSeat, GreensFile, Scene
from seatfem.seats.needs import COARSENING, serves
from seatfem.seats.seat import SeatAnswer, build_seat
from seatfem.seats.store import Store


def seat_of(
    scene: Scene, path: Path, watch: Stopwatch, progress: Progress, store: Store | None = None
) -> tuple[SeatAnswer, bool]:
    """The scene's seat and whether it was there already: at ``path``, or in the store; else it is computed.

    Whatever its origin, it is at ``path`` afterwards. Seats of finite elements also go into the store, with the
    coarser mesh's function beside them, so that error bars stay known.
    """
    key, kept_in = scene.seat_key(), Store.default() if store is None else store
    here = _read(path)
    found = here if serves(here, key, scene) else kept_in.get(key)
    if found is not None and serves(found, key, scene):
        if found is not here:
            save_greens(found, path)
        coarser = kept_in.get(_coarser(key))
        ratio = COARSENING if coarser is None else float(str(coarser.provenance.get("refinement", COARSENING)))
        return SeatAnswer(found, coarser, about={"seat_model": f"kept in {path.name}"}, refinement=ratio), True
    answer = build_seat(scene, watch, progress)
    greens = answer.greens
    if not greens.closed_form:  # one costs nothing to make again
        greens = greens.with_error(greens.error_estimate, {**greens.provenance, "seat_key": key})
    if not (isinstance(scene.seat, GreensFile) and path.resolve() == scene.seat.file):
        save_greens(greens, path)
    if isinstance(scene.seat, ElasticSeat) and not greens.closed_form:
        kept_in.put(key, greens)
        if answer.coarser is not None:
            kept_in.put(_coarser(key), answer.coarser)
    return replace(answer, greens=greens), False


def _coarser(key: str) -> str:
    return hashlib.sha256(f"coarser {key}".encode()).hexdigest()


def _read(path: Path) -> GreensFunction | None:
    try:
        return load_greens(path)
    except StorageError:
        return None
