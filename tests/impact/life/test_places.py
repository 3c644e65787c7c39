"""The worst of several places, under one axis and several; maps of many points. All strengths are invented."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from impact.exact.contact_stress import hertz_circular, hertz_stiffness
from impact.life.damage import Goodman, damage, rainflow
from impact.life.multiaxial import Crossland, hertz_path
from impact.life.places import Demand, cycle_map, judged, margin_error, margin_map
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


SIZES = np.array([30.0, 100.0, 69.0, 71.0, 50.0, 120.0, 83.0, 84.1]) * 1e6
HISTORIES = SIZES[:, None] * np.random.default_rng(7).uniform(-1, 1, (8, 300))
HISTORIES *= (2 * SIZES / np.ptp(HISTORIES, axis=1))[:, None]


def judged_by_goodman(cycles: object) -> float:
    return damage(cycles, INVENTED, Goodman(1800e6))  # type: ignore[arg-type]


def blocks(size: int) -> Iterator[np.ndarray]:
    for first in range(0, 8, size):
        yield HISTORIES[first : first + size]


@pytest.mark.parametrize("size", [1, 3, 8])
def test_points_below_a_share_of_the_hot_spot_are_skipped(size: int) -> None:
    """Points below 0.7 x 120 = 84 MPa are skipped, however the points are cut into blocks."""
    mapped = cycle_map(blocks(size), judged_by_goodman)
    np.testing.assert_allclose(mapped.ranges, 2 * SIZES)
    assert np.flatnonzero(~np.isnan(mapped.values)).tolist() == [1, 5, 7]
    assert (mapped.skipped, mapped.share) == (5, 0.7)
    for k in (1, 5, 7):
        assert mapped.values[k] == judged_by_goodman(rainflow(HISTORIES[k]))


def test_what_is_no_map() -> None:
    with pytest.raises(LifeError, match="share = 2"):
        cycle_map(blocks(1), judged_by_goodman, 2.0)
    with pytest.raises(LifeError, match="no points"):
        cycle_map([], judged_by_goodman)
    with pytest.raises(LifeError, match="no points"):
        margin_map([], Crossland(310e6, 500e6))
    with pytest.raises(LifeError, match=r"not \(300,\)"):
        cycle_map([HISTORIES[0]], judged_by_goodman)
    spoiled = HISTORIES.copy()
    spoiled[5, 7] = np.nan
    with pytest.raises(LifeError, match="those of point 5"):
        cycle_map([spoiled[:4], spoiled[4:]], judged_by_goodman)
