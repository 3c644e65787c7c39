"""One reader of CSV: every dialect gives the same numbers; what cannot be told for sure is refused in words."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from impact.bodies.time_series import TimeSeriesError, read_time_series
from impact.measured.frf import FrequencyResponseError, read_frf, read_impulse_response
from seatfem.structures.columns import read_columns

TIMES, VALUES = np.array([0.0, 0.5, 1.25, 2.0]), np.array([-1.5, 0.25, 3.0, 1e-3])
DIALECTS = [(separator, decimal) for separator, decimal in product(",;\t", ".,") if (separator, decimal) != (",", ",")]


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "r.csv"
    path.write_bytes(text.encode(encoding))
    return path


def table(heads: tuple[str, str], separator: str, decimal: str, end: str = "\n") -> str:
    rows = [separator.join(f"{x:.6e}".replace(".", decimal) for x in row) for row in zip(TIMES, VALUES, strict=True)]
    return end.join([separator.join(heads), "# a remark", *rows, ""])


@pytest.mark.parametrize(("separator", "decimal"), DIALECTS)
@pytest.mark.parametrize("heads", [("time [ms]", "force [kN]"), ("Time (ms)", "Force (kN)")])
@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("cp1252", "\r\n")])
def test_dialects_of_courses(
    tmp_path: Path, separator: str, decimal: str, heads: tuple[str, str], encoding: str, end: str
) -> None:
    series = read_time_series(written(tmp_path, table(heads, separator, decimal, end), encoding), "force")
    np.testing.assert_allclose(series.time, TIMES * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(series.value, VALUES * 1e3, rtol=1e-12)


@pytest.mark.parametrize(("separator", "decimal"), DIALECTS)
def test_dialects_of_impulse_responses_and_tables(tmp_path: Path, separator: str, decimal: str) -> None:
    rows = [separator.join(f"{x:.3f}".replace(".", decimal) for x in (k, 2 * k)) for k in range(12)]
    head = f"time [µs]{separator}impulse_response [um/(N s)]"
    greens = read_impulse_response(written(tmp_path, "\n".join([head, *rows])))
    assert greens.dt == pytest.approx(1e-6)
    assert greens.values[0, 0] == pytest.approx(2e-6 * np.arange(12))
    path = written(tmp_path, "\n".join([f"x [mm]{separator}height [um]", *rows]))
    columns = read_columns(path, {"x": "length", "height": "length"}, ("x", "height"))
    assert columns["x"] == pytest.approx(1e-3 * np.arange(12))
    assert columns["height"] == pytest.approx(2e-6 * np.arange(12))


F = np.linspace(100.0, 2000.0, 20)
H = (1.5 - 0.5j) * np.exp(1j * F / 700) * (1 + F / 1000)


def response(heads: list[str], columns: list[np.ndarray], separator: str = ";", decimal: str = ",") -> str:
    rows = [separator.join(f"{x:.9e}".replace(".", decimal) for x in row) for row in zip(*columns, strict=True)]
    return "\n".join([separator.join(heads), *rows])


@pytest.mark.parametrize(("angle", "factor"), [("deg", 180 / np.pi), ("rad", 1.0), ("°", 180 / np.pi)])
def test_decibels_and_phase(tmp_path: Path, angle: str, factor: float) -> None:
    heads = ["Frequency (Hz)", "Mag (dB re 1 g/N)", f"Phase ({angle})"]
    columns = [F, 20 * np.log10(np.abs(H) / 9.80665), np.angle(H) * factor]
    read = read_frf(written(tmp_path, response(heads, columns)))
    assert read.receptance[:, 0, 0] * (2j * np.pi * F) ** 2 == pytest.approx(H, rel=1e-7)
    heads[1] = "Mag"
    stated = read_frf(written(tmp_path, response(heads, columns)), units={"response": "dB re 1 g/N"})
    assert stated.receptance == pytest.approx(read.receptance, rel=1e-12)
    heads[1] = "Mag (dB)"  # of what?
    with pytest.raises(FrequencyResponseError, match=r"must be like .* dB re 1 m/N"):
        read_frf(written(tmp_path, response(heads, columns)))


def test_coherence_and_variance_tell_the_noise(tmp_path: Path) -> None:
    coherence = np.linspace(0.5, 1.0, len(F))
    heads = ["Frequency (Hz)", "Real (m/N)", "Imag (m/N)", "Coherence"]
    path = written(tmp_path, response(heads, [F, H.real, H.imag, coherence]))
    read = read_frf(path, averages=8)
    # var|H|/|H|^2 = (1 - g2)/(2 g2 n), and as much across it
    exact = np.abs(H) ** 2 * 2 * (1 - coherence) / (2 * coherence * 8)
    assert read.deviation[10, 0, 0] == pytest.approx(np.sqrt(exact[3:18].mean()), rel=1e-8)  # over 15 lines
    assert read_frf(path).deviation.size == 0
    per_cent = written(tmp_path, response(heads, [F, H.real, H.imag, 100 * coherence]))
    with pytest.raises(FrequencyResponseError, match=r"coherence .*50.*100.*per cent"):
        read_frf(per_cent, averages=8)
    heads[1:] = ["Real (mm/N)", "Imag (mm/N)", "Variance"]
    read = read_frf(written(tmp_path, response(heads, [F, H.real, H.imag, 0.04 + 0 * F])))
    assert read.deviation[:, 0, 0] == pytest.approx(0.2e-3)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        (
            {"columns": {"force": "G"}},
            "columns.force = 'G'.*0.*'time .s.', 'force .N.'",
        ),
        ({"units": {"force": "kN"}}, "column 2:.*'N', units.force = 'kN':"),
        ({"columns": {"pressure": "p"}}, "columns.*pressure:"),
    ],
)
def test_what_is_stated_beside_a_header(tmp_path: Path, how: dict, words: str) -> None:
    path = written(tmp_path, "time [s];force [N]\n0;1\n1;2\n")
    with pytest.raises(TimeSeriesError, match=words):
        read_time_series(path, "force", **how)


def test_a_stated_unit_stands_in_place_of_one_that_is_unknown(tmp_path: Path) -> None:
    """The stated unit replaces that of a header in another language; a known one that differs is refused."""
    path = written(tmp_path, "time [ms],force [Kilopond]\n0,1\n1,2\n")
    assert read_time_series(path, "force", units={"force": "kN"})(np.array([1e-3])) == pytest.approx([2e3])
