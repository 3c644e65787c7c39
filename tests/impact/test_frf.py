"""FRFs from CSV files: every quantity, unit and form gives the same receptance; noise estimated from the record."""

from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.base import Array
from impact.measured import frf

BODY = impact.single_mode(frequency_hz=1e3, mass=0.01, damping_ratio=0.05)
F = np.linspace(100.0, 3000.0, 30)
W = 2j * np.pi * F
G = BODY.transfer(W)[:, 0, 0]


def write(path: Path, header: str, f: np.ndarray, a: np.ndarray, b: np.ndarray) -> Path:
    rows = [",".join(f"{value:.12e}" for value in row) for row in zip(f, a, b, strict=True)]
    path.write_text("# analyser 7\n" + "\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("quantity", "unit", "order", "factor"),
    [
        ("receptance", "um/N", 0, 1e6),
        ("receptance", "m/N", 0, 1.0),
        ("mobility", "mm/(N s)", 1, 1e3),
        ("mobility", "m/s/N", 1, 1.0),
        ("accelerance", "m/s^2/N", 2, 1.0),
        ("accelerance", "1/kg", 2, 1.0),
        ("accelerance", "g/N", 2, 1 / 9.80665),
        ("accelerance", "1/g", 2, 1e-3),
        ("accelerance", "mm/(N s^2)", 2, 1e3),
    ],
)
def test_quantities_and_units(tmp_path: Path, quantity: str, unit: str, order: int, factor: float) -> None:
    h = G * W**order * factor
    header = f"frequency [kHz], {quantity} real [{unit}], {quantity} imag [{unit}]"
    read = frf.read_frf(write(tmp_path / "h.csv", header, F / 1e3, h.real, h.imag), port_name="lip")
    assert read.frequency == pytest.approx(F)
    assert read.receptance[:, 0, 0] == pytest.approx(G, rel=1e-9)
    assert read.port_names == ("lip",)
    for angle, unit_of_angle in ((np.angle(h), "rad"), (np.degrees(np.angle(h)), "deg")):
        header = f"frequency [Hz],{quantity} magnitude [{unit}],{quantity} phase [{unit_of_angle}]"
        read = frf.read_frf(write(tmp_path / "p.csv", header, F, np.abs(h), angle))
        assert read.receptance[:, 0, 0] == pytest.approx(G, rel=1e-9)


def test_bad_files(tmp_path: Path) -> None:
    header = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(frf.FrequencyResponseError, match=r"empty.csv:.*'frequency"):
        frf.read_frf(tmp_path / "empty.csv")
    with pytest.raises(frf.FrequencyResponseError, match=r"b.csv: frequency"):
        frf.read_frf(write(tmp_path / "b.csv", header, F[::-1], G.real, G.imag))
    with pytest.raises(frf.FrequencyResponseError, match=r"4 frequencies.*\(4, 1, 1\)"):
        frf.read_frf(write(tmp_path / "b.csv", header, F[:4], G.real[:4], G.imag[:4]))


def test_reciprocity_is_averaged_and_told_or_refused() -> None:
    two = np.empty((len(F), 2, 2), dtype=complex)
    two[:, 0, 0] = two[:, 1, 1] = G
    two[:, 0, 1], two[:, 1, 0] = 0.52 * G, 0.48 * G
    made = frf.FrequencyResponse(F, two, ("a", "b"))
    assert made.receptance[:, 0, 1] == pytest.approx(0.5 * G)
    # |G - G'|/(2 |G|) = sqrt(2) 0.04/(2 sqrt(2 + 0.52^2 + 0.48^2))
    assert made.origin["reciprocity_defect"] == pytest.approx(0.04 / np.sqrt(2 * (2 + 0.52**2 + 0.48**2)), rel=1e-9)
    two[:, 0, 1] = -0.48 * G
    with pytest.raises(frf.FrequencyResponseError, match=r"G_ij and G_ji differ by \d+%"):
        frf.FrequencyResponse(F, two, ("a", "b"))
    with pytest.raises(frf.FrequencyResponseError, match=r"30 values .*finite"):
        frf.FrequencyResponse(F, np.full(30, np.nan))


def test_free_bodies_are_told_by_their_lowest_lines() -> None:
    assert not frf.is_moving_away(frf.FrequencyResponse(F, G))
    assert frf.is_moving_away(frf.FrequencyResponse(F, G + 100 / W**2))


THREE_MODES = impact.ModalGreens(
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
    exact = THREE_MODES.transfer(s)[:, 0, 0] * s**2
    whole = np.sqrt(np.mean(np.abs(exact) ** 2))
    steep = 1 + 10 * (f / 16e3) ** 3
    shape = {"white": whole + 0 * f, "steep": whole * steep, "of each line": np.abs(exact)}[course]
    rng = np.random.default_rng(5)
    noise = size * shape * (rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))) / np.sqrt(2)
    ratio = frf.estimate_deviation(exact + noise, f) / (size * shape)
    # 61 lines of about 10 degrees of freedom each, 15 of them alike: 40 independent ones tell it to 11 %
    assert 0.6 < np.median(ratio) < 1.5
    if course != "of each line":  # which a resonance, narrower than that, tells only where it stands out
        assert np.all(ratio > 0.6)
        assert np.all(ratio[5:] < 1.6)  # the lowest lines may count for less than they are worth, by a part that falls
        assert np.quantile(np.abs(np.log(ratio)), 0.9) < 0.35


def test_noise_by_coherence_is_that_of_averaged_blows() -> None:
    """The coherence of ten noisy blows gives the scatter of H1 over many such records."""
    rng = np.random.default_rng(2)
    averages, records = 10, 4000
    force = rng.normal(size=(records, averages)) + 1j * rng.normal(size=(records, averages))
    noise = 0.5 * (rng.normal(size=force.shape) + 1j * rng.normal(size=force.shape))
    output = 3.0 * force + noise
    cross, power = (np.mean(each, axis=1) for each in (output * force.conj(), np.abs(force) ** 2))
    found = cross / power
    coherence = np.abs(cross) ** 2 / (power * np.mean(np.abs(output) ** 2, axis=1))
    stated = np.sqrt(np.mean(frf.deviation_by_coherence(found, coherence, averages) ** 2))
    assert stated == pytest.approx(np.sqrt(np.mean(np.abs(found - 3.0) ** 2)), rel=0.12)  # n against n - 1, n - 2: 10 %
