"""Number and initial positions of the poles of a noisy response, by an information criterion, all within the band.

Sources: Schwarz, Ann. Statist. 6 (1978) 461 (the information criterion); Ewins, Modal Testing, 2nd ed., 4.4 (residual
terms in place of modes below and above the band).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.greens.base import Array, ComplexArray
from impact.measured.amplitudes import FitData, oscillators
from impact.measured.vector_fitting import Lines, Poles, fitted_poles, left_over, refined, starting_poles

ABOVE_NOISE: Final = 5.0  # least ratio of a resonance to the noise of its line
BEYOND: Final = (1.03, 1.08, 1.16, 1.3, 1.6, 2.5)  # frequencies of residual terms above the band, over the highest line
_PATIENCE: Final = 3  # number of rounds without improvement after which the search ends
_MOST_ROUNDS: Final = 20  # most rounds with more poles; limits the time for a record that no number of poles fits
_MOST_IDLE: Final = 12  # most poles that are removed again
_PROMINENCE: Final = 0.5  # least prominence of a resonance, in the logarithm of the mobility


@dataclass(frozen=True)
class Candidate:
    """Poles of one order that were tried, and their Bayesian information criterion; less is better."""

    poles: Poles
    criterion: float


def choose_poles(data: FitData, floor: Array, most: int) -> tuple[Poles, tuple[Candidate, ...]]:
    """Return the poles of least Bayesian information criterion, and all that were tried, in the order of the search.

    Residual terms represent modes outside the band. ``floor`` (n,): misfit that is acceptable whatever the noise [m/N];
    ``most``: largest number of pole pairs.
    """
    lines, most = data.lines(residual_terms(data.s)), min(most, len(data.s) // 3)
    poles = starting_poles(data.s, *_peaks(data, most))
    best, least, vain = Poles(np.zeros(0, dtype=complex), np.zeros(0)), np.inf, 0
    tried = list[Candidate]()
    for _ in range(_MOST_ROUNDS):
        poles = within(data.s, fitted_poles(lines, poles))
        poles = within(data.s, refined(lines, poles))
        cost = criterion(data, left_over(lines, poles), poles)
        tried.append(Candidate(poles, cost))
        vain = 0 if cost < least else vain + 1
        best, least = (poles, cost) if cost < least else (best, least)
        a, b = lines.posed(poles)
        size = np.linalg.norm(a, axis=0)
        rest = b - (a / size) @ np.linalg.lstsq(a / size, b, rcond=1e-13)[0]  # misfit with the best residues
        apart = (rest[: len(data.s)] + 1j * rest[len(data.s) :]) / data.weights[:, None]
        if np.mean(np.abs(apart) ** 2 / floor[:, None] ** 2) <= 1:
            return poles, tuple(tried)
        if vain >= _PATIENCE or len(poles.pairs) >= most:
            break
        # more pairs at the highest peaks of the misfit, smoothed over five lines
        smooth = np.convolve(data.weights * np.linalg.norm(apart, axis=1), np.ones(5) / 5, mode="same")
        peaks = _local_peaks(np.concatenate([[0.0], smooth, [0.0]])) - 1
        worst = data.s.imag[peaks[np.argsort(-smooth[peaks])[: max(1, len(poles.pairs) // 6)]]]
        pairs = np.concatenate([poles.pairs, (-0.01 + 1j) * worst])
        poles = Poles(pairs[np.argsort(pairs.imag)], poles.rates)
    fewer = _without_idle(data, lines, best, least)
    return (fewer[-1].poles if fewer else best), (*tried, *fewer)


def residual_terms(s: ComplexArray) -> ComplexArray:
    """Return the columns (n, 8) of residual terms: a compliance and oscillators above the band, and a mass below it."""
    highest = float(s.imag[-1])
    above = highest**2 * oscillators(s, 1j * highest * np.array(BEYOND))
    return np.concatenate([np.ones_like(s)[:, None], above, (np.abs(s).min() / s[:, None]) ** 2], axis=1)


def within(s: ComplexArray, poles: Poles) -> Poles:
    """Return the poles with frequencies and rates in the band of the lines."""
    low, high = s.imag[0], s.imag[-1]
    pairs, rates = np.abs(poles.pairs), poles.rates
    return Poles(poles.pairs[(pairs >= low) & (pairs <= high)], rates[(rates >= low) & (rates <= high)])


def criterion(data: FitData, squares: float, poles: Poles, form: str = "complex") -> float:
    """Return the information criterion of a fit with this sum of squared residuals over the variance of the noise.

    The variance is reduced, but never raised, to that of the residuals. The frequency of a pole counts as two
    parameters, as it is searched along all lines.
    """
    q = data.elements.shape[1]
    numbers = 2 * len(data.s) * q / data.alike
    expected = numbers  # real and imaginary part have half of the variance each
    squares = 2 * squares / data.alike
    fit = squares if squares >= expected else expected * (1 + math.log(max(squares / expected, 1e-300)))
    per_pair = 3 + (2 if form == "complex" else 1) * q
    return float(fit + math.log(numbers) * (per_pair * len(poles.pairs) + (1 + q) * len(poles.rates)))


def _without_idle(data: FitData, lines: Lines, poles: Poles, cost: float) -> list[Candidate]:
    """Return candidates with poles removed one after the other, as long as this improves the information criterion."""
    candidates = list[Candidate]()
    for _ in range(_MOST_IDLE):
        if len(poles.pairs) == 0:
            break
        fewer = [Poles(np.delete(poles.pairs, k), poles.rates) for k in range(len(poles.pairs))]
        fewer += [Poles(poles.pairs, np.delete(poles.rates, k)) for k in range(len(poles.rates))]
        costs = [criterion(data, left_over(lines, each), each) for each in fewer]
        least = int(np.argmin(costs))
        moved = within(data.s, refined(lines, fewer[least]))
        new = criterion(data, left_over(lines, moved), moved)
        if new >= cost:
            break
        poles, cost = moved, new
        candidates.append(Candidate(moved, new))
    return candidates


def _local_peaks(values: Array, prominence: float | None = None) -> NDArray[np.int64]:
    """Return the indices of the local maxima of at least this ``prominence``."""
    return np.asarray(scipy.signal.find_peaks(values, prominence=prominence)[0], dtype=np.int64)


def _peaks(data: FitData, most: int) -> tuple[int, Array]:
    """Return the initial number of pole pairs, and the frequencies of resonances above the noise [rad/s]."""
    size = np.linalg.norm(data.g, axis=(1, 2))
    peaks = _local_peaks(np.log(np.maximum(size * data.s.imag, 1e-300)), prominence=_PROMINENCE)
    peaks = data.s.imag[peaks[(size * data.weights)[peaks] > ABOVE_NOISE]]
    return min(max(1, len(peaks)), most), peaks
