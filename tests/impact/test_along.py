"""Forces along a closed line: means over a part of it and a time, and where they are largest."""

import tracemalloc

import numpy as np
import pytest

from impact.after import histories
from impact.after.histories import line_force_peak, line_impulse_peak, over_arcs

LENGTH, DT = 0.03, 1e-7


def test_means_over_whole_arcs_and_parts_of_arcs() -> None:
    """The means are those summed by hand, around the end of the line, from each begin of an arc and up to each end."""
    force = np.array([[1.0, 2.0, 4.0, 8.0, 16.0]])
    begin = [1 + 2 + 4 / 2, 2 + 4 + 8 / 2, 4 + 8 + 16 / 2, 8 + 16 + 1 / 2, 16 + 1 + 2 / 2]
    end = [1 + 16 + 8 / 2, 2 + 1 + 16 / 2, 4 + 2 + 1 / 2, 8 + 4 + 2 / 2, 16 + 8 + 4 / 2]
    np.testing.assert_allclose(over_arcs(force, 0.5, 5.0), np.array([begin + end]) / 2.5, rtol=1e-14)
    np.testing.assert_allclose(over_arcs(force, 0.2, 5.0), np.tile(force, 2), rtol=1e-14)
    np.testing.assert_allclose(over_arcs(force, 1.0, 5.0), np.full((1, 10), 31 / 5), rtol=1e-14)
    np.testing.assert_allclose(over_arcs(force, 0.01, 5.0), np.tile(force, 2), rtol=1e-14)  # at least an arc


def test_no_part_of_the_line_has_a_larger_mean() -> None:
    """Brute force over parts that begin anywhere finds no larger mean, on a closed line and on an open one."""
    rng = np.random.default_rng(5)
    lengths, force, fine = rng.uniform(0.5, 2, 9), rng.uniform(0, 1, 9), 20_000
    borders = np.concatenate([[0], np.cumsum(lengths)])
    for share, closed in ((0.3, True), (0.3, False), (0.47, True)):
        width, whole = share * borders[-1], borders[-1]
        running = np.concatenate([[0], np.cumsum(np.tile(force, 2))])
        places = np.concatenate([borders, whole + borders[1:]])
        starts = np.linspace(0, whole if closed else whole - width, fine)
        each = np.interp(starts + width, places, running) - np.interp(starts, places, running)
        largest = over_arcs(force[None], share, lengths, ((9, closed),)).max()
        assert each.max() / width <= largest * (1 + 1e-12)
        assert largest == pytest.approx(each.max() / width, rel=1e-3)


def test_where_it_is_largest() -> None:
    """A force 1 + cos(th - t0) per radian has its largest mean about t0: 1 + sin(a)/a over a quarter, a = pi/4; arcs of
    2 pi/64 leave an eighth of the square of half of one."""
    arcs, top = 64, 2 * np.pi * 40 / 64
    th = 2 * np.pi * (np.arange(arcs) + 0.5) / arcs
    force = np.zeros((50, arcs))
    force[10:20] = (1 + np.cos(th - top)) * LENGTH / arcs
    expected = 1 + np.sin(np.pi / 4) / (np.pi / 4)
    peak, place = line_force_peak(force, DT, 10 * DT, LENGTH, 0.25)
    assert peak == pytest.approx(expected, rel=1e-3)
    assert place == pytest.approx(40 / 64, abs=1e-12)
    impulse, where = line_impulse_peak(force, DT, LENGTH, 0.25)
    assert impulse == pytest.approx(expected * 10 * DT, rel=1e-3)
    assert where == pytest.approx(40 / 64, abs=1e-12)


def test_a_long_run_is_averaged_in_blocks_and_its_memory_stays_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks take less memory than the force of 24 arcs and give the mean of all at once."""
    rng = np.random.default_rng(3)
    force, edges = rng.uniform(0, 1, (50_000, 24)), np.cumsum(rng.uniform(0.5, 2, 50_001)) * DT
    tracemalloc.start()
    largest = line_force_peak(force, edges, 300 * DT, LENGTH, 0.1)
    assert tracemalloc.get_traced_memory()[1] < force.nbytes
    tracemalloc.stop()
    monkeypatch.setattr(histories, "TOGETHER", 10**9)
    assert line_force_peak(force, edges, 300 * DT, LENGTH, 0.1) == pytest.approx(largest, rel=1e-13)


def test_uneven_arcs_are_weighed_by_their_lengths() -> None:
    """An even force per length is one, whatever the arcs and the part; arcs in halves change no whole ones."""
    lengths = np.array([1.0, 3.0, 2.0, 0.5, 1.5]) * 1e-3
    even = np.tile(lengths, (3, 1))
    for share in (0.01, 0.4, 0.77, 1.0):
        np.testing.assert_allclose(over_arcs(even, share, lengths), 1.0, rtol=1e-12)
    force = np.array([[1.0, 2.0, 4.0, 8.0, 16.0]])
    by_hand = np.array([[1 + 2, 2 + 4 / 2, 4 + 8 + 16, 8 + 16 + 1 + 2 / 3, 16 + 1 + 2 / 2]]) / 4e-3
    np.testing.assert_allclose(over_arcs(force, 0.5, lengths)[:, :5], by_hand, rtol=1e-12)
    halves = np.repeat(force / 2, 2, axis=1), np.repeat(lengths / 2, 2)
    np.testing.assert_allclose(over_arcs(halves[0], 0.5, halves[1])[:, :10:2], by_hand, rtol=1e-12)
    peak, place = line_force_peak(np.repeat(force, 3, axis=0), DT, DT, lengths, 0.5)
    assert peak == pytest.approx(by_hand.max(), rel=1e-12)
    assert place == pytest.approx((4 + 2) / 8, rel=1e-12)
