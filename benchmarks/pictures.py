"""What the pictures of the PEEK sleeve cost: all in this process, and those of bodies in another at the same time.

    .venv/bin/python benchmarks/pictures.py

Wall seconds of both ways, one after the other, in the same minute; then those of the numbers, without pictures.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from scenes import SLEEVE

import impact
from impact.pictures.drawing import gap_of
from impact.progress import silent
from seatfem.study.impacts.contact import run_contacts, seat_of, striker_of
from seatfem.study.method import as_stated
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs import pictures
from seatfem.study.scene import load_scene


def main() -> None:
    start = time.perf_counter()
    plan = plan_scene(load_scene(SLEEVE))
    scene = as_stated(plan.scene, plan.method)
    seat = seat_of(scene)
    dt = scene.run.time_step or 1e-8
    result = run_contacts(scene, striker_of(scene), seat.greens, dt).seat
    spring = impact.spring(stiffness=1 / float(seat.greens.static_compliance()[0, 0]))
    baseline = run_contacts(scene, striker_of(scene), spring, dt).seat
    print(f"numbers: {time.perf_counter() - start:.1f} s")  # noqa: T201
    apart = pictures.drawing_apart
    for words, there in (("apart", True), ("here", False), ("apart", True), ("here", False)):
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            pictures.drawing_apart = apart if there else _here  # type: ignore[assignment]
            _, gaps = pictures.draw_run(scene, plan.method, seat, result, baseline, Path(folder), silent)
            assert gaps == (), gaps
            print(f"pictures, {words}: {time.perf_counter() - begun:.1f} s")  # noqa: T201


class _here:
    """In the place of `drawing_apart`: all in this process."""

    def __init__(self) -> None:
        self._drawn: dict[str, Callable[..., object]] = {}

    def __enter__(self) -> _here:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def take(self, drawn: list[pictures.Picture]) -> None:
        self._drawn |= dict(drawn)

    def __contains__(self, name: str) -> bool:
        return name in self._drawn

    def wait(self, name: str, folder: Path) -> str:
        return gap_of(lambda path: self._drawn[name](path=path), folder / name)


if __name__ == "__main__":
    main()
