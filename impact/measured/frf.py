"""Measured responses: files of Green's functions and of frequency responses, transforms, causality, noise by line.

Sources: McKelvey and Guerin, IFAC Proc. 45 (2012) 424, and Schoukens et al., Mech. Syst. Signal Process. 20 (2006) 897
(local rational and polynomial models of a frequency response); Bendat and Piersol, Random Data, 4th ed., 9.2 (the
variance of a response from its coherence).
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike

from impact.bodies.time_series import NOTHING_STATED, SECONDS, Stated
from impact.files.csv_table import CsvTable, normal_unit, read_needed_csv
from impact.greens.base import Array, ComplexArray, GreensFunctionError
from impact.greens.sampled import Pretrigger, SampledGreens, Tail
from impact.notices import SeatfemError
from impact.quantities import brief

_LIKE_IMPULSE = "'time [us],impulse_response [um/(N s)]'"
_UNITS = {"m/(N s)": 1.0, "mm/(N s)": 1e-3, "um/(N s)": 1e-6, "nm/(N s)": 1e-9}


def read_impulse_response(
    path: str | os.PathLike[str],
    *,
    tail: Tail = "forbid",
    pretrigger: Pretrigger = "refuse",
    port_name: str = "contact",
    static: ArrayLike = (),
    columns: Stated = NOTHING_STATED,
    units: Stated = NOTHING_STATED,
) -> SampledGreens:
    """Read g(t) from two columns under a header such as ``time [us],impulse_response [um/(N s)]``.

    Times in s, ms, us, equally spaced from the impact at 0; g in m/(N s), mm/(N s), um/(N s), nm/(N s). Empty lines and
    lines that begin with # are skipped; separators, ``columns`` and ``units`` as in `impact.read_time_series`, the rest
    as `SampledGreens.from_series`; of several ports, read each and stack the values. ``static``: (1, 1) [m/N].

    Raises:
        GreensFunctionError: what `SampledGreens.from_series` refuses, no CSV text, a header without quantity and unit,
            other numbers of columns, a cell that is no number; the message names the file.
    """
    table = read_needed_csv(path, GreensFunctionError, _LIKE_IMPULSE)
    known = {"time": SECONDS, "impulse_response": _UNITS}
    samples, factors = table.quantities(known, columns, units)
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


Kind = Literal["receptance", "mobility", "accelerance"]
HERTZ = {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6}
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
_FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605}
_ORDER = {"receptance": 0, "mobility": 1, "accelerance": 2}
_FORMS = {
    "receptance": ("{0}/{1}",),
    "mobility": ("{0}/({1} s)", "{0}/s/{1}", "({0}/s)/{1}"),
    "accelerance": ("{0}/({1} s^2)", "{0}/s^2/{1}", "({0}/s^2)/{1}"),
}
_MASSES = {"1/kg": 1.0, "1/g": 1e3}  # accelerance is 1/mass
_ROLES: dict[str, tuple[str, ...]] = {
    "frequency": ("frequency", "freq", "f"),
    "real": ("real", "re"),
    "imag": ("imag", "im", "imaginary"),
    "magnitude": ("magnitude", "mag", "amplitude", "abs"),
    "phase": ("phase", "angle"),
    "coherence": ("coherence", "coh"),
    "variance": ("variance", "var"),
    "response": ("response", "complex", "frf"),
}
_PARTS: tuple[tuple[str, ...], ...] = (("real", "imag"), ("magnitude", "phase"), ("response",))
_LIKE = (
    "must be like 'frequency [Hz],mobility real [mm/(N s)],mobility imag [mm/(N s)]', or have magnitude [m/N, "
    "dB re 1 m/N] and phase [deg], or one column of complex numbers; or give columns and units; quantities: "
    f"{', '.join(_ORDER)}; also in {', '.join(_MASSES)}, g/N"
)
_ANGLES = {"deg": np.pi / 180, "rad": 1.0}
RECIPROCITY_LIMIT = 0.2


class FrequencyResponseError(SeatfemError, ValueError):
    """Error of a frequency response that cannot be used; the message names file, line, number and remedy."""


@dataclass(frozen=True)
class FrequencyResponse:
    """G_ij(s) at s = shift + 2 pi i f: displacement of port i per force on port j, time factor exp(s t).

    Attributes:
        frequency: frequencies (n,), positive and strictly increasing [Hz].
        receptance: G (n, p, p) or, for one port, (n,) [m/N]; symmetrised, ``origin`` has the reciprocity defect.
        port_names: p names.
        shift: decay rate of an exponential window on an impulse response [1/s]; 0 for measured FRFs.
        origin: provenance, plain JSON values.
        measured_as: measured quantity, in which the noise is estimated.
        deviation: standard deviation of the noise, (n, p, p) or (n,), with square E|error|^2 [m/N]; (0,): it is
            estimated from the lines.

    Raises:
        FrequencyResponseError: shapes that do not match, fewer than 8 lines, values not finite, frequencies that do not
            increase, g_ij and g_ji that differ by more than `RECIPROCITY_LIMIT` (rms).
    """

    frequency: Array
    receptance: ComplexArray
    port_names: tuple[str, ...] = ("contact",)
    shift: float = 0.0
    origin: Mapping[str, object] = field(default_factory=dict)
    measured_as: Kind = "receptance"
    deviation: Array = field(default_factory=lambda: np.zeros(0))

    __repr__ = brief

    def __post_init__(self) -> None:
        f: Array = np.asarray(self.frequency, dtype=float)
        g, deviation = np.asarray(self.receptance, dtype=complex), np.asarray(self.deviation, dtype=float)
        p = len(self.port_names)
        g = g.reshape(-1, 1, 1) if g.ndim == 1 else g
        if g.shape != (len(f), p, p) or len(f) < 8:
            shapes = f"{len(f)} frequencies, receptance {g.shape}, {p} ports"
            raise FrequencyResponseError(f"{shapes}: give 8 or more of (n, p, p)")
        if bad := int(np.sum(~np.isfinite(f)) + np.sum(~np.isfinite(g))):
            raise FrequencyResponseError(
                f"{bad} values of the frequency response are not finite: leave these lines out"
            )
        if f[0] <= 0 or np.any(np.diff(f) <= 0):
            raise FrequencyResponseError("frequency must be positive and increase from line to line")
        if deviation.size:
            deviation = deviation.reshape(g.shape)
            if not np.all((deviation >= 0) & np.isfinite(deviation)):
                least = float(np.min(deviation))
                raise FrequencyResponseError(f"noise of {least:g} m/N: must be finite and not negative at every line")
        turned, weight = g.transpose(0, 2, 1), np.abs(self.shift + 2j * np.pi * f) ** _ORDER[self.measured_as]
        asymmetry, size = (float(np.linalg.norm(weight[:, None, None] * each)) for each in (g - turned, g))
        skew = asymmetry / max(2 * size, 1e-300)
        if skew > RECIPROCITY_LIMIT:
            raise FrequencyResponseError(
                f"G_ij and G_ji differ by {skew:.0%} (rms): check places, directions and signs of hammer and sensor"
            )
        origin = dict(self.origin) | ({"reciprocity_defect": skew} if p > 1 else {})
        values = {"frequency": f, "receptance": (g + turned) / 2, "origin": origin, "deviation": deviation}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def lines(self) -> ComplexArray:
        """Return the values s (n,) of the lines [1/s]."""
        return np.asarray(self.shift + 2j * np.pi * self.frequency, dtype=complex)

    @property
    def per_receptance(self) -> ComplexArray:
        """Return s^k (n,), the ratio of the measured quantity to the receptance; k = 0, 1, 2."""
        return np.asarray(self.lines ** _ORDER[self.measured_as])


def receptance(
    frequency: ArrayLike,
    values: ArrayLike,
    kind: Kind,
    *,
    port_names: tuple[str, ...] = ("contact",),
    origin: Mapping[str, object] = NOTHING_STATED,
    deviation: ArrayLike = (),
) -> FrequencyResponse:
    """Return the receptance from mobility [m/(N s)] or accelerance [1/kg], divided by (i w) or (i w)^2, without 0 Hz.

    ``deviation``: standard deviation of the noise of ``values``, in their unit; empty: unknown.
    """
    if kind not in get_args(Kind):
        raise FrequencyResponseError(f"kind {kind!r} is unknown; choose from {', '.join(get_args(Kind))}")
    f, h = np.asarray(frequency, dtype=float), np.asarray(values, dtype=complex)
    positive = f > 0
    f, h = f[positive], h[positive]
    divisor = ((2j * np.pi * f) ** _ORDER[kind]).reshape(-1, *[1] * (h.ndim - 1))
    provenance = {"kind": "measured", "measured_as": kind} | dict(origin)
    noise = np.asarray(deviation, dtype=float)
    noise = noise[positive] / np.abs(divisor) if noise.size else noise
    return FrequencyResponse(f, h / divisor, port_names, origin=provenance, measured_as=kind, deviation=noise)


def read_frf(
    path: str | os.PathLike[str],
    *,
    port_name: str = "contact",
    columns: Stated = NOTHING_STATED,
    units: Stated = NOTHING_STATED,
    quantity: Kind | Literal[""] = "",
    averages: int = 0,
) -> FrequencyResponse:
    """Read an FRF under a header such as ``frequency [Hz],mobility real [mm/(N s)],mobility imag [mm/(N s)]``.

    The frequency may be in Hz, kHz, MHz; receptance, mobility or accelerance in m, mm, um, nm, in per N, (N s), (N s^2)
    or in place of N, mN, kN, lbf, accelerance also in 1/kg or g/N (g = 9.80665 m/s^2); parts are real and imag, or
    magnitude (also in dB re one of these) and phase [deg, rad]; without these a response may be one column of complex
    numbers, as 1e-3+2e-4i. The noise follows from a column of coherence (with
    ``averages``) or of variance, in the square of the response's unit, real and imaginary part together; otherwise it
    is estimated from the lines by the pole fit. Separators, decimals and other columns as in `impact.read_time_series`.

    Args:
        columns: column names by role (frequency, real, imag, magnitude, phase, response, coherence, variance), if not
            evident.
        units: units of frequency, response and phase, if the header lacks them.
        quantity: measured quantity, if neither header nor units state it.
        averages: number of averaged hammer blows.

    Raises:
        FrequencyResponseError: no such file, no CSV text, a header without quantities and units, a cell that is not a
            number, values that `FrequencyResponse` refuses.
    """
    table = read_needed_csv(path, FrequencyResponseError, _LIKE.removeprefix("must be like "))
    if unknown := sorted({*columns} - {*_ROLES}) + sorted({*units} - {"frequency", "response", "phase"}):
        roles = f"columns has {', '.join(_ROLES)}, units has frequency, response and phase"
        raise FrequencyResponseError(f"{table.path}: {unknown[0]!r} is no role: {roles}: remove it")
    refusal = FrequencyResponseError(f"{table.path}, line {table.head_line}: header {table.header!r} {_LIKE}")
    places = _places_of(table, columns)
    parts = next((parts for parts in _PARTS if {"frequency", *parts} <= {*places}), None)
    if parts is None:
        raise refusal
    heads, is_polar = [table.heads[places[role]] for role in ("frequency", *parts)], "phase" in parts
    keys = ("frequency", "response", "phase" if is_polar else "response")
    hertz, *texts = (normal_unit(units.get(key, head.unit)) for key, head in zip(keys, heads, strict=False))
    decibel = re.fullmatch(r"dB(?:\s+re\.?\s+(?:1\s+)?(.+))?", texts[0]) if is_polar else None  # "dB re 1 m/N"
    unit = texts[0] if decibel is None else normal_unit(decibel[1] or "")
    stated = {quantity, *(_said(head.name)[0] for head in heads[1:])} - {""}
    kinds = [kind for kind in get_args(Kind) if unit in response_units(kind) and stated <= {kind}]
    if len(kinds) != 1 or hertz not in HERTZ or texts[-1] not in (_ANGLES if is_polar else texts[:1]):
        raise refusal
    numbers = [role for role in places if role != "response"]
    values = dict(zip(numbers, table.numbers([places[role] for role in numbers]).T, strict=True))
    if parts == ("response",):
        response = table.complex_numbers(places["response"])
    elif is_polar:
        size = values["magnitude"] if decibel is None else 10 ** (values["magnitude"] / 20)
        response = size * np.exp(1j * _ANGLES[texts[1]] * values["phase"])
    else:
        response = values["real"] + 1j * values["imag"]
    f, response = HERTZ[hertz] * values["frequency"], (scale := response_units(kinds[0])[unit]) * response
    try:
        noise, origin = _deviation(values, response, scale, averages), {"file": table.path.name}
        return receptance(f, response, kinds[0], port_names=(port_name,), origin=origin, deviation=noise)
    except FrequencyResponseError as problem:
        raise FrequencyResponseError(f"{table.path}: {problem}") from problem


def _places_of(table: CsvTable, columns: Stated) -> dict[str, int]:
    """Return the columns by role, of the parts of a response only those of one of `_PARTS`."""
    said = [(head.name.lower(), _said(head.name)[1]) for head in table.heads]
    places: dict[str, int] = {}
    for role in _ROLES:  # complex numbers last, where there are no parts, or where they are stated
        if role != "response" or role in columns or not any({*pair} <= {*places} for pair in _PARTS):
            place = table.column_of(role, [name for name, part in said if part == role], columns)
            places |= {} if place is None else {role: place}
    parts = max(_PARTS, key=lambda pair: ({*pair} <= {*places}, len({*pair} & {*columns})))
    return {role: place for role, place in places.items() if role in (*parts, "frequency", "coherence", "variance")}


def _said(name: str) -> tuple[str, str]:
    """Return the quantity and the role in the name of a column, "" for each that it does not state."""
    words = re.split(r"[\s_.:|]+", name.lower())
    quantity = next((word for word in words if word in _ORDER), "")
    roles = [role for role, synonyms in _ROLES.items() if not {*words}.isdisjoint(synonyms)]
    parts = [role for role in roles if role != "response"]
    return quantity, parts[0] if len(parts) == 1 else "response" if not parts and (roles or quantity) else ""


def _deviation(values: Mapping[str, Array], response: ComplexArray, scale: float, averages: int) -> Array:
    """Return the standard deviation of the response (SI) from variance or coherence; (0,) without either."""
    variance, coherence = values.get("variance"), values.get("coherence")
    if variance is not None:
        if np.any(variance < 0):
            raise FrequencyResponseError(f"a variance of {variance.min():g} must be 0 or more")
        return np.asarray(scale * np.sqrt(variance))
    if coherence is None or not averages:
        return np.zeros(0)
    if np.any((coherence < 0) | (coherence > 1 + 1e-6)):
        least, most = coherence.min(), coherence.max()
        raise FrequencyResponseError(f"its coherence is {least:g} to {most:g}, must be 0 to 1: is it in per cent?")
    return deviation_by_coherence(response, coherence, averages)


def response_units(kind: Kind) -> dict[str, float]:
    """Return the units of a quantity and their factors to SI, as "mm/s^2/N"; g is the standard gravity."""
    scales = {
        form.format(length, force): metre / newton
        for force, newton in _FORCES.items()
        for form in _FORMS[kind]
        for length, metre in _LENGTHS.items()
    }
    return scales | ({f"g/{f}": 9.80665 / n for f, n in _FORCES.items()} | _MASSES if kind == "accelerance" else {})


def transform_impulse_response(greens: SampledGreens, *, highest: float = 0.0) -> FrequencyResponse:
    """Return the Laplace transform of the samples, linear in between, at s = shift + 2 pi i f.

    The shift lets the record decay to 1e-3 at its end (rms of the last tenth over the largest |g|), so that poles
    fitted to these lines need no correction; it is 0 for a record that is at rest there. Lines are 1/T apart up to
    ``highest`` [Hz], 0: 0.25/dt.
    """
    dt, n = greens.dt, greens.values.shape[2]
    remainder = np.sqrt(np.mean(greens.values[:, :, -max(n // 10, 1) :] ** 2)) / np.abs(greens.values).max()
    shift = float(-np.log(np.clip(1e-3 / max(remainder, 1e-300), 1e-4, 1.0)) / greens.end)
    f = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    s = shift + 2j * np.pi * f
    hat = dt * (2 * np.sinh(s * dt / 2) / (s * dt)) ** 2
    start = 1 / s - (1 - np.exp(-s * dt)) / (s**2 * dt)
    windowed = greens.values * np.exp(-shift * dt * np.arange(n))
    first = windowed[:, :, 0].copy()
    windowed[:, :, 0] = 0.0
    g = np.fft.rfft(windowed, n, axis=2) * hat + first[:, :, None] * start
    used = (f > 0) & (f <= (highest or 0.25 / dt))
    return FrequencyResponse(f[used], g[:, :, used].transpose(2, 0, 1), greens.port_names, shift, dict(greens.origin))


def is_moving_away(response: FrequencyResponse) -> bool:
    """Return whether the lowest lines (an octave, five at least) fall faster than f^-1.5: a free body, -1/(m w^2)."""
    f, size = response.frequency, np.linalg.norm(response.receptance, axis=(1, 2))
    low = f <= max(2 * f[0], f[4])
    return bool(np.polyfit(np.log(f[low]), np.log(np.maximum(size[low], 1e-300)), 1)[0] < -1.5)


def causality_defect(response: FrequencyResponse) -> float:
    """Return the fraction, 0 ... 1, of the energy of the velocity response before the impact.

    The mobility (for a free body, whose velocity remains, the accelerance) with a Hann window up to the highest line is
    transformed to time; "before" is t < -2/f_max, since the window spreads the impact over 2/f_max. 0.5 is a response
    random in time, near 1 a phase of the wrong sign. A body that still rings after T = 1/df leaks exp(-2 zeta w T) into
    it by periodicity. nan if the lines begin above a tenth of the band.
    """
    f, spacing = response.frequency, float(np.median(np.diff(response.frequency)))
    if f[0] > 0.1 * f[-1]:
        return math.nan
    grid = spacing * np.arange(int(f[-1] / spacing) + 2)
    order = 2 if is_moving_away(response) else 1
    spectrum = np.zeros((len(grid), *response.receptance.shape[1:]), dtype=complex)
    for i, j in np.ndindex(*spectrum.shape[1:]):
        values = response.receptance[:, i, j] * (2j * np.pi * f) ** order
        spectrum[:, i, j] = np.interp(grid, f, values, left=0.0, right=0.0)
    spectrum *= np.cos(np.pi / 2 * np.minimum(grid / f[-1], 1.0))[:, None, None] ** 2
    size = 2 * (len(grid) - 1)
    energy = np.sum(np.fft.irfft(spectrum, size, axis=0) ** 2, axis=(1, 2))
    time = np.fft.fftfreq(size) / spacing
    return float(energy[time < -2 / f[-1]].sum() / max(energy.sum(), 1e-300))
