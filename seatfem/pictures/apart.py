"""Pictures drawn by a process of their own while this one goes on: VTK may crash, hang or be slow without harm."""

from __future__ import annotations

import json
import pickle
import queue
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from impact.files.atomic import whole_file
from impact.pictures.drawing import gap_of
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import LineWorker
from seatfem.pictures.rendering import NO_DRIVER, TRIED, can_draw

PATIENCE: Final = 900.0  # s of the clock for one picture, on a machine that is busy otherwise too
WORKER: Final = "seatfem.pictures.picture_worker"
READY: Final = "libraries"
"""In place of a picture: what drawing needs is loaded."""

Picture = tuple[str, Callable[..., object]]
"""A file's name, and what draws it, called with ``path``."""


@contextmanager
def drawing_apart() -> Iterator[Painter]:
    """Start another process that draws what it is handed; leaving the block ends it.

    A process that crashes or hangs costs the picture it was at. What cannot be handed to another process is drawn here,
    when it is asked for.
    """
    with private_folder("pictures") as private:
        painter = Painter(private)
        try:
            yield painter
        finally:
            painter.end()


class Painter:
    """Client of a worker that draws one picture after the other; another worker follows one that has ended."""

    def __init__(self, private: Path) -> None:
        self._private = private
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._wanted: dict[str, _Job] = {}  # the latest of each name
        self._here: dict[str, Callable[..., object]] = {}
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._worker: LineWorker | None = None
        self._taken, self._cannot = 0, ""

    def begin(self) -> None:
        """Start the process and load its libraries, before there is anything to draw."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="pictures", daemon=True)
            self._thread.start()

    def take(self, pictures: Sequence[Picture]) -> None:
        """Have them drawn from now on; one of a name that is there already takes its place."""
        for name, draw in pictures:
            self._taken += 1
            job = _Job(name, self._private / f"{self._taken}.pickle")
            self._here.pop(name, None)
            self._wanted.pop(name, None)
            if not _handed_over(draw, job.drawing):
                self._here[name] = draw
                continue
            self._wanted[name] = job
            self._jobs.put(job)
            self.begin()

    def __contains__(self, name: str) -> bool:
        """Return whether a picture of this name was taken."""
        return name in self._wanted or name in self._here

    def wait(self, name: str, folder: Path) -> str:
        """Put a picture into ``folder`` once it is drawn; why it could not be, or ""."""
        if name in self._here:
            return gap_of(lambda path: self._here[name](path=path), folder / name)
        job = self._wanted[name]
        job.done.wait()
        return job.gap or gap_of(lambda path: _moved(self._private / name, path), folder / name)

    def end(self) -> None:
        """End the worker at once, one that is only being started too."""
        self._ending.set()
        self._jobs.put(None)
        while self._thread is not None and self._thread.is_alive():
            self._end_worker()
            self._thread.join(0.05)
        self._end_worker()

    def _work(self) -> None:
        self._asked(READY, "")
        while (job := self._jobs.get()) is not None and not self._ending.is_set():
            if self._wanted.get(job.name) is job:
                job.gap = self._asked(job.name, job.drawing.name)
            job.done.set()

    def _end_worker(self) -> None:
        with suppress(OSError):
            if self._worker is not None:
                self._worker.end()

    def _asked(self, name: str, drawing: str) -> str:
        if self._cannot or self._ending.is_set():
            return self._cannot
        try:
            if self._worker is None:
                own = {TRIED: "1"}
                self._worker = LineWorker(WORKER, str(self._private), log=self._private / "log.txt", environment=own)
            answer = self._worker.ask(f"{drawing} {name}", PATIENCE)
            if answer:
                return str(json.loads(answer))
            problem = "the process that draws it crashed; seatfem doctor shows what may be missing"
            if not self._ending.is_set() and not can_draw():
                self._cannot = NO_DRIVER
        except (OSError, ValueError, RuntimeError, MemoryError) as error:  # any other would leave `wait` waiting
            problem = str(error) or type(error).__name__
        self._end_worker()
        self._worker = None
        return self._cannot or f"{name}: {problem}"


@dataclass(eq=False)
class _Job:
    """A picture, where what draws it is written down, and why there is none."""

    name: str
    drawing: Path
    gap: str = ""
    done: threading.Event = field(default_factory=threading.Event)


def _handed_over(draw: Callable[..., object], drawing: Path) -> bool:
    """Write a drawing down for another process, and return whether that can draw it."""
    try:
        drawing.write_bytes(pickle.dumps(draw, protocol=pickle.HIGHEST_PROTOCOL))
    except (pickle.PicklingError, AttributeError, TypeError, OSError, MemoryError):
        return False
    return True


def _moved(drawn: Path, path: Path) -> None:
    with whole_file(path) as temporary:
        shutil.copyfile(drawn, temporary)
