"""Who may strike, how it starts, and what drives it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.bodies.loads import Gravity, PointForce, Pressure
from impact.bodies.reeds import reed
from impact.greens.base import ErrorEstimate
from seatfem.study.error_budget import error_budget
from seatfem.study.impacts.contact import RunError, check_step
from seatfem.study.impacts.window import Excerpt
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.table import ladder_of
from seatfem.study.method import SEAT_MODES, stated_method
from seatfem.study.scene import Scene, SceneError
from tests.gallery import load_text, refusal, summary_of
from tests.steps import LevelError, Stopwatch, begin_plan, key_of, problem_of, rounds, run_scene, silent, striker_of

SPRING = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
RUN = '[run]\nduration = "1 ms"\nfilter_width = "20 us"\ntime_step = "1 us"\n[accuracy]\ntarget = "50 %"\n'
CANTILEVER = 'kind = "cantilever"\nlength = "25.4 mm"\nn_modes = 8\n'
STEPPED = 'kind = "stepped"\nthickness = "0.3 mm"\nn_modes = 10\n'
UNIFORM = 'widths = [["0 mm", "8 mm"], ["20 mm", "8 mm"]]\n'
BALL = 'kind = "rigid_mass"\nmass = "2 g"\nvelocity = "-0.5 m/s"\n'
BEAM = impact.Cantilever(200e9, 7850.0, 25.4e-3, 10e-3, 0.305e-3)


def scene_of(folder: Path, striker: str, more: str = "", seat: str = SPRING) -> Scene:
    return load_text(folder, f"{seat}[reed]\n{striker}{more}{RUN}")


@pytest.mark.slow
def test_a_reed_starts_with_a_velocity_in_a_mode(tmp_path: Path) -> None:
    """Straight, its tip at -2 m/s: it strikes at that; its frequencies are those of a beam, k L = 1.8751, 4.6941."""
    scene = scene_of(tmp_path, CANTILEVER, 'release = { mode = 1, velocity = "-2 m/s" }\n')
    start = striker_of(scene).modal_start()
    assert not np.any(start.displacement)
    shapes = striker_of(scene).greens.shapes[:, 0]  # type: ignore[attr-defined]
    assert start.velocity @ shapes == pytest.approx(-2.0, rel=1e-12)
    assert not np.any(start.velocity[1:])
    opened = scene.model_copy(update={"contact": scene.contact.model_copy(update={"gap": 10e-6})})
    summary = summary_of(opened, tmp_path / "out")
    assert summary["impact_velocity_m_per_s"] == pytest.approx(2.0, rel=1e-2)
    wave = np.sqrt(BEAM.young * BEAM.thickness**2 / (12 * BEAM.density)) / BEAM.length**2 / (2 * np.pi)
    assert summary["reed_frequencies_Hz"][:2] == pytest.approx([1.8751041**2 * wave, 4.6940911**2 * wave], rel=1e-6)
    assert len(summary["reed_frequencies_Hz"]) == 8


@pytest.mark.slow
def test_loads_drive_a_reed_at_rest(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("time [ms],pressure [bar]\n0,0\n0.5,-0.1\n1,-0.1\n", encoding="utf-8")
    more = 'pressure = { file = "p.csv" }\npoint_force = { value = "-2 N", at = "12 mm" }\ngravity = "-9.81 m/s^2"\n'
    loads = [
        Pressure(lambda t: np.interp(t, [0, 0.5e-3, 1e-3], [0, -1e4, -1e4])),
        PointForce(lambda t: -2.0, 12e-3),
        Gravity(-9.81),
    ]
    scene = scene_of(tmp_path, CANTILEVER, more)
    one, other, t = striker_of(scene), reed(BEAM, n_modes=8, loads=loads), np.linspace(0.0, 1e-3, 11)
    assert one.modal_start().displacement == pytest.approx(other.modal_start().displacement, rel=1e-12)
    for mine, theirs in zip(one.loads, other.loads, strict=True):
        assert mine.shape == pytest.approx(theirs.shape, rel=1e-12)
        assert mine.amplitude(t) == pytest.approx(theirs.amplitude(t), rel=1e-9)
    assert summary_of(scene, tmp_path / "out")["contact_count"] > 0


def test_a_preload_starts_in_equilibrium(tmp_path: Path) -> None:
    """A constant pressure holds the tip on the seat with 3/8 of its force, as on Roark's rigid support: the reed is
    softer than the seat by five orders."""
    scene = scene_of(tmp_path, CANTILEVER, 'pressure = "-0.01 bar"\n[contact]\npreload = true\n')
    assert problem_of(scene, striker_of(scene), impact.Body(impact.spring(stiffness=2e7))).preload
    summary = summary_of(scene, tmp_path / "out")
    assert summary["peak_force_N"] == pytest.approx(3 / 8 * 1e3 * 25.4e-3 * 10e-3, rel=1e-3)
    assert summary["impact_velocity_m_per_s"] is summary["spring_impact_velocity_m_per_s"] is None  # nothing comes in


@pytest.mark.slow
def test_what_is_struck_is_at_rest(tmp_path: Path) -> None:
    seat = "[seat]\n" + CANTILEVER + 'release = { tip_deflection = "1 mm" }\n'
    with pytest.raises(SceneError, match=r"seat.release:.*struck"):
        scene_of(tmp_path, BALL, seat=seat)
    struck = scene_of(tmp_path, BALL, seat="[seat]\n" + CANTILEVER)
    assert summary_of(struck, tmp_path / "out")["seat_kind"] == "cantilever"


BAR = 'kind = "bar"\nlength = "20 mm"\nwidth = "4 mm"\nheight = "4 mm"\nmaterial = "steel"\ndamping_ratio = 0.02\n'


@pytest.mark.slow
def test_finite_elements_strike(tmp_path: Path) -> None:
    """A bar let go from a static deflection d of its end: the end moves at c d/L, and is back after L/c, to a step."""
    more = 'model = "sector"\ngreens = { bandwidth = "80 kHz" }\ndeflection = "1 um"\n'
    scene = scene_of(tmp_path, BAR, more)
    striker = striker_of(scene)
    summary = summary_of(scene, tmp_path / "out")
    assert summary["first_contact_s"] == pytest.approx(20e-3 / np.sqrt(200e9 / 7850), abs=1e-6)
    assert striker_of(scene).greens is striker.greens  # computed once


def test_what_is_held_has_no_velocity(tmp_path: Path) -> None:
    more = 'model = "rod"\nvelocity = "-1 m/s"\n'
    with pytest.raises(ValueError, match=r"reed.velocity = -1 m/s:.*'bar'"):
        run_scene(scene_of(tmp_path, BAR, more), tmp_path / "out")


OPEN = RUN.replace('time_step = "1 us"\n', "").replace("50 %", "10 %")
FREE_ROD = (
    'kind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "10 mm"\narea = "10 mm^2"\n'
    'far_end = "free"\nvelocity = "-0.1 m/s"\n'
)


def test_what_is_not_known_of_a_striker_is_named(tmp_path: Path) -> None:
    g = impact.rigid_mass(mass=2e-3, velocity=0.0).greens
    impact.save_greens(g.with_error(ErrorEstimate(0.0, None)), tmp_path / "mass.h5")
    striker = 'kind = "greens"\nfile = "mass.h5"\nvelocity = "-0.5 m/s"\n'
    assert summary_of(scene_of(tmp_path, striker), tmp_path / "out")["error_unknown"] == "striker's mesh"


def test_a_rod_thrown_over_a_gap_meets_the_target(tmp_path: Path) -> None:
    """It has no modes that could be moved on: the part of a run with the contact begins where the run does."""
    values = []
    for gap in ("0 mm", "20 um"):
        scene = load_text(tmp_path, f'{SPRING}[reed]\n{FREE_ROD}[contact]\ngap = "{gap}"\n{OPEN}')
        *_, done = rounds(begin_plan(scene), tmp_path, Stopwatch(), silent)
        assert done.met, done.stopped
        values.append((done.budget.values["impulse"], done.budget.bar("impulse")))
    (near, bar), (far, other) = values
    assert abs(near - far) <= bar + other


def test_half_the_step_is_looked_at_of_every_striker_with_waves(tmp_path, monkeypatch):
    steps: list[float] = []
    measures = Excerpt.measures

    def listen(self: Excerpt, each: Any) -> Any:
        steps.extend(each)
        return measures(self, each)

    scene = scene_of(tmp_path, FREE_ROD)
    *_, done = rounds(begin_plan(scene), tmp_path, Stopwatch(), silent)
    monkeypatch.setattr(Excerpt, "measures", listen)
    error_budget(ComputedRun(scene, done.plan.method, done.seat, done.striker), done.touches)
    assert steps == [1e-6, 5e-7]


FIXED_ROD = FREE_ROD.replace('far_end = "free"\nvelocity = "-0.1 m/s"\n', "")
WRONG = [
    (CANTILEVER, "release = { mode = 1 }", "reed.release.deflection: .*beside mode"),
    (CANTILEVER, 'release = { mode = 1, tip_deflection = "1 mm" }', "reed.release.tip_deflection: mode"),
    (CANTILEVER, 'release = { velocity = "-1 m/s" }', "reed.release.mode: .*beside velocity"),
    (CANTILEVER, 'release = { mode = 1, velocity = "1 m/s" }', "reed.release.velocity"),
    (CANTILEVER, 'point_force = { value = "1 N", at = "30 mm" }', "reed.point_force.at: 30 mm"),
    (CANTILEVER, 'pressure = { value = "1 bar", file = "scene.toml" }', "reed.pressure.value: .*value and file"),
    (STEPPED, 'widths = [["1 mm", "8 mm"], ["20 mm", "8 mm"]]', "reed.widths: .*positions must rise from 0"),
    (STEPPED, 'widths = [["0 mm", "0 mm"], ["20 mm", "8 mm"]]', "reed.widths: .*all must be positive"),
    (STEPPED, 'widths = [["0 mm", "8 mm"]]', "reed.widths: .*at least 2"),
    (
        STEPPED,
        f'{UNIFORM}release = {{ tip_deflection = "1 mm" }}\n[contact]\nat = "21 mm"',
        "contact.at: .*reed.*20 mm",
    ),
    (FIXED_ROD, 'velocity = "-1 m/s"', "reed.velocity: .*far_end = 'free'"),
    (FIXED_ROD, 'deflection = "1 um"', "reed.deflection: .*closed form.* kind = 'bar'"),
    (FIXED_ROD, 'force = "-1 N"', "reed.force: .*closed form.* kind = 'bar'"),
    (FREE_ROD, 'force = "-1 N"', "reed.force: .*free rod in closed form"),
    (BAR, 'model = "rod"\nforce = "-1 N"', "reed.model: .*rod in closed form"),
]


@pytest.mark.parametrize(("striker", "more", "words"), WRONG)
def test_what_a_striker_needs_is_told(striker: str, more: str, words: str, tmp_path: Path) -> None:
    assert re.search(words, refusal(scene_of, tmp_path, striker, more + "\n"))


@pytest.mark.slow
def test_a_stepped_reed_of_one_width_is_the_cantilever(tmp_path: Path) -> None:
    there = 'release = { tip_deflection = "0.2 mm" }\n[contact]\nat = "18 mm"\ngap = "1 um"\n'
    beam = STEPPED.replace("stepped", "cantilever") + 'length = "20 mm"\nwidth = "8 mm"\n'
    mine, theirs = (summary_of(scene_of(tmp_path, each, there), tmp_path / "out") for each in (STEPPED + UNIFORM, beam))
    for key in ("impulse_Ns", "first_contact_s", "reed_frequencies_Hz"):
        assert mine[key] == pytest.approx(theirs[key], rel=1e-4)


def test_a_striker_is_told_of_in_keys_of_its_own_table(tmp_path: Path) -> None:
    """The same mistake in a seat and in a striker is refused by the key of its own table."""
    wrong = BAR + 'model = "axisymmetric"\n'
    for role, scene in {
        "seat": lambda: scene_of(tmp_path, BALL, seat="[seat]\n" + wrong),
        "reed": lambda: scene_of(tmp_path, wrong + 'deflection = "1 um"\n'),
    }.items():
        with pytest.raises(LevelError, match=rf"^{role}.model = 'axisymmetric'"):
            striker_of(scene()) if role == "reed" else stated_method(scene())


@pytest.mark.slow
def test_a_beam_that_is_struck_has_an_error_of_its_modes(tmp_path: Path) -> None:
    """Three modes are not enough, and the run says so; more are kept unless the file says how many."""
    ball = BALL.replace("2 g", "0.2 g")
    few = "[seat]\n" + CANTILEVER.replace("n_modes = 8", "n_modes = 3")
    summary = summary_of(scene_of(tmp_path, ball, seat=few), tmp_path / "few")
    assert summary["error_model_filtered_peak_force_N"] > 0.05 * summary["filtered_peak_force_N"]
    many = "[seat]\n" + CANTILEVER.replace("n_modes = 8", "n_modes = 200")
    one, other = (scene_of(tmp_path, ball, seat=text) for text in (few, many))
    assert key_of(one.seat, stated_method(one).seat) != key_of(other.seat, stated_method(other).seat)
    folder = tmp_path / "few"  # where the seat of 3 modes is
    again = summary_of(other, folder)
    assert not again["seat_reused"]
    open_seat = scene_of(tmp_path, ball, seat="[seat]\n" + CANTILEVER.replace("n_modes = 8\n", ""))
    plan = begin_plan(open_seat)
    assert ladder_of(SEAT_MODES).refine(plan, 2.0).seat.n_modes > plan.method.seat.n_modes == 40


def test_a_seat_is_no_thicker_than_its_theory(tmp_path: Path) -> None:
    thick = scene_of(tmp_path, BALL, seat="[seat]\n" + CANTILEVER + 'thickness = "8 mm"\n')
    with pytest.raises(RunError, match=r"^seat.thickness = 8 mm.*seat.length = 25.4 mm"):
        check_step(thick)
