"""FRFs from CSV files: every quantity, unit and form gives the same receptance; what is wrong is named."""

from pathlib import Path

import numpy as np
import pytest

import impact
from impact.bodies.time_series import TimeSeriesError
from impact.measured.frf import FrequencyResponse, FrequencyResponseError, moves_away, read_frf

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
    read = read_frf(write(tmp_path / "h.csv", header, F / 1e3, h.real, h.imag), port_name="lip")
    assert read.frequency == pytest.approx(F)
    assert read.receptance[:, 0, 0] == pytest.approx(G, rel=1e-9)
    assert read.port_names == ("lip",)
    for angle, unit_of_angle in ((np.angle(h), "rad"), (np.degrees(np.angle(h)), "deg")):
        header = f"frequency [Hz],{quantity} magnitude [{unit}],{quantity} phase [{unit_of_angle}]"
        read = read_frf(write(tmp_path / "p.csv", header, F, np.abs(h), angle))
        assert read.receptance[:, 0, 0] == pytest.approx(G, rel=1e-9)


@pytest.mark.parametrize(
    "header",
    [
        "frequency,mobility real [mm/(N s)],mobility imag [mm/(N s)]",
        "frequency [Hz],mobility real [mm/N],mobility imag [mm/N]",
        "frequency [Hz],mobility real [mm/(N s)],receptance imag [mm/N]",
        "frequency [Hz],mobility real [mm/(N s)],mobility phase [deg]",
        "frequency [Hz],mobility magnitude [mm/(N s)],mobility phase [grad]",
        "frequency [rpm],mobility real [mm/(N s)],mobility imag [mm/(N s)]",
        "frequency [Hz],impedance real [N s/m],impedance imag [N s/m]",
    ],
)
def test_a_header_must_say_quantity_and_unit(tmp_path: Path, header: str) -> None:
    with pytest.raises(FrequencyResponseError, match=r"h.csv, line 2: header .* must be like 'frequency \[Hz\]"):
        read_frf(write(tmp_path / "h.csv", header, F, G.real, G.imag))


def test_bad_files(tmp_path: Path) -> None:
    header = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    with pytest.raises(FrequencyResponseError, match=r"none.csv: no such file"):
        read_frf(tmp_path / "none.csv")
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(FrequencyResponseError, match=r"empty.csv: is empty; the first line must be like 'frequency"):
        read_frf(tmp_path / "empty.csv")
    path = write(tmp_path / "h.csv", header, F, G.real, G.imag)
    path.write_text(path.read_text() + "3100,1\n")
    with pytest.raises(TimeSeriesError, match=r"h.csv, line 33: 2 columns, 3 are needed"):
        read_frf(path)
    path.write_text(path.read_text().replace("3100,1\n", "3100,one,2\n"))
    with pytest.raises(TimeSeriesError, match=r"line 33, column 2: 'one' must be a finite number"):
        read_frf(path)
    with pytest.raises(FrequencyResponseError, match=r"b.csv: frequency must be positive and increase"):
        read_frf(write(tmp_path / "b.csv", header, F[::-1], G.real, G.imag))
    with pytest.raises(FrequencyResponseError, match=r"4 frequencies, receptance \(4, 1, 1\)"):
        read_frf(write(tmp_path / "b.csv", header, F[:4], G.real[:4], G.imag[:4]))


def test_reciprocity_is_averaged_and_told_or_refused() -> None:
    two = np.empty((len(F), 2, 2), dtype=complex)
    two[:, 0, 0] = two[:, 1, 1] = G
    two[:, 0, 1], two[:, 1, 0] = 0.52 * G, 0.48 * G
    made = FrequencyResponse(F, two, ("a", "b"))
    assert made.receptance[:, 0, 1] == pytest.approx(0.5 * G)
    # |G - G'|/(2 |G|) = sqrt(2) 0.04/(2 sqrt(2 + 0.52^2 + 0.48^2))
    assert made.origin["reciprocity_defect"] == pytest.approx(0.04 / np.sqrt(2 * (2 + 0.52**2 + 0.48**2)), rel=1e-9)
    two[:, 0, 1] = -0.48 * G
    with pytest.raises(FrequencyResponseError, match=r"G_ij and G_ji differ by \d+%"):
        FrequencyResponse(F, two, ("a", "b"))
    with pytest.raises(FrequencyResponseError, match="30 values of the frequency response are not finite"):
        FrequencyResponse(F, np.full(30, np.nan))


def test_free_bodies_are_told_by_their_lowest_lines() -> None:
    assert not moves_away(FrequencyResponse(F, G))
    assert moves_away(FrequencyResponse(F, G + 100 / W**2))
