"""The worst of several places, under one axis and several. All strengths are invented."""

from dataclasses import replace

import numpy as np
import pytest

from impact.exact.contact_stress import hertz_circular, hertz_stiffness
from impact.life.damage import Goodman
from impact.life.multiaxial import Crossland, hertz_path
from impact.life.places import Demand, judged, margin_error
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
