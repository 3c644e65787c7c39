"""Measured Green's functions: read from files, and what to know of a run with them."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from impact.advice import Advice
from impact.bodies.time_series import SECONDS, Stated, TimeSeriesError
from impact.files.csv_table import CsvTable, needed_csv
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.greens.sampled import Pretrigger, SampledGreens, Tail
from impact.measured.passivity import passivity

UNRESOLVED_LIMIT = 0.01  # share of the response above the run's Nyquist frequency
REST_LIMIT = 0.05  # of the largest value: what a record may end with under the tail rule 'zero'
_CHECKED_STEPS = 8192
_LIKE = "'time [us],impulse_response [um/(N s)]'"
_UNITS = {"m/(N s)": 1.0, "mm/(N s)": 1e-3, "um/(N s)": 1e-6, "nm/(N s)": 1e-9}


def read_impulse_response(
    path: str | os.PathLike[str],
    *,
    tail: Tail = "forbid",
    pretrigger: Pretrigger = "refuse",
    port_name: str = "contact",
    static: Array | None = None,
    delimiter: str | None = None,
    columns: Stated | None = None,
    units: Stated | None = None,
) -> SampledGreens:
    """Read g(t) from two columns under a header such as ``time [us],impulse_response [um/(N s)]``.

    Times in s, ms, us, equally spaced, t = 0 the blow; g in m/(N s), mm/(N s), um/(N s), nm/(N s). Empty lines and
    lines that begin with # are skipped; separators, ``columns`` and ``units`` as in `impact.read_time_series`, the rest
    as `SampledGreens.from_series`; of several ports, read each and stack the values. ``static``: (1, 1) [m/N].

    Raises:
        GreensFunctionError: what `SampledGreens.from_series` refuses, a header without quantity and unit.
        TimeSeriesError: no CSV text, another number of columns, or a cell that is not a number. Both name the file.
    """
    table = needed_csv(path, TimeSeriesError, GreensFunctionError, _LIKE, delimiter)
    chosen, factors = _columns_of(table, columns or {}, units or {})
    time, values = table.numbers(chosen).T * factors[:, None]
    try:
        return SampledGreens.from_series(
            time,
            values,
            tail=tail,
            pretrigger=pretrigger,
            port_names=(port_name,),
            static=static,
            origin={"kind": "measured", "file": table.path.name},
        )
    except GreensFunctionError as problem:
        raise GreensFunctionError(f"{table.path}: {problem}") from problem


def sampling_advice(greens: GreensFunction, dt: float, n: int, *, body: str = "target") -> tuple[Advice, ...]:
    """Return advice on what a run of ``n`` steps of ``dt`` [s] should know of a sampled body (or of the sampled parts
    of a sum).

    Share of the sum of |g^(f)|^2 of the samples above 1/(2 dt), with its limit; and whether the step weights are
    passive, over the first 8192 steps at most; whether a record that the tail rule sets to zero has come to rest.
    """
    return tuple(advice for part in greens.sampled_parts for advice in _advice_on(part, dt, n, body))


def _advice_on(greens: SampledGreens, dt: float, n: int, body: str) -> Iterator[Advice]:
    power = np.sum(np.abs(np.fft.rfft(greens.values, axis=2)) ** 2, axis=(0, 1))
    above = np.fft.rfftfreq(greens.values.shape[2], greens.dt) > 0.5 / dt * (1 + 1e-9)
    share = float(power[above].sum() / max(power.sum(), 1e-300))
    if share > UNRESOLVED_LIMIT:
        yield Advice(
            f"share of the sampled {body}'s response above half the step rate",
            share,
            UNRESOLVED_LIMIT,
            f"the samples reach {0.5 / greens.dt:.3g} Hz, steps of {dt:.3g} s only {0.5 / dt:.3g} Hz",
            f"use dt <= {greens.dt:.3g} s",
        )
    size = np.abs(greens.values).max(axis=(0, 1))
    level = float(size[-max(len(size) // 10, 1) :].max() / max(size.max(), 1e-300))
    if greens.tail == "zero" and n * dt > greens.end * (1 + 1e-9) and level > REST_LIMIT:
        yield Advice(
            f"last tenth of the sampled {body}'s record over its largest value",
            level,
            REST_LIMIT,
            f"the tail rule 'zero' cuts a motion that goes on at {greens.end:.3g} s",
            "measure or compute longer, until it has come to rest",
        )
    report = passivity(greens, dt, min(n, _CHECKED_STEPS))
    if not report.passive:
        yield Advice(
            f"least work of the sampled {body} over the largest",
            report.smallest / report.largest,
            -report.tolerance / report.largest,
            f"contact can draw energy from it, most near {report.frequency:.3g} Hz",
            "use impact.repair(greens, dt), and a step that is a whole multiple of the samples' spacing",
        )


def _columns_of(table: CsvTable, columns: Stated, units: Stated) -> tuple[list[int], Array]:
    """Return the columns of time and impulse response, and their factors to SI (2,)."""
    wanted = (("time", SECONDS), ("impulse_response", _UNITS))
    try:
        chosen = [table.column_of(word, (word,), columns) for word, _ in wanted]
        entries = [
            (column, word, known) for column, (word, known) in zip(chosen, wanted, strict=True) if column is not None
        ]
        factors = [table.factor_of(column, word, known, units) for column, word, known in entries]
    except TimeSeriesError as problem:
        raise GreensFunctionError(str(problem)) from problem
    if len(entries) != 2:
        raise GreensFunctionError(
            f"{table.path}, line {table.head_line}: header {table.header!r} must be like "
            f"{_LIKE}, or its columns be named by columns = {{ time = ..., "
            f"impulse_response = ... }}; time in {', '.join(SECONDS)}; impulse_response in {', '.join(_UNITS)}"
        )
    return [column for column, _, _ in entries], np.array(factors)
