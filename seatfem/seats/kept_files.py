"""Green's functions of seats on file, found by key; plans look for them without loading what computes one."""

from __future__ import annotations

from pathlib import Path

from impact.greens import GreensFunction
from seatfem.scene import GreensFile, Scene
from seatfem.seats.needs import serves
from seatfem.seats.store import Tell


def kept_at(path: Path, key: str, scene: Scene, tell: Tell | None = None) -> GreensFunction | None:
    """The function at ``path``, if it is the scene's, sealed and sound; what is sound and another's is no news."""
    if not path.is_file():
        return None
    from impact.storage import OtherKeyError, StorageError, load_greens  # h5py takes long to load, and is rarely needed

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
    from impact.storage import StorageError, load_greens

    try:
        return str(load_greens(path).provenance.get("seat_key", ""))
    except (StorageError, OSError):
        return ""
