"""Pictures drawn by a process of their own while this one goes on: VTK may crash, hang or be slow without harm."""

from __future__ import annotations

import json
import pickle
import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from impact.files.atomic import whole_file
from impact.pictures.drawing import gap_of
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import LineWorker

PATIENCE: Final = 900.0  # s of the clock for one picture, on a machine that is busy otherwise too
WORKER: Final = "seatfem.pictures.picture_worker"

Picture = tuple[str, Callable[..., object]]
"""A file's name, and what draws it, called with ``path``."""


@contextmanager
def drawn_apart(pictures: Sequence[Picture], folder: Path) -> Iterator[Callable[[str], str]]:
    """Draw ``pictures`` into ``folder`` from now on, in another process; leaving the block ends that.

    Gives a function of a picture's name that waits for it, and tells why it could not be drawn, or "". A process that
    crashes or hangs costs the picture it was at. What cannot be handed to another process is drawn here, when it is
    asked for.
    """
    with private_folder("pictures") as private:
        here = dict(pictures[number] for number in range(len(pictures)) if not _handed_over(pictures, number, private))
        there = [(number, name) for number, (name, _) in enumerate(pictures) if name not in here]
        painter = _Painter(private, there)
        painter.start()

        def wait(name: str) -> str:
            if name in here:
                return gap_of(lambda path: here[name](path=path), folder / name)
            gap = painter.gap(name)
            return gap or gap_of(lambda path: _moved(private / name, path), folder / name)

        try:
            yield wait
        finally:
            painter.end()


def _handed_over(pictures: Sequence[Picture], number: int, private: Path) -> bool:
    """Whether another process can draw it: written down for it."""
    try:
        (private / f"{number}.pickle").write_bytes(pickle.dumps(pictures[number][1], protocol=pickle.HIGHEST_PROTOCOL))
    except (pickle.PicklingError, AttributeError, TypeError, OSError, MemoryError):
        return False
    return True


def _moved(drawn: Path, path: Path) -> None:
    with whole_file(path) as temporary:
        shutil.copyfile(drawn, temporary)


class _Painter(threading.Thread):
    """Asks a worker for one picture after the other; another worker after one that has ended."""

    def __init__(self, private: Path, jobs: Sequence[tuple[int, str]]) -> None:
        super().__init__(name="pictures", daemon=True)
        self._private, self._jobs = private, jobs
        self._gaps: dict[str, str] = {}
        self._done = {name: threading.Event() for _, name in jobs}
        self._ending = threading.Event()
        self._worker: LineWorker | None = None

    def run(self) -> None:
        for number, name in self._jobs:
            if self._ending.is_set():
                return
            self._gaps[name] = self._drawn(number, name)
            self._done[name].set()

    def gap(self, name: str) -> str:
        """Wait for a picture; why it is not there, or ""."""
        self._done[name].wait()
        return self._gaps[name]

    def end(self) -> None:
        """At once, a worker that is only being started too."""
        self._ending.set()
        while self.is_alive():
            self._end_worker()
            self.join(0.05)
        self._end_worker()

    def _end_worker(self) -> None:
        with suppress(OSError):
            if self._worker is not None:
                self._worker.end()

    def _drawn(self, number: int, name: str) -> str:
        try:
            if self._worker is None:
                self._worker = LineWorker(WORKER, str(self._private), log=self._private / "log.txt")
            answer = self._worker.ask(f"{number} {name}", PATIENCE)
            if answer:
                return str(json.loads(answer))
            problem = "the process that draws it crashed; seatfem doctor tells what may be missing"
        except (TimeoutError, OSError, ValueError) as error:
            problem = str(error)
        self._end_worker()
        self._worker = None
        return f"{name}: {problem}"
