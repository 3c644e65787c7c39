"""Stress and the margin of life as measures that an accuracy is asked of; hot spots, and the forces behind a stress."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatfem.faces.exchange import export
from seatfem.fields import KeyProblem
from seatfem.study.impacts.forces import PatchForces
from seatfem.study.runs.stress_spots import load_histories
from tests.gallery import load_text
from tests.steps import Division, Limits, SceneError, converge, run_scene

RING = """
seat = { kind = "annular", bore_radius = "14.5 mm", lip_width = "1 mm", lip_edge_radius = "0 mm", \
    outer_radius = "24 mm", material = "steel", model = "spring", mesh = { size = "3 mm", contact_size = "0.5 mm" } }
reed = { kind = "ring_plate", outer_diameter = "40 mm", inner_diameter = "20 mm", thickness = "1.5 mm", \
    material = "steel", damping_ratio = 0.01, velocity = "-1 m/s", greens = { bandwidth = "40 kHz" }, \
    mesh = { size = "3 mm" } }
contact = { tilt = "0.05 deg", ports = 8, rings = 3, law = { kind = "spring", stiffness = "20 N/um" } }
run = { duration = "200 us", time_step = "0.5 us" }
accuracy = { target = 0.5, measures = ["impulse", "stress"] }
"""
BALL = """
seat = { kind = "stopper", radius = "6 mm", thickness = "6 mm", contact_radius = "1 mm", material = "steel", \
    fixed = "underside", damping_ratio = 0.02, model = "spring" }
reed = { kind = "ball", diameter = "10 mm", material = "steel", velocity = "-0.2 m/s" }
run = { duration = "30 us", filter_width = "1 us" }
accuracy = { target = 0.5, measures = ["stress"] }
"""


def run(folder: Path, text: str) -> dict[str, Any]:
    run_scene(load_text(folder, text), folder, pictures=False)
    return dict(json.loads((folder / "summary.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return run(tmp_path_factory.mktemp("ring"), RING)


@pytest.mark.slow
def test_stress_of_a_ring_has_a_bar_of_its_own(ring: dict[str, Any]) -> None:
    """The seat is a spring: what is left is mostly the plate's own, and finer parts of the lip change little."""
    name = "landing_peak_reed_stress_Pa"
    stress, bar = (ring[prefix + name] for prefix in ("", "error_bar_"))
    assert "landing_peak_reed_stress_Pa" in str(ring["accuracy_judged_keys"])
    assert ring[f"error_patch_{name}"] < 0.1 * stress
    assert 0 < ring[f"error_striker_{name}"] < bar < 0.5 * stress
    assert ring[f"spring_{name}"] == pytest.approx(stress, rel=0.05)  # the seat is a spring


@pytest.mark.slow
def test_an_asked_stress_is_that_of_the_table(ring: dict[str, Any], tmp_path: Path) -> None:
    beside = run(tmp_path, RING.replace('"impulse", "stress"', '"impulse"') + '[stress]\ndistance = "0.5 mm"\n')
    key = "peak_reed_stress_after_contact_Pa"
    assert ring[key] == pytest.approx(beside[key], rel=1e-9)
    assert ring[f"error_bar_{key}"] >= beside[f"error_bar_{key}"] * 0.5


@pytest.mark.slow
def test_stress_of_a_ball_is_that_below_a_disk_under_uniform_pressure(tmp_path: Path) -> None:
    """Von Mises on the axis is Timoshenko and Goodier's difference of sigma_z = -(1 - c^3) and sigma_r = -((1 + 2 nu)/2
    - (1 + nu) c + c^3/2), c = cos of the cone of the disk's edge, over the pressure."""
    summary = run(tmp_path, BALL)
    c, nu = np.linspace(0, 1, 20001), 0.3
    difference = np.abs((1 - c**3) - ((1 + 2 * nu) / 2 - (1 + nu) * c + c**3 / 2))
    pressure = summary["peak_force_N"] / (math.pi * (10e-3 / 16) ** 2)
    assert summary["peak_reed_stress_Pa"] == pytest.approx(difference.max() * pressure, rel=1e-6)
    assert summary["error_bar_landing_peak_reed_stress_Pa"] > 0


def test_a_margin_is_asked_of_a_strength(tmp_path: Path) -> None:
    text = RING.replace('"impulse", "stress"', '"life_margin"')
    with pytest.raises((SceneError, KeyProblem), match=r"life_margin .*life\.strength"):
        load_text(tmp_path, text)


@pytest.mark.slow
def test_a_margin_is_judged_by_its_stress(tmp_path: Path) -> None:
    strength = Path(__file__).parents[2] / "examples" / "strengths" / "invented_strip.toml"
    life = f'[life]\nstrength = "{strength.as_posix()}"\ncycles = 1e7\n'
    scene = load_text(tmp_path, RING.replace('"impulse", "stress"', '"life_margin"') + life)
    plan = converge(scene, limits=Limits(1)).plan
    assert set(plan.error) == {"stress"}
    assert 0 < plan.error["stress"] < 1


BEAM = """
seat = { kind = "spring", stiffness = "27.8 N/um" }
reed = { kind = "cantilever", length = "25.4 mm", width = "10 mm", thickness = "0.305 mm", \
    material = { young = "200 GPa", density = "7850 kg/m^3" }, n_modes = 12, release = { tip_deflection = "0.5 mm" } }
run = { duration = "1 ms", time_step = "0.1 us" }
"""


@pytest.mark.slow
def test_the_history_at_the_root_of_a_beam(tmp_path: Path) -> None:
    """It begins with 3 E (h/2) d/L^2 less 2/(pi n)^2, and has the largest stress of the run, where and when it says."""
    summary = run_scene(load_text(tmp_path, BEAM), tmp_path, pictures=False).summary
    time, places = load_histories(tmp_path / "stress.h5")
    root = places["reed, root, x = 0 mm, xx"]
    assert root[0] == pytest.approx(1.5 * 200e9 * 0.305e-3 * 0.5e-3 / 25.4e-3**2, rel=2 / (np.pi * 12) ** 2 * 1.05)
    spot = json.loads((tmp_path / "summary.json").read_text())["reed_stress_hot_spots"][0]
    assert (spot["part"], spot["component"], spot["at_m"], spot["edge_distance_m"]) == ("root", "xx", [0.0], None)
    touched = time >= spot["time_s"] * (1 - 1e-12)
    assert abs(spot["component_Pa"]) == spot["von_mises_Pa"] == np.abs(root[touched]).max()
    # the summary looks twice a radian of the highest mode, coarsely at half of that: all of an eighth of a period
    assert spot["von_mises_Pa"] == pytest.approx(summary["peak_reed_stress_after_contact_Pa"], rel=0.02)
    (rows,) = [path for path in export(tmp_path, "csv", tmp_path / "csv") if path.name == "stress.csv"]
    table = np.loadtxt(rows, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], root, rtol=1e-12)


def test_forces_keep_their_sum_and_their_place_on_the_lip() -> None:
    force = np.random.default_rng(0).uniform(0, 5, (3, 8))
    four = PatchForces(force, Division(4, 2))
    assert four.by(Division(4, 2)) is force
    np.testing.assert_allclose(four.by(Division())[:, 0], force.sum(axis=1))
    arcs = force.reshape(3, 4, 2).sum(axis=2)
    np.testing.assert_allclose(four.by(Division(2)), arcs.reshape(3, 2, 2).sum(axis=2))
    np.testing.assert_allclose(four.by(Division(8)), np.repeat(arcs / 2, 2, axis=1))
    rings = force.reshape(3, 4, 2)  # borders at 0, 1/2, 1 of the area, those of three at 0, 1/4, 3/4, 1
    across = np.stack([rings[..., 0] / 2, rings.mean(axis=2), rings[..., 1] / 2], axis=2)
    np.testing.assert_allclose(four.by(Division(4, 3)), across.reshape(3, 12))
