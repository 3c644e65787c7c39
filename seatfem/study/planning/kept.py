"""Seats computed before that are at least as fine as the plan asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from seatfem.structures import cache
from seatfem.structures.store import Store
from seatfem.study.scene import Scene

RUNGS: Final = 10  # seats that much finer than needed are not looked for: each is a key to form


@dataclass(frozen=True)
class Fineness:
    """What a seat is computed for: band [Hz], tolerance of the reduction, error of g by the mesh."""

    band: float
    tolerance: float
    mesh: float


def finer(
    wanted: Fineness, bands: Sequence[float], tolerances: Sequence[float], meshes: Sequence[float]
) -> Iterator[Fineness]:
    """``wanted`` and what is at least as fine in all three, the nearest `RUNGS` of each, the nearest first."""
    wider = sorted({wanted.band, *(band for band in bands if band > wanted.band)})[:RUNGS]
    denser = sorted({wanted.mesh, *(mesh for mesh in meshes if mesh < wanted.mesh)}, reverse=True)[:RUNGS]
    stricter = sorted({wanted.tolerance, *(t for t in tolerances if t < wanted.tolerance)}, reverse=True)[:RUNGS]
    return (Fineness(band, tolerance, mesh) for band in wider for mesh in denser for tolerance in stricter)


def kept_seat(
    candidates: Iterator[tuple[Fineness, Scene]], folder: Path | None, store: Store
) -> tuple[Fineness, Scene, str] | None:
    """The first of the filled scenes whose seat is there and lasts as long as it asks for, and where it is."""
    here = cache.key_at(folder) if folder is not None and folder.is_file() else ""
    if not here and not _holds_any(store.folder):
        return None  # with nothing kept, no key need be formed
    for fineness, scene in candidates:
        key = scene.seat_key()
        if folder is not None and here == key and cache.at(folder, key, scene.run.duration) is not None:
            return fineness, scene, f"in {folder.name}"
        if cache.at(store.path(key), key, scene.run.duration) is not None:
            return fineness, scene, "in the store"
    return None


def _holds_any(folder: Path) -> bool:
    try:
        return any(folder.glob("*.h5"))
    except OSError:  # it may not be looked into
        return False
