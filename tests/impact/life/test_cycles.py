"""Rainflow counting against the standard's example, the package, and what counting must not change."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rainflow import extract_cycles

from impact.life.damage import Cycles, from_peak, rainflow, reversals
from impact.life.strength import LifeError

ASTM = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]
"""ASTM E1049-85, figure 6: the history of its example of rainflow counting."""


def round_to_millis(value: float) -> float:
    """Round to millis: differences whose products underflow escape the package."""
    return round(value, 3)


few_levels = arrays(np.float64, st.integers(1, 60), elements=st.integers(-5, 5).map(float))
histories = few_levels | arrays(np.float64, st.integers(1, 60), elements=st.floats(-1e9, 1e9).map(round_to_millis))


def rows(cycles: Cycles) -> list[tuple[float, float, float]]:
    """Return (range, mean, count), sorted."""
    return sorted(zip(cycles.ranges.tolist(), cycles.means.tolist(), cycles.counts.tolist(), strict=True))


def test_the_example_of_the_standard() -> None:
    """The counts are those of the standard's table; the means were found by hand."""
    cycles = rainflow(ASTM, repeated=False)
    expected = [(3, -0.5, 0.5), (4, -1, 0.5), (4, 1, 1), (6, 1, 0.5), (8, 0, 0.5), (8, 1, 0.5), (9, 0.5, 0.5)]
    assert rows(cycles) == expected
    by_range = Counter[float]()
    for size, _, count in rows(cycles):
        by_range[size] += count
    assert by_range == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


@pytest.mark.slow
@given(histories)
def test_the_loop_counts_as_the_package(history: np.ndarray) -> None:
    """The package counts the same cycles from the highest peak on, where its half cycles come in pairs."""
    counts = Counter[tuple[float, float]]()
    for size, mean, count, *_ in extract_cycles(from_peak(history)):
        counts[size, mean] += count
    assert counts == Counter((size, mean) for size, mean, _ in rows(rainflow(history)))


def test_turning_points_alone() -> None:
    assert reversals([1, 1, 2, 3, 3, 2, 2, 2, 4, 4]).tolist() == [1, 3, 2, 4]
    assert reversals([7, 7, 7]).tolist() == [7]
    for history in ([3.0], [7.0, 7.0]):
        assert rows(rainflow(history)) == rows(rainflow(history, repeated=False)) == []


@pytest.mark.parametrize("history", [[], [[1.0, 2.0]], [1.0, np.nan], [np.inf, 0.0]])
def test_what_is_no_history(history: list[float]) -> None:
    with pytest.raises(LifeError, match=r"one row|must be finite"):
        rainflow(history)


@pytest.mark.slow
@given(histories, st.integers(1, 5))
def test_plateaus_do_not_count(history: np.ndarray, samples: int) -> None:
    """Repeated values and values between two turning points add no cycles."""
    held = np.repeat(history, samples)
    between = np.insert(history, 1, (history[0] + history[min(1, len(history) - 1)]) / 2)
    assert rows(rainflow(held)) == rows(rainflow(history))
    np.testing.assert_allclose(np.sort(rainflow(between).ranges), np.sort(rainflow(history).ranges), rtol=1e-12)
