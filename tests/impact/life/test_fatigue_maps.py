"""Maps: what one point at a time gives, in blocks; what is skipped is told."""

from collections.abc import Iterator

import numpy as np
import pytest

from impact.life.damage import Goodman, damage, rainflow
from impact.life.multiaxial import Crossland
from impact.life.places import cycle_map, margin_map
from impact.life.strength import LifeError, Strength, basquin

INVENTED = Strength("invented for tests", ultimate=1800e6, curve=basquin(400e6, 1e7, 12.0))
SIZES = np.array([30.0, 100.0, 69.0, 71.0, 50.0, 120.0, 83.0, 84.1]) * 1e6
HISTORIES = SIZES[:, None] * np.random.default_rng(7).uniform(-1, 1, (8, 300))
HISTORIES *= (2 * SIZES / np.ptp(HISTORIES, axis=1))[:, None]


def judged(cycles: object) -> float:
    return damage(cycles, INVENTED, Goodman(1800e6))  # type: ignore[arg-type]


def blocks(size: int) -> Iterator[np.ndarray]:
    for first in range(0, 8, size):
        yield HISTORIES[first : first + size]


@pytest.mark.parametrize("size", [1, 3, 8])
def test_points_below_a_share_of_the_hot_spot_are_skipped(size: int) -> None:
    """However the points are cut into blocks: 0.7 x 120 = 84 MPa."""
    found = cycle_map(blocks(size), judged)
    np.testing.assert_allclose(found.ranges, 2 * SIZES)
    assert np.flatnonzero(~np.isnan(found.values)).tolist() == [1, 5, 7]
    assert (found.skipped, found.share) == (5, 0.7)
    for k in (1, 5, 7):
        assert found.values[k] == judged(rainflow(HISTORIES[k]))


def test_a_share_of_nothing_skips_nothing() -> None:
    found = cycle_map(blocks(3), judged, 0.0)
    assert found.skipped == 0
    np.testing.assert_array_equal(found.values, [judged(rainflow(each)) for each in HISTORIES])


def test_margins_of_points() -> None:
    histories = np.random.default_rng(8).normal(size=(5, 40, 6)) * 1e8
    judge = Crossland(310e6, 500e6)
    found = margin_map([histories[:2], histories[2:]], judge)
    assert found.tolist() == [judge.margin(each) for each in histories]


def test_what_is_no_map() -> None:
    with pytest.raises(LifeError, match="share = 2"):
        cycle_map(blocks(1), judged, 2.0)
    with pytest.raises(LifeError, match="no points"):
        cycle_map([], judged)
    with pytest.raises(LifeError, match="no points"):
        margin_map([], Crossland(310e6, 500e6))
    with pytest.raises(LifeError, match=r"not \(300,\)"):
        cycle_map([HISTORIES[0]], judged)
    spoiled = HISTORIES.copy()
    spoiled[5, 7] = np.nan
    with pytest.raises(LifeError, match="those of point 5"):
        cycle_map([spoiled[:4], spoiled[4:]], judged)
