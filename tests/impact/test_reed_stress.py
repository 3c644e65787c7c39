"""Bending stress of a reed: statics with any number of modes, free vibration, and the impact of a long beam."""

import math
from functools import partial

import numpy as np
import pytest

import impact
from impact.after.histories import StressError
from impact.after.stresses import bending_stress, peak_bending_stress, reed_stress
from impact.bodies.body import Body
from impact.greens.base import GreensFunctionError

BEAM = impact.Cantilever(young=200e9, density=7850.0, length=25.4e-3, width=10e-3, thickness=0.305e-3)
X = np.linspace(0.0, BEAM.length, 23)


def reed(n_modes: int, **more: object) -> Body:
    return impact.reed(BEAM, n_modes=n_modes, **more)  # type: ignore[arg-type]


def test_release_from_the_static_shape() -> None:
    """The start has 3 E (h/2) d (L - x)/L^3, less 2/(pi n)^2 of the largest at the clamp by n modes."""
    top = 1.5 * BEAM.young * BEAM.thickness * 1e-3 / BEAM.length**2
    for n in (5, 40):
        body = reed(n, release=impact.StaticShape(1e-3))
        start = bending_stress(np.zeros(2), 1e-9, body, BEAM, X)[:, 0]
        missing = (start / top - (1 - X / BEAM.length)) * (math.pi * n) ** 2
        assert abs(missing[0]) == pytest.approx(2, rel=0.05)
        assert np.abs(missing).max() < 8
    peak = peak_bending_stress(np.zeros(2), 1e-9, body, BEAM)
    assert (peak.at, peak.time) == (0.0, pytest.approx(0.0, abs=1e-9))
    assert peak.value == pytest.approx(top, rel=2e-4)


@pytest.mark.parametrize("at", [None, 0.6 * BEAM.length])
@pytest.mark.parametrize("n", [1, 3, 30])
def test_a_steady_force_gives_the_static_stress_with_any_number_of_modes(n: int, at: float | None) -> None:
    """Stress is 6 N (a - x)/(b h^2) up to the contact and none beyond, once damping has ended the motion."""
    body = reed(n, contact_at=at, damping_ratio=1.0)
    force, dt = np.full(4001, 3.0), 6e-6
    force[0] = 0.0
    a = BEAM.length if at is None else at
    exact = 6 * 3.0 * np.maximum(a - X, 0.0) / (BEAM.width * BEAM.thickness**2)
    stress = bending_stress(force, dt, body, BEAM, X, contact_at=at)
    np.testing.assert_allclose(stress[:, -1], exact, atol=1e-9 * exact.max())
    assert not np.any(stress[:, 0])


@pytest.mark.parametrize("at", [None, 0.6 * BEAM.length])
def test_a_load_at_the_contact_bends_as_a_contact_force_does(at: float | None) -> None:
    """Few modes, which alone miss a tenth of the stress beside the contact; a preload holds it from the start on."""
    a = BEAM.length if at is None else at
    load = impact.PointForce(lambda t: np.full_like(t, 3.0), at=a)
    body = reed(3, contact_at=at, damping_ratio=1.0, loads=(load,))
    exact = 6 * 3.0 * np.maximum(a - X, 0.0) / (BEAM.width * BEAM.thickness**2)
    stress = bending_stress(np.zeros(4001), 6e-6, body, BEAM, X, contact_at=at)
    np.testing.assert_allclose(stress[:, -1], exact, atol=1e-9 * exact.max())
    held = bending_stress(np.full(9, -3.0), 1e-6, body, BEAM, X, contact_at=at)
    np.testing.assert_allclose(held, 0.0, atol=1e-9 * exact.max())


def test_free_vibration_in_one_mode() -> None:
    """Stress is (E h/2) w'' cos(omega t), with w'' by differences of the shape; its peak is at the clamp."""
    body, k = reed(6, release=impact.ModeShape(3, 1e-4)), 2
    omega = float(BEAM.frequencies(6)[k])
    dt = 0.01 / omega
    times = dt * np.arange(1001)
    h = 1e-5
    inner = X[1:-1]
    a, b, c = (BEAM.shapes(6, inner + s)[k] for s in (-h, 0.0, h))
    amplitude = 1e-4 / float(BEAM.shapes(6, BEAM.length)[k])
    exact = BEAM.young * BEAM.thickness / 2 * amplitude * np.outer((a - 2 * b + c) / h**2, np.cos(omega * times))
    stress = bending_stress(np.zeros(1001), dt, body, BEAM, inner)
    np.testing.assert_allclose(stress, exact, atol=1e-4 * np.abs(exact).max())
    peak = peak_bending_stress(np.zeros(1001), dt, body, BEAM)
    clamp = BEAM.young * BEAM.thickness / 2 * abs(amplitude) * 2 * (2.5 * math.pi / BEAM.length) ** 2 / BEAM.mass**0.5
    assert peak.value == pytest.approx(clamp, rel=1e-3)
    assert peak.at == 0.0


def test_impossible_stress_is_refused() -> None:
    two = reed(4, contact_at=(0.01, 0.02))
    with pytest.raises(StressError, match=r"force \(5,\).*2 contacts"):
        bending_stress(np.zeros(5), 1e-6, two, BEAM, X)
    with pytest.raises(StressError, match=r"contact_at .*1 .*2 contacts"):
        bending_stress(np.zeros((5, 2)), 1e-6, two, BEAM, X)
    with pytest.raises(StressError, match=r"force \(5, 2\)"):
        bending_stress(np.zeros((5, 2)), 1e-6, reed(4), BEAM, X)
    with pytest.raises(StressError, match=r"bending.*cantilever_reed"):
        bending_stress(np.zeros(5), 1e-6, Body(impact.fixed_rod(young=1, density=1, area=1, length=1)), BEAM, X)
    with pytest.raises(StressError, match="has no modes"):
        bending_stress(np.zeros(5), 1e-6, Body(impact.spring(stiffness=1.0)), BEAM, X)
    with pytest.raises(GreensFunctionError, match=r"position 0.03 m is outside"):
        bending_stress(np.zeros(5), 1e-6, reed(4), BEAM, [0.03])


def test_the_start_and_a_landing_cut_the_record() -> None:
    """A reed let go bends more on its way than at rest; a landing in mid-record has its own largest on both sides."""
    body = impact.reed(BEAM, n_modes=8, release=impact.StaticShape(1e-3), contact_at=0.6 * BEAM.length)
    force, dt, since = np.zeros(1501), 5e-7, 4e-4
    force[200:230], force[801:850] = 0.2, 1.0  # a light touch first; the landing begins at step 800
    find = partial(reed_stress, force, dt, body, BEAM, contact_at=0.6 * BEAM.length)
    peaks = find(since=since)
    places = np.linspace(0, BEAM.length, 8 * 8 + 1)
    field = np.abs(bending_stress(force, dt, body, BEAM, places, contact_at=0.6 * BEAM.length)).max(axis=0)
    values = [peak.value for peak in (peaks.at_start, peaks.initial, peaks.before_landing, peaks.after_landing)]
    np.testing.assert_allclose(values, [field[0], field[:200].max(), field[:801].max(), field[801:].max()], rtol=1e-9)
    assert peaks.after_contact.value == pytest.approx(field[200:].max(), rel=1e-9)
    assert peaks.at_start.time == 0.0
    assert peaks.before_landing.time <= since < peaks.after_landing.time
    assert find(since=since - 1e-12).after_landing == peaks.after_landing
    alone = find()
    assert (alone.initial, alone.after_contact, alone.at_start) == (peaks.initial, peaks.after_contact, peaks.at_start)
    assert not alone.before_landing.is_known
    assert not alone.after_landing.is_known
