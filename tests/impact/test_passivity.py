"""Passivity of step weights and the nearest passive samples: what is refused, what is found, what contact then does."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact.greens.base import GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.greens.passivity import passivity, repair, require_passive, work_increments
from impact.greens.sampled import SampledGreens

STEEL = {"young": 2e11, "density": 7850.0}
DT = 1e-6
SEAT = ModalGreens(
    2 * np.pi * np.array([2e4, 5.1e4, 9.3e4]),
    np.full(3, 0.02),
    np.array([[20.0], [16.0], [12.0]]),
    Residual.exponential(2e-9, 5e-4),
)


def seat_samples(n: int) -> np.ndarray:
    return SEAT.impulse_response(DT * np.arange(n))


def noisy(g: np.ndarray, level: float, seed: int) -> np.ndarray:
    out = g + level * np.abs(g).max() * np.random.default_rng(seed).normal(size=g.shape)
    out[..., 0] = g[..., 0]
    return out


def two_ports(zeta: float) -> ModalGreens:
    rng = np.random.default_rng(7)
    omega = np.sort(rng.uniform(1e4, 9e5, 8))
    return ModalGreens(omega, np.full(8, zeta), rng.normal(size=(8, 2)), Residual.none(2), ("a", "b"))


@pytest.mark.parametrize("factor", [1.0, 0.37, 7.3])
@pytest.mark.parametrize(
    "greens",
    [
        SEAT,
        replace(SEAT, zeta=np.zeros(3)),
        two_ports(0.0),
        two_ports(0.05),
        impact.rigid_mass(mass=0.05, velocity=0.0).greens,
        impact.spring(stiffness=1e6),
        impact.semi_infinite_rod(**STEEL, area=1e-4),
        impact.fixed_rod(**STEEL, area=1e-4, length=0.03),
        impact.free_rod(**STEEL, area=1e-4, length=0.03),
        impact.fixed_rod(**STEEL, area=1e-4, length=0.03, damping_ratio=0.05),
        impact.half_space_patch(**STEEL, poisson=0.3, radius=1e-3),
    ],
    ids=lambda g: type(g).__name__,
)
def test_what_is_passive_is_never_refused(greens, factor):
    report = passivity(greens, factor * DT, 1500)
    assert report.passive, report
    assert report.gain_per_cycle == 0.0
    assert "passive over 1500 steps" in str(report)


def modal_with(zeta: float, sign: float) -> np.ndarray:
    """Return the samples of the seat and one more oscillator at 30 kHz."""
    t = DT * np.arange(2000)
    omega = 2 * np.pi * 3e4
    return SEAT.impulse_response(t) + sign * 100 * np.exp(-zeta * omega * t) * np.sin(omega * t) / omega


@pytest.mark.parametrize(
    ("values", "frequency"),
    [
        (modal_with(0.01, -1.0), 3e4),  # wrong sign: gains at its own frequency
        (modal_with(-0.002, 1.0), 3e4),  # negative damping: gains on the flanks of its line
        (np.r_[np.zeros(5), seat_samples(1995)], None),  # late by 5 samples
        (noisy(seat_samples(2000), 0.3, 1), None),
    ],
    ids=["wrong sign", "negative damping", "time shift", "noise"],
)
def test_what_gains_energy_is_found(values, frequency):
    greens = SampledGreens(values, DT)
    report = passivity(greens, DT)
    assert not report.passive
    assert report.steps == 1999
    if frequency is not None:  # within 4 widths 1/(n dt) of a line of this record
        assert report.frequency == pytest.approx(frequency, abs=4 / (1999 * DT))
    with pytest.raises(GreensFunctionError, match=r"1999 steps.*J per cycle.*impact\.repair"):
        require_passive(greens, DT)
    require_passive(SampledGreens(seat_samples(2000), DT), DT)


def test_the_reported_gain_is_what_a_harmonic_force_nearly_draws():
    """The gain is 1.04 of the work of cos(omega t), summed by hand: the best force is shaped a little."""
    greens = SampledGreens(modal_with(0.05, -1.0), DT)
    report = passivity(greens, DT)
    n = report.steps
    force = np.cos(2 * np.pi * report.frequency * DT * np.arange(n))
    work = np.dot(force, np.convolve(work_increments(greens, DT)[0, 0], force)[:n])
    cycles = n * DT * report.frequency
    assert report.gain_per_cycle == pytest.approx(1.0400 * -work / cycles, rel=0.01)


@pytest.mark.slow
def test_two_ports_each_passive_but_not_together():
    """Equal and opposite forces draw work from g_12 = 1.1 g_11, though each port alone is passive."""
    g = seat_samples(150)
    values = np.einsum("ij,n->ijn", [[1.0, 1.1], [1.1, 1.0]], g)
    assert passivity(SampledGreens(g, DT), DT).passive
    pair = SampledGreens(values, DT)
    assert not passivity(pair, DT).passive
    assert passivity(repair(pair), DT).passive


def test_what_passivity_asks_for():
    with pytest.raises(GreensFunctionError, match="n is missing"):
        passivity(SEAT, DT)
    with pytest.raises(GreensFunctionError, match=r"n = 7.*least 1.*3"):
        passivity(np.ones(3), DT, 7)
    with pytest.raises(GreensFunctionError, match="finite"):
        passivity(np.array([1.0, np.nan]), DT)
    with pytest.raises(GreensFunctionError, match="subtract t/M"):
        repair(SampledGreens(seat_samples(50), DT, "rigid"))


def rebound(greens, steps: int, dt: float = DT, mass: float = 0.05):
    striker = impact.rigid_mass(mass=mass, velocity=-1.0)
    problem = impact.ContactProblem(striker, impact.Body(greens), law=impact.LinearSpring(1e8))
    result = impact.solve(problem, dt=dt, duration=steps * dt, rule="passive")
    share = result.energy.target / (0.5 * mass)
    return float(result.energy.striker[-1] / (0.5 * mass)), float(share.min())


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**31),
    level=st.floats(1e-4, 1.0),
    tail=st.sampled_from(["zero", "hold", "forbid"]),
    n=st.integers(60, 160),
    late=st.integers(0, 5),
    stride=st.integers(1, 3),
)
def test_repaired_kernels_never_gain_energy(seed, level, tail, n, late, stride):
    """Whatever the noise: the work the seat has received is never negative, nothing rebounds faster than it came."""
    g = noisy(np.r_[np.zeros(late), seat_samples(n - late)], level, seed)
    mended = repair(SampledGreens(g, DT, tail))
    steps = n - 1 if tail == "forbid" else 4 * n
    assert passivity(mended, DT, steps).passive
    rebounded, least = rebound(mended, steps // stride, stride * DT)
    assert least >= -1e-9
    assert rebounded <= 1 + 1e-9


@pytest.mark.slow
def test_unrepaired_contact_gains_energy():
    """The test above can fail: a seat that answers against the push sends the mass back faster than it came."""
    t = DT * np.arange(400)
    g = SEAT.impulse_response(t) - 3e-3 * np.sin(2 * np.pi * 3e3 * t)
    rebounded, least = rebound(SampledGreens(g, DT), 399)
    assert rebounded > 1.05
    assert least < -0.05
    rebounded, least = rebound(repair(SampledGreens(g, DT)), 399)
    assert rebounded <= 1 + 1e-9
    assert least >= -1e-9


@pytest.mark.slow
def test_repair_takes_off_a_mode_of_the_wrong_sign():
    """Repair brings (passive - intruder) five times nearer to the passive part and states its change."""
    g, truth = modal_with(0.002, -1.0), seat_samples(2000)
    mended = repair(SampledGreens(g, DT))
    assert np.linalg.norm(mended.values[0, 0] - truth) < np.linalg.norm(g - truth) / 5
    said = mended.provenance["repair"]
    change = np.abs(mended.values[0, 0] - g).max() / np.abs(g).max()
    assert said["change_of_peak"] == pytest.approx(change)
    assert mended.error_estimate.reduction == pytest.approx(change)
    assert "gains" in said["before"]
    assert json.loads(json.dumps(dict(mended.provenance))) == mended.provenance  # goes into files


def test_repair_for_a_step_within_the_spacing():
    """Linear interpolation adds images above the samples' Nyquist frequency; the repaired samples know them."""
    greens = SampledGreens(seat_samples(400), DT)
    assert passivity(greens, DT).passive
    assert not passivity(greens, 0.3 * DT).passive
    mended = repair(greens, 0.3 * DT)
    assert mended.dt == 0.3 * DT
    assert passivity(mended, 0.3 * DT).passive
