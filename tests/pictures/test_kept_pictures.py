"""Pictures of mesh and modes: kept beside the stored seat, there again in any folder that reuses it."""

import pytest

import impact
from seatfem.pictures.rendering import drawing_apart
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.method import Method, Solved
from seatfem.study.method import RunMethod
from seatfem.study.runs import pictures
from tests.gallery import BAR, load_text, mass

METHOD = RunMethod(Method("axisymmetric", 1e6), Method())
SEAT = impact.single_mode(frequency_hz=1e4, mass=0.01, damping_ratio=0.02)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))
    for name in ("plot_force", "plot_motion", "plot_energy"):
        monkeypatch.setattr(pictures, name, lambda *given, **options: write(given[-1]))
    monkeypatch.setattr(pictures, "plot_greens", lambda greens, path, **options: write(path))
    return load_text(tmp_path, "[seat]", BAR, "[reed]\n", mass(5, "-2 m/s"), '[run]\nduration = "1 ms"\n')


def write(path, text="curve"):
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)


def drawn(scene, folder, of_seat, monkeypatch, missing=False):
    monkeypatch.setattr(pictures, "_seat_pictures", lambda *_: of_seat)
    seat = Solved(SEAT, mesh=of_seat or None)  # without a mesh it was computed before
    with drawing_apart() as painter:
        files, gaps = pictures.draw_run(scene, METHOD, seat, None, None, folder, lambda stage, done: None, painter)
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
        files, gaps = pictures.draw_run(scene, METHOD, seat, None, None, out, lambda stage, done: None, painter)
    assert "mesh.png" in {file.name for file in files}
    assert gaps[0].startswith("skipped pictures: modes.png: MemoryError")
    assert gaps[1].startswith("pictures of the seat are not kept")
