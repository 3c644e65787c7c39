"""Runs in the formats of other programs, read back."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
import skfem
from scipy import io, linalg

import impact
from impact.greens.base import Array
from seatfem.pictures.frames import mode_frames
from seatfem.pictures.moving import load_moving, save_moving
from seatfem.pictures.skins import skin_of
from seatfem.structures.formats.matrices import read_matrices
from seatfem.structures.formats.uff import UffError, read_modes_uff, write_receptance_uff
from seatfem.structures.formats.uff_responses import read_frf_uff
from tests.gallery import Told
from tests.solids import Material, assemble, greens_function, solve_modes
from tests.steps import BAD_INPUT, DONE, FAILED, Residual, load_greens, load_results, run_command

SCENE = (
    '[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\nmaterial = "steel"\ndamping_ratio = 0.05\n'
    'mesh = { size = "3 mm", contact_size = "1 mm" }\ngreens = { bandwidth = "50 kHz", tolerance = "5 %" }\n[reed]\n'
    'kind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "0.3 ms"\ntime_step = "0.2 us"\n'
    'filter_width = "10 us"\n[accuracy]\ntarget = "20 %"\n'
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("export")
    (where / "scene.toml").write_text(SCENE, encoding="utf-8")
    words = ["run", str(where / "scene.toml"), "-o", str(where / "r"), "--quiet", "--no-pictures"]
    assert run_command(words) in (DONE, FAILED)  # whether the target is met is not the point
    return where / "r"


@pytest.mark.slow
def test_spreadsheets(folder: Path, tmp_path: Path) -> None:
    assert run_command(["export", str(folder), "--to", "csv", "-o", str(tmp_path), "--quiet"]) == DONE
    run = load_results(folder / "result.h5")["wave"]
    with (tmp_path / "force.csv").open(encoding="utf-8", newline="") as file:
        heads, *rows = list(csv.reader(file))
    assert heads[:3] == ["time [s]", "force [N]", "force, mean over 10 us [N]"]
    values = np.array(rows, dtype=float)
    np.testing.assert_array_equal(values[:, 0], run.time)
    np.testing.assert_array_equal(values[:, 1], run.force)
    assert values[:, 2].max() == pytest.approx(impact.measures.filtered_peak_force(run, 10e-6), rel=1e-12)  # roundoff
    with (tmp_path / "summary.csv").open(encoding="utf-8", newline="") as file:
        by_key = {row["key"]: row for row in csv.DictReader(file)}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert float(by_key["impulse_Ns"]["value"]) == summary["impulse_Ns"]
    assert float(by_key["impulse_Ns"]["error bar"]) == summary["error_bar_impulse_Ns"]
    assert float(by_key["impulse_Ns"]["spring baseline"]) == summary["spring_impulse_Ns"]


@pytest.mark.slow
def test_a_receptance_comes_back(folder: Path, tmp_path: Path) -> None:
    assert run_command(["export", str(folder), "--to", "uff", "-o", str(tmp_path), "--quiet"]) == DONE
    read = read_frf_uff(tmp_path / "receptance.uff", ports={"contact": (1, "+z")})
    exact = load_greens(folder / "seat.h5").transfer(2j * np.pi * read.frequency)
    np.testing.assert_allclose(read.receptance, exact, rtol=1e-6)
    assert read.frequency[-1] == pytest.approx(1.25 / 10e-6)


def test_uneven_frequencies(tmp_path: Path) -> None:
    with pytest.raises(UffError, match="even, rising steps"):
        write_receptance_uff(impact.spring(stiffness=1e6), [1.0, 2.0, 4.0], tmp_path / "x.uff")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_reduced_models(folder: Path, tmp_path: Path) -> None:
    """The state space is g itself; the matrices, read back, give g without the residual."""
    assert run_command(["export", str(folder), "--to", "reduced", "-o", str(tmp_path), "--quiet"]) == DONE
    greens = load_greens(folder / "seat.h5")
    modal = greens.modal
    t = np.array([0.0, 1e-6, 7e-6, 4e-5])
    exact = greens.impulse_response(t)
    for held in (np.load(tmp_path / "reduced.npz"), io.loadmat(tmp_path / "reduced.mat")):
        assert not {"A", "B", "C", "D", "M", "Cq", "K", "phi", "states", "ports"} - set(held)
        samples = [(held["C"] @ linalg.expm(held["A"] * moment) @ held["B"])[0, 0] for moment in t]
        np.testing.assert_allclose(samples, exact, atol=1e-9 * np.abs(exact).max())
        np.testing.assert_array_equal(held["D"], modal.residual.compliance)
    assert "q_0 [m sqrt(kg)]" in (tmp_path / "README.txt").read_text(encoding="utf-8")
    model = read_matrices(
        *(tmp_path / f"{name}.mtx" for name in ("mass", "stiffness", "damping")),
        ports={"contact": tmp_path / "contact.csv"},
        first_dof=1,
    )
    band = 5 * modal.frequencies_hz.max()  # poles above it would be left out
    back = greens_function(model, bandwidth=band, duration=1e-4, tolerance=1e-6)
    bare = replace(modal, residual=Residual.none())
    np.testing.assert_allclose(
        back.filtered(np.linspace(0, 1e-4, 50), 1e-5),
        bare.filtered(np.linspace(0, 1e-4, 50), 1e-5),
        atol=1e-9 * np.abs(exact).max(),
    )


@pytest.mark.slow
def test_a_scene_is_computed_for_its_reduced_model(folder: Path, tmp_path: Path) -> None:
    scene = folder.parent / "scene.toml"
    assert run_command(["export", str(scene), "--to", "reduced", "-o", str(tmp_path), "--quiet"]) == DONE
    greens, held = load_greens(tmp_path / "seat.h5"), np.load(tmp_path / "reduced.npz")
    static = held["D"] - held["C"] @ np.linalg.solve(held["A"], held["B"])
    np.testing.assert_allclose(static, greens.static_compliance(), rtol=1e-9)
    rod = impact.fixed_rod(young=2e11, density=7850.0, length=0.1, area=1e-4)
    impact.save_greens(rod, tmp_path / "rod.h5")
    assert run_command(["export", str(tmp_path / "rod.h5"), "--to", "reduced", "-o", str(tmp_path / "r")]) == BAD_INPUT


@pytest.mark.slow
def test_the_folder_of_a_run_makes_decks(folder: Path, tmp_path: Path) -> None:
    assert run_command(["export", str(folder), "--to", "calculix", "-o", str(tmp_path), "--quiet"]) == DONE
    readme = (tmp_path / "README.txt").read_text(encoding="utf-8")
    assert "CAX6" in readme
    assert "contact.inp    is not written: reed.kind = 'rigid_mass': a plate lands" in readme


@pytest.fixture(scope="module")
def modes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Array, Array]:
    """Give a folder of modes, their frequencies, and the mass-normalised shapes of the skin's last node."""
    sides = (8e-3, 6e-3, 4e-3)
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, side, 3) for side in sides))
    mesh = mesh.with_boundaries({"contact": lambda x: x[2] > 4e-3 - 1e-9, "fixed": lambda x: x[2] < 1e-9})
    model = assemble(mesh, Material(200e9, 0.3, 7850.0), order=2)
    solved, skin, where = solve_modes(model, 3), skin_of(model), tmp_path_factory.mktemp("modes")
    shapes = [skin.moved(model.expand(shape)[:, skin.nodes].T) for shape in solved.shapes.T]
    frames = mode_frames(skin, shapes, ["1", "2", "3"], "", solved.frequencies_hz)
    save_moving(frames, where / "modes.h5")
    return where, solved.frequencies_hz, np.array(shapes)[:, -1]


def test_modes_come_back(modes: tuple[Path, Array, Array], tmp_path: Path) -> None:
    """Shapes come back to the 1/32767 of the largest displacement with which they are kept, frequencies to 5 digits."""
    folder, frequencies, shapes = modes
    assert run_command(["export", str(folder), "--to", "uff", "-o", str(tmp_path), "--quiet"]) == DONE
    last = len(load_moving(folder / "modes.h5").points)
    read = read_modes_uff(tmp_path / "modes.uff", ports={"x": (last, "+x"), "z": (last, "-z")})
    np.testing.assert_allclose(read.frequencies_hz, frequencies, rtol=1e-5)
    np.testing.assert_allclose(read.shapes, shapes[:, [0, 2]] * [1, -1], atol=1e-4 * np.abs(shapes).max())


@pytest.mark.slow
def test_modes_for_paraview(modes: tuple[Path, Array, Array], tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    folder, frequencies, _ = modes
    assert run_command(["export", str(folder), "--to", "vtk", "-o", str(tmp_path), "--quiet"]) == DONE
    bodies, series = load_moving(folder / "modes.h5"), pyvista.get_reader(tmp_path / "modes_motion.pvd")
    np.testing.assert_allclose(series.time_values, frequencies, rtol=1e-8)
    series.set_active_time_value(series.time_values[1])
    body = series.read()[0]
    np.testing.assert_allclose(body.points, bodies.points, atol=1e-9)
    np.testing.assert_allclose(body.point_data["displacement [m]"], bodies.displacement[1], atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--to", "vtp"], "csv, uff, vtk, calculix, reduced, dxf"), (["--to", "csv"], "no summ"),
        (["--to", "reduced"], "holds no seat.h5"), (["--to", "calculix"], "keeps no scene.toml"),
        (["--to", "vtk"], "holds no motion"), (["--to", "uff"], "holds no seat.h5"),
        (["scene.toml", "--to", "csv"], "takes the folder of a run"),
        (["scene.toml", "--to", "reduced"], "no such file or folder"),
    ],
)  # fmt: skip
def test_bad_input(tmp_path: Path, arguments: list[str], message: str, capfd: Told, folder: Path) -> None:
    place = folder if "vtp" in arguments else tmp_path
    given = [str(tmp_path / arguments[0]), *arguments[1:]] if "scene.toml" in arguments else [str(place), *arguments]
    assert run_command(["export", *given, "--quiet"]) == BAD_INPUT
    assert message in capfd.readouterr().err


def test_a_copy_of_a_scene_without_its_files(tmp_path: Path, capfd: Told) -> None:
    assert run_command(["init", "cad", "-o", str(tmp_path / "scene.toml"), "--quiet"]) == DONE
    assert run_command(["export", str(tmp_path), "--to", "calculix", "--quiet"]) == BAD_INPUT
    message = capfd.readouterr().err
    assert "seat.file: no such file" in message
    assert "export the scene itself" in message


@pytest.mark.slow
def test_the_copy_of_a_scene_finds_its_files(tmp_path: Path, folder: Path, capfd: Told) -> None:
    """The copy in the folder of results names files by whole paths; comments and other strings stay."""
    home = tmp_path / "ours"
    (home / "seats").mkdir(parents=True)
    copy(folder / "seat.h5", home / "seats" / "one.h5")
    text = (
        'title = "seats/two.h5"  # "kept"\n[seat]\nkind = \'greens\'\nfile = "seats/one.h5"\n'
        '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
        '[run]\nduration = "0.05 ms"\n[accuracy]\ntarget = "20 %"\n'
    )
    (home / "scene.toml").write_text(text, encoding="utf-8")
    words = ["run", str(home / "scene.toml"), "-o", str(tmp_path / "out"), "--no-pictures", "--quiet"]
    assert run_command(words) in (DONE, FAILED)
    kept = (tmp_path / "out" / "scene.toml").read_text(encoding="utf-8")
    assert kept == text.replace("seats/one.h5", (home / "seats" / "one.h5").resolve().as_posix())
    assert run_command(["plan", str(tmp_path / "out" / "scene.toml"), "--quiet"]) == DONE
    capfd.readouterr()
