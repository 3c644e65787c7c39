"""Green's functions of seats on file, found by key; plans look for them without loading what computes one."""

from __future__ import annotations

from pathlib import Path

from impact.greens.base import GreensFunction
from seatfem.structures.seats.needs import serves
from seatfem.structures.seats.store import Tell
from seatfem.study.scene import GreensFile, Scene


def kept_at(path: Path, key: str, scene: Scene, tell: Tell | None = None) -> GreensFunction | None:
    """The function at ``path``, if it is the scene's, sealed and sound; what is sound and another's is no news."""
    if not path.is_file():
        return None
    from impact.storage.hdf5 import (  # h5py takes long to load, and is rarely needed
        OtherKeyError,
        StorageError,
        load_greens,
    )

    try:
        found = load_greens(path, key=key)
        return found if serves(found, key, scene) else None
    except OtherKeyError:
        return None
    except (StorageError, OSError) as problem:
        if tell is not None and not isinstance(scene.seat, GreensFile):
            tell(f"not used again: {problem}")
        return None


def key_at(path: Path) -> str:
    """Which seat the function at ``path`` says it is; "" where none can be read."""
    from impact.storage.hdf5 import StorageError, load_greens

    try:
        return str(load_greens(path).provenance.get("seat_key", ""))
    except (StorageError, OSError):
        return ""
