"""The way from a structure and a method to its Green's function: computed, or found where it was computed before."""

from __future__ import annotations

from impact.progress import Progress, silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.cache import Cache
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.method import Method
from seatfem.structures.solved import Solved

__all__ = ["Cache", "Solved", "build"]


def build(
    structure: Structure,
    method: Method,
    duration: float,
    cache: Cache | None = None,
    *,
    watch: Stopwatch | None = None,
    progress: Progress = silent,
    mesh_error: bool = True,
) -> Solved:
    """Return a structure's Green's function. Of several programs that ask for the same one, one computes it.

    Args:
        structure: of any kind.
        method: how it is computed.
        duration: of the runs that it must cover [s].
        cache: where it may be, and is kept; ``None``: it is computed.
        watch: for the time of each stage.
        progress: informed of each stage.
        mesh_error: whether a drawn body is solved on a coarser mesh, too.

    Raises:
        What the stages raise: LevelError, MeshError, MeshingError, ModelError, GreensFunctionError, StorageError.
    """
    if cache is None:
        return structure.solve(method, duration, watch or Stopwatch(), progress, mesh_error=mesh_error)
    if (cached := cache.find(structure, method, duration, mesh_error=mesh_error)) is not None:
        return cached
    with cache.claimed(structure, method, mesh_error=mesh_error) as made_meanwhile:
        cached = cache.find(structure, method, duration, mesh_error=mesh_error) if made_meanwhile else None
        if cached is not None:
            return cached
        solved = structure.solve(method, duration, watch or Stopwatch(), progress, mesh_error=mesh_error)
        return cache.keep(structure, method, solved, mesh_error=mesh_error)
