"""A scene, carried out: what is written, what is used again, and what an interrupted run leaves."""

import json
import math
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impact import measures
from impact.notices import Progress, silent
from seatfem.pictures import moving, plots
from seatfem.structures.cache import VARIABLE
from seatfem.structures.kinds.drawn import Drawn
from seatfem.study.runs import pictures
from seatfem.study.runs.pipeline import RunOutcome, run_scene
from seatfem.study.runs.stress_spots import load_histories
from tests.gallery import read_summary
from tests.steps import SOURCES, load_greens, load_results, load_scene
from tests.study.small_scenes import write_oscillator

REED = (
    '\n[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nwidth = "10 mm"\nthickness = "0.305 mm"\n'
    'material = { young = "200 GPa", density = "7850 kg/m^3" }\ndamping_ratio = 0.03\nn_modes = 8\n'
    'release = { tip_deflection = "1 mm" }\n\n[run]\nduration = "0.9 ms"\n\n[accuracy]\ntarget = "50 %"\n'
)
SPRING = '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n' + REED
ROD = '[seat]\nkind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "30 mm"\narea = "1 mm^2"\n' + REED
STEEL = 'material = { young = "200 GPa", density = "7850 kg/m^3" }\n'
ANNULAR = (
    '[seat]\nkind = "annular"\nmodel = "axisymmetric"\nbore_radius = "4 mm"\nlip_width = "2 mm"\n'
    'lip_edge_radius = "0 mm"\n'
    'damping_ratio = 0.1\nmesh = { size = "3 mm", contact_size = "1.5 mm" }\n'
    'greens = { bandwidth = "100 kHz", tolerance = "3 %", method = "modes" }\n' + STEEL + REED
)
BAR = (
    '[seat]\nkind = "bar"\nmodel = "sector"\nlength = "12 mm"\nwidth = "4 mm"\nheight = "4 mm"\ndamping_ratio = 0.1\n'
    'mesh = { size = "3 mm", contact_size = "3 mm" }\ngreens = { bandwidth = "100 kHz", tolerance = "3 %" }\n'
    + STEEL
    + REED
)
OF_STRESS = ("reed_hot_spots.csv", "stress.h5")  # of a beam, always
DEMANDED = {
    "peak_force_N", "filtered_peak_force_N", "filter_width_s", "impulse_Ns", "first_contact_s", "contact_duration_s",
    "contact_count", "contact_count_raw", "max_seat_displacement_m", "energy_residual", "wall_time_s",
}  # fmt: skip


@dataclass(frozen=True)
class Ran:
    """A finished run."""

    scene: Path
    folder: Path
    outcome: RunOutcome

    @property
    def summary(self) -> dict[str, Any]:
        return read_summary(self.folder)


def run(text: str, folder: Path, progress: Progress = silent, *, pictures: bool = False) -> Ran:
    """Run a scene, without pictures unless asked: they take most of a small run's time."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder.parent / f"{folder.name}.toml"
    scene.write_text(text, encoding="utf-8")
    return Ran(scene, folder, run_scene(load_scene(scene), folder, progress, pictures=pictures))


def without_vtk(patch: pytest.MonkeyPatch) -> None:
    """Replace what VTK draws by stand-ins (see test_plots)."""
    for module, name in ((plots, "plot_mesh"), (moving, "plot_frames"), (moving, "swing_frame")):
        patch.setattr(module, name, lambda *given, path, **options: path.touch())


@pytest.fixture(scope="module")
def annular(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ran]:
    """Run the annular seat with its curves drawn, and a store of its own: other files run this scene, too."""
    with pytest.MonkeyPatch.context() as patch:
        without_vtk(patch)
        patch.setenv(VARIABLE, str(tmp_path_factory.mktemp("store")))
        yield run(ANNULAR, tmp_path_factory.mktemp("annular") / "out", pictures=True)


def test_a_run_that_finds_its_seat_on_file_without_pictures_draws_its_mesh_and_modes(tmp_path, monkeypatch):
    """A later run has the seat's numbers on file and draws its mesh and modes; a third one copies the pictures."""
    without_vtk(monkeypatch)
    quick = ANNULAR.replace('"0.9 ms"', '"0.3 ms"')
    plain = run(quick, tmp_path / "one")
    second = run(quick, tmp_path / "two", pictures=True)
    of_seat = {"mesh.png", "modes.png", "mode_1.gif", "modes.h5"}
    assert plain.summary["seat_reused"] is False
    assert second.summary["seat_reused"] is True
    assert of_seat <= {path.name for path in second.folder.iterdir()}
    assert second.summary["pictures_missing"] == ""
    one, other = (load_results(each.folder / "result.h5") for each in (plain, second))
    assert set(one) == set(other) == {"wave", "spring"}
    for name, series in product(one, ("time", "force", "gap", "striker_displacement", "target_displacement")):
        np.testing.assert_array_equal(getattr(one[name], series), getattr(other[name], series))
    monkeypatch.setattr(Drawn, "meshed", None)
    assert of_seat <= {path.name for path in run(quick, tmp_path / "three", pictures=True).folder.iterdir()}


@pytest.mark.slow
def test_summary_has_the_demanded_keys_for_the_seat_and_for_the_spring(annular: Ran) -> None:
    assert DEMANDED | {f"spring_{key}" for key in DEMANDED} <= set(annular.summary)
    assert (
        json.loads((annular.folder / "summary.json").read_text(encoding="utf-8"))["notes"] == annular.summary["notes"]
    )
    assert annular.outcome.messages == tuple(annular.summary["notes"])  # and no picture is missing
    text = (annular.folder / "summary.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    results = load_results(annular.folder / "result.h5")
    for prefix, name in (("", "wave"), ("spring_", "spring")):
        summary, result = annular.summary, results[name]
        assert summary[prefix + "filter_width_s"] == 1e-6
        assert summary[prefix + "peak_force_N"] == measures.peak_force(result) > 0
        assert summary[prefix + "filtered_peak_force_N"] == measures.filtered_peak_force(result, 1e-6)
        assert summary[prefix + "impulse_Ns"] == measures.impulse(result)
        groups, raw = measures.contact_groups(result, merge=30e-6), measures.contact_intervals(result)
        assert summary[prefix + "contact_count"] == len(groups)
        assert summary[prefix + "contact_count_raw"] == len(raw) >= len(groups)
        assert 0 <= summary[prefix + "first_contact_s"] - groups[0, 0] <= result.dt
        assert groups[0, 0] == raw[0, 0]
        assert abs(summary[prefix + "contact_duration_s"] - (groups[0, 1] - groups[0, 0])) <= 2 * result.dt
        number, (start, end) = measures.hardest_group(result)
        assert summary[prefix + "hardest_blow"] == number + 1
        assert summary[prefix + "hardest_blow_duration_s"] == end - start
        assert start <= summary[prefix + "peak_time_s"] <= end
        assert summary[prefix + "max_seat_displacement_m"] == np.abs(result.target_displacement).max()
        assert summary[prefix + "energy_residual"] == result.energy.residual < 1e-9
        assert 0 < summary[prefix + "wall_time_s"] < 600


@pytest.mark.slow
def test_every_measure_has_an_error_bar_split_by_source(annular: Ran) -> None:
    """A bar is 1.7 times the root of the sum of its parts' squares, and the mesh's part is not nothing."""
    summary = annular.summary
    for key in ("impulse_Ns", "filtered_peak_force_N", "contact_duration_s", "max_seat_displacement_m"):
        parts = [summary[f"error_{source}_{key}"] for source in SOURCES]
        assert summary[f"error_bar_{key}"] == pytest.approx(1.7 * math.hypot(*parts))
    assert summary["error_unknown"] == ""
    peak = summary["filtered_peak_force_N"]
    assert 1e-5 * peak < summary["error_mesh_filtered_peak_force_N"] < 0.2 * peak
    # a force is at most as sensitive as g itself: a stiff contact follows g, a soft one the root of it
    assert 0 < summary["error_reduction_filtered_peak_force_N"] < 0.2 * peak


@pytest.mark.slow
def test_a_run_writes_what_it_says_and_nothing_else(annular: Ran) -> None:
    written = {path.name for path in annular.outcome.files}
    files = {"summary.json", "landings.csv", "result.h5", "seat.h5", "seat_coarser.h5"}
    curves = {"force.png", "motion.png", "energy.png", "greens.png", "drawing.png"}
    assert written == files | curves | {*OF_STRESS, "stress_histories.png"} | {
        "mesh.png", "modes.png", "mode_1.gif", "modes.h5"
    }  # fmt: skip
    assert {path.name for path in annular.folder.iterdir()} == written
    assert not [message for message in annular.outcome.messages if "picture" in message]
    stages = (
        "plan", "mesh", "assembly", "reduction", "mesh error", "contact", "spring baseline", "reed stress",
        "error budget", "hot spots", "files", "pictures",
    )  # fmt: skip
    assert set(annular.outcome.stages) == set(stages)
    assert sum(annular.outcome.stages.values()) <= annular.summary["wall_time_s"]


@pytest.mark.slow
def test_another_folder_and_another_reed_do_not_compute_the_seat_again(tmp_path: Path) -> None:
    """The store gives the seat with the error bars from its coarser mesh; a wider band is another seat."""
    first = run(BAR, tmp_path / "one").summary
    again = run(BAR.replace("1 mm", "0.5 mm"), tmp_path / "two")
    assert (first["seat_reused"], again.summary["seat_reused"]) == (False, True)
    assert "reduction" not in again.outcome.stages
    assert again.summary["error_mesh_impulse_Ns"] > 0
    assert again.summary["greens_error"] == first["greens_error"]
    load_greens(again.folder / "seat.h5")
    assert run(BAR.replace("100 kHz", "90 kHz"), tmp_path / "three").summary["seat_reused"] is False


@pytest.mark.slow
def test_seats_from_other_programs_files(tmp_path: Path) -> None:
    """Matrices in mm, t, s and the measured receptance of a mass on a spring are the same seat."""
    write_oscillator(tmp_path, 1e-3)
    matrices = (
        '[seat]\nkind = "matrices"\nmass = "m.mtx"\nstiffness = "k.mtx"\ncontact = "port.csv"\nsystem = "mm-t-s"\n'
        'damping_ratio = 0.05\ngreens = { bandwidth = "20 kHz" }\n'
    )
    frf = '[seat]\nkind = "frf"\nfile = "frf.csv"\n'
    one, other = (run(text + REED, tmp_path / name).summary for name, text in (("matrices", matrices), ("frf", frf)))
    for summary in (one, other):
        assert summary["seat_static_stiffness_N_per_m"] == pytest.approx(4e7, rel=1e-3)
    assert other["impulse_Ns"] == pytest.approx(one["impulse_Ns"], rel=1e-2)


@pytest.mark.slow
def test_time_stepping_gives_the_same_impact_and_is_used_again(tmp_path: Path) -> None:
    """Time stepping and Ritz vectors agree under Rayleigh damping; the second run reuses the seat."""
    striker = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "30 us"\n'
    ritz = BAR.partition("[reed]")[0].replace("damping_ratio = 0.1\n", 'rayleigh = { stiffness = "1 us" }\n') + striker
    text = ritz.replace("bandwidth", 'method = "transient", bandwidth')
    summary, expected = run(text, tmp_path / "stepped").summary, run(ritz, tmp_path / "ritz").summary
    assert load_greens(tmp_path / "stepped" / "seat.h5").provenance["method"] == "transient"
    assert 0 < summary["greens_error_reduction"] <= 0.03
    assert 0 < summary["greens_error_mesh"] < 0.05
    for key, within in (("impulse_Ns", 0.06), ("seat_static_stiffness_N_per_m", 1e-6)):  # 0.06: both tolerances
        assert summary[key] == pytest.approx(expected[key], rel=within)
    assert run(text, tmp_path / "stepped").summary["seat_reused"] is True


def test_a_rigid_mass_on_a_rod_is_the_textbooks(tmp_path: Path) -> None:
    """A mass as heavy as the rod has 2.1353 rho c V A, leaves at 3.0677 l/c, with 0.68762 V (Timoshenko & Goodier)."""
    mass, transit = 7850 * 1e-6 * 30e-3, 30e-3 / np.sqrt(200e9 / 7850)
    striker = f'[reed]\nkind = "rigid_mass"\nmass = "{mass} kg"\nvelocity = "-1 m/s"\n[run]\nduration = "18.7 us"\n'
    stepped = f'{striker}time_step = "{transit / 40} s"\n'
    summary = run(ROD.partition("[reed]")[0] + stepped, tmp_path / "out").summary
    # first order in the step, a fortieth of a transit, times a slope of order one
    step = summary["time_step_s"] / transit
    assert step == pytest.approx(1 / 40)
    assert summary["peak_force_N"] == pytest.approx(2.135335 * 1e-6 * np.sqrt(200e9 * 7850), rel=2 * step)
    assert summary["contact_duration_s"] == pytest.approx(3.067668 * transit, abs=2 * step * transit)
    assert summary["impulse_Ns"] == pytest.approx(1.687619 * mass, rel=step)
    assert summary["restitution"] == pytest.approx(0.687619, abs=1.7 * step)  # impulse/(m V) - 1
    assert summary["spring_restitution"] == pytest.approx(1.0, abs=step)


def test_a_run_without_contact_has_no_times(tmp_path: Path) -> None:
    summary = run(SPRING.replace('"0.9 ms"', '"0.1 ms"'), tmp_path / "out").summary
    assert summary["first_contact_s"] is summary["contact_duration_s"] is summary["spring_first_contact_s"] is None
    assert summary["contact_count"] == summary["impulse_Ns"] == summary["peak_force_N"] == 0


def assert_whole(folder: Path) -> None:
    """Check that whatever is there can be read, and nothing temporary is left."""
    for path in folder.iterdir():
        assert not path.name.startswith("."), path
        match path.suffix:
            case ".json":
                json.loads(path.read_text(encoding="utf-8"))
            case ".h5":
                {"result": load_results, "stress": load_histories}.get(path.stem, load_greens)(path)
            case ".png":
                assert path.read_bytes().endswith(b"IEND\xaeB`\x82")


@pytest.mark.slow(but="reduction")
@pytest.mark.parametrize(
    ("stage", "at", "files"),
    [
        ("reduction", 1.0, set()),
        ("stepping", 1.0, {"seat.h5", "seat_coarser.h5"}),
        ("pictures", 0.0,
         {"seat.h5", "seat_coarser.h5", "result.h5", "summary.json", "landings.csv", "force.png", *OF_STRESS}),
    ],
)  # fmt: skip
def test_an_interrupted_run_leaves_whole_files_only(stage: str, at: float, files: set[str], tmp_path: Path) -> None:
    """It is interrupted, as by Ctrl-C, at the first report of a stage, or at its last."""

    def stop(now: str, done: float) -> None:
        if now == stage and done >= at:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(BAR, tmp_path / "out", stop, pictures=True)
    assert {path.name for path in (tmp_path / "out").iterdir()} == files
    assert_whole(tmp_path / "out")


@pytest.mark.slow
def test_missing_picture_libraries_are_told_and_the_rest_is_done(tmp_path: Path) -> None:
    (tmp_path / "bar.toml").write_text(BAR, encoding="utf-8")
    blocked = "import sys; sys.modules.update(dict.fromkeys(('matplotlib', 'pyvista')))"
    command = [sys.executable, "-c", f"{blocked}; from seatfem.faces.cli import main; main()", "run", "bar.toml"]
    done = subprocess.run(
        [*command, "-o", "out"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert "Traceback" not in done.stdout + done.stderr
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("summary.json", "landings.csv", "result.h5", "seat.h5", "seat_coarser.h5"),
        *("scene.toml", "plan.json", *OF_STRESS),
    }
    notes = [line for line in done.stdout.splitlines() if line.startswith("note: ")]
    assert any(line.startswith("note: skipped pictures: ") and "matplotlib" in line for line in notes), notes
    assert any(line.startswith("note: skipped pictures: ") and "pyvista" in line for line in notes), notes
    assert len(notes) == len(set(notes))


@pytest.mark.slow
@pytest.mark.parametrize("problem", [OSError(28, "No space left on device"), MemoryError()])
def test_a_picture_that_fails_is_told_and_costs_no_number(problem, tmp_path, monkeypatch):
    """Whatever it raises: the other pictures follow, summary.json names it, the target stays met."""
    stand_in = r"\x89PNG"

    def fail(*given: object, **options: object) -> None:
        assert (tmp_path / "out" / "result.h5").exists()
        before = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
        assert DEMANDED | {"error_bar_impulse_Ns", "stages_s"} <= set(before)  # numbers first
        raise problem

    for name in ("plot_force", "plot_energy"):
        monkeypatch.setattr(pictures, name, lambda *given, **options: given[-1].write_text(stand_in))
    monkeypatch.setattr(pictures, "plot_greens", lambda greens, path, **options: path.write_text(stand_in))
    monkeypatch.setattr(pictures, "plot_motion", fail)
    ran = run(SPRING, tmp_path / "out", pictures=True)
    wanted = f"skipped pictures: motion.png: {type(problem).__name__}: {str(problem) or 'no reason given'}"
    assert [text for text in ran.outcome.messages if "picture" in text] == [wanted]
    assert ran.summary["pictures_missing"] == wanted
    assert ran.outcome.met
    assert {path.name for path in ran.outcome.files if path.suffix == ".png"} == {
        "force.png", "energy.png", "greens.png", "stress_histories.png", "drawing.png"
    }  # fmt: skip
    assert {path.name for path in ran.folder.iterdir()} == {path.name for path in ran.outcome.files}


@pytest.mark.slow
def test_a_seat_file_read_from_the_output_folder_is_left_as_it_is(tmp_path: Path) -> None:
    before = (run(SPRING, tmp_path / "out").folder / "seat.h5").read_bytes()
    run('[seat]\nkind = "greens"\nfile = "out/seat.h5"\n' + REED, tmp_path / "out")
    assert (tmp_path / "out" / "seat.h5").read_bytes() == before
