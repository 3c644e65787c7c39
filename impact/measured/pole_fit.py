"""The way from a measured response to a passive Green's function: poles, residues, and what they miss."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

import numpy as np

from impact.greens.base import Array, ComplexArray, ErrorEstimate
from impact.greens.modal import ModalGreens
from impact.greens.oscillator import hann
from impact.greens.poles import PoleGreens
from impact.greens.sampled import SampledGreens
from impact.measured import frf, pole_choice, reading
from impact.measured.amplitudes import FitData, free_residues, least_squares, made_passive, modal_fit, response_of
from impact.measured.vector_fitting import Poles, basis, left_over, pole_passivity, refined

Form = Literal["auto", "modal", "complex"]
Fitted = ModalGreens | PoleGreens
NOT_CAUSAL: Final = 0.5  # causality defect above which a response is refused
DRAWS: Final = 24  # copies of the record with other noise that are fitted anew, over the number of ports
MOST_UNEXPLAINED: Final = 0.5  # share of the response left unexplained above which a fit is refused
_SEED: Final = 20_261
_FLOOR: Final = 0.1  # misfit, over the tolerance, that a fit need not explain, whatever the noise
_LEAN: Final = 0.01  # least eigenvalue of a mode's amplitude matrix, over the largest: noise adds to its rank one
_SURE: Final = 30.0  # decrease of the squares, in variances of the noise, above which the lines support a term
_BEYOND: Final = (1.02, 1.04, 1.06, 1.09, 1.13, 1.18, 1.25, 1.35, 1.5, 1.8, 2.5, 4.0)
"""Frequencies, over the highest line, at which modes above the band are looked for."""
_MOST_BEYOND: Final = 3
_FARTHEST: Final = 6.0  # highest frequency, over the highest line, that modes above the band may move to
_MOST_DAMPED: Final = 0.3  # largest damping ratio of modes above the band
_SIGNAL: Final = 10.0  # least excess of a response's power over the noise's, in standard deviations of that
_MARGIN: Final = 1.5  # safety factor on the largest change among the draws
_BLOCK: Final = 9  # neighbouring lines over which the misfit is averaged
BLOCK_LIMIT: Final = 4.5
"""Largest mean square of their misfit, in variances of the noise: five deviations, for noise known to 20 %."""
_RANGES: Final = 5  # most ranges of lines that are named


@dataclass(frozen=True)
class PoleFit:
    """Poles through a measured response, and what its noise leaves open.

    ``greens``: the passive fit; ``draws``: the same, of the same order, to records that differ by their noise, and
    behind them with other modes beyond the band that the record does not refute; ``deviation``: (n,) of the noise, from
    the file or from the lines [m/N]; ``tried``: poles of each order that were looked at.
    """

    greens: Fitted
    draws: tuple[Fitted, ...]
    deviation: Array
    tried: tuple[pole_choice.Candidate, ...] = ()


def fit_poles(
    response: frf.FrequencyResponse,
    *,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> Fitted:
    """Return a passive sum of poles through a measured response: `fit_response` without its draws.

    ``tolerance``: relative misfit that is allowed beyond the noise.
    """
    return fit_response(response, tolerance=tolerance, form=form, free=free, most_pairs=most_pairs).greens


def fit_response(
    response: frf.FrequencyResponse,
    *,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
    draws: int | None = None,
) -> PoleFit:
    """Return a passive sum of poles through a measured response, with draws of what its noise leaves open.

    Each line counts by its noise in the quantity that was measured (`response.deviation`, or what neighbouring lines
    have beyond a smooth course), which a misfit of a tenth of ``tolerance`` adds to. Poles by vector fitting, then by
    least squares; their number by the Bayesian information criterion; all of them within the band. Then either:

        "modal":   g_ij = sum of damped oscillators with positive matrices of amplitudes, relaxations and a bare
                   compliance, by least squares under these signs: passive by construction (uncoupled modes);
        "complex": `PoleGreens` with free residues, changed as little as makes them passive (modes coupled by damping);
        "auto":    real modes unless the noise lets complex ones be distinguished from them.

    What lies above the band is a bare compliance, and where the highest lines rise towards it, oscillators at fixed
    places beyond them; what lies below is a rigid body, if ``free`` or the lines say so, and otherwise not known.

    ``error.reduction``: the largest change of g after a Hann pulse whose spectrum ends with the band (-6 dB at half the
    highest line) among the draws, what oscillations beyond the band leave after it, and the misfit that noise does not
    explain, over the largest response to it. ``origin["fit"]`` holds misfit, noise, causality, passivity and order.

    Args:
        free: whether the body can move away (a term -1/(m w^2)); by default, whether the lines need that term and it
            outweighs all others at the lowest.
        most_pairs: limit of pole pairs.
        draws: of records with other noise, always the same; `DRAWS` over the number of ports if absent.

    Raises `FrequencyResponseError`: not causal, lines that hold nothing but noise, a misfit beyond the noise of more
    than half of the response, a "complex" fit that cannot be made passive.
    """
    if form not in get_args(Form):
        raise frf.FrequencyResponseError(f"form {form!r} is unknown; choose from {', '.join(get_args(Form))}")
    defect = frf.causality_defect(response) if response.shift == 0 else None
    if defect is not None and defect > NOT_CAUSAL:
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
    poles, tried = pole_choice.choose_poles(data, floor, most_pairs)
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
            f"most of it {in_words(ranges) or 'at all lines'}: check units and phase, or leave these lines out"
        )
    noise = _noise_of_draws(data, deviation, residual)
    count = DRAWS // len(names) if draws is None else draws
    others: tuple[Fitted, ...] = ()
    if response.shift == 0 and count:
        drawn = _drawn(data, poles, chosen, complex_form, noise, count)
        others = (*drawn, *(_chosen(*one, form, floor)[0] for one in alike))
    report = {
        **_report(chosen, data, response, defect),
        "noise_rms": float(np.linalg.norm(deviation) / np.linalg.norm(np.abs(data.g).max(axis=(1, 2)))),
        "noise_from": "the lines" if response.deviation is None else "the file",
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
    highest: float | None = None,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> ModalGreens | PoleGreens:
    """Do `fit_poles` of a sampled g, which need not have come to rest: an exponential window is laid over it and taken
    off the poles. ``highest``: band [Hz], by default 0.25/dt. ``free``: by default, whether its tail rule is
    "rigid"."""
    free = greens.tail == "rigid" if free is None else free
    response = frf.of_impulse_response(greens, highest=highest)
    fit = fit_poles(response, tolerance=tolerance, form=form, free=free, most_pairs=most_pairs)
    n, width = greens.values.shape[2], float(2 / response.frequency[-1])
    t: Array = greens.dt * np.arange(n, dtype=np.float64)
    pulse = hann(t[t <= width], width) * greens.dt
    filtered = np.array([[np.convolve(row, pulse)[:n] for row in rows] for rows in greens.values])
    error = float(np.abs(filtered - fit.filtered_matrix(t, width)).max() / np.abs(filtered).max())
    return fit.with_error(ErrorEstimate(error, None))


def noise_of(response: frf.FrequencyResponse) -> Array:
    """Return the standard deviation (n,) of the noise of a line, of its noisiest element, as receptance [m/N]."""
    if response.deviation is not None:
        return np.asarray(response.deviation.max(axis=(1, 2)))
    unit = response.per_receptance
    p = len(response.port_names)
    elements = [unit * response.receptance[:, i, j] for i in range(p) for j in range(i, p)]
    f, every = response.frequency, _lines_alike(response)
    largest = np.max([reading.estimate_deviation(values[::every], f[::every]) for values in elements], axis=0)
    return np.asarray(np.interp(f, f[::every], largest) / np.abs(unit))


def _lines_alike(response: frf.FrequencyResponse) -> int:
    """Return how many neighbouring lines share their noise: under an exponential window, those in its width."""
    spacing = 2 * np.pi * float(np.median(np.diff(response.frequency)))
    return int(min(1 + round(4 * response.shift / spacing), max(len(response.frequency) // 20, 1)))


def _floor_of(response: frf.FrequencyResponse, share: float) -> Array:
    """Return the misfit (n,) that counts as none: ``share`` of the root of the line's size and of the median size, as
    measured; so that it is a smaller part of resonances than of what lies between them."""
    unit = np.abs(response.per_receptance)
    size = unit * np.linalg.norm(response.receptance, axis=(1, 2))
    middle = float(np.median(size))
    return np.asarray(share * np.sqrt(np.maximum(size, 1e-3 * middle) * middle) / unit)


def _check_signal(data: FitData) -> None:
    """Raise `FrequencyResponseError` where the power of the lines is that of their noise."""
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
    """Return the data with the terms beyond the band that the lines support, and poles; then others not refuted."""
    data = replace(data, free=True)
    if not (_is_free(data, poles) if free is None else free):
        data = replace(data, free=False)
    every = data.lines(pole_choice.residual_terms(data.s))
    if 2 * left_over(data.lines(data.fixed), poles) - 2 * left_over(every, poles) > _SURE:
        zeta = np.median(-poles.pairs.real / np.abs(poles.pairs)) if len(poles.pairs) else 0.02
        return _with_modes_beyond(data, poles, float(np.clip(zeta, 0.002, 0.05)))
    return [_moved_together(data, poles)]


def _moved_together(data: FitData, poles: Poles, iterations: int = 6) -> tuple[FitData, Poles]:
    """Return the data and the poles after least squares for those in the band and those beyond it, if these stay
    there."""
    several = refined(data.lines(data.extra), data.with_beyond(poles), iterations)
    count, highest = len(poles.pairs), float(data.s.imag[-1])
    inside, above = Poles(several.pairs[:count], several.rates), several.pairs[count:]
    size = np.abs(above)
    if np.all((size > highest) & (size < _FARTHEST * highest) & (-above.real < _MOST_DAMPED * size)):
        return replace(data, above=tuple(map(complex, above))), pole_choice.within(data.s, inside)
    return data, pole_choice.within(data.s, refined(data.lines(data.fixed), poles, iterations))


def _is_free(data: FitData, poles: Poles) -> bool:
    """Return whether the lines support a mass line, beside all from above the band, and where it outweighs the rest."""
    s, terms = data.s, pole_choice.residual_terms(data.s)
    if 2 * left_over(data.lines(terms[:, :-1]), poles) - 2 * left_over(data.lines(terms), poles) < _SURE:
        return False
    columns = np.concatenate([basis(s, poles), terms], axis=1)
    amplitudes = least_squares(columns, data.elements[:, :, None], data.weights)[:, :, 0]
    mass_line = np.abs(columns[:, -1:] * amplitudes[-1]).max(axis=1)
    rest = np.abs(columns[:, :-1] @ amplitudes[:-1]).max(axis=1)
    return bool(np.sum((data.weights * mass_line)[mass_line > rest] ** 2) > _SURE)


def _with_modes_beyond(data: FitData, poles: Poles, zeta: float) -> list[tuple[FitData, Poles]]:
    """Return data and poles with as many modes beyond the band as its highest lines resolve, three at most.

    Behind them are those with more modes, which fit as well, and those with fewer whose criterion is hardly worse: of
    what they say about the response beyond the band, and so about its static part, the lines prefer none.
    """
    turn, places = -zeta + 1j * np.sqrt(1 - zeta**2), float(data.s.imag[-1]) * np.array(_BEYOND)
    candidates = [_moved_together(data, poles)]
    for _ in range(_MOST_BEYOND):
        last, _ = candidates[-1]  # its poles may have left the band to stand for what it lacks there
        more = [replace(last, above=(*last.above, complex(w * turn))) for w in places]
        place = min(more, key=lambda each: left_over(data.lines(each.fixed), poles))
        candidates.append(_moved_together(place, poles))

    everywhere = [moved.with_beyond(inside) for moved, inside in candidates]
    costs = [pole_choice.criterion(data, left_over(data.lines(data.extra), each), each) for each in everywhere]
    best = int(np.argmin(costs))
    alike = [one for k, one in enumerate(candidates) if k > best or (k < best and costs[k] - costs[best] < _SURE)]
    return [candidates[best], *alike]


def _chosen(data: FitData, poles: Poles, form: Form, floor: Array) -> tuple[Fitted, bool]:
    """Return the passive fit of the form asked for, and whether its residues are complex."""
    real: tuple[float, Fitted] | None = None
    if form != "complex":
        whole, lean = (modal_fit(data, poles, smallest) for smallest in (1e-9, _LEAN))
        lefts = [float(np.sum(_squares(data, modal.transfer(data.s) - data.g))) for modal in (whole, lean)]
        misfit, modal = (lefts[1], lean) if lefts[1] <= 1.1 * lefts[0] else (lefts[0], whole)
        real = (pole_choice.criterion(data, misfit, poles, "modal"), modal)
        enough = np.mean(np.abs(modal.transfer(data.s) - data.g) ** 2 / floor[:, None, None] ** 2) <= 1
        if form == "modal" or enough:
            return modal, False
    freely = free_residues(data, data.with_beyond(poles))
    misfit = float(np.sum(_squares(data, response_of(freely, data.s) - data.g)))
    if real is not None and real[0] <= pole_choice.criterion(data, misfit, poles):
        return real[1], False
    passive = made_passive(freely, data.port_names, data.s, data.weights)
    if passive is None:
        if real is None:
            raise frf.FrequencyResponseError(
                'the residues cannot be made passive by a small change: use form="modal", or fewer pole pairs'
            )
        return real[1], False
    misfit = float(np.sum(_squares(data, response_of(passive, data.s) - data.g)))
    if real is not None and real[0] <= pole_choice.criterion(data, misfit, poles):
        return real[1], False
    return passive.greens(data.port_names), True


def _ranges_of(data: FitData, residual: ComplexArray) -> tuple[list[tuple[float, float]], float]:
    """Return ranges of lines [Hz] whose misfit is more than the noise, the worst first, and the largest ratio (rms)."""
    squares = np.mean(np.abs(residual) ** 2, axis=(1, 2))
    mean = np.convolve(np.pad(squares, _BLOCK // 2, mode="reflect"), np.ones(_BLOCK) / _BLOCK, mode="valid")
    over, worst = np.flatnonzero(mean > BLOCK_LIMIT), float(np.sqrt(mean.max()))
    if not over.size:
        return [], worst
    runs = np.split(over, np.flatnonzero(np.diff(over) > _BLOCK) + 1)
    runs.sort(key=lambda lines: -float(mean[lines].sum()))
    f = data.s.imag / (2 * np.pi)
    return [(float(f[lines[0]]), float(f[lines[-1]])) for lines in runs[:_RANGES]], worst


def in_words(ranges: list[tuple[float, float]]) -> str:
    """Return ranges of lines as text: "from 1200 to 1310 Hz, from 4 to 4.1 kHz"."""
    return ", ".join(f"from {low:.4g} to {high:.4g} Hz" for low, high in ranges)


def _noise_of_draws(data: FitData, deviation: Array, residual: ComplexArray) -> Array:
    """Return the deviation (n,) that records are drawn with: the noise, and what the fit misses around a line."""
    squares = np.mean(np.abs(residual) ** 2, axis=(1, 2))
    width = min(51, len(squares) | 1)
    around = np.convolve(np.pad(squares, width // 2, mode="reflect"), np.ones(width) / width, mode="valid")
    missed = np.sqrt(around[: len(squares)]) / data.weights
    known = deviation * min(1.0, float(np.sqrt(np.mean(squares))))  # an estimate of the noise may be too large
    return np.asarray(np.maximum(missed, known))


def _drawn(data: FitData, poles: Poles, fitted: Fitted, complex_form: bool, noise: Array, count: int) -> list[Fitted]:
    """Return fits of the same order to the fit's own response with other noise."""
    rng = np.random.default_rng(_SEED)
    own, fits = fitted.transfer(data.s), list[Fitted]()
    for _ in range(count):
        error = rng.normal(size=own.shape) + 1j * rng.normal(size=own.shape)
        error = (error + error.transpose(0, 2, 1)) / 2 if own.shape[1] > 1 else error
        drawn = replace(data, g=own + noise[:, None, None] * error / np.sqrt(2))
        drawn, moved = _moved_together(drawn, poles, 3)
        passive = None
        if complex_form:
            together = free_residues(drawn, drawn.with_beyond(moved))
            passive = made_passive(together, data.port_names, data.s, data.weights)
        modal = _LEAN if own.shape[1] > 1 else 1e-9
        fits.append(modal_fit(drawn, moved, modal) if passive is None else passive.greens(data.port_names))
    return fits


def _report(greens: Fitted, data: FitData, response: frf.FrequencyResponse, defect: float | None) -> dict[str, object]:
    apart = np.abs(greens.transfer(data.s) - data.g)
    unit = np.abs(response.per_receptance)[:, None, None]
    complex_poles, highest = greens.pole_sum, float(response.frequency[-1])
    return {
        "form": "modal" if complex_poles is None else "complex",
        "measured_as": response.measured_as,
        "pole_pairs": int(np.sum((greens.frequencies_hz > 0) & (greens.frequencies_hz <= highest))),
        "free": data.free,
        "band_hz": [float(response.frequency[0]), highest],
        "misfit_weighted_rms": float(np.linalg.norm(data.weights[:, None, None] * apart) / data.scale),
        "misfit_rms": float(np.linalg.norm(unit * apart) / np.linalg.norm(unit * data.g)),
        "misfit_worst_of_peak": float((unit * apart).max() / np.abs(unit * data.g).max()),
        "causality_defect": defect,
        "passivity": "by construction" if complex_poles is None else str(pole_passivity(complex_poles)),
    }


def _pulse_error(greens: Fitted, draws: tuple[Fitted, ...], data: FitData, unexplained: float) -> float:
    """Return what draws change of g after the pulse of the band, with oscillations beyond it and the unexplained
    part."""
    w = data.s.imag
    width, end = float(4 * np.pi / w[-1]), float(2 * np.pi / np.median(np.diff(w)))
    t = np.linspace(0.0, min(end, 200 * width), int(min(4 * end * w[-1] / (2 * np.pi), 2000)) + 2)
    own = greens.filtered_matrix(t, width)
    peak = float(np.abs(own).max())
    changes = [float(np.abs(draw.filtered_matrix(t, width) - own).max()) for draw in draws]
    beyond = greens.above(float(w[-1])).filtered_matrix(width * np.linspace(1, 6, 200), width)
    return (_MARGIN * max(changes, default=0.0) + float(np.abs(beyond).max(initial=0.0))) / peak + unexplained
