"""Steps of different lengths, and histories at fine steps that are made from them."""

import numpy as np
import pytest

from impact import ContactError
from impact.march import grid
from impact.march.grid import TimeGrid

STEPS = TimeGrid(1e-3, np.array([0, 1, 2, 6, 22]))
MOVED = np.array([0.0, 1.0, 2.0, 6.0, 22.0])  # on one line


def test_a_force_is_constant_over_a_step_and_a_motion_is_a_line() -> None:
    np.testing.assert_array_equal(STEPS.spread_forces(MOVED), [0, 1, 2, 6, 6, 6, 6, *[22] * 16])
    np.testing.assert_allclose(STEPS.spread_motions(MOVED), np.arange(23.0))
    np.testing.assert_array_equal(STEPS.spread_forces(MOVED, 2, 4), [2, 6, 6])
    np.testing.assert_allclose(
        STEPS.find_motions(np.stack([MOVED, -MOVED], axis=1), np.array([4, 14]))[:, 1], [-4, -14]
    )


@pytest.mark.parametrize(
    ("start", "stop", "rows", "times"),
    [
        (0, 22, [1, 2, 3, 4], [0, 1, 2, 6, 22]),
        (1, 6, [2, 3], [1, 2, 6]),
        (3, 5, [3], [3, 5]),
        (3, 7, [3, 4], [3, 6, 7]),
        (6, 7, [4], [6, 7]),
    ],
)
def test_rows_of_a_window_with_the_times_of_their_parts(
    start: int, stop: int, rows: list[int], times: list[float]
) -> None:
    cut, edges = STEPS.cut(start, stop)
    assert np.arange(5)[cut].tolist() == rows
    assert STEPS.until(stop).ends[-1] == stop
    np.testing.assert_allclose(edges, 1e-3 * np.array(times))


def test_a_history_that_would_not_fit_is_refused_and_its_windows_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid, "MOST_BYTES", 8.0 * 10)
    with pytest.raises(ContactError, match=r"0 to 22 .*window"):
        STEPS.spread_forces(MOVED)
    assert len(STEPS.spread_forces(MOVED, 3, 12)) == 10
    with pytest.raises(ContactError, match=r"0 to 23.*22 steps"):
        STEPS.spread_motions(MOVED, 0, 23)
