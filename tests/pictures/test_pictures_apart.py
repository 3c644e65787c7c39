"""Pictures in another process: what crashes, fails or cannot be handed over costs itself alone."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from seatfem.jobs import crew
from seatfem.pictures.rendering import Picture, drawing_apart

WORKER = """
import os, signal
from pathlib import Path

def fine(path, text="a picture"):
    Path(path).write_text(f"{text} by {os.getpid()}")

def failing(path):
    raise MemoryError("no room")

def crashing(path):
    print("words of a library that are no answer", flush=True)
    os.kill(os.getpid(), signal.SIGSEGV)
"""


@contextmanager
def drawn_apart(pictures: Sequence[Picture], folder: Path) -> Iterator[Callable[[str], str]]:
    """Take pictures, and give what waits for one by its name."""
    with drawing_apart() as painter:
        painter.take(pictures)
        yield lambda name: painter.wait(name, folder)


@pytest.fixture
def drawers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Give a module that both processes can import."""
    (tmp_path / "drawers.py").write_text(WORKER, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.syspath_prepend(str(tmp_path))
    import drawers  # type: ignore[import-not-found]

    return drawers


@pytest.mark.slow
def test_another_process_draws_while_this_one_goes_on(drawers, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    with drawn_apart([("a.png", partial(drawers.fine, text="one")), ("b.png", drawers.fine)], out) as drawn:
        assert (drawn("b.png"), drawn("a.png")) == ("", "")
    texts = [(out / name).read_text(encoding="utf-8") for name in ("a.png", "b.png")]
    assert texts[0].startswith("one by ")
    assert not any(text.endswith(f" {os.getpid()}") for text in texts)
    assert {path.name for path in out.iterdir()} == {"a.png", "b.png"}


@pytest.mark.slow
def test_a_crash_costs_the_picture_it_happened_at(drawers, tmp_path: Path) -> None:
    jobs = [("a.png", drawers.crashing), ("b.png", drawers.failing), ("c.png", drawers.fine)]
    with drawn_apart(jobs, tmp_path) as drawn:
        assert drawn("a.png").startswith("a.png: the process ")
        assert drawn("b.png") == "b.png: MemoryError: no room"
        assert drawn("c.png") == ""
    assert (tmp_path / "c.png").exists()


def test_a_worker_that_cannot_be_started_costs_its_pictures_and_no_wait(
    drawers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker for which the system has no thread is reported with the picture's name."""

    def refuse(*_: object, **__: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(crew, "start_worker", refuse)
    with drawing_apart() as painter:
        painter.take([("a.png", drawers.fine)])
        assert painter.wait("a.png", tmp_path) == "a.png: can't start new thread"
