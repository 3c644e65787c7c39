"""Means along a lip and in time, and the plane next to its gaps."""

import numpy as np
import pytest

from impact.after.histories import line_impulse, line_impulse_peak, per_length

ARCS, LENGTH, DT = 16, 0.04, 1e-7


def force() -> np.ndarray:
    """(n + 1, N) of a front that runs around, nothing at the ends of the record."""
    t, around = np.arange(401)[:, None], np.arange(ARCS)[None, :]
    return np.maximum(0.0, 3.0 - np.abs(t - 100 - 12 * around) / 10) * (t > 0)


def test_means_in_time_keep_the_impulse_of_each_arc() -> None:
    """The integral of a moving average is that of the force, as long as the force is zero near the ends."""
    found = per_length(force(), DT, 2e-6, LENGTH)
    assert found.shape == (401, ARCS)
    impulse = force()[1:].sum(axis=0) * DT
    np.testing.assert_allclose(found.sum(axis=0) * DT * LENGTH / ARCS, impulse, rtol=1e-12)
    assert 0.8 * 3.0 * ARCS / LENGTH < found.max() < 3.0 * ARCS / LENGTH


def test_impulse_per_length_goes_around_and_has_its_peak() -> None:
    share = 3 / ARCS
    pushed = force()[1:].copy()
    pushed[:, 5] *= 2.0
    values, places = line_impulse(pushed, DT, LENGTH, share)
    assert np.all(np.diff(places) > 0)
    assert values.mean() * LENGTH == pytest.approx(pushed.sum() * DT, rel=1e-12)
    peak, at = line_impulse_peak(pushed, DT, LENGTH, share)
    assert peak == values.max() == pytest.approx(4 / 3 * pushed[:, 4].sum() * DT * ARCS / LENGTH, rel=1e-9)
    assert at == places[np.argmax(values)]
    assert abs(at - 5.5 / ARCS) < 1.5 / ARCS  # one of the three parts that hold arc 5
