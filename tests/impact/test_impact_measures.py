"""Measures of records whose force is known, of several contacts, and of preloaded records."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactProblem, EnergyLedger, ImpactResult, measures
from impact.after.histories import MOVING_AVERAGE, averaged, largest_averages
from impact.after.measures import MeasureError
from impact.after.result import RunRows

DT = 1e-6


def record(force: list[float], **changed: float) -> ImpactResult:
    n = len(force) + 1
    zero = np.zeros(n)
    ledger = EnergyLedger(zero, np.linspace(4.0, 1.0, n), zero, zero, zero, zero)
    rows = RunRows(DT, np.arange(n), np.array([0.0, *force]), np.linspace(1.0, 0.0, n), zero, zero, ledger)
    result = ImpactResult(
        rows, striker_mass=2.0, target_mass=math.inf, striker_velocity=-3.0, target_velocity=0.0, engine="none"
    )
    return replace(result, **changed)


def with_rows(result: ImpactResult, **changed: Any) -> ImpactResult:
    return replace(result, rows=replace(result.rows, **changed))


def test_averages_in_equal_steps_are_those_in_any_steps() -> None:
    """Also of windows longer than the record, and of whole numbers of steps."""
    rng = np.random.default_rng(1)
    for n, dt, width in ((1, 0.3, 0.1), (7, 1.0, 3.0), (40, 0.7, 2.3), (40, 0.1, 9.0)):
        force, time = rng.normal(size=(n, 3)), dt * np.arange(n + 1)
        np.testing.assert_allclose(largest_averages(force, dt, width), largest_averages(force, time, width), rtol=1e-12)
        integral = np.concatenate([[0.0], np.cumsum(force[:, 0]) * dt])
        after, before = (np.interp(time + shift, time, integral) for shift in (width / 2, -width / 2))
        average = averaged(force[:, 0], dt, width, MOVING_AVERAGE)
        np.testing.assert_allclose(average, (after - before) / width, atol=1e-12 * np.abs(integral).max() / width)


def test_groups_close_short_openings() -> None:
    force = [0.0] * 200
    for first, last in ((10, 20), (40, 50), (81, 90)):  # openings of 20 and 31 steps
        force[first:last] = [1.0] * (last - first)
    result = record(force)
    np.testing.assert_allclose(measures.contact_groups(result), DT * np.array([[10, 50], [81, 90]]))
    assert len(measures.contact_groups(result, merge=10e-6)) == 3
    np.testing.assert_allclose(measures.contact_groups(result, merge=40e-6), DT * np.array([[10, 90]]))
    assert len(measures.contact_groups(result, merge=19.5e-6)) == 3  # an opening of exactly the limit ends the group
    closed_at_the_ends = measures.contact_intervals(record([1.0, 0.0, 1.0]))
    np.testing.assert_allclose(closed_at_the_ends, DT * np.array([[0, 1], [2, 3]]))
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
    with pytest.raises(MeasureError, match=r"1e-06 s.*dt <= 9.5e-07"):
        measures.filtered_force(result, 1.9 * DT)


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


SPRING = Body(impact.spring(stiffness=1e12))


def between(law: impact.Law, duration: float = 1.0, dt: float = 1e-4) -> ImpactResult:
    """Run a mass between a seat at once and a stopper a bit further; a second seat is never reached."""
    contacts = [Contact(SPRING, gap=0.01, law=law), Contact(SPRING, gap=0.05, law=law, side=-1)]
    contacts.append(Contact(SPRING, gap=1.0, law=law))
    striker = impact.rigid_mass(mass=0.5, velocity=-1.0)
    return impact.solve(ContactProblem(striker, contacts=contacts), dt=dt, duration=duration)


def test_every_measure_asks_one_contact() -> None:
    result = between(impact.LinearSpring(stiffness=1e4))
    for measure in (
        measures.impulse,
        measures.peak_force,
        measures.contact_intervals,
        measures.contact_groups,
        measures.impact_velocity,
        measures.rebound_velocity,
        measures.spectrum,
        measures.work,
    ):
        with pytest.raises(MeasureError, match=r"3 contacts:.*contact=0 \.\.\. 2"):
            measure(result)
        with pytest.raises(MeasureError, match=r"contact = 3.*0 \.\.\. 2:.*3"):
            measure(result, contact=3)
        one = measures.select_contact(result, 1)
        np.testing.assert_array_equal(np.asarray(measure(result, contact=1)).shape, np.asarray(measure(one)).shape)
    assert measures.impulse(result, contact=1) == pytest.approx(np.sum(result.force[:, 1]) * 1e-4, rel=1e-13)
    assert measures.peak_force(result, contact=1) == result.force[:, 1].max()
    seat, stopper = (measures.contact_intervals(result, contact=c) for c in (0, 1))
    assert seat[0, 0] < stopper[0, 0] < seat[1, 0]


def test_a_contact_that_never_closes() -> None:
    result = between(impact.LinearSpring(stiffness=1e4))
    assert measures.impulse(result, contact=2) == measures.peak_force(result, contact=2) == 0.0
    assert measures.filtered_peak_force(result, 1e-3, contact=2) == 0.0
    assert measures.filtered_peak_force(result, 1e-3, contact=2, window="hann") == 0.0
    assert (
        measures.contact_intervals(result, contact=2).shape
        == measures.contact_groups(result, contact=2).shape
        == (0, 2)
    )
    assert math.isnan(measures.impact_velocity(result, contact=2))
    assert math.isnan(measures.rebound_velocity(result, contact=2))
    assert measures.work(result, contact=2) == measures.Work(0.0, 0.0)
    assert not np.any(measures.spectrum(result, contact=2)[1])
    with pytest.raises(MeasureError, match="no contact in this record"):
        measures.restitution(result, contact=2)


def test_speeds_before_and_after_a_lossy_contact() -> None:
    """A mass leaves Hunt-Crossley at d V = 1/2 with 0.748435 V, and the stopper with less by its own loss."""
    result = between(impact.HuntCrossley(stiffness=1e6, damping=0.5), duration=0.15, dt=2e-5)
    e = 0.748434931597
    assert measures.impact_velocity(result, contact=0) == pytest.approx(1.0, rel=1e-9)
    # first order in the step, which is 1/500 of the contact
    assert measures.rebound_velocity(result, contact=0) == pytest.approx(e, abs=5e-3)
    assert measures.impact_velocity(result, contact=1) == pytest.approx(
        measures.rebound_velocity(result, contact=0), rel=1e-6
    )
    assert measures.impulse(result, contact=0) == pytest.approx(
        0.5 * (1 + measures.rebound_velocity(result, contact=0)), rel=1e-6
    )
    # kinetic energy gained and lost by the striker at each
    speeds = [1.0, measures.rebound_velocity(result, contact=0), measures.rebound_velocity(result, contact=1)]
    for contact in (0, 1):
        work = measures.work(result, contact=contact)
        assert work.striker == pytest.approx(0.25 * (speeds[contact + 1] ** 2 - speeds[contact] ** 2), rel=1e-6)
        assert abs(work.target) < 1e-3 * abs(work.striker)  # the targets are all but rigid
    assert measures.total_impulse(result) == pytest.approx(0.5 * (1.0 - speeds[2]), rel=1e-6)
    with pytest.raises(MeasureError, match="several contacts"):
        measures.restitution(result, contact=0)


def test_restitution_and_peak_of_each_blow_of_a_held_reed() -> None:
    """A mode without damping: it comes back as fast as it left, so that each blow is told by the speeds around it."""
    reed = impact.single_mode(frequency_hz=20.0, mass=0.1)
    release = impact.ModalState(np.array([math.sqrt(0.1) * 0.01]), np.zeros(1))
    pulse = impact.Load(np.array([1 / math.sqrt(0.1)]), lambda t: np.where((t > 0.03) & (t < 0.04), -20.0, 0.0))
    law = impact.HuntCrossley(stiffness=1e6, damping=0.2)
    body = Body(reed, state=release, loads=(pulse,))
    result = impact.solve(ContactProblem(body, SPRING, law=law), dt=1e-5, duration=0.1)
    groups, gap, dt = measures.contact_groups(result), result.gap, result.dt
    assert len(groups) >= 3
    for number, (start, end) in enumerate(groups[:3]):
        first, last = (round(time / dt) for time in (start, end))
        closing, parting = gap[first - 1] - gap[first], gap[last + 1] - gap[last]
        assert measures.restitution(result, group=number) == pytest.approx(parting / closing, rel=0.01)
    hardest = int(np.argmax([result.force[round(a / dt) : round(b / dt) + 1].max() for a, b in groups]))
    assert 0 < hardest == measures.hardest_group(result, 1e-4)[0]
    at = measures.peak_time(result, 1e-4)
    assert groups[hardest, 0] < at < groups[hardest, 1]
    top = result.force[round((at - 5e-5) / dt) + 1 : round((at + 5e-5) / dt) + 1].mean()
    assert top == pytest.approx(measures.filtered_peak_force(result, 1e-4), rel=1e-3)
    with pytest.raises(MeasureError, match=rf"group = 99: .*{len(groups)}"):
        measures.restitution(result, group=99)
    assert math.isnan(measures.peak_time(replace(result, rows=replace(result.rows, force=0 * result.force)), 1e-4))


def test_contact_from_the_first_step() -> None:
    """The approach of free bodies is their translation, a stopper's as well; that of held bodies is not recorded."""
    law = impact.LinearSpring(stiffness=100.0)
    for side in (1, -1):
        striker = impact.rigid_mass(mass=1.0, velocity=-2.0 * side)
        problem = ContactProblem(striker, contacts=[Contact(SPRING, law=law, side=side)])
        assert measures.impact_velocity(impact.solve(problem, dt=1e-3, duration=0.1)) == 2.0
    mode = impact.single_mode(frequency_hz=20.0, mass=0.1)
    held = Body(mode, state=impact.ModalState(np.zeros(1), np.array([-0.1])))
    result = impact.solve(ContactProblem(held, SPRING, law=law), dt=1e-3, duration=0.01)
    assert math.isnan(measures.impact_velocity(result))
    with pytest.raises(MeasureError, match="still in contact"):
        measures.rebound_velocity(result)


def test_a_side_that_cannot_be_told_is_not_guessed() -> None:
    resting = with_rows(record(np.ones(5)), gap=np.zeros(6))
    for measure in (measures.total_impulse, measures.work):
        with pytest.raises(MeasureError, match="seat or a stopper"):
            measure(resting)
    steps = np.arange(6.0)
    rows = replace(resting.rows, gap=steps, target_displacement=-steps)
    receding = replace(resting, rows=rows)  # a seat that gives way, under a striker at rest
    assert measures.total_impulse(receding) == pytest.approx(measures.impulse(receding))


def test_spectrum_is_the_transform_of_the_stepwise_force() -> None:
    """Amplitudes are the integrals of exp(-2 pi i f t) over the steps, on any grid."""
    force = np.random.default_rng(3).uniform(0, 1, 37)
    result = record(force)
    frequency, amplitude = measures.spectrum(result)
    assert frequency[1] == pytest.approx(1 / (37 * DT))
    time = result.time
    for f, value in zip(frequency[1:], amplitude[1:], strict=True):
        phases = np.exp(-2j * np.pi * f * time)
        integral = np.sum(force * np.diff(phases)) / (-2j * np.pi * f)
        assert value == pytest.approx(abs(integral), rel=1e-10)
    closer, finer = measures.spectrum(result, resolution=0.3 / (37 * DT))
    assert np.diff(closer).max() == pytest.approx(1 / (124 * DT))  # 37/0.3 and up
    assert (amplitude[0], finer[0]) == pytest.approx([measures.impulse(result)] * 2, rel=1e-13)
    for resolution in (0.0, -1.0, math.nan):
        with pytest.raises(MeasureError, match="must be positive"):
            measures.spectrum(result, resolution=resolution)
    with pytest.raises(MeasureError, match="no steps"):
        measures.spectrum(record(np.zeros(0)))


@pytest.mark.parametrize("width", [2.0, 5.0, 12.3, 80.0])
def test_hann_average_against_quadrature(width: float) -> None:
    """The average is the integral of N(t - s) (1 + cos(2 pi s/w))/w by 2,000 midpoints a step."""
    force = np.random.default_rng(4).uniform(0, 1, 25)
    result = record(force)
    filtered = measures.filtered_force(result, width * DT, window="hann")
    assert filtered.shape == (26,)
    fine = np.repeat(force, 2000)
    middle = (np.arange(fine.size) + 0.5) / 2000
    for m in (0, 3, 12, 25):
        s = m - middle
        weight = np.where(np.abs(s) < width / 2, (1 + np.cos(2 * np.pi * s / width)) / width, 0.0)
        assert filtered[m] == pytest.approx(np.sum(fine * weight) / 2000, abs=1e-6)
