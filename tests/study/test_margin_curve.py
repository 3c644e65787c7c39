"""The margin against one key of a scene, and the value that it allows. All strengths are invented."""

import math
from pathlib import Path

import pytest

from seatfem.life.lives import margin_curve
from seatfem.life.maps import plot_margins
from tests.steps import RunError, SceneError, load_scene

KEY = "reed.release.velocity"
SCENE = """
seat = { kind = "spring", stiffness = "27.8 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", n_modes = 12, \
    release = { mode = 1, velocity = "-2 m/s" } }
run = { duration = "1.2 ms", time_step = "2 us", filter_width = "10 us" }
accuracy = { target = 0.9 }
"""
LIFE = '[life]\nstrength = "strength.toml"\ncriterion = "swt"\ncycles = 4.5e9\n'
STRENGTH = 'source = "invented for tests"\n[curve]\nknee_stress = "400 MPa"\nknee_cycles = 1e7\nslope = 12\n'


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "strength.toml").write_text(STRENGTH, encoding="utf-8")
    path = tmp_path / "scene.toml"
    path.write_text(SCENE + LIFE, encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_allowed_speed(scene: Path, tmp_path: Path) -> None:
    """Rigid unilateral contact of linear bodies without gap: stress grows with the speed, so that margin * speed is
    the speed allowed, found by runs to 1e-3; the step does not depend on the speed, and nothing else does."""
    messages: list[str] = []
    curve = margin_curve(scene, KEY, ["-2 m/s", "-1 m/s", "-16 m/s"], tmp_path / "runs", tell=messages.append)
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
def test_none_allowed_where_no_values_enclose_it(scene: Path, tmp_path: Path) -> None:
    curve = margin_curve(scene, KEY, ["-1 m/s", "-0.5 m/s"], tmp_path / "runs")
    assert math.isnan(curve.allowed)
    assert len(curve.values) == 2
    assert min(curve.margins) > 1


@pytest.mark.parametrize(
    ("key", "values", "said"),
    [
        (KEY, ["-1 m/s", "-2 mm/s"], "m/s.*mm/s"),
        (KEY, ["-1 m/s", "-1 m/s"], "values.*1"),
        (KEY, ["fast", "slow"], "'fast'.*number"),
    ],
)
def test_values_refused(scene: Path, tmp_path: Path, key: str, values: list[str], said: str) -> None:
    with pytest.raises(RunError, match=said):
        margin_curve(scene, key, values, tmp_path / "runs")


def test_a_scene_without_a_life(scene: Path, tmp_path: Path) -> None:
    scene.write_text(SCENE, encoding="utf-8")
    with pytest.raises(RunError, match="has no life_margin"):
        margin_curve(scene, KEY, ["-1 m/s", "-2 m/s"], tmp_path / "runs")


def test_values_in_place_of_those_of_the_file(scene: Path) -> None:
    """They are read as those are: checked, with the same messages; tables are made where there are none."""
    changed = load_scene(scene, {"contact.gap": "0.1 mm", "reed.release.velocity": "-3 m/s"})
    assert (changed.contact.gap, changed.reed.release.velocity) == (pytest.approx(1e-4), -3.0)  # type: ignore[attr-defined]
    assert math.isclose(load_scene(scene).reed.release.velocity, -2.0)  # type: ignore[attr-defined]
    with pytest.raises(SceneError, match=r"scene\.toml:3: reed\.release\.velocity: .*towards"):
        load_scene(scene, {"reed.release.velocity": "3 m/s"})
    with pytest.raises(SceneError, match=r"reed\.tip: unknown key"):
        load_scene(scene, {"reed.tip": "3 m/s"})
    with pytest.raises(SceneError, match=r"load: "):
        load_scene(scene, {"load.0.gravity": "-9.81 m/s^2"})
    with pytest.raises(SceneError, match=r"reed\.length\.x:.*table"):
        load_scene(scene, {"reed.length.x": "1 mm"})
