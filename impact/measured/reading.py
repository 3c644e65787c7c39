"""Measured Green's functions: reading of files, advice on runs with them, and noise of frequency responses by line.

Sources: McKelvey and Guerin, IFAC Proc. 45 (2012) 424, and Schoukens et al., Mech. Syst. Signal Process. 20 (2006) 897
(local rational and polynomial models of a frequency response); Bendat and Piersol, Random Data, 4th ed., 9.2 (the
variance of a response from its coherence).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Final

import numpy as np
import scipy
from numpy.typing import ArrayLike

from impact.bodies.time_series import SECONDS, Stated
from impact.files.csv_table import needed_csv
from impact.greens.base import Array, ComplexArray, GreensFunction, GreensFunctionError
from impact.greens.sampled import Pretrigger, SampledGreens, Tail
from impact.measured.passivity import passivity
from impact.notices import Advice

UNRESOLVED_LIMIT = 0.01  # fraction of the power above the run's Nyquist frequency beyond which there is advice
REST_LIMIT = 0.05  # ratio of a record's end to its largest value beyond which there is advice, for tail 'zero'
_CHECKED_STEPS = 8192  # most steps whose passivity is checked
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

    Times in s, ms, us, equally spaced from the impact at 0; g in m/(N s), mm/(N s), um/(N s), nm/(N s). Empty lines and
    lines that begin with # are skipped; separators, ``columns`` and ``units`` as in `impact.read_time_series`, the rest
    as `SampledGreens.from_series`; of several ports, read each and stack the values. ``static``: (1, 1) [m/N].

    Raises:
        GreensFunctionError: what `SampledGreens.from_series` refuses, no CSV text, a header without quantity and unit,
            other numbers of columns, a cell that is no number; the message names the file.
    """
    table = needed_csv(path, GreensFunctionError, _LIKE, delimiter)
    known = {"time": SECONDS, "impulse_response": _UNITS}
    samples, factors = table.quantities(known, columns or {}, units or {})
    time, values = samples.T * factors[:, None]
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
    """Return advice for a run of ``n`` steps of ``dt`` [s] with a sampled body (or the sampled parts of a sum).

    Advice is given if the fraction of the power |g^(f)|^2 of the samples above 1/(2 dt) is large, if the step weights
    are not passive (in the first 8192 steps), and if a record that is set to zero at its end is not at rest there.
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


HALF: Final = 7  # number of lines on either side of one in its local model
SMOOTH: Final = 61  # least number of lines over which the level of the noise is smoothed
_MODELS: Final = ((7, 2), (7, 4), (4, 2))  # half width in lines, and degree of numerator and denominator
_MUCH_LESS: Final = 0.3  # ratio of variances below which another local model replaces the first
_OUTLIER: Final = 30.0  # ratio of the local variance to its smooth model above which it is due to a resonance
_LEAST_COHERENCE: Final = 1e-4  # smaller values are replaced by this one


def deviation_by_coherence(values: ArrayLike, coherence: ArrayLike, averages: int) -> Array:
    """Return the standard deviation of a complex response, whose squared magnitude is E|error|^2, from its coherence.

    The variance of |H| over |H|^2 is (1 - g2)/(2 g2 n); that of real and imaginary part together is twice that. It is
    averaged over neighbouring lines, as otherwise lines that noise happens to make small would seem accurate.
    """
    share = np.clip(np.asarray(coherence, dtype=float), _LEAST_COHERENCE, 1.0)
    variance = np.abs(np.asarray(values)) ** 2 * (1 - share) / (share * averages)
    width = min(2 * HALF + 1, (len(variance) - 1) | 1)
    around = np.pad(variance, width // 2, mode="reflect")
    return np.asarray(np.sqrt(np.convolve(around, np.ones(width) / width, mode="valid")))


def estimate_deviation(values: ComplexArray, frequency: Array) -> Array:
    """Return the standard deviation (n,) of the noise of one response, by the scatter of neighbouring lines.

    The residual of a rational function fitted to each line and its neighbours is noise. Its variance is modelled as a
    sum of a constant, a part proportional to the response, and parts that fall and rise with the frequency, as by
    electronics and conversion of units, times the running median of the local estimates relative to this sum.
    """
    variance, smooth = _about_rational(values, *_MODELS[0])
    for half, degree in _MODELS[1:]:  # the best local model
        other, magnitude = _about_rational(values, half, degree)
        better = _running_median(other, 2 * HALF + 1) < _MUCH_LESS * _running_median(variance, 2 * HALF + 1)
        variance, smooth = np.where(better, other, variance), np.where(better, magnitude, smooth)
    floor = (np.finfo(float).eps * np.abs(values).max()) ** 2
    variance = np.maximum(variance, max(floor, np.finfo(float).tiny))
    course = _components(variance, smooth, frequency)
    ratio = _running_median(variance / course, max(SMOOTH, len(values) // 12))
    return np.sqrt(course * ratio)


def _about_rational(values: ComplexArray, half: int, degree: int) -> tuple[Array, Array]:
    """Return the (n,) variance about local rational functions of the line's number, and their magnitude at the line."""
    n = len(values)
    width = min(2 * half + 1, n)
    degree = min(degree, (width - 2) // 2)
    first = np.clip(np.arange(n) - half, 0, n - width)
    index = first[:, None] + np.arange(width)
    x = (index - np.arange(n)[:, None]) / half
    h = values[index]
    size = np.abs(h).max(axis=1, keepdims=True)
    size = np.where(size > 0, size, 1.0)
    h = h / size
    powers = x[:, :, None] ** np.arange(1, degree + 1)
    matrix = np.concatenate([np.ones_like(h)[..., None], powers, -h[..., None] * powers, h[..., None]], axis=2)
    q = 2 * degree + 1
    r = np.asarray(np.linalg.qr(matrix, mode="r"))
    diagonal = np.arange(q)
    ridge = 1e-13 * np.abs(r[:, diagonal, diagonal]).max(axis=1)
    r[:, diagonal, diagonal] += np.where(np.abs(r[:, diagonal, diagonal]) < ridge[:, None], ridge[:, None], 0.0)
    coefficients = np.linalg.solve(r[:, :q, :q], r[:, :q, q, None])[..., 0]
    below = 1 + np.einsum("nwk,nk->nw", powers, coefficients[:, degree + 1 :])
    freedom = np.mean(np.abs(below) ** 2, axis=1) * (width - q)
    return size[:, 0] ** 2 * np.abs(r[:, q, q]) ** 2 / freedom, size[:, 0] * np.abs(coefficients[:, 0])


def _components(variance: Array, smooth: Array, frequency: Array) -> Array:
    """Return the variance (n,) as a positive sum of a few functions, by reweighted least squares without outliers."""
    middle = np.sqrt(frequency[0] * frequency[-1])
    courses = (np.ones_like(frequency), smooth**2, (frequency / middle) ** -4, (frequency / middle) ** 4)
    columns = np.stack([course / max(course.max(), 1e-300) for course in courses], axis=1)
    model = np.full(len(variance), float(np.median(variance)))
    for _ in range(12):
        near = variance < _OUTLIER * model
        if np.sum(near) < columns.shape[1] + 2:
            return model
        amplitudes = scipy.optimize.nnls(columns[near] / model[near, None], variance[near] / model[near])[0]
        model = np.maximum(columns @ amplitudes, 1e-6 * float(np.median(variance)))
    return model


def _running_median(values: Array, width: int) -> Array:
    return np.asarray(scipy.ndimage.median_filter(values, size=min(width | 1, len(values)), mode="reflect"))
