"""Measured or computed courses in time, read from CSV files."""

from __future__ import annotations

import csv
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from impact.brief import brief
from impact.files.input_files import CSV_LIMIT, check_file
from impact.greens.base import Array

Outside = Literal["forbid", "hold", "zero", "repeat"]
Quantity = Literal["pressure", "force", "acceleration", "velocity", "displacement"]

MOST_COLUMNS, MOST_LINES = 64, 2_000_000
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
TURN = 360.0  # degrees of crank angle after which a record in angles repeats
MOST_GAP = 90.0  # degrees between neighbours all around the turn: a line over more is no record
_UNITS: dict[str, dict[str, float]] = {
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "psi": 6894.757293168361},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "displacement": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
}
_HEADER = re.compile(r"\s*(\w+)\s*[\[(]\s*([\w/^]+)\s*[\])]\s*")


class TimeSeriesError(ValueError):
    """A time series that cannot be used; the message names file, line, column and remedy."""


@dataclass(frozen=True)
class TimeSeries:
    """A course in time by linear interpolation; call it with times [s].

    Attributes:
        time: (n,) strictly increasing [s].
        value: (n,) SI.
        outside: before the first and after the last sample: "hold" the end value, "zero", "repeat" or "forbid" (raise).
        name: for messages.
        period: after which it repeats [s], with "repeat"; between last and first sample it is a line.
    """

    time: Array
    value: Array
    outside: Outside = "forbid"
    name: str = "time series"
    period: float = 0.0

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", np.asarray(self.time, dtype=float))
        object.__setattr__(self, "value", np.asarray(self.value, dtype=float))
        if self.outside not in get_args(Outside):
            raise TimeSeriesError(
                f"{self.name}: outside = {self.outside!r} is unknown; choose forbid, hold, zero or repeat"
            )
        if self.time.ndim != 1 or self.time.shape != self.value.shape or len(self.time) < 2:
            raise TimeSeriesError(f"{self.name}: needs two or more samples, time and value of equal length")
        if not (np.all(np.isfinite(self.time)) and np.all(np.isfinite(self.value))):
            raise TimeSeriesError(f"{self.name}: all samples must be finite")
        if not np.all(np.diff(self.time) > 0):
            raise TimeSeriesError(f"{self.name}: the time must increase from sample to sample")
        span = self.time[-1] - self.time[0]
        if self.outside == "repeat" and not (math.isfinite(self.period) and span <= self.period * (1 + 1e-9)):
            raise TimeSeriesError(
                f"{self.name}: its samples cover {span:g} s, more than the period of {self.period:g} s after which it "
                "repeats; cut the record to one period"
            )

    def __call__(self, t: Array) -> Array:
        """Values at the times ``t`` [s]; `TimeSeriesError` beyond the samples under ``outside="forbid"``."""
        first, last = self.time[0], self.time[-1]
        slack = 1e-9 * (last - first)
        if self.outside == "forbid" and t.size and (t.min() < first - slack or t.max() > last + slack):
            raise TimeSeriesError(
                f"{self.name}: covers {first:g}..{last:g} s, the run asks for {t.min():g}..{t.max():g} s; "
                'give a longer record, or outside="hold" or "zero"'
            )
        if self.outside == "repeat":
            inside = first + np.mod(t - first, self.period)
            return np.asarray(
                np.interp(inside, np.append(self.time, first + self.period), np.append(self.value, self.value[0]))
            )
        beyond = 0.0 if self.outside == "zero" else None
        return np.asarray(np.interp(t, self.time, self.value, left=beyond, right=beyond))


def read_time_series(
    path: str | os.PathLike[str],
    quantity: Quantity,
    *,
    outside: Outside = "forbid",
    delimiter: str = ",",
    rpm: float | None = None,
    start: float = 0.0,
    most_gap: float = MOST_GAP,
) -> TimeSeries:
    """Read two columns, time and value, under a header such as ``time [ms],pressure [bar]``.

    Times in s, ms, us; pressure in Pa, kPa, MPa, mbar, bar, psi; force in N, mN, kN; acceleration in m/s^2, mm/s^2;
    velocity in m/s, mm/s; displacement in m, mm, um. Units stand in [] or (). Empty lines and lines that begin with #
    are skipped. With ``rpm``, the speed of a crank [1/min], the first column is ``angle [deg]``, ``start`` [deg] is the
    angle at t = 0, and the record repeats every 360 deg; neighbours, the last and the first one too, are ``most_gap``
    [deg] apart at most.

    Raises:
        TimeSeriesError: no such file, a header that does not say quantity and unit, a cell that is not a number, a time
            that does not increase, fewer than two samples, angles without a speed or the other way round, or with gaps;
            the message names file, line and column.
    """
    name = Path(path)
    if not name.exists():
        raise TimeSeriesError(f"{name}: no such file; check the path")
    rows = csv_rows(name, delimiter)
    if not rows:
        raise TimeSeriesError(f"{name}: is empty; the first line must be like 'time [s],{quantity} [SI unit]'")
    if rpm is not None and not (rpm > 0 and math.isfinite(rpm)):
        raise TimeSeriesError(f"{name}: rpm = {rpm:g} must be positive and finite")
    factors = _factors(name, quantity, rpm, *rows[0])
    samples = np.zeros((len(rows) - 1, 2))
    for sample, (line, cells) in zip(samples, rows[1:], strict=True):
        if len(cells) != 2:
            raise TimeSeriesError(f"{name}, line {line}: {len(cells)} columns, 2 are needed (separator {delimiter!r})")
        for column, cell in enumerate(cells):
            sample[column] = csv_number(name, line, column + 1, cell)
    back = np.flatnonzero(np.diff(samples[:, 0]) <= 0)
    if back.size:
        line = rows[int(back[0]) + 2][0]
        now, before = samples[back[0] + 1, 0], samples[back[0], 0]
        what = "time" if rpm is None else "angle"
        raise TimeSeriesError(f"{name}, line {line}, column 1: {what} {now:g} must exceed the one before, {before:g}")
    if len(samples) < 2:
        raise TimeSeriesError(f"{name}: {len(samples)} samples, at least 2 are needed")
    if rpm is None:
        return TimeSeries(samples[:, 0] * factors[0], samples[:, 1] * factors[1], outside, str(name))
    if (covered := samples[-1, 0] - samples[0, 0]) > TURN * (1 + 1e-9):
        raise TimeSeriesError(f"{name}: covers {covered:g} deg, more than one turn of {TURN:g}; cut the record to one")
    _check_gaps(name, samples[:, 0], [line for line, _ in rows[1:]], most_gap)
    time = (samples[:, 0] - start) * factors[0]
    return TimeSeries(time, samples[:, 1] * factors[1], "repeat", str(name), period=TURN * factors[0])


def _check_gaps(name: Path, angles: Array, lines: list[int], most: float) -> None:
    """Raise `TimeSeriesError` of angles that leave out more than ``most``, from the last to the first one, too."""
    gaps = np.diff(angles, append=angles[0] + TURN)
    worst = int(gaps.argmax())
    if gaps[worst] > most * (1 + 1e-9):
        here, there = angles[worst], angles[worst] + gaps[worst]
        raise TimeSeriesError(
            f"{name}, line {lines[worst]}, column 1: no sample between {here:g} and {there:g} deg, {gaps[worst]:g} deg "
            f"of the turn (limit {most:g}); give samples there, as one at {here + most:g} deg, also where nothing "
            "changes"
        )


def csv_rows(name: Path, delimiter: str) -> list[tuple[int, list[str]]]:
    """Line numbers and cells of the lines that hold something."""
    check_file(name, CSV_LIMIT, TimeSeriesError)
    rows: list[tuple[int, list[str]]] = []
    try:
        with name.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, delimiter=delimiter)
            for row in reader:
                if any(c.strip() for c in row) and row[0].strip()[:1] != "#":
                    rows.append((reader.line_num, row))
                if len(row) > MOST_COLUMNS or len(rows) > MOST_LINES:
                    raise TimeSeriesError(
                        f"{name}, line {reader.line_num}: {len(row)} columns, {len(rows)} lines; at most "
                        f"{MOST_COLUMNS} and {MOST_LINES} are read: resample the record, or cut it"
                    )
    except (UnicodeDecodeError, csv.Error) as problem:
        raise TimeSeriesError(f"{name}: is no CSV text in UTF-8 ({problem}); save it as such") from problem
    return rows


def _factors(name: Path, quantity: str, rpm: float | None, line: int, cells: list[str]) -> tuple[float, float]:
    first = ("time", SECONDS) if rpm is None else ("angle", {"deg": 60 / (TURN * rpm)})
    wanted = (first, (quantity, _UNITS[quantity]))
    if len(cells) != 2:
        raise TimeSeriesError(
            f"{name}, line {line}: the header has {len(cells)} columns, 2 are needed: "
            f"{wanted[0][0]} and {quantity}{separated(cells)}"
        )
    found = []
    for column, (cell, (word, units)) in enumerate(zip(cells, wanted, strict=True), 1):
        match = _HEADER.fullmatch(cell)
        if match is None or match[1].lower() != word or match[2] not in units:
            raise TimeSeriesError(
                f"{name}, line {line}, column {column}: header {cell.strip()!r} must be '{word} [unit]' "
                f"with the unit {', '.join(units)}" + _in_the_other(match, rpm)
            )
        found.append(units[match[2]])
    return found[0], found[1]


def separated(cells: list[str]) -> str:
    """What to do about a line of one cell that another separator divides."""
    found = [name for mark, name in ((";", "semicolons"), ("\t", "tabs")) if mark in "".join(cells[:1])]
    return f"; its columns are divided by {found[0]}: write commas, and decimal points in the numbers" if found else ""


def _in_the_other(match: re.Match[str] | None, rpm: float | None) -> str:
    """What to do about times where angles are expected, and the other way round."""
    found = "" if match is None else match[1].lower()
    if rpm is None and found not in ("time", *_UNITS):
        return "; of a record in crank angle, 'angle [deg]', state rpm, too"
    return "; rpm is for records in crank angle: remove it" if rpm is not None and found == "time" else ""


def csv_number(name: Path, line: int, column: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise TimeSeriesError(f"{name}, line {line}, column {column}: {cell.strip()[:80]!r} must be a finite number")
    return value
