"""The noise of a record, estimated from the record: known noise of several courses on bodies with sharp resonances."""

import numpy as np
import pytest

import impact
from impact.greens.base import Array
from impact.measured.reading import deviation_by_coherence, estimate_deviation

BODY = impact.ModalGreens(
    2 * np.pi * np.array([2.3e3, 6.1e3, 11.8e3]),
    np.array([0.02, 0.015, 0.02]),
    2 * np.pi * np.array([[2.3e3 * 1.1e-4], [6.1e3 * 7e-5], [11.8e3 * 4.6e-5]]),
    impact.Residual.spring(2e-9),
)


@pytest.mark.parametrize("spacing", [5.0, 25.0, 100.0])  # half the width of the first resonance is 46 Hz
@pytest.mark.parametrize("size", [1e-5, 1e-3, 0.02])
@pytest.mark.parametrize("course", ["white", "steep", "of each line"])
def test_known_noise_is_found(spacing: float, size: float, course: str) -> None:
    f: Array = np.arange(50.0, 16e3, spacing)
    s = 2j * np.pi * f
    exact = BODY.transfer(s)[:, 0, 0] * s**2
    whole = np.sqrt(np.mean(np.abs(exact) ** 2))
    steep = 1 + 10 * (f / 16e3) ** 3
    shape = {"white": whole + 0 * f, "steep": whole * steep, "of each line": np.abs(exact)}[course]
    rng = np.random.default_rng(5)
    noise = size * shape * (rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))) / np.sqrt(2)
    ratio = estimate_deviation(exact + noise, f) / (size * shape)
    # 61 lines of about 10 degrees of freedom each, 15 of them alike: 40 independent ones tell it to 11 %
    assert 0.6 < np.median(ratio) < 1.5
    if course != "of each line":  # which a resonance, narrower than that, tells only where it stands out
        assert np.all(ratio > 0.6)
        assert np.all(ratio[5:] < 1.6)  # the lowest lines may count for less than they are worth, by a part that falls
        assert np.quantile(np.abs(np.log(ratio)), 0.9) < 0.35


def test_a_smooth_response_has_none() -> None:
    f: Array = np.arange(50.0, 16e3, 10.0)
    exact = BODY.transfer(2j * np.pi * f)[:, 0, 0]
    assert np.all(estimate_deviation(exact, f) < 1e-6 * np.abs(exact).max())


def test_noise_by_coherence_is_that_of_averaged_blows() -> None:
    """Ten blows with noise in the output: the scatter of H1 over many such records, and what their coherence says."""
    rng = np.random.default_rng(2)
    averages, records = 10, 4000
    force = rng.normal(size=(records, averages)) + 1j * rng.normal(size=(records, averages))
    noise = 0.5 * (rng.normal(size=force.shape) + 1j * rng.normal(size=force.shape))
    output = 3.0 * force + noise
    cross, power = (np.mean(each, axis=1) for each in (output * force.conj(), np.abs(force) ** 2))
    found = cross / power
    coherence = np.abs(cross) ** 2 / (power * np.mean(np.abs(output) ** 2, axis=1))
    stated = np.sqrt(np.mean(deviation_by_coherence(found, coherence, averages) ** 2))
    assert stated == pytest.approx(np.sqrt(np.mean(np.abs(found - 3.0) ** 2)), rel=0.12)  # n against n - 1, n - 2: 10 %
