"""[life] of plates and of finite elements: margins from their tensors, where, curves over speed, tilt and lift.

All strengths are invented.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from impact.life.places import margin_error
from impact.life.strength import basquin
from impact.notices import Progress
from seatfem.faces.report.fragments import html_table
from seatfem.faces.tables import result_table
from seatfem.structures.fields.peaks import hottest, largest, mises_range, von_mises
from seatfem.structures.fields.recovery import histories
from seatfem.study.impacts.plate_stress import RIM
from seatfem.study.runs import afterwards, pipeline
from seatfem.study.runs.body_stress import BodyStress
from seatfem.study.runs.reed_stress import PlateStress, plate_stress
from seatfem.wings.life import life_sentence
from tests.gallery import Patch, load_text
from tests.steps import Round, SceneError
from tests.study.small_scenes import PRESSED, PRESSURE

CURVE = basquin(400e6, 1e7, 12.0)
STRENGTH = 'source = "invented for tests"\ntorsion_limit = "310 MPa"\nbending_limit = "500 MPa"\nlimit_cycles = 1e7\n'
STRENGTH += '[curve]\nknee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\n'
SPRING = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
REED = (
    '[reed]\nkind = "flapper"\nroot_width = "6 mm"\ntaper_length = "1 mm"\nneck_width = "6 mm"\nneck_length = "14 mm"\n'
    'paddle_diameter = "12 mm"\nthickness = "0.3 mm"\n'
    'material = { young = "200 GPa", poisson = 0.0, density = "7850 kg/m^3" }\ngreens = { bandwidth = "4 kHz" }\n'
)
THROWN = REED + 'release = { velocity = "-2 m/s" }\n'
RUN = '[run]\nduration = "{} ms"\ntime_step = "2 us"\nfilter_width = "20 us"\n[accuracy]\ntarget = 0.9\n'
FINER = RUN.format(1.5).replace("2 us", "1 us")
LIFE = '[life]\nstrength = "strength.toml"\ncriterion = "swt"\ncycles = 4.5e9\n'


def run(folder: Path, text: str, monkeypatch: Patch | None = None) -> tuple[dict[str, object], list[Round]]:
    """Run a scene, and return its summary and the round."""
    (folder / "strength.toml").write_text(STRENGTH, encoding="utf-8")
    kept: list[Round] = []
    if monkeypatch is not None:
        stresses = afterwards.stresses.stresses

        def keep(done: Round, progress: Progress) -> tuple[BodyStress | None, BodyStress | None]:
            kept.append(done)
            return stresses(done, progress)

        monkeypatch.setattr("seatfem.study.runs.stresses.stresses", keep)
    outcome = pipeline.run_scene(load_text(folder, text), folder / "out", pictures=False)
    return dict(outcome.summary), kept


def stress_of(done: Round) -> PlateStress:
    """Return the stress in the plate of a round."""
    stress = plate_stress(done)
    assert stress is not None
    return stress


@pytest.mark.slow
def test_a_plate_in_free_flight_fails_where_and_when_its_stress_says(tmp_path, monkeypatch):
    """One mode without Poisson's ratio: its largest von Mises stress is of one axis and fully reversed, so that the
    margin is S(N) over it, and Crossland's t/(sqrt(J2a) + k pmax) = f over it."""
    text = SPRING + THROWN + '[contact]\ngap = "9 mm"\n' + RUN.format(12) + LIFE + 'multiaxial = "crossland"\n'
    keys, (done,) = run(tmp_path, text, monkeypatch)
    field = stress_of(done).field
    peak = float(largest(field, np.zeros((len(done.result.time), 1)), done.result.dt).initial.von_mises.max())
    periods = 12e-3 * float(done.striker.greens.modal.omega[0]) / (2 * np.pi)  # type: ignore[union-attr]
    assert keys["life_margin"] == pytest.approx(CURVE.stress(4.5e9 * periods) / peak, rel=0.01)
    assert keys["life_multiaxial_margin"] == pytest.approx(500e6 / peak, rel=0.01)
    assert (keys["life_multiaxial_criterion"], keys["life_multiaxial_cycles"]) == ("crossland", 1e7)
    assert str(keys["life_at"]).startswith("reed, root, (")
    assert keys["error_bar_life_margin"] is None
    assert keys["error_bar_life_multiaxial_margin"] is None
    assert "the reed endures 1e7 cycles with" in life_sentence(keys)


@pytest.mark.slow
def test_the_points_with_the_largest_ranges_of_each_region(tmp_path: Path, monkeypatch: Patch) -> None:
    """Ranges lie between the largest von Mises stress of differences of two states and sqrt 5 times it."""
    soft = SPRING.replace("20 N/um", "0.2 N/um")  # whose landing asks little of what lies above the plate's modes
    text = soft + THROWN + RUN.format(0.4) + LIFE + 'multiaxial = "crossland"\n'
    keys, (done,) = run(tmp_path, text, monkeypatch)
    stress, bar = (keys[f"{of}peak_reed_stress_after_contact_Pa"] for of in ("", "error_bar_"))
    several = margin_error(keys["life_multiaxial_margin"], bar / stress)  # type: ignore[operator,arg-type]
    assert keys["error_bar_life_multiaxial_margin"] == pytest.approx(several)
    field = stress_of(done).field
    some = field.at(np.arange(0, len(field.points), 40))
    ranges = mises_range(some, done.result.force, done.result.dt)
    stress = np.moveaxis(histories(some, done.result.force, done.result.dt), 1, 2)
    true = [max(float(von_mises(each - state).max()) for state in each[::2]) for each in stress]
    assert np.all(ranges > 0.97 * np.array(true))  # at its coarser times
    assert np.all(ranges < np.sqrt(5) * np.array(true))
    regions = np.array(["a", "b"] * len(ranges))[: len(ranges)]
    chosen = hottest(ranges, regions, 2)
    assert sorted(regions[chosen]) == ["a", "a", "b", "b"]
    assert ranges.max() == ranges[chosen].max()


@pytest.mark.slow
def test_the_bar_of_a_margin_holds_what_a_finer_run_finds(tmp_path: Path, monkeypatch: Patch) -> None:
    """A quarter of the step and twice the band leave a tenth of the error at most: the bar is of the rest."""
    soft = SPRING.replace("20 N/um", "0.2 N/um") + THROWN + RUN.format(0.4) + LIFE
    finer = soft.replace('"2 us"', '"0.5 us"').replace('"4 kHz"', '"8 kHz"')
    of_run, of_finer = (run(tmp_path, text, monkeypatch)[0] for text in (soft, finer))
    margin, bar = float(of_run["life_margin"]), float(of_run["error_bar_life_margin"])  # type: ignore[arg-type]
    off = abs(float(of_finer["life_margin"]) - margin)  # type: ignore[arg-type]
    assert 0.0 < off < 1.1 * bar
    stress, bar_of_stress = (float(of_run[f"{of}peak_reed_stress_after_contact_Pa"]) for of in ("", "error_bar_"))  # type: ignore[arg-type]
    assert bar < margin_error(
        margin, bar_of_stress / stress
    )  # which is of the largest stress anywhere, not of the margin
    assert float(of_finer["error_bar_life_margin"]) < bar  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_plate_that_meets_its_stopper_alone_has_a_bar(tmp_path: Path) -> None:
    """The bars of stress, margin and the stopper's force hold what half the step changes."""
    bent = REED + 'release = { deflection = "-1 mm" }\n[contact]\ngap = "1.5 mm"\n'
    stopper = '[stopper]\nkind = "spring"\nstiffness = "0.02 N/um"\ngap = "50 um"\n'
    keys, finer = (run(tmp_path, SPRING + bent + stopper + each + LIFE)[0] for each in (RUN.format(1.5), FINER))
    assert keys["peak_force_N"] == 0.0
    stress = "peak_reed_stress_after_contact_Pa"
    for name in (stress, "life_margin", "stopper_filtered_peak_force_N", "stopper_impulse_Ns"):
        value, bar, other = (float(of[key]) for of, key in ((keys, name), (keys, f"error_bar_{name}"), (finer, name)))  # type: ignore[arg-type]
        assert 0 < abs(other - value) < bar < value, name  # a margin divides by a stress less its bar


@pytest.mark.slow
def test_margin_over_speed_is_the_allowed_speed_over_it(tmp_path: Path) -> None:
    """Margin times speed stays the allowed speed of a linear reed on a linear seat that it touches at first."""
    text = SPRING + THROWN + RUN.format(1.2) + LIFE + 'curves = { speed = ["1 m/s", "2 m/s", "16 m/s"] }\n'
    keys, _ = run(tmp_path, text)
    rows = (tmp_path / "out" / "margin_over_speed.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "speed [m/s],life_margin,error_bar"
    speeds, margins, bars = np.array([[float(x) for x in row.split(",")] for row in rows[1:]]).T
    np.testing.assert_allclose(speeds * margins, speeds[0] * margins[0], rtol=1e-7)
    relative = float(keys["error_bar_life_margin"]) / float(keys["life_margin"])  # type: ignore[arg-type]
    np.testing.assert_allclose(bars / margins, relative, rtol=1e-7)  # measured, not that of the largest stress
    assert keys["life_margin"] == pytest.approx(margins[speeds == 2.0][0], rel=5e-9)  # nine digits are written
    assert keys["life_allowed_speed_m_per_s"] == pytest.approx(speeds[0] * margins[0], rel=0.05)  # 4 more runs


@pytest.mark.slow
def test_loads_by_the_lift_are_in_the_stress(tmp_path: Path) -> None:
    """One whose area does not change with the lift is as good as a constant load."""
    load = '[[load]]\npressure = "-0.1 bar"\narea = {}\n'
    margins = []
    for area in ('"30 mm^2"', '[["0 mm", "30 mm^2"], ["1 mm", "30 mm^2"]]'):
        keys, _ = run(tmp_path, SPRING + THROWN + load.format(area) + RUN.format(1) + LIFE)
        margins.append(keys["life_margin"])
    alone, _ = run(tmp_path, SPRING + THROWN + RUN.format(1) + LIFE)
    assert margins[1] == pytest.approx(margins[0], rel=1e-6)
    assert margins[1] != pytest.approx(alone["life_margin"], rel=0.03)


@pytest.mark.slow
def test_margin_over_lift_is_that_of_runs_with_another_stopper(tmp_path: Path) -> None:
    beam = '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nn_modes = 6\nrelease = { mode = 1, velocity = "-2 m/s" }\n'
    stop = '[stopper]\nkind = "spring"\nstiffness = "20 N/um"\nlift = "{} mm"\n'
    curve = 'curves = { lift = ["0.5 mm", "3 mm"] }\n'
    keys, _ = run(tmp_path, SPRING + beam + stop.format(1) + RUN.format(6) + LIFE + curve)
    rows = (tmp_path / "out" / "margin_over_lift.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "lift [mm],life_margin,error_bar"
    for lift, row in zip((0.5, 3), rows[1:], strict=True):
        (tmp_path / str(lift)).mkdir()
        there, _ = run(tmp_path / str(lift), SPRING + beam + stop.format(lift) + RUN.format(6) + LIFE)
        assert float(row.split(",")[1]) == pytest.approx(there["life_margin"], rel=1e-6)
        assert float(row.split(",")[2]) > 0
    assert float(rows[1].split(",")[1]) != pytest.approx(float(rows[2].split(",")[1]), rel=0.01)
    assert "life_allowed_lift_m" in keys


@pytest.mark.parametrize(
    ("scene", "life", "said"),
    [
        (THROWN, 'curves = { tilt = ["0 deg", "1 deg"] }\n', r"life.curves.tilt: 0 deg:"),
        (THROWN, 'curves = { lift = ["1 mm", "2 mm"] }\n', r"life.curves.lift: 1 mm:.*\[stopper\]"),
        (REED + 'release = { deflection = "1 mm" }\n', 'curves = { speed = ["1 m/s", "2 m/s"] }\n',
         "life.curves.speed: 1 m/s:"),
        (
            REED
            + 'release = { deflection = "1 mm" }\n[stopper]\nkind = "spring"\nstiffness = "1 N/um"\ngap = "2 mm"\n',
            'curves = { lift = ["3 mm", "0.5 mm"] }\n',
            "life.curves.lift: 0.5 mm: .*at.*1 mm",
        ),
        (THROWN, 'curves = { speed = ["1 m/s"] }\n', "life.curves.speed:.*values.*1"),
        (THROWN, "curves = {}\n", "life.curves.speed:.*curve"),
        (THROWN, 'seat_strength = "strength.toml"\n', r"life.seat_strength: .*add.*\[stress\]"),
    ],
)  # fmt: skip
def test_refused(tmp_path: Path, scene: str, life: str, said: str) -> None:
    with pytest.raises(SceneError, match=r"scene\.toml:\d+: " + said):
        run(tmp_path, SPRING + scene + "\n" + RUN.format(1) + LIFE + life)


@pytest.mark.slow
def test_a_seat_pressed_slowly(tmp_path: Path) -> None:
    """A mass on a soft spring presses a bar: its surface bears -p with p = v sqrt(k m)/A once a block, pulsating; swt
    sees no damage in compression, goodman an amplitude of p/2. Its own waves and give: 2.4 %."""
    (tmp_path / "seat.toml").write_text(STRENGTH.replace("[curve]", 'ultimate = "1800 MPa"\n[curve]'), encoding="utf-8")
    text = PRESSED + 'points = [["0 mm", "0 mm", "5 mm"]]\n[life]\nseat_strength = "seat.toml"\n'
    keys, _ = run(tmp_path, text + 'criterion = "goodman"\nmultiaxial = "crossland"\ncycles = 4.5e9\n')
    assert keys["life_margin"] == pytest.approx(CURVE.stress(4.5e9) / (PRESSURE / 2), rel=0.03)
    # sqrt(J2a) = p/2/sqrt 3; the pressure's largest value is 0, at rest
    assert keys["life_multiaxial_margin"] == pytest.approx(310e6 * 2 * np.sqrt(3) / PRESSURE, rel=0.03)
    assert str(keys["life_at"]).startswith("seat, (")
    assert isinstance(keys["error_bar_life_margin"], float)
    assert keys["life_strength_source"] == "invented for tests"
    assert "the seat endures 4.5e9 cycles" in life_sentence(keys)


@pytest.mark.slow
def test_the_rim_of_an_averaged_patch_says_so_and_counts_in_no_margin_without_a_bar(tmp_path, monkeypatch):
    """A disc as one contact: its rim is a hot spot; the life of its points is asked for only where stress has a bar."""
    disc = THROWN.replace("release", 'contact_radius = "2 mm"\nrelease')
    text = SPRING + disc + '[contact]\ngap = "0.1 mm"\n' + RUN.format(0.3) + LIFE
    keys, (done,) = run(tmp_path, text, monkeypatch)
    parts = [spot["part"] for spot in keys["reed_stress_hot_spots"]]
    assert RIM in parts
    stress = stress_of(done)
    for bar in (1e6, math.nan):
        names = [name for name, _ in replace(stress, bar=bar).histories(0)]
        assert any(RIM in name for name in names) != math.isnan(bar)
        assert any("paddle" in name for name in names)
    at_rim = {**keys, "reed_stress_hot_spots": [next(s for s in keys["reed_stress_hot_spots"] if s["part"] == RIM)]}
    assert f"largest reed stress: {RIM}" in result_table(at_rim).caption
    assert RIM in html_table(result_table(at_rim))
