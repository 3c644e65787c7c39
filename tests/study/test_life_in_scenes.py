"""[life] in scenes: refusals, margins of known vibrations and over one key, what a run tells. All are invented."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.exact.contact_stress import hertz_circular, hertz_impact
from impact.life.strength import basquin
from seatfem.life.assess import assess_life, block_from, life_keys
from seatfem.life.lives import margin_curve
from seatfem.life.maps import plot_margins
from seatfem.study.impacts.forces import Strike
from seatfem.study.runs.body_stress import ClosedFormStress
from seatfem.wings.life import life_sentence
from tests.gallery import load_text, refusal, summary_of, write_scene
from tests.steps import RunError, Scene, run_contacts, run_scene, striker_of

STRENGTH = """source = "invented for tests"
ultimate = "1800 MPa"
curve = { knee_stress = "400 MPa", knee_cycles = 1e7, slope = 12, scatter = 0.25 }
"""
LENGTH, THICKNESS, YOUNG, DENSITY = 25.4e-3, 0.305e-3, 200e9, 7850.0
ROOT = 1.8751040687  # first root of cos(x) cosh(x) = -1
FREQUENCY = (ROOT / LENGTH) ** 2 * THICKNESS * math.sqrt(YOUNG / 12 / DENSITY) / (2 * math.pi)
SCENE = """
seat = {{ kind = "spring", stiffness = "27.8 N/um" }}
reed = {{ kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", \
    material = {{ young = "200 GPa", density = "7850 kg/m^3" }}, n_modes = {modes}, \
    release = {{ mode = 1, deflection = "0.5 mm" }} }}
contact = {{ gap = "{gap}" }}
run = {{ duration = "{duration:.12g} s", time_step = "0.5 us" }}
[life]
"""
LIMITS = 'torsion_limit = "{} MPa"\nbending_limit = "500 MPa"\n'
ASKED = 'strength = "strength.toml"\nsurvival = 0.999\nhours = 25000\nrpm = 3000\n'


def scene_of(
    folder: Path, life: str = ASKED, *, strength: str = STRENGTH, periods: int = 3, gap: str = "2 mm", more: str = ""
) -> Scene:
    (folder / "strength.toml").write_text(strength, encoding="utf-8")
    text = SCENE.format(modes=1 if gap == "2 mm" else 6, gap=gap, duration=periods / FREQUENCY)
    return load_text(folder, text + life + more)


def keys_of(scene: Scene, dt: float = 0.5e-6) -> dict[str, object]:
    striker = striker_of(scene)
    seat = impact.spring(stiffness=27.8e6)
    touches = run_contacts(scene, striker, seat, dt)
    first = block_from(scene.life, scene.turn, touches)
    histories = ClosedFormStress(Strike(scene.geometry, striker, seat, touches)).histories(first)
    return life_keys(assess_life(scene.life, touches, first, histories))


@pytest.mark.parametrize("periods", [1, 3])
def test_the_margin_of_one_mode_in_free_flight(tmp_path: Path, periods: int) -> None:
    """The root bends by sigma = E h/2 (x/l)^2 d, fully reversed, ``periods`` times a block: margin S(N)/sigma.

    The step of 0.5 us misses the trough by (w dt)^2/8 = 1e-7 of the amplitude, rounding of the duration as much.
    """
    amplitude = YOUNG * THICKNESS / 2 * (ROOT / LENGTH) ** 2 * 0.5e-3
    keys = keys_of(scene_of(tmp_path, periods=periods))
    allowed = basquin(400e6, 1e7, 12.0, scatter=0.25).stress(4.5e9 * periods, 0.999)
    assert keys["life_margin"] == pytest.approx(allowed / amplitude, rel=1e-5)
    assert str(keys["life_at"]).startswith("reed, root, face")
    damage = periods / basquin(400e6, 1e7, 12.0, scatter=0.25).life(amplitude, 0.999)
    assert keys["life_damage_per_cycle"] == pytest.approx(float(damage), rel=2e-4)  # 23 times as steep
    assert keys["life_cycles"] == pytest.approx(1 / float(damage), rel=2e-4)


def test_the_initial_bending_is_in_the_block(tmp_path: Path) -> None:
    """A quarter period from the deflection to none has half its stress as range and as mean."""
    scene = scene_of(tmp_path)
    short = scene.model_copy(update={"run": scene.run.model_copy(update={"duration": 0.25 / FREQUENCY})})
    amplitude = YOUNG * THICKNESS / 2 * (ROOT / LENGTH) ** 2 * 0.5e-3 / 2
    allowed = basquin(400e6, 1e7, 12.0, scatter=0.25).stress(4.5e9, 0.999)
    expected = 1 / (amplitude / allowed + amplitude / 1800e6)  # Goodman, mean = amplitude, in tension
    assert keys_of(short)["life_margin"] == pytest.approx(expected, rel=2e-3)  # the end is a step off the zero
    assert keys_of(short)["life_at"] == "reed, root, face towards the seat"


def test_the_last_turn_alone(tmp_path: Path) -> None:
    """The block under a load in crank angle is the last turn, without the start."""
    (tmp_path / "load.csv").write_text(
        "angle [deg],force [N]\n0,0.1\n90,0\n180,-0.1\n270,0\n360,0.1\n", encoding="utf-8"
    )
    load = '[[load]]\nforce = { file = "load.csv", rpm = 60000 }\n'
    scene = scene_of(tmp_path, ASKED + 'block = "last cycle"\n', periods=2, more=load)
    touches = run_contacts(scene, striker_of(scene), impact.spring(stiffness=27.8e6), 0.5e-6)
    first = block_from(scene.life, scene.turn, touches)
    assert len(touches.seat.time) - first == 2001  # 1 ms, with both ends
    whole = scene.model_copy(update={"life": scene.life.model_copy(update={"block": "run"})})  # type: ignore[union-attr]
    assert block_from(whole.life, whole.turn, touches) == 0
    start = np.zeros(len(touches.seat.time))
    start[: first - 1] = 1e9  # all before the block is passed over
    verdicts = assess_life(scene.life, touches, first, [("reed, root", start)]).of_one_axis
    assert verdicts.worst.life.margin == math.inf
    assert keys_of(scene)["life_margin"] > 1.01 * keys_of(whole)["life_margin"]  # type: ignore[operator]


def test_both_faces_and_the_places_of_the_largest_stresses(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, gap="0 mm")
    striker = striker_of(scene)
    seat = impact.spring(stiffness=27.8e6)
    strike = Strike(scene.geometry, striker, seat, run_contacts(scene, striker, seat, 0.5e-6))
    stress = strike.largest_stress()
    histories = dict(ClosedFormStress(replace(strike, stress=stress)).histories(0))
    assert len(histories) >= 2 * 17
    at = stress.largest.at
    place = "reed, root" if at == 0 else f"reed, {1e3 * at:.4g} mm from the root"
    towards, away = (histories[f"{place}, face {which} the seat"] for which in ("towards", "away from"))
    np.testing.assert_array_equal(towards, -away)
    assert np.abs(towards).max() == pytest.approx(stress.largest.value, rel=0.01)  # at its coarser times


@pytest.mark.slow
def test_what_a_run_tells(tmp_path: Path) -> None:
    limit = 'impact_speed_limit = "8 m/s"\nsource = "invented, too"\n'
    scene = scene_of(tmp_path, ASKED + limit, gap="0 mm", periods=1)
    outcome = run_scene(scene, tmp_path / "out", pictures=False)
    keys = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert keys["life_margin"] == pytest.approx(keys_of(scene)["life_margin"], rel=0.01)
    assert keys["error_bar_life_margin"] > 0
    share = keys["error_bar_peak_reed_stress_after_contact_Pa"] / keys["peak_reed_stress_after_contact_Pa"]
    assert keys["error_bar_life_margin"] == pytest.approx(keys["life_margin"] * share / (1 - share))
    assert keys["life_speed_margin"] == pytest.approx(8 / keys["life_speed_m_per_s"])
    assert keys["life_speed_m_per_s"] >= keys["impact_velocity_m_per_s"] > 0
    assert (keys["life_criterion"], keys["life_survival"], keys["life_design_cycles"]) == ("goodman", 0.999, 4.5e9)
    assert keys["life_strength_source"] == "invented for tests"
    assert {"spring_life_margin", "life_cycles", "life_damage_per_cycle", "life_at"} <= keys.keys()
    page = (Path(__file__).parents[2] / "docs" / "life.md").read_text(encoding="utf-8")
    in_scenes = page.partition("## In scenes")[2].partition("## Strength files")[0]
    assert set(re.findall(r"^\| `(life_\w+)` \|", in_scenes, re.MULTILINE)) <= keys.keys()
    words = life_sentence(outcome.summary)
    assert "4.5e9 cycles with 99.9 % survival" in words
    assert "invented for tests" in words
    assert "of the 8 m/s allowed (invented, too)" in words


def test_without_contact_the_margin_has_no_bar(tmp_path: Path) -> None:
    outcome = run_scene(
        scene_of(tmp_path, ASKED + 'impact_speed_limit = "8 m/s"\nsource = "x"\n'), tmp_path / "out", pictures=False
    )
    assert outcome.summary["life_margin"] == outcome.summary["spring_life_margin"]
    assert outcome.summary["error_bar_life_margin"] is None
    assert any("nothing closed within run.duration" in note for note in outcome.messages)
    assert "life_speed_margin" not in outcome.summary


@pytest.mark.parametrize(
    ("life", "strength", "said"),
    [
        (ASKED, 'source = "x"\nultimate = "1800 MPa"\n', r"life.strength:.*\(x\)"),
        (ASKED, STRENGTH.replace("ultimate", "#"), "life.criterion:.*ultimate"),
        (ASKED, STRENGTH.replace(", scatter = 0.25", ""), "life.survival: survival = 0.999"),
        (ASKED + 'criterion = "godman"\n', STRENGTH, "life.criterion:.*'godman'.*'goo"),
        (ASKED.replace("rpm = 3000", ""), STRENGTH, "life.rpm: required"),
        (ASKED + "cycles = 1e9\n", STRENGTH, "life.hours: cycles"),
        ('strength = "strength.toml"\n', STRENGTH, "life.cycles: required"),
        ("cycles = 1e9\n", STRENGTH, "life.cycles:.*strength"),
        ('impact_speed_limit = "8 m/s"\n', STRENGTH, "life.source: required"),
        (ASKED + 'multiaxial = "crossland"\n', LIMITS.format(300) + STRENGTH, "life.multiaxial:.*'canti"),
        (ASKED + 'multiaxial = "papadopoulos"\n', LIMITS.format(450) + STRENGTH,
         "life.multiaxial: torsion_limit/bending_limit = 0.9:.*0.5774.*0.8"),
        (ASKED + 'multiaxial = "dang_van"\n', LIMITS.format(240) + STRENGTH,
         "life.multiaxial: torsion_limit/bending_limit = 0.48: dang_van.*0.5.*1"),
        (ASKED + 'block = "last cycle"\n', STRENGTH, "life.block:.*repeats"),
        (ASKED + 'contact_criterion = "crossland"\n', STRENGTH, "life.contact_modulus: required"),
        (ASKED + 'contact_criterion = "crossland"\ncontact_modulus = "110 GPa"\n', STRENGTH,
         "life.contact_criterion:.*torsion_limit.*bending_limit"),
        (ASKED + 'contact_criterion = "crossland"\ncontact_modulus = "110 GPa"\n',
         'torsion_limit = "310 MPa"\nbending_limit = "500 MPa"\n' + STRENGTH,
         "life.contact_criterion: .*Hertz"),
        (ASKED.replace("strength.toml", "none.toml"), STRENGTH, "life.strength: no such file"),
    ],
)  # fmt: skip
def test_refused(tmp_path: Path, life: str, strength: str, said: str) -> None:
    """A scene's life is refused with the scene's file and line before anything is computed."""
    message = refusal(scene_of, tmp_path, life, strength=strength)
    assert re.search(said, message)
    assert message.startswith(str(tmp_path / "scene.toml") + ":")


def test_a_mass_has_no_stress_but_a_speed(tmp_path: Path) -> None:
    (tmp_path / "strength.toml").write_text(STRENGTH, encoding="utf-8")
    base = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n[reed]\nkind = "rigid_mass"\nmass = "1 g"\n'
    base += 'velocity = "-2 m/s"\n[run]\nduration = "1 ms"\n[life]\n'
    assert re.search(r"life\.strength:.*'rigid_mass'", refusal(load_text, tmp_path, base + ASKED))
    scene = load_text(tmp_path, base + 'impact_speed_limit = "5 m/s"\nsource = "x"\n')
    keys = keys_of(scene)
    assert keys["life_speed_margin"] == pytest.approx(2.5, rel=1e-6)
    assert "life_margin" not in keys


def test_below_the_contact_of_a_ball(tmp_path: Path) -> None:
    """Crossland's margin is that of half the largest shear stress under Hertz's p0 on a stiff support.

    sqrt(J2a) = tau/sqrt 3 with tau = 0.310 p0 at nu = 0.3 (Johnson), and no tension: the pressure's largest value is 0.
    The support's compliance takes 2e-4 of the force, depths and digits 1e-3.
    """
    k, mass, speed, modulus = 4e9, 1e-3, 0.5, 110e9
    (tmp_path / "strength.toml").write_text(
        'source = "x"\ntorsion_limit = "310 MPa"\nbending_limit = "500 MPa"\nlimit_cycles = 1e7\n', encoding="utf-8"
    )
    scene = load_text(
        tmp_path,
        '[seat]\nkind = "spring"\nstiffness = "1e6 N/um"\n[reed]\nkind = "rigid_mass"\nmass = "1 g"\n'
        'velocity = "-0.5 m/s"\n[contact]\nlaw = { kind = "hertz", stiffness = "4e9 N/m^1.5" }\n[run]\n'
        'duration = "0.3 ms"\ntime_step = "0.05 us"\n[life]\nstrength = "strength.toml"\n'
        'contact_criterion = "crossland"\ncontact_modulus = "110 GPa"\n',
    )
    summary = summary_of(scene, tmp_path / "out")
    largest = hertz_impact(stiffness=k, mass=mass, speed=speed).force
    radius = (3 * k / (4 * modulus)) ** 2
    pressure = hertz_circular(force=largest, reduced_modulus=modulus, radius=radius).pressure
    margin, bar = summary["life_contact_margin"], summary["error_bar_life_contact_margin"]
    exact = 310e6 * math.sqrt(3) / (0.310 * pressure)  # whose digits are worth 1e-3
    assert margin == pytest.approx(exact, rel=2e-3)
    assert abs(margin - exact) < bar + 1e-3 * margin < 5e-3 * margin
    assert summary["life_contact_cycles"] == 1e7
    assert "life_margin" not in summary
    assert f"endures 1e7 cycles with {margin:.3g} times the stress" in life_sentence(summary)


STRUCK = """
seat = { kind = "rod", young = "200 GPa", density = "7850 kg/m^3", length = "30 mm", width = "10 mm", \
    thickness = "0.4 mm", damping_ratio = 0.10 }
reed = { kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", damping_ratio = 0.03, \
    material = { young = "200 GPa", density = "7850 kg/m^3" }, release = { tip_deflection = "1 mm" } }
run = { duration = "1.5 ms" }
accuracy = { target = "5 %", measures = ["impulse", "stress"] }
[life]
"""


@pytest.mark.slow
def test_a_reed_that_is_released_and_struck(tmp_path: Path) -> None:
    """The root is bent one way by the release and the other way after the blow: the largest cycle, by Goodman, on the
    face where its mean is tension.

    The S-N curve by hand: 450 times the cycles of the knee, 23 = 2 * 12 - 1, z(0.999) = 3.09023 of 0.25 decades.
    Smaller cycles, none above half of it, take less than 1e-3 of the margin.
    """
    (tmp_path / "strength.toml").write_text(STRENGTH, encoding="utf-8")
    summary = summary_of(load_text(tmp_path, STRUCK + ASKED), tmp_path / "out")
    allowed = 400e6 * (450 * 10 ** (3.09023 * 0.25)) ** (-1 / 23)
    stresses = (summary[f"{key}_Pa"] for key in ("initial_reed_stress", "peak_reed_stress_after_contact"))
    before, after = (float(str(value)) for value in stresses)
    amplitude, mean = (after + before) / 2, abs(after - before) / 2
    assert summary["life_margin"] == pytest.approx(1 / (amplitude / allowed + mean / 1800e6), rel=1e-3)
    assert summary["life_at"] == f"reed, root, face {'towards' if before > after else 'away from'} the seat"


KEY = "reed.release.velocity"
THROWN = """
seat = { kind = "spring", stiffness = "27.8 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", n_modes = 12, \
    release = { mode = 1, velocity = "-2 m/s" } }
run = { duration = "1.2 ms", time_step = "2 us", filter_width = "10 us" }
accuracy = { target = 0.9 }
"""
SWT = '[life]\nstrength = "strength.toml"\ncriterion = "swt"\ncycles = 4.5e9\n'
SIMPLE = 'source = "invented for tests"\n[curve]\nknee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\n'


@pytest.fixture
def thrown_scene(tmp_path: Path) -> Path:
    (tmp_path / "strength.toml").write_text(SIMPLE, encoding="utf-8")
    return write_scene(tmp_path, THROWN, SWT)


@pytest.mark.slow
def test_the_allowed_speed(thrown_scene: Path, tmp_path: Path) -> None:
    """Rigid unilateral contact of linear bodies without gap: stress grows with the speed, so that margin * speed is
    the speed allowed, found by runs to 1e-3; the step does not depend on the speed, and nothing else does."""
    messages: list[str] = []
    curve = margin_curve(thrown_scene, KEY, ["-2 m/s", "-1 m/s", "-16 m/s"], tmp_path / "runs", tell=messages.append)
    products = [-value * margin for value, margin in zip(curve.values, curve.margins, strict=True)]
    assert products == pytest.approx([products[0]] * len(products), rel=1e-9)
    assert curve.allowed == pytest.approx(-products[0], rel=2e-3)
    assert (curve.unit, curve.label) == ("m/s", f"{KEY} [m/s]")
    assert list(curve.values) == sorted(curve.values)
    assert 3 < len(curve.values) == len(messages) <= 15
    assert all(bar > 0 for bar in curve.bars)
    rows = (tmp_path / "runs" / "margin.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == f"{KEY} [m/s],life_margin,error_bar"
    assert len(rows) == 1 + len(curve.values)
    picture = tmp_path / "margin.png"
    plot_margins(curve.values, curve.margins, curve.bars, picture, label=curve.label, allowed=curve.allowed)
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_none_allowed_where_no_values_enclose_it(thrown_scene: Path, tmp_path: Path) -> None:
    curve = margin_curve(thrown_scene, KEY, ["-1 m/s", "-0.5 m/s"], tmp_path / "runs")
    assert math.isnan(curve.allowed)
    assert len(curve.values) == 2
    assert min(curve.margins) > 1


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (["-1 m/s", "-2 mm/s"], "m/s.*mm/s"),
        (["-1 m/s", "-1 m/s"], "values.*1"),
        (["fast", "slow"], "'fast'.*number"),
        (["-1 m/s", "-2 m/s"], "has no life_margin"),
    ],
)
def test_curves_refused(thrown_scene: Path, tmp_path: Path, values: list[str], said: str) -> None:
    """Values that are none, and a scene without a life."""
    if "life" in said:
        thrown_scene.write_text(THROWN, encoding="utf-8")
    with pytest.raises(RunError, match=said):
        margin_curve(thrown_scene, KEY, values, tmp_path / "runs")
