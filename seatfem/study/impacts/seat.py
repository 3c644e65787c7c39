"""The seat of a scene, computed or found."""

from __future__ import annotations

from impact.progress import Progress, silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.build import Cache, Solved, build
from seatfem.study.scene import Scene, method_of


def seat_of(
    scene: Scene,
    cache: Cache | None = None,
    *,
    watch: Stopwatch | None = None,
    progress: Progress = silent,
    mesh_error: bool = True,
) -> Solved:
    """The seat by the method that the scene states, for its own duration; the rest as `build`."""
    duration = scene.run.duration
    return build(scene.seat, method_of(scene), duration, cache, watch=watch, progress=progress, mesh_error=mesh_error)
