"""Limits of the theory: thick reeds, large deflections, filters beyond a measured band, measures without a bar."""

import json
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.modal import ModalGreens, Residual
from impact.notices import Advice
from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.study.impacts.contact import RunError, check_step, run_contacts
from seatfem.study.impacts.validity import dishing_notes, validity_advice
from tests.gallery import Patch, Told, load_text, write_scene
from tests.steps import ComputedRun, GreensFunction, Scene, Solved, error_budget, load_scene, stated_method, striker_of

SCENE = """
seat = {{ kind = "spring", stiffness = "40 N/um" }}
reed = {{ kind = "cantilever", length = "{length} mm", width = "10 mm", thickness = "{thickness} mm", \
    material = {{ young = "200 GPa", density = "7850 kg/m^3" }}, n_modes = 12, \
    release = {{ tip_deflection = "{deflection} mm" }} }}
run = {{ duration = "1 ms", filter_width = "2 us" }}
"""


def dishing_of(scene: Scene) -> tuple[str, ...]:
    return dishing_notes(scene.reed, scene.seat, scene.load, scene.run.duration)


def advice_of(scene: Scene, *bodies: GreensFunction) -> tuple[Advice, ...]:
    return validity_advice(scene.geometry, scene.run.filter_width, *bodies)


def scene_of(folder: Path, length: float, thickness: float, deflection: float = 0.5) -> Scene:
    return load_text(folder, SCENE.format(length=length, thickness=thickness, deflection=deflection))


def test_a_reed_that_is_no_beam_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    scene = scene_of(tmp_path, 25, 40)
    with pytest.raises(RunError, match=r"reed.thickness = 40 mm.*reed.length = 25 mm.*1.6 \(limit 0.2\)"):
        check_step(scene)
    assert run_command(["plan", str(tmp_path / "scene.toml")]) == BAD_INPUT
    assert "bends by shear" in " ".join(capsys.readouterr().err.split())
    assert scene_of(tmp_path, 25, 5).reed.too_thick() == ""
    assert scene_of(tmp_path, 25, 5.01).reed.too_thick() != ""


@pytest.mark.slow
def test_shear_of_a_thick_reed_is_in_the_bar(tmp_path: Path) -> None:
    """The shear error is Timoshenko's compliance over the slender one's, and is in the measures' bars."""
    scene = scene_of(tmp_path, 25, 3, 0.05)
    beam = impact.TimoshenkoCantilever(young=200e9, density=7850.0, length=25e-3, width=10e-3, thickness=3e-3)
    slender = impact.Cantilever(young=200e9, density=7850.0, length=25e-3, width=10e-3, thickness=3e-3)
    more = beam.compliance(25e-3, 25e-3) / slender.compliance(25e-3, 25e-3) - 1
    error = scene.reed.shear_error(scene.contact.at)
    assert error == pytest.approx(more, rel=0.05)  # the shear factor differs a little between authors
    striker, seat = striker_of(scene), impact.spring(stiffness=40e6)
    run = run_contacts(scene, striker, seat, 1e-7)
    thick = error_budget(ComputedRun(scene, stated_method(scene), Solved(seat), striker), run)
    loose = scene.model_copy(update={"accuracy": scene.accuracy.model_copy(update={"target": 0.9})})
    assert (
        thick.parts["model"]["impulse"]
        > error_budget(ComputedRun(loose, stated_method(loose), Solved(seat), striker), run).parts["model"]["impulse"]
    )


@pytest.mark.parametrize(("deflection", "is_told"), [(0.5, False), (2.9, False), (3.1, True), (88.0, True)])
def test_large_deflections_are_told(deflection: float, is_told: bool, tmp_path: Path) -> None:
    notes = advice_of(scene_of(tmp_path, 30, 0.3, deflection))
    assert len(notes) == is_told
    if is_told:
        assert notes[0].value == pytest.approx(deflection / 30)
        assert f"{deflection / 0.3:.3g} thicknesses" in notes[0].reason
        assert "release it from at most 3 mm" in notes[0].remedy


def test_a_filter_beyond_the_measured_band_is_told(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 30, 0.3)

    def seat(highest: float) -> ModalGreens:
        fit = {"fit": {"band_hz": [100.0, highest]}}
        return ModalGreens(np.array([1e5]), np.array([0.01]), np.ones((1, 1)), Residual.none(), origin=fit)

    (note,) = advice_of(scene, seat(2e4))
    assert note.value == pytest.approx(25.0)
    assert "use run.filter_width >= 50 us" in note.remedy
    assert advice_of(scene, seat(6e5)) == ()
    (other,) = advice_of(scene, seat(6e5), seat(2e4))
    assert "the reed was measured up to 20 kHz" in str(other)


ANNULAR = """
seat = { kind = "annular", bore_radius = "2 mm", lip_width = "1 mm", outer_radius = "12 mm", thickness = "8 mm", \
    model = "spring", material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }, damping_ratio = 0.02 }
reed = { kind = "rigid_mass", mass = "2 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "20 us" }
accuracy = { target = 0.1, measures = ["impulse"] }
"""


@pytest.mark.slow
def test_a_stated_spring_has_what_waves_change_in_the_bars_of_all_measures(tmp_path: Path) -> None:
    """The bars hold what waves change in the displacement, too, whether or not it was asked for."""
    path, out = write_scene(tmp_path, ANNULAR), tmp_path / "out"
    run_command(["run", str(path), "-o", str(out), "--quiet", "--no-pictures"])
    first = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert first["plan_seat_level"] == "spring"
    assert first["max_seat_displacement_m"] > 0
    assert first["error_model_max_seat_displacement_m"] > 0.01 * first["max_seat_displacement_m"]
    assert first["error_bar_max_seat_displacement_m"] > first["error_model_max_seat_displacement_m"]
    assert first["error_bar_impulse_Ns"] > 0


def test_a_beam_that_is_pressed_on_a_port_says_that_it_does_not_dish() -> None:
    """The note gives 3 p r^2/(4 t^2) = 159 MPa, 3.3/2 of it with a free edge, for 9 bar over 9.2 mm."""
    examples = Path(__file__).parents[2] / "examples"
    (note,) = dishing_of(load_scene(examples / "valve_on_cast_iron.toml"))
    assert "900 kPa over a port of 9.2 mm" in note
    assert "these 159 MPa to 262 MPa" in note
    assert dishing_of(load_scene(examples / "flapper_on_peek_sleeve.toml")) == ()  # no pressure
    assert dishing_of(load_scene(examples / "suction_flapper.toml")) == ()  # a plate


LANDING = """
seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", n_modes = 6, release = { mode = 1, velocity = "-2 m/s" } }
run = { duration = "2 ms", filter_width = "5 us", time_step = "1 us" }
contact = { gap = "0 mm" }
"""


def pressed(*bars: float, more: str = "", area: str = "80 mm^2") -> str:
    """Return a load by the pressure of a file over a turn of 2 ms."""
    rows = "".join(f"{k * 360 / len(bars):g},{bar:g}\n" for k, bar in enumerate(bars))
    name = f"{'_'.join(map(str, bars))}.csv"
    Path(name).write_text(f"angle [deg],pressure [bar]\n{rows}", encoding="utf-8")
    return f'{LANDING}[[load]]\npressure = {{ file = "{name}", rpm = 30000 }}\narea = "{area}"\n{more}'


@pytest.mark.slow
def test_an_absolute_pressure_is_named_before_the_run(tmp_path: Path, monkeypatch: Patch, capsys: Told) -> None:
    """1 to 9 bar on 80 mm^2 are 8 to 72 N: they push the reed off all the time, or press it on with the other sign."""
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(pressed(1, 3, 9, 3), encoding="utf-8")
    for verb, more in (("draw", []), ("plan", []), ("run", ["-o", "out", "--no-pictures"])):
        run_command([verb, "scene.toml", *more])
        said = " ".join(capsys.readouterr().out.split())
        assert "load.0.pressure: the loads (8 N to 72 N, positive off the seat) push the reed off its seat" in said, (
            verb
        )
        assert "of an absolute one subtract the pressure on the other side" in said, verb
    (note,) = load_text(tmp_path, pressed(-1, -3, -9, -3)).find_doubts()
    assert "(-72 N to -8 N, positive off the seat) press the reed on its seat" in str(note)
