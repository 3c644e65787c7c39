"""Pictures drawn by a process of their own while this one goes on: VTK may crash, hang or be slow without harm."""

from __future__ import annotations

import json
import pickle
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from impact.files.atomic import whole_file
from impact.pictures.drawing import gap_of
from seatfem.jobs.desk import Desk, Lost, Program
from seatfem.jobs.folders import private_folder
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
        self._private, self._taken, self._cannot, self._is_ending = private, 0, "", False
        self._desk = Desk(Program(WORKER, (str(private),), environment={TRIED: "1"}), private / "desk")
        self._thread = ThreadPoolExecutor(1, "pictures")
        self._drawn: dict[str, Future[str] | Callable[..., object]] = {}  # the latest of each name
        self._begun: Future[str] | None = None

    def begin(self) -> None:
        """Start the process and load its libraries, before there is anything to draw."""
        self._begun = self._begun or self._thread.submit(self._ask, READY, "")

    def take(self, pictures: Sequence[Picture]) -> None:
        """Have them drawn from now on; one of a name that is there already takes its place."""
        for name, draw in pictures:
            if isinstance(former := self._drawn.pop(name, None), Future):
                former.cancel()
            self._taken += 1
            drawing = self._private / f"{self._taken}.pickle"
            if _handed_over(draw, drawing):
                self.begin()
                self._drawn[name] = self._thread.submit(self._ask, name, drawing.name)
            else:
                self._drawn[name] = draw

    def __contains__(self, name: str) -> bool:
        """Return whether a picture of this name was taken."""
        return name in self._drawn

    def wait(self, name: str, folder: Path) -> str:
        """Put a picture into ``folder`` once it is drawn; why it could not be, or ""."""
        drawn = self._drawn[name]
        if not isinstance(drawn, Future):
            return gap_of(lambda path: drawn(path=path), folder / name)
        return drawn.result() or gap_of(lambda path: _moved(self._private / name, path), folder / name)

    def end(self) -> None:
        """End the worker at once, one that is only being started too."""
        self._is_ending = True
        self._thread.shutdown(wait=False, cancel_futures=True)
        asked = [each for each in (self._begun, *self._drawn.values()) if isinstance(each, Future)]
        while not all(each.done() for each in asked):
            self._desk.end()
            time.sleep(0.05)
        self._desk.end()

    def _ask(self, name: str, drawing: str) -> str:
        """Return why a picture was not drawn, or ""."""
        if self._cannot or self._is_ending:
            return self._cannot
        try:
            self._desk.start()
            answer = self._desk.answer(f"{drawing} {name}", PATIENCE)
            if not isinstance(answer, Lost):
                return str(json.loads(answer))
            problem = "the process that draws it crashed; seatfem doctor shows what may be missing"
            if answer.hung:
                problem = f"no answer within {PATIENCE:g} s"
            elif not self._is_ending and not can_draw():
                self._cannot = NO_DRIVER
        except (OSError, ValueError, RuntimeError, MemoryError) as error:
            problem = str(error) or type(error).__name__
        self._desk.end()
        return self._cannot or f"{name}: {problem}"


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
