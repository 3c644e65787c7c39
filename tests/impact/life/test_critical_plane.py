"""Planes of stress tensors: proportional stress exactly, whatever its axes; turning stress within the grid."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from impact.life.damage import Goodman
from impact.life.multiaxial import Crossland
from impact.life.places import STRAIGHT, Demand, judged, normal_stresses, on_planes, thinned
from impact.life.strength import LifeError, Strength, basquin

DEMAND = Demand(
    Strength("invented for tests", ultimate=1800e6, curve=basquin(400e6, 1e7, 12.0)), Goodman(1800e6), 4.5e9
)
WALK = 40e6 * np.cumsum(np.random.default_rng(3).standard_normal(300)) / 4
PLACES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def proportional(course: np.ndarray, tensor: np.ndarray) -> np.ndarray:
    return np.outer(course, [tensor[place] for place in PLACES])


def margin(stress: np.ndarray) -> float:
    life = judged(on_planes([("root", stress)]), DEMAND).life
    return life.margin


@pytest.mark.parametrize("seed", range(4))
def test_one_axis_however_it_lies(seed: int) -> None:
    turn = Rotation.random(rng=seed).as_matrix()
    assert margin(proportional(WALK, turn @ np.diag([1.0, 0, 0]) @ turn.T)) == pytest.approx(margin(WALK), rel=1e-9)


@pytest.mark.slow
def test_torsion_is_judged_by_its_principal_stress_and_pressure_by_its_own() -> None:
    shear = np.zeros((3, 3))
    shear[0, 1] = shear[1, 0] = 1.0
    both = min(margin(WALK), margin(-WALK))  # tension on one plane, compression on the other
    assert margin(proportional(WALK, shear)) == pytest.approx(both, rel=1e-9)
    assert margin(proportional(WALK, np.eye(3))) == pytest.approx(margin(WALK), rel=1e-9)


def test_a_stress_that_turns_is_right_within_the_grid() -> None:
    """Bending with torsion 90 degrees behind, ta = sa/2: on the plane at angle a off the axis the amplitude is
    sa sqrt(cos^4 a + sin^2 a cos^2 a) = sa |cos a|, so that the axis' own plane is the worst."""
    time = 2 * np.pi * np.arange(720) / 720
    stress = np.zeros((720, 6))
    stress[:, 0], stress[:, 5] = 250e6 * np.sin(time), 125e6 * np.cos(time)
    expected = 1 / (250e6 / DEMAND.strength.curve.stress(4.5e9))  # type: ignore[union-attr]
    assert margin(stress) == pytest.approx(expected, rel=0.008)
    amplitudes = [np.ptp(each) / 2 for _, each in normal_stresses("root", stress)]
    assert 0.992 * 250e6 < max(amplitudes) <= 250e6 * (1 + 1e-9)


def test_a_plane_stress_has_the_margin_of_the_same_stress_turned() -> None:
    """Turned in space, its planes are those over half the sphere, up to half of `APART` off the critical one."""
    time = 2 * np.pi * np.arange(360) / 360
    tensors = np.zeros((360, 3, 3))
    tensors[:, 0, 0], tensors[:, 1, 1] = 250e6 * np.sin(time), 90e6 * np.cos(3 * time)
    tensors[:, 0, 1] = tensors[:, 1, 0] = 125e6 * np.cos(time + 0.4)
    turn = Rotation.from_euler("xyz", (0.3, 0.7, 1.1)).as_matrix()
    flat, turned = (each[:, [0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]] for each in (tensors, turn @ tensors @ turn.T))
    assert margin(flat) == pytest.approx(margin(turned), rel=0.016)
    assert len(list(normal_stresses("", flat))) <= 18 < len(list(normal_stresses("", turned)))


@pytest.mark.parametrize("stress", [np.zeros((0, 6)), np.zeros((4, 5)), np.full((2, 6), np.nan)])
def test_what_is_no_history_of_tensors(stress: np.ndarray) -> None:
    with pytest.raises(LifeError, match=r"root: .*(\(n, 6\)|finite)"):
        list(normal_stresses("root", stress))
    with pytest.raises(LifeError, match=r"\(n, 6\)|must be finite"):
        Crossland(310e6, 500e6).value(stress)


def test_the_corners_of_a_history_decide_its_life() -> None:
    """The corners keep extremes on planes, of pressure and sphere to `STRAIGHT` of the largest turn."""
    rng, t = np.random.default_rng(3), 31e-9 * np.arange(100_000)
    waves = np.array([150.0, 900.0, 2600.0, 15e3, 60e3])
    history: np.ndarray = 50e6 + sum(
        rng.normal(size=6) * 1e8 / (f / 150) ** 0.6 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6))[:, None]
        for f in waves
    )
    history[40_000] += 2e6  # one step alone
    corners = thinned(history)
    assert len(corners) < len(history) / 12  # 60 kHz take more than a plate of 30 kHz
    np.testing.assert_array_equal(corners[[0, -1]], history[[0, -1]])
    assert (corners == history[40_000]).all(axis=1).any()
    turns = history - history.mean(axis=0)
    allowed = STRAIGHT * np.sqrt((turns**2 @ [1, 1, 1, 2, 2, 2]).max())
    for normal in rng.normal(size=(50, 3)):
        x, y, z = normal / np.linalg.norm(normal)
        across = np.array([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y])
        for extreme in (np.max, np.min):
            assert abs(extreme(history @ across) - extreme(corners @ across)) <= allowed
    criterion = Crossland(torsion_limit=300e6, bending_limit=500e6)
    assert criterion.margin(corners) == pytest.approx(criterion.margin(history), rel=2 * STRAIGHT)


def test_a_straight_course_has_no_corners_between_its_ends() -> None:
    path = np.outer(np.linspace(0, 1e8, 1025), np.ones(6))
    np.testing.assert_array_equal(thinned(path), path[[0, 256, 512, 768, 1024]])
    few = path[:200]
    assert thinned(few) is few
    damaged = path.copy()
    damaged[300, 2] = np.nan
    assert np.isnan(thinned(damaged)).any()  # and is refused where it is judged
