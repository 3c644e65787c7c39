"""Pictures of mesh and modes: kept beside the stored seat, there again in any folder that reuses it."""

from pathlib import Path

import pytest

import impact
from seatfem.structures.cache import Store, content_key
from seatfem.structures.kinds import Spring
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.method import Method, Solved, bed
from seatfem.structures.rings import Division
from seatfem.study.impacts.touches import Touches
from seatfem.study.method import RunMethod
from seatfem.study.runs import pictures
from tests.gallery import BAR, load_text, mass

KEY = content_key({"seat": "a"})
OTHER = content_key({"seat": "b"})
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
    files, gaps = pictures.draw_run(scene, METHOD, seat, None, None, folder, lambda stage, done: None)
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


def test_the_greens_function_of_a_divided_patch_is_drawn_as_a_whole(scene, tmp_path, monkeypatch):
    """A divided patch is drawn as one port: 64 of them took half a minute."""
    shown = []
    monkeypatch.setattr(pictures, "plot_greens", lambda greens, path, **options: shown.append(greens))
    monkeypatch.setattr(pictures, "_seat_pictures", lambda *_: [])
    bare = bed(Division(64), 5e6)
    pictures.draw_run(scene, METHOD, Solved(bare, mesh=[]), None, None, tmp_path, lambda stage, done: None)
    assert [greens.ports for greens in shown] == [("contact",)]
    assert shown[0].static_compliance()[0, 0] == pytest.approx(2e-7, rel=1e-12)


def test_what_is_kept_belongs_to_its_key_and_goes_with_it(tmp_path):
    store = Store(tmp_path / "store")
    function = store.put(KEY, SEAT)
    store.put(OTHER, SEAT)
    picture = tmp_path / "mesh.png"
    picture.write_bytes(b"0123456789")
    store.keep(KEY, picture)
    assert [path.name for path in store.fetch(KEY, tmp_path / "out")] == ["mesh.png"]
    assert store.fetch(OTHER, tmp_path / "other") == ()
    sizes = {entry.key: entry.size for entry in store.entries()}
    assert sizes[KEY] == function.stat().st_size + 10
    assert len(store.entries()) == 2
    store.prune(most_bytes=0)
    assert list(Path(store.folder).iterdir()) == []


def test_seats_that_are_not_meshed_leave_the_store_alone(scene, tmp_path, monkeypatch):
    spring = scene.model_copy(update={"seat": Spring(kind="spring", stiffness="1 N/um")})
    drawn(spring, tmp_path / "out", [], monkeypatch)
    assert not (tmp_path / "store").exists()


def test_a_store_that_cannot_be_written_to_and_a_shape_that_cannot_be_made_are_told(scene, tmp_path, monkeypatch):
    (tmp_path / "store").write_text("a file where the folder should be")

    def broken(path):
        raise MemoryError

    of_seat = [("mesh.png", lambda path: write(path)), ("modes.png", broken)]
    monkeypatch.setattr(pictures, "_seat_pictures", lambda *_: of_seat)
    seat = Solved(SEAT, mesh=of_seat)
    files, gaps = pictures.draw_run(scene, METHOD, seat, None, None, tmp_path / "out", lambda stage, done: None)
    assert "mesh.png" in {file.name for file in files}
    assert gaps[0].startswith("skipped pictures: modes.png: MemoryError")
    assert gaps[1].startswith("pictures of the seat are not kept")


def test_the_force_on_a_struck_stopper_is_drawn(tmp_path: Path) -> None:
    thrown, spring = impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.spring(stiffness=1e6)
    struck, missed = (
        impact.solve(impact.ContactProblem(thrown, spring, gap=gap), dt=1e-6, duration=2e-4) for gap in (0.0, 1.0)
    )
    seat = impact.solve(impact.ContactProblem(thrown, spring), dt=1e-6, duration=2e-4)
    assert pictures.stopper_pictures(Touches(seat), 1e-5, "") == []
    assert pictures.stopper_pictures(Touches(seat, stopper=missed), 1e-5, "") == []
    ((name, draw),) = pictures.stopper_pictures(Touches(seat, stopper=struck), 1e-5, "A valve")
    figure = draw(path=tmp_path / name)
    assert (tmp_path / "stopper_force.png").read_bytes().startswith(b"\x89PNG")
    assert figure.get_suptitle() == "Force on the stopper: A valve"
    (axes, *_) = figure.axes
    assert max(line.get_ydata().max() for line in axes.lines) == pytest.approx(struck.force.max(), rel=0.01)
