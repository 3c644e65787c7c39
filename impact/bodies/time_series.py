"""Time series from measurement or computation, read from CSV files."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal, get_args

import numpy as np

from impact.files.csv_table import read_needed_csv
from impact.greens.base import Array
from impact.notices import SeatfemError
from impact.quantities import brief

Outside = Literal["forbid", "hold", "zero", "repeat"]
Quantity = Literal["pressure", "force", "acceleration", "velocity", "displacement", "strain"]

Stated = Mapping[str, str]
"""Column names or units by the role of a column, if the header does not state them."""
NOTHING_STATED: Final[Stated] = MappingProxyType({})
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
TURN = 360.0  # degrees of crank angle after which a record in angles repeats
MOST_GAP = 90.0  # largest distance of neighbouring samples in a record of one turn [degrees]
_UNITS: dict[str, dict[str, float]] = {
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "psi": 6894.757293168361},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "displacement": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "strain": {"m/m": 1.0, "mm/m": 1e-3, "um/m": 1e-6},
}


class TimeSeriesError(SeatfemError, ValueError):
    """Error of an unusable time series; the message names file, line, column and remedy."""


@dataclass(frozen=True)
class TimeSeries:
    """A time series as a function of times [s], by linear interpolation.

    Attributes:
        time: (n,) strictly increasing times [s].
        value: (n,) values [SI].
        outside: extrapolation: "hold" the end values, "zero", "repeat" or "forbid" (raise an error).
        name: name in messages.
        period: period with "repeat" [s]; it is linear between the last and the first sample.
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
        """Return values at the times ``t`` [s]; `TimeSeriesError` beyond the samples under ``outside="forbid"``."""
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
    columns: Stated = NOTHING_STATED,
    units: Stated = NOTHING_STATED,
    rpm: float | None = None,
    start: float = 0.0,
    most_gap: float = MOST_GAP,
) -> TimeSeries:
    """Read two columns, time and value, under a header such as ``time [ms],pressure [bar]``; others are left aside.

    Columns are divided by tabs, semicolons or commas, with decimal points or commas, as the lines show.
    ``columns`` and ``units`` name those of "time", or "angle", and of the quantity where the header does not.
    Times in s, ms, us; pressure in Pa, kPa, MPa, mbar, bar, psi; force in N, mN, kN; acceleration in m/s^2, mm/s^2;
    velocity in m/s, mm/s; displacement in m, mm, um; strain in m/m, mm/m, um/m. Units stand in [] or (). Empty lines
    and lines that begin with # are skipped. With ``rpm``, the speed of a crank [1/min], the first column is ``angle
    [deg]``, ``start`` [deg] is the angle at t = 0, and the record repeats every 360 deg; neighbours, the last and the
    first one too, are ``most_gap`` [deg] apart at most.

    Raises:
        TimeSeriesError: no such file, a header that does not say quantity and unit, a cell that is not a number, a time
            that does not increase, fewer than two samples, angles without a speed or the other way round, or with gaps;
            the message names file, line and column.
    """
    like = f"'{'time [s]' if rpm is None else 'angle [deg]'},{quantity} [SI unit]'"
    table = read_needed_csv(path, TimeSeriesError, like)
    name = table.path
    if rpm is not None and not (rpm > 0 and math.isfinite(rpm)):
        raise TimeSeriesError(f"{name}: rpm = {rpm:g} must be positive and finite")
    first = {"time": SECONDS} if rpm is None else {"angle": {"deg": 60 / (TURN * rpm)}}

    def hint(head: str) -> str:
        """Return a hint if there are times in place of angles, or the other way round."""
        if rpm is None and head not in ("time", *_UNITS):
            return "; of a record in crank angle, 'angle [deg]', state rpm, too"
        return "; rpm is for records in crank angle: remove it" if rpm is not None and head == "time" else ""

    samples, factors = table.quantities(first | {quantity: _UNITS[quantity]}, columns, units, hint)
    back = np.flatnonzero(np.diff(samples[:, 0]) <= 0)
    if back.size:
        line = table.lines[int(back[0]) + 1]
        now, before = samples[back[0] + 1, 0], samples[back[0], 0]
        what = "time" if rpm is None else "angle"
        words = f"{what} {now:g} must exceed the one before, {before:g}; sort the rows by {what}, each once"
        raise TimeSeriesError(f"{name}, line {line}, column 1: {words}")
    if len(samples) < 2:
        raise TimeSeriesError(f"{name}: {len(samples)} samples, at least 2 are needed")
    if rpm is None:
        return TimeSeries(samples[:, 0] * factors[0], samples[:, 1] * factors[1], outside, str(name))
    if (covered := samples[-1, 0] - samples[0, 0]) > TURN * (1 + 1e-9):
        raise TimeSeriesError(f"{name}: covers {covered:g} deg, more than one turn of {TURN:g}; cut the record to one")
    _check_gaps(name, samples[:, 0], table.lines, most_gap)
    time = (samples[:, 0] - start) * factors[0]
    return TimeSeries(time, samples[:, 1] * factors[1], "repeat", str(name), period=TURN * factors[0])


def _check_gaps(name: Path, angles: Array, lines: Sequence[int], most: float) -> None:
    """Raise `TimeSeriesError` for a gap between angles above ``most``, also from the last to the first."""
    gaps = np.diff(angles, append=angles[0] + TURN)
    worst = int(gaps.argmax())
    if gaps[worst] > most * (1 + 1e-9):
        start, end = angles[worst], angles[worst] + gaps[worst]
        raise TimeSeriesError(
            f"{name}, line {lines[worst]}, column 1: no sample between {start:g} and {end:g} deg, {gaps[worst]:g} deg "
            f"of the turn (limit {most:g}); give samples there, as one at {start + most:g} deg, also where nothing "
            "changes"
        )
