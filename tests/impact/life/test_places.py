"""The worst of several places and planes, under one axis and several. All strengths are invented."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from impact.exact.contact_stress import hertz_circular, hertz_stiffness
from impact.life.damage import Goodman
from impact.life.multiaxial import Crossland, hertz_path
from impact.life.places import STRAIGHT, Demand, judged, margin_error, normal_stresses, resolve_on_planes, thin_history
from impact.life.strength import LifeError, Strength, basquin

INVENTED = Strength("invented for tests", ultimate=1800e6, curve=basquin(400e6, 1e7, 12.0, scatter=0.25))
DEMAND = Demand(INVENTED, Goodman(1800e6), 4.5e9, 0.999)
WALK = 40e6 * np.cumsum(np.random.default_rng(7).standard_normal(400)) / 5


def margin(history: np.ndarray, demand: Demand = DEMAND) -> float:
    life = judged([("root", history)], demand).life
    return life.margin


def test_a_block_taken_twice_has_half_the_life_and_time_no_direction() -> None:
    once, twice, back = (judged([("root", h)], DEMAND).life for h in (WALK, np.tile(WALK, 2), WALK[::-1]))
    assert twice.blocks == pytest.approx(once.blocks / 2, rel=1e-12)
    assert (back.blocks, back.margin) == pytest.approx((once.blocks, once.margin), rel=1e-12)


def test_the_bar_of_a_margin_is_that_of_histories_at_the_end_of_theirs() -> None:
    """The bar is the larger deviation of the margins at stresses 1 - b and 1 + b."""
    here, bar = margin(WALK), 0.07
    off = [abs(margin(factor * WALK) - here) for factor in (1 - bar, 1 + bar)]
    assert margin_error(here, bar) == pytest.approx(max(off), rel=1e-9)
    assert margin_error(here, 1.0) == np.inf


def test_the_worst_place_is_found_by_its_mean_too() -> None:
    """The place in tension is worse than one of equal amplitude in compression and one without a mean."""
    wave = 100e6 * np.cos(np.linspace(0, 2 * np.pi, 101))
    worst = judged([("pressed", wave - 300e6), ("pulled", wave + 300e6), ("even", 0.9 * wave)], DEMAND)
    assert worst.at == "pulled"
    assert worst.life.margin == pytest.approx(1 / (0.1 / INVENTED.curve.stress(4.5e9, 0.999) * 1e9 + 300 / 1800))  # type: ignore[union-attr]


def test_tensors_are_judged_beside_and_only_where_a_criterion_is_stated() -> None:
    wave = np.cos(np.linspace(0, 2 * np.pi, 101))
    bending = np.zeros((101, 6))
    bending[:, 0] = 250e6 * wave
    both = [("root", 100e6 * wave), ("fillet", bending), ("flank", 0.5 * bending)]
    worst = judged(both, replace(DEMAND, several_axes=Crossland(310e6, 500e6)))
    assert (worst.at, worst.tensor_at) == ("root", "fillet")
    assert worst.tensor_margin == pytest.approx(2.0, rel=1e-6)
    with pytest.raises(LifeError, match=r"fillet: .*several axes"):
        judged(both, DEMAND)


def test_nothing_to_judge() -> None:
    assert judged([], DEMAND).at == ""
    at_rest = judged([("root", np.full(5, 3e6))], DEMAND)
    assert at_rest.life.margin == np.inf
    with pytest.raises(LifeError, match=r"root: .*mean stress"):
        judged([("root", np.full(5, 3e6))], replace(DEMAND, judge=None))


def test_a_contact_of_hertz_at_its_largest_force() -> None:
    """The last tensors are those on the axis of the whole contact; every criterion sees half of the way there."""
    force, modulus, radius = 20.0, 110e9, 5e-3
    whole = hertz_circular(force=force, reduced_modulus=modulus, radius=radius)
    stiffness = hertz_stiffness(reduced_modulus=modulus, radius=radius)
    paths = dict(hertz_path(force, stiffness=stiffness, modulus=modulus, poisson=0.3))
    top = paths["0 um below the contact"]
    np.testing.assert_allclose(top[-1, 2], -whole.pressure, rtol=1e-12)
    np.testing.assert_allclose(top[-1, :2], -0.8 * whole.pressure, rtol=1e-12)  # (1 + 2 nu)/2
    shear = {name: abs(path[-1, 2] - path[-1, 0]) / 2 for name, path in paths.items()}
    deepest = max(shear, key=lambda name: shear[name])
    assert shear[deepest] == pytest.approx(0.310 * whole.pressure, rel=2e-3)
    assert float(deepest.split()[0]) == pytest.approx(0.481e6 * whole.half_width, rel=0.05)  # the next depth: 8 %
    worst = judged(paths.items(), replace(DEMAND, judge=None, several_axes=Crossland(310e6, 500e6)))
    assert worst.tensor_at == deepest
    with pytest.raises(LifeError, match="under -1 N"):
        list(hertz_path(-1.0, stiffness=stiffness, modulus=modulus))


PLACES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def proportional(course: np.ndarray, tensor: np.ndarray) -> np.ndarray:
    return np.outer(course, [tensor[place] for place in PLACES])


def plane_margin(stress: np.ndarray) -> float:
    return judged(resolve_on_planes([("root", stress)]), DEMAND).life.margin


@pytest.mark.parametrize("seed", range(4))
def test_one_axis_however_it_lies(seed: int) -> None:
    turn = Rotation.random(rng=seed).as_matrix()
    stress = proportional(WALK, turn @ np.diag([1.0, 0, 0]) @ turn.T)
    assert plane_margin(stress) == pytest.approx(margin(WALK), rel=1e-9)


@pytest.mark.slow
def test_torsion_is_judged_by_its_principal_stress_and_pressure_by_its_own() -> None:
    shear = np.zeros((3, 3))
    shear[0, 1] = shear[1, 0] = 1.0
    both = min(margin(WALK), margin(-WALK))  # tension on one plane, compression on the other
    assert plane_margin(proportional(WALK, shear)) == pytest.approx(both, rel=1e-9)
    assert plane_margin(proportional(WALK, np.eye(3))) == pytest.approx(margin(WALK), rel=1e-9)


def test_a_stress_that_turns_is_right_within_the_grid() -> None:
    """Bending with torsion 90 degrees behind, ta = sa/2: on the plane at angle a off the axis the amplitude is
    sa sqrt(cos^4 a + sin^2 a cos^2 a) = sa |cos a|, so that the axis' own plane is the worst."""
    time = 2 * np.pi * np.arange(720) / 720
    stress = np.zeros((720, 6))
    stress[:, 0], stress[:, 5] = 250e6 * np.sin(time), 125e6 * np.cos(time)
    expected = 1 / (250e6 / INVENTED.curve.stress(4.5e9, 0.999))  # type: ignore[union-attr]
    assert plane_margin(stress) == pytest.approx(expected, rel=0.008)
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
    assert plane_margin(flat) == pytest.approx(plane_margin(turned), rel=0.016)
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
    corners = thin_history(history)
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
    np.testing.assert_array_equal(thin_history(path), path[[0, 256, 512, 768, 1024]])
    few = path[:200]
    assert thin_history(few) is few
    damaged = path.copy()
    damaged[300, 2] = np.nan
    assert np.isnan(thin_history(damaged)).any()  # and is refused where it is judged
