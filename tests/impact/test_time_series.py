"""CSV time series: units, interpolation, and errors that name file, line and column."""

from pathlib import Path

import numpy as np
import pytest

from impact.bodies.time_series import TimeSeries, TimeSeriesError, read_time_series

GOOD = "time [ms],pressure [bar]\n# from the test stand\n0,1.0\n0.5,1.5\n\n2, -0.25\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "p.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_become_si(tmp_path: Path) -> None:
    series = read_time_series(written(tmp_path, GOOD), "pressure")
    np.testing.assert_allclose(series.time, [0, 0.5e-3, 2e-3], rtol=1e-15)
    np.testing.assert_allclose(series.value, [1e5, 1.5e5, -0.25e5], rtol=1e-15)
    assert series(np.array([0.25e-3]))[0] == pytest.approx(1.25e5, rel=1e-14)


def test_beyond_the_record() -> None:
    time, value = np.array([1.0, 2.0]), np.array([3.0, 5.0])
    t = np.array([0.5, 1.5, 2.5])
    np.testing.assert_array_equal(TimeSeries(time, value, "hold")(t), [3, 4, 5])
    np.testing.assert_array_equal(TimeSeries(time, value, "zero")(t), [0, 4, 0])
    forbidding = TimeSeries(time, value, name="p.csv")
    with pytest.raises(TimeSeriesError, match=r"p\.csv:.*1\.\.2 s.*0\.5\.\.2\.5 s.*hold"):
        forbidding(t)
    np.testing.assert_array_equal(forbidding(np.array([1.0, 2.0])), [3, 5])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty.*'time \\[s\\],pressure"),
        ("0,1\n1,2\n", "line 1, column 1:.*'0'.*'time \\[unit\\]'"),
        ("time [h],pressure [Pa]\n0,1\n1,2\n", "column 1: .*'time \\[h\\]'.*s, ms, us"),
        ("time [s]\n0\n1\n", "line 1, column 2: .*'pressure \\[unit\\]'"),
        ("time [s],pressure [Pa]\n0,1,5\n1,2,5\n", "line 2: 3 columns, 2 .*commas.*semicolons"),
        ("time [s];pressure [Pa]\n0;1,5\n1;2.5\n", "line 3: '2.5'.*'1,5'.*2."),
        ("time [s];pressure [Pa]\n0;1.234,5\n1;2\n", "line 2: '1.234,5'.*thou"),
        ("time [s];pressure [Pa]\n0;1_0\n1;2\n", "line 2, column 2: '1_0'"),
        ("time [s];pressure [Pa];pressure [kPa]\n0;1;2\n1;2;3\n", "2 columns.*columns ="),
        ("crank angle,pressure [Pa]\n0,1\n", "'angle \\[deg\\]', state rpm"),
        ("time [s],pressure [Pa]\n0,1\nnan,1\n", "line 3, column 1: 'nan'"),
        ("time [s],pressure [Pa]\n0,1\n\n2,1\n1,1\n", "line 5, column 1:.*1.*2"),
        ("time [s],pressure [Pa]\n0,1\n", "1 samples, at least 2"),
    ],
)
def test_bad_files_are_named_by_line_and_column(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(TimeSeriesError, match=f"p\\.csv.*{words}"):
        read_time_series(written(tmp_path, text), "pressure")


@pytest.mark.parametrize(
    ("time", "value", "outside", "words"),
    [
        ([0.0, 1.0], [0.0, 1.0], "guess", "outside = 'guess' is unknown"),
        ([0.0, 1.0], [0.0], "hold", "equal length"),
        ([0.0, 0.0], [0.0, 1.0], "hold", "must increase"),
        ([0.0, 1.0], [0.0, np.inf], "hold", "must be finite"),
    ],
)
def test_impossible_series_are_refused(time: list[float], value: list[float], outside: object, words: str) -> None:
    with pytest.raises(TimeSeriesError, match=words):
        TimeSeries(np.array(time), np.array(value), outside)


TURN = "angle [deg],pressure [bar]\n0,1\n90,3\n180,1\n270,-1\n"


def test_crank_angles_repeat(tmp_path: Path) -> None:
    """A turn at 3000 rpm takes 20 ms, and the line from 270 deg goes on to the next turn's first sample."""
    path = written(tmp_path, TURN)
    series = read_time_series(path, "pressure", rpm=3000)
    t = np.array([0.0, 5e-3, 17.5e-3, 20e-3, 45e-3, -15e-3])
    np.testing.assert_allclose(series(t), np.array([1, 3, 0, 1, 3, 3]) * 1e5, rtol=1e-12, atol=1e-6)
    late = read_time_series(path, "pressure", rpm=1500, start=90.0)  # 10 ms for 90 deg
    np.testing.assert_allclose(late(np.array([0.0, 5e-3, 30e-3])), np.array([3, 2, 1]) * 1e5, rtol=1e-12)
    whole = read_time_series(written(tmp_path, TURN + "360,1\n"), "pressure", rpm=3000)
    fine = np.linspace(0, 60e-3, 1001)
    np.testing.assert_allclose(whole(fine), series(fine), rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "rpm", "words"),
    [
        (TURN, None, "'angle [deg]'.*'time [unit]'.*rpm"),
        (TURN + "400,1\n", 3000.0, "400 deg.*360"),
        (TURN, 0.0, "rpm = 0 must be positive"),
    ],
)
def test_angles_that_cannot_be(text: str, rpm: float | None, words: str, tmp_path: Path) -> None:
    with pytest.raises(TimeSeriesError, match=words.replace("[", r"\[").replace("]", r"\]")):
        read_time_series(written(tmp_path, text), "pressure", rpm=rpm)


def test_a_period_shorter_than_the_samples() -> None:
    with pytest.raises(TimeSeriesError, match="more than the period of 1 s"):
        TimeSeries(np.array([0.0, 2.0]), np.zeros(2), "repeat", period=1.0)
