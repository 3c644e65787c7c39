"""Plates whose modes were computed before: mesh and modes on file, by the hash of all they depend on."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from impact.files.input_files import MB
from seatfem.machine.code import cache_folder
from seatfem.structures.cache import warn
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.reduction.modes import Modes
from seatfem.structures.shapes import fingerprint
from seatfem.structures.store import Store, content_key

if TYPE_CHECKING:
    from seatfem.structures.sheets import Sheet

MOST: Final = 1024 * MB  # of all plates together: the longest unused go
CONTENT: Final = "modes of a plate"
Meshed = tuple[PlateMesh, Modes]


def kept(asked: Sheet, coarser: float, compute: Callable[[], Meshed]) -> Meshed:
    """Return the mesh and modes of a plate as they are on file, else as ``compute`` finds them, which are then kept.

    A folder that cannot be written to, and a file that is damaged, cost a `CacheWarning` and the time to compute.
    """
    from impact.storage.hdf5 import written  # with h5py, which takes long to load

    store = Store(cache_folder() / "plates", warn)
    parts = {**vars(asked), "shape": fingerprint(asked.shape), "material": vars(asked.material)}
    key = content_key({"modes of": parts, "coarser": coarser})
    if (found := store.find(key, lambda path: _read(path, key), "plate on file")) is not None:
        return found
    mesh, modes = compute()
    try:
        with written(store.path(key), CONTENT) as file:
            _write(file, key, mesh, modes)
        store.prune(most_bytes=MOST)
    except (OSError, MemoryError) as problem:
        warn(f"the plate's modes are not kept for later runs: {problem}")
    return mesh, modes


def _write(file: Any, key: str, mesh: PlateMesh, modes: Modes) -> None:
    file.attrs["key"] = key
    file.attrs["modes"] = json.dumps({name: getattr(modes, name) for name in ("complete", "backend", "solves")})
    for name in ("points", "cells"):
        file[name] = getattr(mesh, name)
    for name, nodes in mesh.lines.items():
        file[f"lines/{name}"] = nodes
    for name in ("frequencies_hz", "shapes", "residuals"):
        file[f"modes/{name}"] = getattr(modes, name)


def _read(path: Any, key: str) -> Meshed:
    from impact.storage.hdf5 import OtherKeyError, finite_array, opened  # as above

    with opened(path, CONTENT, sealed=True) as file:
        if (stated := str(file.attrs.get("key", ""))) != key:
            raise OtherKeyError(f"{path}: belongs to the key {stated!r}, not to {key!r}; compute it again")
        lines = {name: finite_array(file, f"lines/{name}").astype(int) for name in file.get("lines", ())}
        mesh = PlateMesh(finite_array(file, "points"), finite_array(file, "cells").astype(int), lines)
        frequencies, shapes, residuals = (
            finite_array(file, f"modes/{name}") for name in ("frequencies_hz", "shapes", "residuals")
        )
        return mesh, Modes(frequencies, shapes, residuals, **json.loads(str(file.attrs["modes"])))
