"""The seat of a scene, computed or found."""

from __future__ import annotations

from impact.progress import Progress, silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.build import Cache, Solved, build
from seatfem.structures.cache import key_of
from seatfem.structures.method import Method
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene


def seat_of(
    scene: Scene,
    cache: Cache | None = None,
    *,
    method: Method | None = None,
    watch: Stopwatch | None = None,
    progress: Progress = silent,
    mesh_error: bool = True,
) -> Solved:
    """The seat for the scene's own duration, by a method, by default the one that its file states; else as `build`."""
    how = stated_method(scene).seat if method is None else method
    duration = scene.run.duration
    return build(scene.seat, how, duration, cache, watch=watch, progress=progress, mesh_error=mesh_error)


def seat_key(scene: Scene) -> str:
    """The hash under which the seat is kept that its file states."""
    return key_of(scene.seat, stated_method(scene).seat)
