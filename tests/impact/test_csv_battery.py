"""One reader of CSV: every dialect gives the same numbers; what cannot be told for sure is refused in words."""

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impact.bodies.time_series import TimeSeriesError, read_time_series
from impact.measured.frf import FrequencyResponseError, read_frf, read_impulse_response
from seatfem.structures.columns import read_columns
from tests.mutated_lines import check_mutants, is_same

F = np.linspace(20.0, 200.0, 10)
H = (1.5 - 0.5j) * np.exp(1j * F / 70) * (1 + F / 100)
T = 0.5 * np.arange(8)
P = np.sin(T) + 1.25


def rows(*columns: Any, mark: str = ",", decimal: str = ".", form: str = "{:.6e}") -> str:
    lines = [
        mark.join(form.format(x) if not isinstance(x, str) else x for x in row) for row in zip(*columns, strict=True)
    ]
    return "\n".join(line.replace(".", decimal) for line in lines) + "\n"


PREAMBLE = "Recorder 7,channel 2\nDate,2024-03-02\nSample rate,1000\n"
COMPLEX = [f"{h.real:.6e}{h.imag:+.6e}i" for h in H]
PAIRS = [f"({h.real:.6e}, {h.imag:.6e})" for h in H]
PARTS = (F, H.real, H.imag)
POLAR = (F, 20 * np.log10(np.abs(H) / 9.80665), np.degrees(np.angle(H)))
ACCELERANCE = "frequency [Hz],accelerance real [1/kg],accelerance imag [1/kg]\n"
RESPONSES: dict[str, tuple[str, dict[str, Any]]] = {
    "plain": (ACCELERANCE + rows(*PARTS), {}),
    "below lines": (PREAMBLE + "\n" + ACCELERANCE + rows(*PARTS), {}),
    "below remarks": ("# a remark\n" + ACCELERANCE + "# another\n" + rows(*PARTS), {}),
    "units beneath": ("Frequency,Accelerance Re,Accelerance Im\nHz,m/s²/N,m/s²/N\n" + rows(*PARTS), {}),
    "units beneath in brackets": (
        PREAMBLE + "Frequency;Accelerance Re;Accelerance Im\n[Hz];[g/N];[g/N]\n"
        + rows(F, H.real / 9.80665, H.imag / 9.80665, mark=";"), {},
    ),
    "a remark as head": ("# by another program\n# " + ACCELERANCE + rows(*PARTS), {}),
    "a rule beneath": (ACCELERANCE + "---,---,---\n" + rows(*PARTS), {}),
    "Fortran": (ACCELERANCE + rows(*PARTS).replace("e", "D"), {}),
    "semicolons and commas": (ACCELERANCE.replace(",", ";") + rows(*PARTS, mark=";", decimal=","), {}),
    "tabs": ("Title\tof it\n" + ACCELERANCE.replace(",", "\t") + rows(*PARTS, mark="\t"), {}),
    "blanks": ("Frequency [Hz]   Real [m/s^2/N]   Imag [m/s^2/N]\n" + rows(*PARTS, mark=" ", form="{:14.6e}"), {}),
    "complex": ("frequency [Hz],accelerance [1/kg]\n" + rows(F, COMPLEX), {}),
    "complex pairs": ("Point 1\nfrequency [Hz];accelerance [1/kg]\n" + rows(F, PAIRS, mark=";"), {}),
    "decibels": ("f (Hz),Mag (dB re 1 g/N),Phase (deg)\n" + rows(*POLAR), {}),
    "decibels, stated": ("f (Hz),Mag,Phase (deg)\n" + rows(*POLAR), {"units": {"response": "dB re 1 g/N"}}),
    "other words": (
        PREAMBLE + "Freq.,H1,H2\n" + rows(*PARTS),
        {
            "columns": {"frequency": "Freq.", "real": "H1", "imag": "H2"},
            "units": {"frequency": "Hz", "response": "m/s^2/N"},
        },
    ),
    "other columns": (
        "no,frequency [Hz],note,accelerance real [1/kg],accelerance imag [1/kg]\n"
        + rows(np.arange(10.0), F, ["good"] * 10, H.real, H.imag), {},
    ),
    "quoted": (
        '"frequency [Hz]","accelerance real [1/kg]","accelerance imag [1/kg]"\n'
        + rows(*([f'"{x:.6e}"' for x in column] for column in PARTS)), {},
    ),
}  # fmt: skip


def lacks_a_line(before: Any, after: Any) -> bool:
    """Return whether one row less is all that differs."""
    x, y = before[:2]
    less = [np.arange(len(x)) != k for k in range(len(x))]
    return any(is_same((x[kept], y[kept]), after[:2]) for kept in less) and before[2:] == after[2:]


def check(tmp_path: Path, text: str, read: Callable[[Path], Any]) -> None:
    count = len(text.splitlines())
    same, refused = check_mutants(
        tmp_path / "a.csv", text, read, (TimeSeriesError, FrequencyResponseError), lacks_a_line
    )
    assert same + refused == 3 * count
    assert same >= len(F if "Hz" in text else T) - 2  # a row less each, of at least so many
    assert refused >= 12


@pytest.mark.parametrize("name", RESPONSES)
def test_a_response_changed_in_a_line_is_the_same_or_refused(name: str, tmp_path: Path) -> None:
    """Heads, units, separators and notations of numbers differ and mean one response, but for a removed row of numbers,
    which is missing."""
    text, stated = RESPONSES[name]
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    whole = read_frf(tmp_path / "a.csv", **stated)
    assert np.allclose(whole.receptance[:, 0, 0] * whole.per_receptance, H, rtol=1e-5)

    def read(path: Path) -> Any:
        response = read_frf(path, **stated)
        return response.frequency, response.receptance, response.measured_as

    check(tmp_path, text, read)


COURSES: dict[str, tuple[str, dict[str, Any]]] = {
    "plain": ("time [ms],pressure [bar]\n" + rows(T, P), {}),
    "below lines": (PREAMBLE + "time [ms],pressure [bar]\n" + rows(T, P), {}),
    "units beneath": ("Recorder\nTime;Pressure\nms;bar\n" + rows(T, P, mark=";", decimal=","), {}),
    "other words": (
        "Messung 3\nZeit;p_zyl\n" + rows(T, P, mark=";", decimal=","),
        {"columns": {"time": "Zeit", "pressure": "p_zyl"}, "units": {"time": "ms", "pressure": "bar"}},
    ),
    "blanks": ("Time [ms]  Pressure [bar]\n" + rows(T, P, mark="  "), {}),
    "by angle": ("stand 2,3\nangle [deg],pressure [bar]\n" + rows(45 * np.arange(8.0), P), {"rpm": 3000.0}),
}


@pytest.mark.parametrize("name", COURSES)
def test_a_course_changed_in_a_line_is_the_same_or_refused(name: str, tmp_path: Path) -> None:
    """Its head and its units are found, whatever stands above them."""
    text, stated = COURSES[name]

    def read(path: Path) -> Any:
        series = read_time_series(path, "pressure", **stated)
        return series.time, series.value

    check(tmp_path, text, read)
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    assert read(tmp_path / "a.csv")[1] == pytest.approx(1e5 * P, rel=1e-5)


DIALECTS = [(mark, decimal) for mark, decimal in product(",;\t", ".,") if (mark, decimal) != (",", ",")]


@pytest.mark.parametrize(("mark", "decimal"), DIALECTS)
@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("cp1252", "\r\n")])
def test_dialects_of_tables(tmp_path: Path, mark: str, decimal: str, encoding: str, end: str) -> None:
    """A course, an impulse response and a table of lengths are the same numbers in every dialect."""
    numbers = rows(np.arange(12.0), 2 * np.arange(12.0), mark=mark, decimal=decimal)

    def written(*heads: str) -> Path:
        text = "\n".join([mark.join(heads), "# a remark", numbers])
        (tmp_path / "a.csv").write_bytes(text.replace("\n", end).encode(encoding))
        return tmp_path / "a.csv"

    series = read_time_series(written("Time (ms)", "Force (kN)"), "force")
    greens = read_impulse_response(written("time [µs]", "impulse_response [um/(N s)]"))
    columns = read_columns(written("x [mm]", "height [um]"), {"x": "length", "height": "length"}, ("x", "height"))
    assert (greens.dt, greens.ports) == (pytest.approx(1e-6), ("contact",))
    for x, y, scale, of in (
        (series.time, series.value, 1e-3, 1e3), (columns["x"], columns["height"], 1e-3, 1e-6),
        (1e-6 * np.arange(12), greens.values[0, 0], 1e-6, 1e-6),
    ):  # fmt: skip
        np.testing.assert_allclose(x, scale * np.arange(12), rtol=1e-12)
        np.testing.assert_allclose(y, 2 * of * np.arange(12), rtol=1e-12)


def test_coherence_and_variance_tell_the_noise(tmp_path: Path) -> None:
    """var|H|/|H|^2 = (1 - g2)/(2 g2 n), and as much across it."""
    f = np.linspace(100.0, 2000.0, 20)
    h, coherence = (1.5 - 0.5j) * np.exp(1j * f / 700) * (1 + f / 1000), np.linspace(0.5, 1.0, 20)

    def written(heads: str, last: np.ndarray) -> Path:
        (tmp_path / "a.csv").write_text(f"Frequency (Hz),{heads}\n{rows(f, h.real, h.imag, last, form='{:.9e}')}")
        return tmp_path / "a.csv"

    path = written("Real (m/N),Imag (m/N),Coherence", coherence)
    exact = np.abs(h) ** 2 * 2 * (1 - coherence) / (2 * coherence * 8)
    deviation = read_frf(path, averages=8).deviation
    assert deviation[10, 0, 0] == pytest.approx(np.sqrt(exact[3:18].mean()), rel=1e-8)  # over 15 lines
    assert read_frf(path).deviation.size == 0
    with pytest.raises(FrequencyResponseError, match=r"coherence .*50.*100.*per cent"):
        read_frf(written("Real (m/N),Imag (m/N),Coherence", 100 * coherence), averages=8)
    path = written("Real (mm/N),Imag (mm/N),Variance", 0.04 + 0 * f)
    assert read_frf(path).deviation[:, 0, 0] == pytest.approx(0.2e-3)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("frequency [Hz],accelerance real [1/kg],accelerance real [1/kg],accelerance imag [1/kg]", "real .*2 columns"),
        ("frequency [Hz],accelerance real [1/kg],accelerance imag [m/s^2/N],x", "must be like"),
        ("frequency [Hz],accelerance real [1/kg],mobility imag [1/kg],x", "must be like"),
        ("frequency [Hz],accelerance real [1/kg],accelerance phase [deg],x", "must be like"),
        ("frequency [Hz],accelerance magnitude [1/kg],accelerance phase [grad],x", "must be like"),
        ("frequency [Hz],accelerance [1/kg],mobility [m/s/N],x", "response .*2 columns"),
        ("frequency [Hz],accelerance [1/kg],x,y", "must be a complex number"),
        ("frequency [Hz],accelerance re [1/kg],accelerance im [1/kg],x\nkHz,1/kg,1/kg,-", "must be like"),
        ("frequency [Hz],Mag (dB),Phase (deg),x", "must be like .* dB re 1 m/N"),
        ("frequency,mobility real [mm/(N s)],mobility imag [mm/(N s)],x", r"line 1: .*'frequency \[Hz\]"),
        ("frequency [rpm],mobility real [mm/(N s)],mobility imag [mm/(N s)],x", r"line 1: .*'frequency \[Hz\]"),
        ("frequency [Hz],impedance real [N s/m],impedance imag [N s/m],x", r"line 1: .*'frequency \[Hz\]"),
    ],
)
def test_heads_that_contradict_each_other_or_lack_something(head: str, words: str, tmp_path: Path) -> None:
    """Two columns of one role, two units or quantities of one response, a size without its phase, no unit."""
    (tmp_path / "a.csv").write_text(head + "\n" + rows(F, H.real, H.imag, H.imag), encoding="utf-8")
    with pytest.raises(FrequencyResponseError, match=rf"a\.csv.*{words}"):
        read_frf(tmp_path / "a.csv")


TWO = "time [ms],force [N]\n0,1\n1,2\n"


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"columns": {"force": "G"}}, "columns.force = 'G'.*0.*'time .ms.', 'force .N.'"),
        ({"units": {"force": "kN"}}, "column 2:.*'N', units.force = 'kN':"),
        ({"columns": {"pressure": "p"}}, "columns.*pressure:"),
    ],
)
def test_what_is_stated_beside_a_header(tmp_path: Path, how: dict[str, Any], words: str) -> None:
    """A stated unit replaces that of a header in another language; a known one that differs is refused."""
    path = tmp_path / "a.csv"
    path.write_text(TWO.replace("[N]", "[Kilopond]"))
    assert read_time_series(path, "force", units={"force": "kN"})(np.array([1e-3])) == pytest.approx([2e3])
    path.write_text(TWO)
    with pytest.raises(TimeSeriesError, match=words):
        read_time_series(path, "force", **how)
