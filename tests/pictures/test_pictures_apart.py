"""Pictures in another process: what fails there costs itself alone; those of a stored seat are there again."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

import impact
from seatfem.jobs import crew
from seatfem.pictures import rendering
from seatfem.pictures.rendering import Picture, drawing_apart
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.method import Method, Solved
from seatfem.study.method import RunMethod
from seatfem.study.plan import Plan
from seatfem.study.runs import pictures
from tests.gallery import BAR, load_text, mass

WORKER = """
import os, signal, time
from pathlib import Path

def fine(path, text="a picture"):
    Path(path).write_text(f"{text} by {os.getpid()}")

def failing(path):
    raise MemoryError("no room")

def crashing(path):
    print("words of a library that are no answer", flush=True)
    os.kill(os.getpid(), signal.SIGSEGV)

def hanging(path):
    time.sleep(60)
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


@pytest.mark.slow
def test_what_hangs_is_ended(drawers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendering, "TIMEOUT", 0.5)
    with drawn_apart([("a.png", drawers.hanging)], tmp_path) as drawn:
        assert drawn("a.png") == "a.png: no answer within 0.5 s"


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


METHOD = RunMethod(Method("axisymmetric", 1e6), Method())
SEAT = impact.single_mode(frequency_hz=1e4, mass=0.01, damping_ratio=0.02)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))
    for name in ("plot_force", "plot_motion", "plot_energy"):
        monkeypatch.setattr(pictures, name, lambda *given, **options: write(given[-1]))
    monkeypatch.setattr(pictures, "plot_greens", lambda greens, path, **options: write(path))
    return load_text(tmp_path, "[seat]", BAR, "[reed]\n", mass(5, "-2 m/s"), '[run]\nduration = "1 ms"\n')


def round_on(scene, seat):
    """Return what pictures need of a round."""
    return SimpleNamespace(plan=Plan(scene, METHOD, ()), seat=seat, result=None)


def write(path, text="curve"):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)


def drawn(scene, folder, of_seat, monkeypatch, missing=False):
    monkeypatch.setattr(pictures, "_seat_pictures", lambda *_: of_seat)
    seat = Solved(SEAT, mesh=of_seat or None)  # without a mesh it was computed before
    with drawing_apart() as painter:
        files, gaps = pictures.draw_run(round_on(scene, seat), None, folder, lambda stage, done: None, painter)
    assert [gap.startswith("no pictures of the seat's mesh") for gap in gaps] == [True] * missing
    assert all(file.parent == folder and file.is_file() for file in files)
    return {file.name for file in files}


def test_a_second_run_in_another_folder_shows_the_same_pictures(scene, tmp_path, monkeypatch):
    curves = {"force.png", "motion.png", "energy.png", "greens.png"}
    of_seat = [("mesh.png", lambda path: write(path, "mesh")), ("mode_1.gif", lambda path: write(path, "mode"))]
    assert drawn(scene, tmp_path / "one", of_seat, monkeypatch) == curves | {"mesh.png", "mode_1.gif"}
    assert drawn(scene, tmp_path / "two", [], monkeypatch) == curves | {"mesh.png", "mode_1.gif"}
    assert (tmp_path / "two" / "mesh.png").read_text() == "mesh"
    assert (tmp_path / "two" / "mode_1.gif").read_text() == "mode"
    another = scene.model_copy(update={"seat": scene.seat.model_copy(update={"length": 13e-3})})

    def fail(*given):
        raise MeshingError("gmsh is missing")

    monkeypatch.setattr(type(scene.seat), "meshed", fail)
    assert drawn(another, tmp_path / "three", [], monkeypatch, missing=True) == curves


def test_a_store_that_cannot_be_written_to_and_a_shape_that_cannot_be_made_are_told(scene, tmp_path, monkeypatch):
    (tmp_path / "store").write_text("a file where the folder should be")

    def broken(path):
        raise MemoryError

    of_seat = [("mesh.png", lambda path: write(path)), ("modes.png", broken)]
    monkeypatch.setattr(pictures, "_seat_pictures", lambda *_: of_seat)
    seat = Solved(SEAT, mesh=of_seat)
    with drawing_apart() as painter:
        out = tmp_path / "out"
        files, gaps = pictures.draw_run(round_on(scene, seat), None, out, lambda stage, done: None, painter)
    assert "mesh.png" in {file.name for file in files}
    assert gaps[0].startswith("skipped pictures: modes.png: MemoryError")
    assert gaps[1].startswith("pictures of the seat are not kept")
