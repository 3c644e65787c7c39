"""From a measured response to a passive Green's function: poles, residues, and what they miss."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array, ComplexArray, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens
from impact.greens.poles import PoleGreens
from impact.greens.pulse import hann
from impact.greens.sampled import SampledGreens
from impact.measured.amplitudes import FitData, free_residues, modal_fit, response_of
from impact.measured.frf import (
    FrequencyResponse,
    FrequencyResponseError,
    causality_defect,
    moves_away,
    of_impulse_response,
)
from impact.measured.passive_residues import made_passive
from impact.measured.pole_passivity import pole_passivity
from impact.measured.vector_fitting import Poles, fitted_poles, starting_poles

Form = Literal["auto", "modal", "complex"]
NOT_CAUSAL = 0.5  # causality defect from which a response is refused
_FLOOR = 1e-3  # of the largest response: lines below count no more than it
_ABOVE_NOISE = 5.0  # times the noise of a line: what counts as a resonance, and the least size that weights regard
_GAIN = 0.9  # so many rounds of more poles must lower the misfit to this part
_PATIENCE = 3
_LEAN = 0.01  # of a mode's amplitude matrix: what noise adds to its rank one
_ENOUGH = 1.25  # real modes are preferred while their misfit is below this multiple of the complex poles'


def fit_poles(
    response: FrequencyResponse,
    *,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> ModalGreens | PoleGreens:
    """A passive sum of poles through a measured response.

    The poles by vector fitting, more of them until the relative misfit (rms, weighted by |G|^(-1/2)) is below
    ``tolerance``, or the noise, or stands still. Then either:

        "modal":   g_ij = sum of damped oscillators with positive matrices of amplitudes, relaxations and a bare
                   compliance, by least squares under these signs: passive by construction (uncoupled modes);
        "complex": `PoleGreens` with free residues, changed as little as makes them passive (modes coupled by damping);
        "auto":    real modes unless complex poles miss the response by less than 1/1.25 of what they miss.

    What lies above the band is a bare compliance, what lies below is not known. ``error.reduction`` is the misfit after
    a Hann pulse whose spectrum ends with the band (-6 dB at half the highest line), over the largest response to it;
    ``origin["fit"]`` holds misfit, causality, passivity and order.

    Args:
        free: whether the body can move away (a term -1/(m w^2)); by default, whether the lowest lines fall as f^-2.
        most_pairs: limit of pole pairs.

    Raises:
        FrequencyResponseError: not causal, a misfit above one half, a "complex" fit that cannot be made passive.
    """
    if form not in get_args(Form):
        raise FrequencyResponseError(f"form {form!r} is unknown; choose from {', '.join(get_args(Form))}")
    defect = causality_defect(response) if response.shift == 0 else None
    if defect is not None and defect > NOT_CAUSAL:
        raise FrequencyResponseError(
            f"not causal: {defect:.0%} of the energy comes before the blow; where the phase is that of exp(-i w t), "
            "give the conjugate values; otherwise remove the delay between the channels"
        )
    data = _data(response, free)
    poles = _poles(data, tolerance, most_pairs)
    candidates: list[tuple[float, ModalGreens | PoleGreens]] = []
    freely = free_residues(data, poles)
    best = data.misfit(response_of(freely, data.s))
    if form != "complex":
        whole, lean = (modal_fit(data, poles, smallest) for smallest in (1e-9, _LEAN))
        misfits = [data.misfit(modal.transfer(data.s)) for modal in (whole, lean)]
        candidates.append((misfits[1], lean) if misfits[1] <= 1.05 * misfits[0] else (misfits[0], whole))
    if form == "complex" or (form == "auto" and candidates[0][0] > max(_ENOUGH * best, tolerance)):
        passive = made_passive(freely, data.port_names, data.s, data.weights)
        if passive is None and form == "complex":
            raise FrequencyResponseError(
                'the residues cannot be made passive by a small change: use form="modal", or fewer pole pairs'
            )
        if passive is not None:
            candidates.append((data.misfit(response_of(passive, data.s)), passive.greens(data.port_names)))
    misfit, chosen = min(candidates, key=lambda candidate: candidate[0])
    if misfit > 0.5:
        raise FrequencyResponseError(
            f"the fit misses {misfit:.0%} of the response with {len(poles.pairs)} pole pairs: check units and phase, "
            "or leave noisy lines out"
        )
    return _reported(chosen, data, response, misfit, defect)


def fit_impulse_response(
    greens: SampledGreens,
    *,
    highest: float | None = None,
    tolerance: float = 0.01,
    form: Form = "auto",
    free: bool | None = None,
    most_pairs: int = 80,
) -> ModalGreens | PoleGreens:
    """`fit_poles` of a sampled g, which need not have come to rest: an exponential window is laid over it and taken off
    the poles. ``highest``: band [Hz], by default 0.25/dt. ``free``: by default, whether its tail rule is "rigid"."""
    free = greens.tail == "rigid" if free is None else free
    response = of_impulse_response(greens, highest=highest)
    fit = fit_poles(response, tolerance=tolerance, form=form, free=free, most_pairs=most_pairs)
    error = _sampled_error(greens, fit, float(2 / response.frequency[-1]))
    return fit.with_error(ErrorEstimate(error, None))


def _data(response: FrequencyResponse, free: bool | None) -> FitData:
    g = response.receptance
    size = np.linalg.norm(g, axis=(1, 2))
    free = moves_away(response) if free is None else free
    weights = 1 / np.sqrt(np.maximum(size, max(_FLOOR * size.max(), _ABOVE_NOISE * _noise(g))))
    return FitData(response.lines, g, np.asarray(weights), free, response.port_names)


def _poles(data: FitData, tolerance: float, most: int) -> Poles:
    """The fewest poles that reach the tolerance, or beyond which more are in vain."""
    p = len(data.port_names)
    elements = [(i, j) for i in range(p) for j in range(i, p)]
    responses = np.stack([data.g[:, i, j] for i, j in elements], axis=1)
    weights = np.stack([data.weights * (1 if i == j else np.sqrt(2)) for i, j in elements], axis=1)
    most = min(most, len(data.s) // 3)
    poles = starting_poles(data.s, *_peaks(data, most))
    enough = max(tolerance, _noise(data.g) * float(np.linalg.norm(data.weights)) / data.scale)
    found: list[tuple[float, Poles]] = []
    while True:
        poles = fitted_poles(data.s, responses, weights, data.extra, poles)
        apart = data.weights * np.linalg.norm(response_of(free_residues(data, poles), data.s) - data.g, axis=(1, 2))
        found.append((float(np.linalg.norm(apart) / data.scale), poles))
        vain = len(found) > _PATIENCE and found[-1][0] > _GAIN * found[-1 - _PATIENCE][0]
        if found[-1][0] <= enough or vain or len(poles.pairs) >= most:
            break
        poles = _with_more(poles, data.s, apart, max(1, len(poles.pairs) // 6))
    least = min(misfit for misfit, _ in found)
    return next(poles for misfit, poles in found if misfit <= max(enough, least / _GAIN))


def _noise(g: ComplexArray) -> float:
    """Of one line, from the second differences of the lines: the median leaves resonances out."""
    return float(np.median(np.linalg.norm(np.diff(g, 2, axis=0), axis=(1, 2))) / np.sqrt(6))


def _local_peaks(values: Array, prominence: float | None = None) -> NDArray[np.int64]:
    """Indices of the local maxima that stand out of their surroundings by ``prominence``."""
    from scipy.signal import find_peaks  # here, for its import alone takes longer than many a scene

    return np.asarray(find_peaks(values, prominence=prominence)[0], dtype=np.int64)


def _peaks(data: FitData, most: int) -> tuple[int, Array]:
    """How many pole pairs to begin with, and the resonances that stand out of the noise [rad/s]."""
    size = np.linalg.norm(data.g, axis=(1, 2))
    peaks = _local_peaks(np.log(size * data.s.imag), prominence=0.5)
    peaks = data.s.imag[peaks[size[peaks] > _ABOVE_NOISE * _noise(data.g)]]
    return min(max(1, len(peaks)), most), peaks


def _with_more(poles: Poles, s: ComplexArray, apart: Array, count: int) -> Poles:
    """``count`` pairs more, where the fit is worst: at the highest peaks of the misfit, smoothed over five lines."""
    smooth = np.convolve(apart, np.ones(5) / 5, mode="same")
    peaks = _local_peaks(np.concatenate([[0.0], smooth, [0.0]])) - 1
    worst = s.imag[peaks[np.argsort(-smooth[peaks])[:count]]]
    pairs = np.concatenate([poles.pairs, (-0.01 + 1j) * worst])
    return Poles(pairs[np.argsort(pairs.imag)], poles.rates)


def _reported(
    greens: ModalGreens | PoleGreens, data: FitData, response: FrequencyResponse, misfit: float, defect: float | None
) -> ModalGreens | PoleGreens:
    apart = np.abs(greens.transfer(data.s) - data.g)
    complex_poles = greens.pole_sum
    report = {
        "form": "modal" if complex_poles is None else "complex",
        "pole_pairs": int(np.sum(greens.frequencies_hz > 0)),
        "free": data.free,
        "band_hz": [float(response.frequency[0]), float(response.frequency[-1])],
        "misfit_weighted_rms": misfit,
        "misfit_rms": float(np.linalg.norm(apart) / np.linalg.norm(data.g)),
        "misfit_worst_of_peak": float(apart.max() / np.abs(data.g).max()),
        "causality_defect": defect,
        "passivity": "by construction" if complex_poles is None else str(pole_passivity(complex_poles)),
    }
    error = _pulse_error(greens, data, response) if response.shift == 0 else None
    return replace(greens, error=ErrorEstimate(error, None), origin={**response.origin, "fit": report})


def _pulse_error(greens: ModalGreens | PoleGreens, data: FitData, response: FrequencyResponse) -> float:
    """Largest |(1/pi) Re integral of dG P exp(i w t) dw|, t over one period of the lines, and what oscillations beyond
    the band, whose frequencies nobody measured, leave after the pulse; over the largest filtered g."""
    f, w = response.frequency, data.s.imag
    width = float(2 / f[-1])
    u = w * width / (2 * np.pi)
    near = np.abs(1 - u**2) < 1e-9
    pulse = np.exp(-1j * np.pi * u) * np.where(near, 0.5, np.sinc(u) / np.where(near, 1.0, 1 - u**2))
    apart = (greens.transfer(data.s) - data.g) * (pulse * np.gradient(w))[:, None, None]
    end = float(1 / np.median(np.diff(f)))
    t = np.linspace(0.0, end, int(min(4 * end * f[-1], 8000)) + 2)
    largest = 0.0
    for start in range(0, len(t), 256):
        turns = np.exp(1j * np.outer(t[start : start + 256], w))
        largest = max(largest, float(np.abs(np.tensordot(turns, apart, axes=1).real).max()) / np.pi)
    beyond = greens.above(float(w[-1])).filtered_matrix(width * np.linspace(1, 6, 200), width)
    peak = float(np.abs(greens.filtered_matrix(t[t <= 200 * width], width)).max())
    return (largest + float(np.abs(beyond).max(initial=0.0))) / peak


def _sampled_error(greens: SampledGreens, fit: GreensFunction, width: float) -> float:
    n = greens.values.shape[2]
    t: Array = greens.dt * np.arange(n, dtype=np.float64)
    pulse = hann(t[t <= width], width) * greens.dt
    filtered = np.array([[np.convolve(row, pulse)[:n] for row in rows] for rows in greens.values])
    return float(np.abs(filtered - fit.filtered_matrix(t, width)).max() / np.abs(filtered).max())
