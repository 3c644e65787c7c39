"""A scene run from Python: what the result has, in which forms a scene is taken, and what is refused in words."""

import inspect
import math
import pkgutil
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import impact
import seatfem
from tests.gallery import write_scene

TEXT = """
seat = { kind = "spring", stiffness = "80 N/um" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-2 m/s" }
contact = { gap = "0.1 mm" }
run = { duration = "0.1 ms" }
"""
RAISED_INSIDE = {"_Damage", "LadderError", "_SpentError", "_Unreadable"}
"""Errors that are caught where they are raised, or that a process of gmsh reports in words."""


@pytest.fixture(scope="module")
def result() -> seatfem.RunResult:
    return seatfem.run(TEXT)


def test_a_result_has_measures_with_bar_unit_and_spring(result: seatfem.RunResult) -> None:
    """A mass on a spring is thrown back: impulse 2 m v, contact for half a period."""
    impulse, duration = result.measures["landing_impulse_Ns"], result.measures["contact_duration"]
    assert abs(impulse.value - 4e-3) <= impulse.bar
    assert abs(duration.value - math.pi * math.sqrt(1e-3 / 80e6)) <= duration.bar
    assert (impulse.unit, duration.unit) == ("N s", "s")
    assert impulse.spring == impulse.value  # the seat is the spring
    assert result.measures["impulse"] is impulse
    assert all(key in result.summary for key in result.measures)
    assert str(impulse).endswith("mN s")
    assert f"{impulse:.3e}" == f"{impulse.value:.3e}"


def test_a_name_of_a_scene_means_what_the_accuracy_refers_to() -> None:
    for landing, key in {"run": "impulse_Ns", "first": "first_landing_impulse_Ns"}.items():
        assert seatfem.run(TEXT, changed={"accuracy.landing": landing}).measures["impulse"].key == key


def test_a_run_without_a_landing_says_so(tmp_path: Path) -> None:
    away = seatfem.run(TEXT, changed={"contact.gap": "1 mm"})
    assert away.landings == ()
    assert "no landing" in str(away)
    assert away.met is None
    away.plot("gap", tmp_path / "gap.png")
    with pytest.raises(seatfem.SeatfemError, match="there are 0 landings"):
        away.landings[0]


def test_a_result_has_landings(result: seatfem.RunResult) -> None:
    [landing] = result.landings
    assert isinstance(result.landings, tuple)
    assert (landing.body, landing.number, landing.is_hardest) == ("seat", 1, True)
    assert (
        abs(landing.time.value - 0.1e-3 / 2) <= landing.time.bar + 1e-9
    )  # gap/speed; bars of picoseconds are round-off
    assert landing.closing_speed.value == pytest.approx(2.0, rel=1e-9)  # no force acts before
    assert landing.peak.unit == "N"
    assert math.isnan(landing.stress.value)  # of a rigid mass
    assert not result.landings[1:]
    with pytest.raises(seatfem.SeatfemError, match="1 landings; take"):
        result.landings[1]


def test_nothing_is_kept_and_the_result_stays(result: seatfem.RunResult, tmp_path: Path) -> None:
    """No file remains without a folder; with one, the files are those that the result names, and the numbers equal."""
    assert result.files == ()
    assert not [*Path(tempfile.gettempdir()).glob("seatfem-run-*")]
    assert result.histories.force.max() == pytest.approx(result.summary["peak_force_N"])
    kept = seatfem.run(TEXT, tmp_path / "out", pictures=False)
    assert {"summary.json", "result.h5", "landings.csv"} <= {file.name for file in kept.files}
    assert all(file.is_file() for file in kept.files)
    assert kept.measures["impulse"] == result.measures["impulse"]


@pytest.mark.parametrize("form", ["text", "str", "path", "scene"])
def test_a_scene_is_taken_in_any_form(form: str, result: seatfem.RunResult, tmp_path: Path) -> None:
    path = write_scene(tmp_path, TEXT)
    scene = {"text": TEXT, "str": str(path), "path": path, "scene": seatfem.load_scene(path)}[form]
    for run in (seatfem.run, seatfem.run_scene):
        assert run(scene).measures["impulse"] == result.measures["impulse"]
    done = seatfem.converge(scene, "20 %")
    assert done.measures["impulse"].bar <= 0.2 * done.measures["impulse"].value
    assert done.measures.keys() == result.measures.keys()
    assert len(done.landings) == 1
    assert done.plan.scene.accuracy.target == 0.2


def test_frames_have_all_numbers(result: seatfem.RunResult) -> None:
    frame = result.to_dataframe()
    assert frame.loc["landing_impulse_Ns", "value"] == result.measures["impulse"].value
    assert frame.loc["landing_impulse_Ns", "error_bar"] == result.measures["impulse"].bar
    landings = result.landings.to_dataframe()
    assert landings["impulse_Ns"][0] == result.measures["impulse"].value


def test_without_pandas_the_extra_is_named(result: seatfem.RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    for frame in (result.to_dataframe, result.landings.to_dataframe):
        with pytest.raises(seatfem.SeatfemError, match=r"pip install 'seatfem\[tables\]'"):
            frame()


@pytest.mark.slow(but="lift")
@pytest.mark.parametrize("history", ["force", "gap", "lift", "motion"])
def test_plots_are_figures(result: seatfem.RunResult, history: str, tmp_path: Path) -> None:
    path = tmp_path / f"{history}.png"
    figure = result.plot(history, path)
    assert isinstance(figure, Figure)
    assert path.stat().st_size > 10_000
    if history in ("gap", "lift"):
        [curve, *_] = [line for line in figure.axes[0].lines if line.get_label() == "seat"]
        lowest = np.min(curve.get_ydata())  # in um; the lift is below zero by what the spring gives way
        expected = 0.0 if history == "gap" else -1e6 * result.measures["seat_displacement"].value
        assert lowest == pytest.approx(expected, abs=1e-3)


def test_notebooks_show_tables_and_nothing_in_them_is_markup(result: seatfem.RunResult) -> None:
    hostile = seatfem.RunResult(
        {"landing_status": "<script>", "title": "<script>"}, ("<script>",), (), met=None,
        histories=result.histories, spring=result.spring, plan=result.plan,
    )  # fmt: skip
    assert "<script>" not in hostile._repr_html_()
    done = seatfem.converge(TEXT, "20 %")
    for shown in (result, result.measures, result.measures["impulse"], result.landings, result.landings[0], done):
        html = shown._repr_html_()
        assert html.startswith("<table>")
        assert html.count("<table>") == html.count("</table>")
        assert "impulse" in html
        assert "mN s" in str(shown)


def mistakes(result: seatfem.RunResult, folder: Path) -> dict[str, tuple[Callable[[], object], str]]:
    """Return what users may try, and the part of the answer that names it or its remedy."""
    model = seatfem.SecondOrderModel(M=np.eye(2), C=None, K=np.eye(2), ports={"contact": np.eye(2)[1]})
    asked = {"bandwidth": 1.0, "duration": 1.0, "tolerance": 0.01}
    run, converge, matrices = seatfem.run, seatfem.converge, seatfem.SecondOrderModel
    vectors, scene = {"contact": np.eye(2)[1]}, seatfem.load_scene(TEXT)
    path = write_scene(folder, TEXT)
    return {
        "number": (lambda: run(5), "5 is no path"),
        "missing file": (lambda: run("missing.toml"), "missing.toml: cannot be read: no such file"),
        "folder as scene": (lambda: run(folder), "is a folder"),
        "text with a wrong key": (lambda: run(TEXT.replace("mass =", "mas =")), "text of the scene:3: reed.mas:"),
        "wrong value": (lambda: run(path, changed={"reed.mass": 1e-3}), "reed.mass: 0.001 has no unit"),
        "changes as a list": (lambda: run(path, changed=["reed.mass"]), "changed: ('reed.mass') must map"),
        "changes of a scene": (lambda: run(scene, changed={"reed.mass": "1 g"}), "give the path"),
        "target in words": (lambda: run(TEXT, target="fast"), "accuracy.target: 'fast'"),
        "target in per cent": (lambda: converge(TEXT, 2), "accuracy.target: 2 must be below 1"),
        "rounds": (lambda: run(TEXT, rounds="3"), "--rounds = '3' must be a whole number"),
        "no time": (lambda: run(TEXT, max_time=None), "--max-time = None is no time"),
        "folder a file": (lambda: run(TEXT, path), "cannot be written"),
        "measure": (lambda: result.measures["impuls"], "did you mean 'impulse'?"),
        "history": (lambda: result.plot("stress"), "choose: force, gap, lift, motion"),
        "picture": (lambda: result.plot("gap", folder / "gap.xyz"), "unknown picture format"),
        "vary a list": (lambda: seatfem.sweep(path, ["reed.mass"]), "vary: ('reed.mass') must map"),
        "sweep a text": (lambda: seatfem.sweep(TEXT, {"reed.mass": ["1 g"]}), "is no path"),
        "optimise a scene": (lambda: seatfem.optimise(path), "is a table of a scene: take `seatfem run"),
        "trade": (lambda: seatfem.measure_trade("missing.toml", "journal"), "missing.toml"),
        "strength": (lambda: seatfem.load_strength(5), "5 is no path"),
        "complex K": (lambda: matrices(np.eye(2), None, 1j * np.eye(2), vectors), "K.imag as loss"),
        "ports as a vector": (lambda: matrices(np.eye(2), None, np.eye(2), np.ones(2)), "give {'contact': vector}"),
        "port in words": (lambda: matrices(np.eye(2), None, np.eye(2), {"a": "tip"}), "'tip' is no vector"),
        "band with unit": (lambda: seatfem.greens_function(model, **asked | {"bandwidth": "1 Hz"}), "without its unit"),
        "K for a model": (lambda: seatfem.greens_function(np.eye(2), **asked), "give a seatfem.SecondOrderModel"),
        "modes in words": (lambda: seatfem.solve_modes(model, "3"), "n = '3' is no number"),
        "material": (lambda: seatfem.Material("steel", 0.3, 7850.0), "young = 'steel' is not a number"),
        "mesh by its name": (lambda: seatfem.assemble("mesh.msh", scene.reed), "'mesh.msh' is no mesh"),
        "part by its name": (lambda: seatfem.make_mesh("a.step", seatfem.MeshSpec(1e-3)), "give a shape, or CadPart"),
        "mesh file": (lambda: seatfem.read_mesh("missing.msh"), "missing.msh: no such mesh file"),
        "mass with unit": (lambda: impact.rigid_mass(mass="1 kg", velocity=-1.0), "mass = '1 kg' is no number"),
        "a law by its name": (lambda: impact.ContactProblem(
            impact.rigid_mass(mass=1.0, velocity=-1.0), impact.spring(stiffness=1.0), law="hertz"),
            "law = 'hertz' is no contact law"),
        "path and Green's function": (
            lambda: impact.save_greens("g.h5", impact.spring(stiffness=1.0)), "give first that, then the path"),
        "array as response": (lambda: impact.fit_poles(np.zeros(3)), "is no response"),
        "step with unit": (lambda: impact.solve(impact.ContactProblem(
            impact.rigid_mass(mass=1.0, velocity=-1.0), impact.spring(stiffness=1.0)), dt="1 us", duration=1.0),
            "dt = '1 us' is no number"),
    }  # fmt: skip


def test_mistakes_are_answered_in_words(result: seatfem.RunResult, tmp_path: Path) -> None:
    """Each of the mistakes raises an error of the program that names it, or what to do."""
    for name, (attempt, words) in mistakes(result, tmp_path).items():
        with pytest.raises(seatfem.SeatfemError) as caught:
            attempt()
        assert words in str(caught.value), name


@pytest.mark.slow
def test_every_error_is_of_the_one_base() -> None:
    """An error class in any module of the two packages that leaves them derives from `SeatfemError`."""
    other: set[str] = set()
    for package in (impact, seatfem):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if "__main__" in module.name or "._gmsh" in module.name:
                continue
            for name, each in inspect.getmembers(import_module(module.name), inspect.isclass):
                ours = each.__module__.startswith(("impact", "seatfem"))
                if ours and issubclass(each, Exception) and not issubclass(each, seatfem.SeatfemError | Warning):
                    other.add(name)
    assert other <= RAISED_INSIDE
