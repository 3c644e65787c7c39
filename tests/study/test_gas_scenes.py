"""[gas]: the uncoupled case is that of [[load]], what a run says of its gas, what is wrong with a table."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.after.result import ImpactResult
from impact.gas import Compressor, Prescribed
from seatfem.study.impacts.contact import RunError, check_step, fallback_step, run_contacts
from seatfem.wings.gas import cycle_masses
from tests.gallery import load_text, refusal
from tests.steps import Scene, begin_plan, problem_of, run_scene, seat_of, striker_of

SEAT = '[seat]\nkind = "spring"\nstiffness = "50 N/um"\n'
REED = (
    '[reed]\nkind = "cantilever"\nlength = "40 mm"\nwidth = "14 mm"\nthickness = "0.3 mm"\nmaterial = "steel"\n'
    'damping_ratio = 0.02\nn_modes = 4\n[stopper]\nkind = "spring"\nstiffness = "5 N/um"\nlift = "2 mm"\n'
)
GAS = (
    '[gas]\nvalve = "suction"\nsuction = { pressure = "1 bar", temperature = "20 degC" }\n'
    'discharge = { pressure = "5 bar", temperature = "453.15 K" }\nrpm = 3000\nport_diameter = "12 mm"\n'
)
CRANK = 'bore = "50 mm"\nstroke = "40 mm"\nrod = "80 mm"\nclearance = "4 cm^3"\n'
RUN = '[run]\nduration = "20 ms"\nfilter_width = "20 us"\n'
AREAS = (
    '[gas.force]\nforward = { area = [["0 mm", "110 mm^2"], ["2 mm", "70 mm^2"]], source = "bench" }\n'
    'back = { area = [["0 mm", "120 mm^2"], ["1 mm", "80 mm^2"]], source = "bench" }\n'
)


def scene_of(folder: Path, text: str, run: str = RUN) -> Scene:
    return load_text(folder, SEAT + REED + text + run)


def record(folder: Path, *, over: bool = False) -> None:
    """Write a cylinder's pressure over a turn; with ``over``, 1 bar less it, which opens a suction valve."""
    angle = np.arange(0, 360, 10)
    turn = np.radians(angle)
    p = 1.0 - 0.15 * np.sin(turn) + np.where(angle > 180, 0.6 * np.sin(turn) ** 2, 0.0)
    rows = [f"{a},{(1.0 - x if over else x):.17g}" for a, x in zip(angle, p, strict=True)]
    (folder / "p.csv").write_text("\n".join(["angle [deg],pressure [bar]", *rows]) + "\n", encoding="utf-8")


def solved(scene: Scene, duration: float = 0.02) -> ImpactResult:
    problem = problem_of(scene, striker_of(scene), impact.Body(impact.spring(stiffness=5e7)))
    return impact.solve(problem, dt=8e-7, duration=duration)


@pytest.mark.parametrize("valve", ["suction", "discharge"])
def test_a_prescribed_pressure_is_that_of_a_load(valve: str, tmp_path: Path) -> None:
    """Gas of a prescribed pressure and [[load]] of the same give equal runs to round-off, impacts included."""
    area = '[["0 mm", "110 mm^2"], ["2 mm", "70 mm^2"]]'
    force = f'[gas.force]\nforward = {{ area = {area}, source = "bench" }}\n'
    record(tmp_path)
    text = GAS.replace('"1 bar"', '"0.5 bar"').replace('"5 bar"', '"1 bar"') if valve == "discharge" else GAS
    text = text.replace('"suction"', f'"{valve}"', 1)
    driven = scene_of(tmp_path, text + 'angle = "30 deg"\ncylinder_pressure = "p.csv"\n' + force)
    one = solved(driven)
    assert isinstance(driven.gas.model_of(1), Prescribed)
    record(tmp_path, over=True)
    load = f'[[load]]\npressure = {{ file = "p.csv", rpm = 3000, angle = "30 deg" }}\narea = {area}\n'
    if valve == "discharge":  # p - 1 bar is what opens
        rows = (tmp_path / "p.csv").read_text(encoding="utf-8").splitlines()
        turned = [f"{a},{-float(x):.17g}" for a, x in (row.split(",") for row in rows[1:])]
        (tmp_path / "p.csv").write_text("\n".join([rows[0], *turned]) + "\n", encoding="utf-8")
    other = solved(scene_of(tmp_path, load))
    assert one.gap[:, 0].max() > 1.9e-3
    assert one.force[:, 0].max() > 5.0
    np.testing.assert_allclose(one.gap, other.gap, atol=1e-9 * one.gap.max())
    np.testing.assert_allclose(one.force, other.force, atol=1e-7 * one.force.max())


def test_directions_have_areas_of_their_own(tmp_path: Path) -> None:
    record(tmp_path)
    scene = scene_of(tmp_path, GAS + 'angle = "30 deg"\ncylinder_pressure = "p.csv"\n' + AREAS)
    forward, back = striker_of(scene).loads
    t = np.array([0.0, 1 / 300])  # 30 and 90 deg, 0.85 and 0.925 bar; 220 deg is above the plenum
    np.testing.assert_allclose(forward.amplitude(t), [0.075e5 * 110e-6, 0.15e5 * 110e-6], rtol=1e-9)
    np.testing.assert_array_equal(back.amplitude(t), [0.0, 0.0])
    above = back.amplitude(np.array([1 / 60 / 50 * 220 - 1 / 600]))
    assert forward.amplitude(np.array([0.011])) == 0.0
    assert above < 0
    assert back.by_opening(5e-4) == pytest.approx(100 / 120)
    assert scene.gas.notes()[0].count("gas.flow") == 2
    assert "gas.force" not in scene.gas.notes()[0]


@pytest.mark.slow
def test_what_a_run_says_of_its_gas(tmp_path: Path) -> None:
    """Two cycles have angles, impacts, masses and balances that add up with the record."""
    text = GAS + CRANK + 'cycles = 2\nstart_pressure = "5 bar"\nother_valve_area = "60 mm^2"\n'
    scene = scene_of(
        tmp_path, '[contact]\npreload = true\n[accuracy]\ntarget = "10 %"\n' + text, '[run]\nfilter_width = "20 us"\n'
    )
    assert scene.run.duration == pytest.approx(0.04)
    drive = scene.gas.model_of(1)
    assert isinstance(drive, Compressor)
    outcome = run_scene(scene, tmp_path / "out", pictures=False)
    keys = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert keys["gas_cycles"] == pytest.approx(2.0)
    lowest = 4e-6 * 5 ** (1 / 1.4)  # the volume at which the clearance's gas is down to 1 bar
    crank = drive.crank
    opens = next(a for a in np.arange(0, 90, 0.01) if crank.volume(a / 18000) > lowest)
    first, second = keys["gas_opening_deg"]
    assert opens < first < opens + 8
    assert second - first == pytest.approx(360, abs=5)
    assert 180 < keys["gas_closing_deg"][0] < 240
    assert 1.99e-3 < keys["gas_largest_lift_m"] < 2.1e-3
    assert all(1 < speed < 5 for speed in keys["gas_seating_velocity_m_per_s"])
    assert all(number >= 1 for number in keys["gas_seat_impacts"] + keys["gas_stopper_impacts"])
    assert keys["gas_mass_residual"] < 1e-9
    assert keys["gas_energy_residual"] < 1e-9
    net = np.subtract(keys["gas_mass_forward_kg"], keys["gas_mass_back_kg"])
    step = keys["time_step_s"] / 3
    again = run_contacts(scene, striker_of(scene, 60), seat_of(scene).greens, step)
    history = scene.gas.follow(again.opening, again.seat.dt, scene.run.duration).history
    finer = cycle_masses(scene.gas, scene.run.duration, history)
    for key, masses in finer.items():
        bars = keys[f"error_bar_{key}"]
        assert len(bars) == 2
        assert (np.abs(np.subtract(masses, keys[key])) < bars).all()
    assert max(keys["error_bar_gas_mass_forward_kg"]) < 0.01 * min(keys["gas_mass_forward_kg"])
    assert net[1] == pytest.approx(keys["gas_mass_other_valve_kg"][1], rel=0.03)  # the second cycle is nearly periodic
    rows = np.loadtxt(tmp_path / "out" / "gas.csv", delimiter=",", skiprows=1)
    assert np.sum(rows[1:, 4] * np.diff(rows[:, 0])) == pytest.approx(net.sum(), rel=2e-3)
    warmth = rows[:, 2] * rows[:, 6] / rows[:, 7] / 287.05
    assert warmth[0] == pytest.approx(293.15 * 5 ** (0.4 / 1.4), rel=1e-4)
    assert (
        230 < warmth.min() < 293 < 500 < warmth.max() < 600
    )  # 293 K compressed 5.6 times: 480 K, mixed with what stays
    swept = math.pi / 4 * 0.05**2 * 0.04
    assert np.ptp(rows[:, 6]) == pytest.approx(swept, rel=1e-3)
    assert any("effective areas not measured: gas.flow.forward" in message for message in outcome.messages)
    assert tmp_path / "out" / "gas.csv" in outcome.files


@pytest.mark.slow
def test_steps_follow_the_crank(tmp_path: Path) -> None:
    """A step is at most half a degree of the crank over 32, whoever chooses it; a longer one is refused."""
    scene = scene_of(tmp_path, GAS + CRANK, RUN.replace("20 us", "400 us"))
    most = 1 / 50 / 360 / 2 / 32
    assert fallback_step(scene.run, scene.driven_by, impact.spring(stiffness=1e6)) == pytest.approx(most)
    assert (begin_plan(scene).method.time_step or 0.0) <= most * (1 + 1e-9)
    stated = scene_of(tmp_path, GAS + CRANK, RUN + 'time_step = "2 us"\n')
    with pytest.raises(RunError, match=r"gas\.rpm = 3000:.*0\.868 us"):
        check_step(stated)


def table(key: str, rows: str) -> str:
    return f'{GAS}{CRANK}[gas.{key}]\nforward = {{ area = [{rows}], source = "bench" }}\n'


P = GAS + 'cylinder_pressure = "p.csv"\n'


@pytest.mark.parametrize(
    ("text", "csv", "words"),
    [
        (GAS, "", "gas.bore:.*cylinder_pressure"),
        (GAS + CRANK.replace('"80 mm"', '"20 mm"'), "", "gas.rod: rod = 20 mm"),
        (GAS + CRANK.replace("4 cm^3", "0 cm^3"), "", r"gas.clearance: '0 cm\^3'"),
        (GAS.replace("5 bar", "0.5 bar") + CRANK, "", "gas.discharge.pressure: 50 kPa"),
        (GAS + CRANK + "cycles = 3\n", "", "gas.cycles: 3 turns.*60 ms, run.duration.*20 ms"),
        (GAS + CRANK + "fluid = { k = 1.3 }\n", "", "gas.fluid.k:.*molar_mass"),
        (table("flow", '["0 mm", "-1 mm^2"]'), "", r"gas.flow.forward.area:.*-1 mm\^2"),
        (table("flow", '["1 mm", "1 mm^2"]'), "", "gas.flow.forward.area:.*begins.*1 mm"),
        (table("force", '["0 mm", "1 mm^2"], ["0 mm", "2 mm^2"]'), "", "gas.force.forward.area:.*lifts"),
        (table("force", '["0 mm", "0 mm^2"], ["1 mm", "2 mm^2"]'), "", "gas.force:.*lift 0.*0"),
        (table("flow", '["0 mm", "1 mm^2"]').replace('"bench"', '" "'), "", "gas.flow.forward.source:.*empty"),
        (P + CRANK, "angle [deg],pressure [bar]\n0,1\n", "gas.bore: cylinder_pressure"),
        (P, "angle [deg],pressure [bar]\n0,1\n20,1\n10,1\n", "line 4, column 1: angle 10"),
        (P, "angle [deg],pressure [bar]\n0,1\n20,1\n300,1\n330,1\n", "line 3, column 1:.*20.*300"),
        (P, "time [ms],pressure [bar]\n0,1\n30,-0.2\n", "-20 kPa:"),
        (P, "time [ms],pressure [bar]\n0,1\n10,1\n", "gas.cylinder_pressure:.*record.*0 ms.*10 ms"),
        (GAS + CRANK + 'columns = { time = "t" }\n', "", "gas.columns:.*cylinder_pressure"),
    ],
)
def test_what_is_wrong_is_named(text: str, csv: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(csv, encoding="utf-8")
    message = refusal(scene_of, tmp_path, text)
    assert re.search(words, message)
    assert int(message.split("scene.toml:")[1].split(":")[0]) > (SEAT + REED).count("\n")
