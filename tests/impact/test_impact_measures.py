"""Measures of a record whose force is known."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from impact import EnergyLedger, ImpactResult, measures
from impact.after.measures import MeasureError
from impact.after.result import RunRows

DT = 1e-6


def record(force: list[float], **changed: float) -> ImpactResult:
    n = len(force) + 1
    zero = np.zeros(n)
    ledger = EnergyLedger(zero, np.linspace(4.0, 1.0, n), zero, zero, zero, zero)
    rows = RunRows(DT, np.arange(n), np.array([0.0, *force]), np.linspace(1.0, 0.0, n), zero, zero, ledger)
    result = ImpactResult(
        rows,
        striker_mass=2.0,
        target_mass=math.inf,
        striker_velocity=-3.0,
        target_velocity=0.0,
        engine="none",
    )
    return replace(result, **changed)


def with_rows(result: ImpactResult, **changed: Any) -> ImpactResult:
    return replace(result, rows=replace(result.rows, **changed))


def test_intervals_span_whole_steps() -> None:
    result = record([0.0, 2.0, 5.0, 0.0, 1.0])
    np.testing.assert_allclose(measures.contact_intervals(result), DT * np.array([[1, 3], [4, 5]]))
    assert measures.contact_intervals(record([0.0, 0.0])).shape == (0, 2)
    np.testing.assert_allclose(measures.contact_intervals(record([1.0])), DT * np.array([[0, 1]]))


def test_groups_close_short_openings() -> None:
    force = [0.0] * 200
    for first, last in ((10, 20), (40, 50), (81, 90)):  # openings of 20 and 31 steps
        force[first:last] = [1.0] * (last - first)
    result = record(force)
    np.testing.assert_allclose(measures.contact_groups(result), DT * np.array([[10, 50], [81, 90]]))
    assert len(measures.contact_groups(result, merge=10e-6)) == 3
    np.testing.assert_allclose(measures.contact_groups(result, merge=40e-6), DT * np.array([[10, 90]]))
    # an opening of exactly the limit ends the group
    assert len(measures.contact_groups(result, merge=19.5e-6)) == 3
    assert measures.contact_groups(record([0.0] * 5)).shape == (0, 2)


def test_filtered_force_is_the_exact_average() -> None:
    """A pulse of two steps becomes its exact average by windows of two, four and five steps."""
    result = record([0.0, 0.0, 6.0, 6.0, 0.0, 0.0])
    np.testing.assert_allclose(measures.filtered_force(result, 2 * DT), [0, 0, 3, 6, 3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(measures.filtered_force(result, 4 * DT), [0, 1.5, 3, 3, 3, 1.5, 0], atol=1e-12)
    # odd width: [t - 2.5, t + 2.5] steps
    np.testing.assert_allclose(
        measures.filtered_force(result, 5 * DT), np.array([0.5, 1.5, 2, 2, 2, 1.5, 0.5]) * 1.2, atol=1e-12
    )
    assert measures.filtered_peak_force(result, 2 * DT) == pytest.approx(6.0)


def test_the_filtered_peak_is_the_largest_of_any_place_of_the_window() -> None:
    """The window of the peak may begin anywhere: three steps hold two of 6 N, centred ones one."""
    result = record(np.array([0.0, 6.0, 0.0, 6.0, 0.0, 0.0]))
    assert measures.filtered_peak_force(result, 3 * DT) == pytest.approx(4.0)
    assert np.max(measures.filtered_force(result, 3 * DT)) == pytest.approx(3.0)
    rng = np.random.default_rng(7)
    force = rng.uniform(0, 1, 40) * (rng.random(40) < 0.5)
    fine = np.repeat(force, 200)  # every place, to 1/200 of a step
    for width in (2.0, 3.37, 7.5):
        count = round(200 * width)
        every = np.convolve(fine, np.ones(count)) / count
        assert measures.filtered_peak_force(record(force), width * DT) == pytest.approx(every.max(), rel=1e-9)


def test_filter_narrower_than_two_steps_is_refused() -> None:
    with pytest.raises(MeasureError, match=r"1e-06 s.*dt <= 9.5e-07"):
        measures.filtered_force(record([1.0, 2.0]), 1.9e-6)


def test_impact_velocity_before_first_contact() -> None:
    result = with_rows(record([0.0, 0.0, 1.0]), gap=np.array([9.0, 5.0, 2.0, 0.0]) * 1e-6)
    assert measures.impact_velocity(result) == pytest.approx(3.0)
    assert measures.impact_velocity(record([1.0, 0.0])) == 3.0  # at once: that of the free motion
    assert math.isnan(measures.impact_velocity(record([0.0, 0.0])))


def test_restitution_of_a_free_striker_from_the_impulse() -> None:
    result = record([0.0, 5e6, 5e6 / 2, 0.0])  # impulse 7.5, mass 2: -3 + 3.75 = 0.75
    assert measures.restitution(result) == pytest.approx(0.25)
    # a free target of mass 6 recoils by 1.25
    assert measures.restitution(replace(result, target_mass=6.0)) == pytest.approx((0.75 + 1.25) / 3)


def test_restitution_of_a_held_striker_from_its_energy() -> None:
    result = record([0.0, 1.0, 1.0, 0.0], striker_mass=math.inf, striker_velocity=0.0)
    stored = np.array([4.0, 4.0, 3.0, 1.0, 1.0])
    result = with_rows(result, energy=replace(result.energy, striker=stored))
    assert measures.restitution(result) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (record([0.0, 0.0]), "no contact in this record"),
        (record([0.0, 1.0]), "still in contact"),
        (record([1.0, 0.0], striker_velocity=0.0), "do not approach"),
        (record([0.0, 1.0], striker_mass=math.inf), "still in contact"),
        (
            with_rows(record([0.0, 1.0, 0.0], striker_mass=math.inf), energy=EnergyLedger(*[np.zeros(4)] * 6)),
            "no energy before the contact",
        ),
    ],
)
def test_restitution_that_does_not_exist_is_refused(result: ImpactResult, words: str) -> None:
    with pytest.raises(MeasureError, match=words):
        measures.restitution(result)


def test_the_largest_speed_of_closing_is_of_any_contact() -> None:
    """The largest of 1, 3 and 2 m/s, each over the last open step, is told; a reed that starts shut has later ones."""
    gap = 1e-6 * np.array([2.0, 1.0, 0.0, 0.0, 4.0, 3.0, 0.0, 0.0, 2.0, 0.0, 0.0])
    result = with_rows(record([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), gap=gap)
    assert measures.impact_velocity(result) == pytest.approx(1.0)
    assert measures.largest_impact_velocity(result) == pytest.approx(3.0)
    shut = with_rows(result, force=np.where(result.time < 2.5e-6, 1.0, result.force))
    assert math.isnan(measures.impact_velocity(shut))
    assert measures.largest_impact_velocity(shut) == pytest.approx(3.0)
    assert math.isnan(measures.largest_impact_velocity(record([0.0, 0.0])))
