"""Fit of a passive Green's function to a measured response: poles, residues, and their uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

import numpy as np

from impact.greens.base import Array, ComplexArray, ErrorEstimate
from impact.greens.modal import ModalGreens
from impact.greens.oscillator import hann
from impact.greens.passivity import pole_passivity
from impact.greens.poles import PoleGreens
from impact.greens.sampled import SampledGreens
from impact.measured import amplitudes, frf
from impact.measured.amplitudes import FitData, free_residues, least_squares, make_passive, modal_fit, response_of
from impact.measured.vector_fitting import Poles, basis, find_misfit, refined
from impact.quantities import brief_value, finite_or_none

Form = Literal["auto", "modal", "complex"]
Fitted = ModalGreens | PoleGreens
NOT_CAUSAL: Final = 0.5  # causality defect above which a response is refused
DRAWS: Final = 24  # number of fits to copies of the record with other, reproducible noise, times the number of ports
MOST_UNEXPLAINED: Final = 0.5  # relative misfit beyond the noise above which a fit is refused
_SEED: Final = 20_261
_FLOOR: Final = 0.1  # misfit over the tolerance that is acceptable whatever the noise
_LEAN: Final = 0.01  # relative eigenvalue of a mode's amplitude matrix below which noise may have raised its rank
_SURE: Final = 30.0  # decrease of the sum of squares, in variances of the noise, above which a term is significant
_BEYOND: Final = (1.02, 1.04, 1.06, 1.09, 1.13, 1.18, 1.25, 1.35, 1.5, 1.8, 2.5, 4.0)
"""Initial frequencies of modes above the band, over the highest line."""
_MOST_BEYOND: Final = 3  # most modes above the band
_FARTHEST: Final = 6.0  # highest frequency of modes above the band, over the highest line
_MOST_DAMPED: Final = 0.3  # largest damping ratio of modes above the band
_SIGNAL: Final = 10.0  # least excess of a response's power over the noise's, in standard deviations of the latter
_MARGIN: Final = 1.5  # safety factor on the largest change among the draws
_BLOCK: Final = 9  # number of neighbouring lines over which the misfit is averaged
BLOCK_LIMIT: Final = 4.5
"""Largest mean squared misfit in variances of the noise: five standard deviations, for noise known to 20 %."""
_RANGES: Final = 5  # most ranges of lines that are reported


@dataclass(frozen=True)
class PoleFit:
    """Poles fitted to a measured response, with samples of their uncertainty.

    ``greens``: the passive fit; ``draws``: fits of the same order to copies of the record with other noise, then fits
    with other modes above the band that are as plausible; ``deviation``: (n,) standard deviation of the noise, from the
    file or from the lines [m/N]; ``tried``: poles of each order that was tried.
    """

    greens: Fitted
    draws: tuple[Fitted, ...]
    deviation: Array
    tried: tuple[amplitudes.Candidate, ...] = ()


def fit_poles(
    response: frf.FrequencyResponse,
    *,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> Fitted:
    """Return a passive sum of poles fitted to a measured response: `fit_response` without its draws.

    ``tolerance``: relative misfit allowed beyond the noise.
    """
    return fit_response(response, tolerance=tolerance, form=form, free=free, most_pairs=most_pairs).greens


def fit_response(
    response: frf.FrequencyResponse,
    *,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> PoleFit:
    """Return a passive sum of poles fitted to a measured response, with draws for the uncertainty by its noise.

    Lines are weighted by their noise in the measured quantity (`response.deviation`, or the scatter of neighbouring
    lines), plus a misfit of a tenth of ``tolerance``. Poles follow from vector fitting, then from least squares, their
    number from the Bayesian information criterion; all lie within the band. Then either:

        "modal":   g_ij = sum of damped oscillators with positive matrices of amplitudes, relaxations and a bare
                   compliance, by least squares under these signs: passive by construction (uncoupled modes);
        "complex": `PoleGreens` with free residues, changed least to be passive (modes coupled by damping);
        "auto":    real modes unless complex ones are distinguishable from them despite the noise.

    Modes above the band are a bare compliance and, if the highest lines rise towards them, oscillators above the band;
    below the band there is a rigid body, if ``free`` or the lines show it, else nothing.

    ``error.reduction``: the largest change among the draws of g filtered by a Hann pulse whose spectrum ends with the
    band (-6 dB at half the highest line), the filtered oscillations above the band, and the misfit beyond the noise,
    over the largest filtered response. ``origin["fit"]`` holds misfit, noise, causality, passivity and order.

    Args:
        free: whether the body is unsupported (a term -1/(m w^2)); by default, whether that term is significant and
            dominates the lowest lines.
        most_pairs: largest number of pole pairs.

    Raises `FrequencyResponseError` for a response that is not causal, lines with noise only, a misfit beyond the noise
    of more than half of the response, or a "complex" fit that cannot be made passive.
    """
    if not isinstance(response, frf.FrequencyResponse):
        raise frf.FrequencyResponseError(f"{brief_value(response)} is no response; give an impact.FrequencyResponse")
    if form not in get_args(Form):
        raise frf.FrequencyResponseError(f"form {form!r} is unknown; choose from {', '.join(get_args(Form))}")
    defect = frf.causality_defect(response) if response.shift == 0 else math.nan
    if defect > NOT_CAUSAL:
        raise frf.FrequencyResponseError(
            f"not causal: {defect:.0%} of the energy comes before the blow; where the phase is that of exp(-i w t), "
            "give the conjugate values; otherwise remove the delay between the channels"
        )
    deviation = noise_of(response)
    floor = _floor_of(response, _FLOOR * tolerance)
    weights = 1 / np.hypot(deviation, floor)
    names = response.port_names
    data = FitData(response.lines, response.receptance, weights, bool(free), names, alike=_lines_alike(response))
    _check_signal(data)
    poles, tried = amplitudes.choose_poles(data, floor, most_pairs)
    (data, poles), *alike = _with_residual_terms(data, poles, free)
    chosen, complex_form = _chosen(data, poles, form, floor)
    residual = data.weights[:, None, None] * (chosen.transfer(data.s) - data.g)
    unit, n = replace(data, weights=np.ones(len(data.s))), len(data.s) * data.elements.shape[1]
    missed, whole = float(np.sum(_squares(unit, residual))), float(np.sum(_squares(data, data.g)))
    unexplained = float(np.sqrt(max(missed - 1.2 * n, 0.0) / max(whole - n, 1e-300)))  # rms, beyond the noise
    ranges, worst = _ranges_of(data, residual)
    if unexplained > MOST_UNEXPLAINED:
        raise frf.FrequencyResponseError(
            f"the fit misses {unexplained:.0%} of the response beyond its noise, with {len(poles.pairs)} pole pairs, "
            f"most of it {describe_ranges(ranges) or 'at all lines'}: check units and phase, or leave these lines out"
        )
    noise = _noise_of_draws(data, deviation, residual)
    others: tuple[Fitted, ...] = ()
    if response.shift == 0:
        drawn = _drawn(data, poles, chosen, complex_form, noise, DRAWS // len(names))
        others = (*drawn, *(_chosen(*one, form, floor)[0] for one in alike))
    report = {
        **_report(chosen, data, response, defect),
        "noise_rms": float(np.linalg.norm(deviation) / np.linalg.norm(np.abs(data.g).max(axis=(1, 2)))),
        "noise_from": "the file" if response.deviation.size else "the lines",
        "unexplained": unexplained,
        "unexplained_lines_hz": [[low, high] for low, high in ranges],
        "unexplained_allowed": tolerance,
        "misfit_over_noise_worst": worst,
        "modes_beyond_band_hz": [abs(pole) / (2 * np.pi) for pole in data.above],
    }
    error = None
    if response.shift == 0:
        error = _pulse_error(chosen, others, data, unexplained)
    fitted = replace(chosen, error=ErrorEstimate(error, None), origin={**response.origin, "fit": report})
    return PoleFit(fitted, others, deviation, tried)


def fit_impulse_response(
    greens: SampledGreens,
    *,
    highest: float = 0.0,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> ModalGreens | PoleGreens:
    """Return the fit by `fit_poles` of a sampled g, which need not end at rest: an exponential window is applied, and
    removed from the poles. ``highest``: band [Hz], 0: 0.25/dt. ``free``: by default, whether its tail rule is
    "rigid"."""
    free = greens.tail == "rigid" if free is None else free
    response = frf.transform_impulse_response(greens, highest=highest)
    fit = fit_poles(response, tolerance=tolerance, form=form, free=free, most_pairs=most_pairs)
    n, width = greens.values.shape[2], float(2 / response.frequency[-1])
    t: Array = greens.dt * np.arange(n, dtype=np.float64)
    pulse = hann(t[t <= width], width) * greens.dt
    filtered = np.array([[np.convolve(row, pulse)[:n] for row in rows] for rows in greens.values])
    error = float(np.abs(filtered - fit.filtered_matrix(t, width)).max() / np.abs(filtered).max())
    return fit.with_error(ErrorEstimate(error, None))


def noise_of(response: frf.FrequencyResponse) -> Array:
    """Return the standard deviation (n,) of the noise of each line's noisiest element, as receptance [m/N]."""
    if response.deviation.size:
        return np.asarray(response.deviation.max(axis=(1, 2)))
    unit = response.per_receptance
    p = len(response.port_names)
    elements = [unit * response.receptance[:, i, j] for i in range(p) for j in range(i, p)]
    f, stride = response.frequency, _lines_alike(response)
    largest = np.max([frf.estimate_deviation(values[::stride], f[::stride]) for values in elements], axis=0)
    return np.asarray(np.interp(f, f[::stride], largest) / np.abs(unit))


def _lines_alike(response: frf.FrequencyResponse) -> int:
    """Return the number of neighbouring lines with correlated noise: those in the width of an exponential window."""
    spacing = 2 * np.pi * float(np.median(np.diff(response.frequency)))
    return int(min(1 + round(4 * response.shift / spacing), max(len(response.frequency) // 20, 1)))


def _floor_of(response: frf.FrequencyResponse, share: float) -> Array:
    """Return the acceptable misfit (n,): ``share`` times the geometric mean of the line's size and the median size, in
    the measured quantity, so that it is relatively smaller at resonances."""
    unit = np.abs(response.per_receptance)
    size = unit * np.linalg.norm(response.receptance, axis=(1, 2))
    middle = float(np.median(size))
    return np.asarray(share * np.sqrt(np.maximum(size, 1e-3 * middle) * middle) / unit)


def _check_signal(data: FitData) -> None:
    """Raise `FrequencyResponseError` if the power of the lines is that of their noise."""
    power, n = float(np.sum(_squares(data, data.g))), len(data.s) * data.elements.shape[1]
    if power - n < _SIGNAL * np.sqrt(n):
        raise frf.FrequencyResponseError(
            f"its {len(data.s)} lines hold nothing but noise: their power is {power / n:.3g} times that of it; "
            "average over more blows, or check which column is which"
        )


def _squares(data: FitData, values: ComplexArray) -> Array:
    """Return the squares (n,) of the upper triangle of ``values`` (n, p, p), over the variance of the noise."""
    rows, columns = np.triu_indices(values.shape[1])
    return np.asarray(data.weights**2 * np.sum(np.abs(values[:, rows, columns]) ** 2, axis=1))


def _with_residual_terms(data: FitData, poles: Poles, free: bool | None) -> list[tuple[FitData, Poles]]:
    """Return the data with significant terms outside the band, and poles, followed by equally plausible pairs."""
    data = replace(data, free=True)
    if not (_is_free(data, poles) if free is None else free):
        data = replace(data, free=False)
    all_terms = data.lines(amplitudes.residual_terms(data.s))
    if 2 * find_misfit(data.lines(data.fixed), poles) - 2 * find_misfit(all_terms, poles) > _SURE:
        zeta = np.median(-poles.pairs.real / np.abs(poles.pairs)) if len(poles.pairs) else 0.02
        return _with_modes_beyond(data, poles, float(np.clip(zeta, 0.002, 0.05)))
    return [_moved_together(data, poles)]


def _moved_together(data: FitData, poles: Poles, iterations: int = 6) -> tuple[FitData, Poles]:
    """Return data and poles after least squares for poles in and above the band together, if the latter remain above,
    else for the former only."""
    several = refined(data.lines(data.extra), data.with_beyond(poles), iterations)
    count, highest = len(poles.pairs), float(data.s.imag[-1])
    inside, above = Poles(several.pairs[:count], several.rates), several.pairs[count:]
    size = np.abs(above)
    if np.all((size > highest) & (size < _FARTHEST * highest) & (-above.real < _MOST_DAMPED * size)):
        return replace(data, above=tuple(map(complex, above))), amplitudes.within(data.s, inside)
    return data, amplitudes.within(data.s, refined(data.lines(data.fixed), poles, iterations))


def _is_free(data: FitData, poles: Poles) -> bool:
    """Return whether a mass line is significant, and dominates the response at some lines."""
    s, terms = data.s, amplitudes.residual_terms(data.s)
    if 2 * find_misfit(data.lines(terms[:, :-1]), poles) - 2 * find_misfit(data.lines(terms), poles) < _SURE:
        return False
    columns = np.concatenate([basis(s, poles), terms], axis=1)
    shares = least_squares(columns, data.elements[:, :, None], data.weights)[:, :, 0]
    mass_line = np.abs(columns[:, -1:] * shares[-1]).max(axis=1)
    others = np.abs(columns[:, :-1] @ shares[:-1]).max(axis=1)
    return bool(np.sum((data.weights * mass_line)[mass_line > others] ** 2) > _SURE)


def _with_modes_beyond(data: FitData, poles: Poles, zeta: float) -> list[tuple[FitData, Poles]]:
    """Return data and poles with the number of modes above the band, up to three, of least information criterion.

    They are followed by those with more modes, and with fewer modes of about the same criterion, as the lines do not
    discriminate between these responses above the band, and their static parts.
    """
    turn, places = -zeta + 1j * np.sqrt(1 - zeta**2), float(data.s.imag[-1]) * np.array(_BEYOND)
    candidates = [_moved_together(data, poles)]
    for _ in range(_MOST_BEYOND):
        last, _ = candidates[-1]  # its poles may be distorted by missing modes above
        trials = [replace(last, above=(*last.above, complex(w * turn))) for w in places]
        place = min(trials, key=lambda each: find_misfit(data.lines(each.fixed), poles))
        candidates.append(_moved_together(place, poles))

    everywhere = [moved.with_beyond(inside) for moved, inside in candidates]
    costs = [amplitudes.criterion(data, find_misfit(data.lines(data.extra), each), each) for each in everywhere]
    best = int(np.argmin(costs))
    alike = [one for k, one in enumerate(candidates) if k > best or (k < best and costs[k] - costs[best] < _SURE)]
    return [candidates[best], *alike]


def _chosen(data: FitData, poles: Poles, form: Form, floor: Array) -> tuple[Fitted, bool]:
    """Return the passive fit in the required form, and whether its residues are complex."""
    if form == "complex":
        return _fit_complex(data, poles), True
    whole, lean = (modal_fit(data, poles, smallest) for smallest in (1e-9, _LEAN))
    lefts = [float(np.sum(_squares(data, modal.transfer(data.s) - data.g))) for modal in (whole, lean)]
    misfit, modal = (lefts[1], lean) if lefts[1] <= 1.1 * lefts[0] else (lefts[0], whole)
    cost = amplitudes.criterion(data, misfit, poles, "modal")
    enough = np.mean(np.abs(modal.transfer(data.s) - data.g) ** 2 / floor[:, None, None] ** 2) <= 1
    if form == "modal" or enough:
        return modal, False

    def is_worse(response: ComplexArray) -> bool:
        misfit = float(np.sum(_squares(data, response - data.g)))
        return cost <= amplitudes.criterion(data, misfit, poles)

    freely = free_residues(data, data.with_beyond(poles))
    if is_worse(response_of(freely, data.s)):
        return modal, False
    try:
        passive = make_passive(freely, data.port_names, data.s, data.weights)
    except frf.FrequencyResponseError:
        return modal, False
    return (modal, False) if is_worse(response_of(passive, data.s)) else (passive.greens(data.port_names), True)


def _fit_complex(data: FitData, poles: Poles) -> PoleGreens:
    """Return the passive fit with complex residues; raises as `make_passive`."""
    freely = free_residues(data, data.with_beyond(poles))
    return make_passive(freely, data.port_names, data.s, data.weights).greens(data.port_names)


def _ranges_of(data: FitData, residual: ComplexArray) -> tuple[list[tuple[float, float]], float]:
    """Return ranges of lines [Hz] with a misfit above the noise, the worst first, and the largest ratio (rms)."""
    squares = np.mean(np.abs(residual) ** 2, axis=(1, 2))
    mean = np.convolve(np.pad(squares, _BLOCK // 2, mode="reflect"), np.ones(_BLOCK) / _BLOCK, mode="valid")
    over, worst = np.flatnonzero(mean > BLOCK_LIMIT), float(np.sqrt(mean.max()))
    if not over.size:
        return [], worst
    runs = np.split(over, np.flatnonzero(np.diff(over) > _BLOCK) + 1)
    runs.sort(key=lambda lines: -float(mean[lines].sum()))
    f = data.s.imag / (2 * np.pi)
    return [(float(f[lines[0]]), float(f[lines[-1]])) for lines in runs[:_RANGES]], worst


def describe_ranges(ranges: list[tuple[float, float]]) -> str:
    """Return ranges of lines as text: "from 1200 to 1310 Hz, from 4 to 4.1 kHz"."""
    return ", ".join(f"from {low:.4g} to {high:.4g} Hz" for low, high in ranges)


def _noise_of_draws(data: FitData, deviation: Array, residual: ComplexArray) -> Array:
    """Return the standard deviation (n,) for draws: that of the noise or, if larger, of the misfit around a line."""
    squares = np.mean(np.abs(residual) ** 2, axis=(1, 2))
    width = min(51, len(squares) | 1)
    around = np.convolve(np.pad(squares, width // 2, mode="reflect"), np.ones(width) / width, mode="valid")
    missed = np.sqrt(around[: len(squares)]) / data.weights
    noise = deviation * min(1.0, float(np.sqrt(np.mean(squares))))  # an estimate of the noise may be too large
    return np.asarray(np.maximum(missed, noise))


def _drawn(data: FitData, poles: Poles, fitted: Fitted, complex_form: bool, noise: Array, count: int) -> list[Fitted]:
    """Return fits of the same order to the fit's own response with other noise."""
    rng = np.random.default_rng(_SEED)
    response, fits = fitted.transfer(data.s), list[Fitted]()
    smallest = _LEAN if response.shape[1] > 1 else 1e-9
    for _ in range(count):
        error = rng.normal(size=response.shape) + 1j * rng.normal(size=response.shape)
        error = (error + error.transpose(0, 2, 1)) / 2 if response.shape[1] > 1 else error
        drawn = replace(data, g=response + noise[:, None, None] * error / np.sqrt(2))
        drawn, moved = _moved_together(drawn, poles, 3)
        try:
            fits.append(_fit_complex(drawn, moved) if complex_form else modal_fit(drawn, moved, smallest))
        except frf.FrequencyResponseError:
            fits.append(modal_fit(drawn, moved, smallest))
    return fits


def _report(greens: Fitted, data: FitData, response: frf.FrequencyResponse, defect: float) -> dict[str, object]:
    misfit = np.abs(greens.transfer(data.s) - data.g)
    unit = np.abs(response.per_receptance)[:, None, None]
    complex_poles, highest = greens.pole_sum, float(response.frequency[-1])
    return {
        "form": "modal" if complex_poles is None else "complex",
        "measured_as": response.measured_as,
        "pole_pairs": int(np.sum((greens.frequencies_hz > 0) & (greens.frequencies_hz <= highest))),
        "free": data.free,
        "band_hz": [float(response.frequency[0]), highest],
        "misfit_weighted_rms": float(np.linalg.norm(data.weights[:, None, None] * misfit) / data.scale),
        "misfit_rms": float(np.linalg.norm(unit * misfit) / np.linalg.norm(unit * data.g)),
        "misfit_worst_of_peak": float((unit * misfit).max() / np.abs(unit * data.g).max()),
        "causality_defect": finite_or_none(defect),
        "passivity": "by construction" if complex_poles is None else str(pole_passivity(complex_poles)),
    }


def _pulse_error(greens: Fitted, draws: tuple[Fitted, ...], data: FitData, unexplained: float) -> float:
    """Return the error of g filtered by the pulse of the band: the change by draws, oscillations above the band and
    the ``unexplained`` misfit."""
    w = data.s.imag
    width, end = float(4 * np.pi / w[-1]), float(2 * np.pi / np.median(np.diff(w)))
    t = np.linspace(0.0, min(end, 200 * width), int(min(4 * end * w[-1] / (2 * np.pi), 2000)) + 2)
    response = greens.filtered_matrix(t, width)
    peak = float(np.abs(response).max())
    changes = [float(np.abs(draw.filtered_matrix(t, width) - response).max()) for draw in draws]
    above_band = greens.above(float(w[-1])).filtered_matrix(width * np.linspace(1, 6, 200), width)
    return (_MARGIN * max(changes, default=0.0) + float(np.abs(above_band).max(initial=0.0))) / peak + unexplained
