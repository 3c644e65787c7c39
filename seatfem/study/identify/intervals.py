"""Confidence intervals of fitted keys: where the profile of the misfit exceeds its minimum by the noise's quantile.

Residuals of real records are correlated, since a model is never exact and a gauge has a limited band. A record of n
samples whose residuals have the variance s^2 over the noise and the autocorrelations rho_k counts as

    n/tau samples,   tau = 1 + 2 sum rho_k,

and its part of the sum of squares is divided by max(s^2 tau, 1): the stated noise is a lower bound. With that weight w
of each record an interval of a key ends where, with all others fitted again,

    min sum w r^2 - sum w r^2 (fit) = t^2,

t the quantile of Student's distribution for the effective number of samples minus keys. tau is summed over the lags
until the sum of two successive rho turns negative (Geyer, Statist. Sci. 7 (1992) 473); intervals by profiles: Venzon &
Moolgavkar, Appl. Statist. 37 (1988) 87.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial, reduce
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.notices import Progress, silent
from impact.quantities import in_digits

LEVEL: Final = 0.95
CLOSE: Final = 0.02  # relative accuracy of an interval's half width
TRIES: Final = 5  # largest number of points of a profile; its root is nearly linear
INNER: Final = 12  # largest number of evaluations to fit the other keys at a point of a profile
LOOSE: Final = 1e-5  # tolerance of these fits: a hundredth of one in a sum of some thousand squares
EDGE: Final = 1e-6  # distance from a bound, over the bounds, within which a fit counts as at the bound
WORSE: Final = 1.5  # misfit over the noise above which the model is reported not to reach the record
SCANNED, MOST_SCANNED = 24, 96  # points per key, and in total, of a search over the bounds
NEARER: Final = 0.9  # fraction of the misfit below which another start is reported to have found another minimum
WIDTHS: Final = (1 / 16, 1 / 64, 1 / 256)  # widths of the Gaussian, over the samples of a record
ROUGH: Final = 10  # largest number of evaluations of a fit of smoothed residuals
Vector = Callable[[Array], Array]
Indices = Sequence[int] | NDArray[np.int64]


@dataclass(frozen=True)
class Counted:
    """Weight of a record: rms ``misfit`` over the noise, correlation time ``tau`` in samples, number of ``samples``."""

    misfit: float
    tau: float
    samples: int

    @property
    def weight(self) -> float:
        """Return the factor on its residuals."""
        return 1 / max(1.0, self.misfit * math.sqrt(self.tau))


@dataclass(frozen=True)
class Interval:
    """Ends of an interval as positions within the bounds, 0..1; whether they are bounds that the record does not
    exclude; and the part of each half that is due to the time step."""

    low: float
    high: float
    at_low: bool
    at_high: bool
    of_step: float = 0.0

    def widened(self, shift: float) -> Interval:
        """Return the interval extended by a ``shift`` to either side, the error of the time step."""
        low, high = max(self.low - shift, 0.0), min(self.high + shift, 1.0)
        return Interval(low, high, self.at_low or low <= 0, self.at_high or high >= 1, shift)


def counted(residuals: Array, keys: float) -> Counted:
    """Return the weight of a record by its residuals; ``keys``: its share of the number of fitted keys."""
    n = len(residuals)
    misfit = math.sqrt(float(residuals @ residuals) / max(n - keys, 1.0))
    return Counted(misfit, correlation_time(residuals), n)


def correlation_time(residuals: Array) -> float:
    """Return the correlation time tau >= 1 in samples, at most their number."""
    n = len(residuals)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(residuals, size)  # about zero, not the mean: an offset is correlated, too
    covered = np.fft.irfft(np.abs(spectrum) ** 2, size)[:n]
    if not covered[0] > 0:
        return 1.0
    rho = covered / covered[0]
    pairs = rho[: n - n % 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    positive = pairs[: int(ends[0])] if ends.size else pairs
    return float(min(max(1.0, 2 * positive.sum() - 1), n))


def quantile(records: Sequence[Counted], keys: int) -> float:
    """Return Student's t for the effective number of samples."""
    free = sum(each.samples / each.tau for each in records) - keys
    return float(scipy.stats.t.ppf((1 + LEVEL) / 2, max(free, 1.0)))


def fit(residuals: Vector, jacobian: Vector, start: Array, most: int, tolerance: float = 1e-8) -> Any:
    """Return the least-squares fit within 0..1, with relative ``tolerance`` of positions and of the sum."""
    return scipy.optimize.least_squares(
        residuals, np.clip(start, EDGE, 1 - EDGE), jacobian, bounds=(0.0, 1.0), x_scale="jac", max_nfev=most,
        xtol=tolerance, ftol=tolerance, gtol=None,
    )  # fmt: skip


def search(
    residuals: Vector, jacobian: Vector, start: Array, most: int, lengths: Indices, progress: Progress = silent
) -> tuple[Array, str]:
    """Return the least-squares fit (P,) from a start; if it does not reach the records, the best of `descend` from this
    start or from points throughout the bounds; and a sentence on the search, or ""."""

    def worst(shares: Array) -> float:
        return max(float(np.sqrt(np.mean(part**2))) for part in np.split(residuals(shares), lengths))

    best = np.asarray(fit(residuals, jacobian, start, most).x)
    if (before := worst(best)) <= WORSE:
        return best, ""

    progress("searching", 0.0)
    ends, count, scanned = [best], min(SCANNED * len(start), MOST_SCANNED), []
    with suppress(ValueError):  # values on the path that a scene or a time integration does not allow
        ends.append(descend(residuals, jacobian, start, most, lengths))
    if all(worst(end) > WORSE for end in ends):
        draws = np.random.default_rng(1)
        points = (np.array([draws.permutation(count) for _ in start]).T + 0.5) / count  # Latin hypercube
        for number, point in enumerate(points):
            progress("searching", number / count)
            with suppress(ValueError):
                scanned.append((float(np.sum(smoothed(residuals(point), lengths, WIDTHS[1]) ** 2)), number))
        for _, number in sorted(scanned)[:2]:
            with suppress(ValueError):
                ends.append(descend(residuals, jacobian, points[number], most, lengths))
    nearest = min(ends, key=worst)
    if (after := worst(nearest)) < NEARER * before:
        words = f"from yours alone {in_digits(before, 3)} times the noise is left, so {in_digits(after, 3)} times"
        return nearest, f"the values were reached from another start than yours, or by smoothed records: {words}"
    return best, f"nothing nearer was found by smoothed records from your start and {count} points over the bounds"


def descend(residuals: Vector, jacobian: Vector, start: Array, most: int, lengths: Indices) -> Array:
    """Return the least-squares fit of residuals that are smoothed less and less, finally not at all. Short pulses that
    do not overlap have no gradient towards each other; smoothed over more than their distance, they have."""

    def roughly(first: Array, width: float) -> Array:
        smooth = partial(smoothed, lengths=lengths, width=width)
        return np.asarray(fit(lambda x: smooth(residuals(x)), lambda x: smooth(jacobian(x)), first, ROUGH, LOOSE).x)

    return np.asarray(fit(residuals, jacobian, reduce(roughly, WIDTHS, start), most).x)


def smoothed(values: Array, lengths: Indices, width: float) -> Array:
    """Return values (N,) or (N, P) smoothed by a Gaussian; ``width``: fraction of the samples of each record."""
    bell, parts = scipy.ndimage.gaussian_filter1d, np.split(values, lengths)
    return np.concatenate([bell(part, width * len(part), axis=0, mode="constant") for part in parts])


@dataclass(frozen=True)
class Valley:
    """Neighbourhood of a fit.

    Attributes:
        residuals, jacobian: weighted functions of positions within the bounds.
        best: positions (P,) of the fit.
        slope: derivatives (N, P) at the fit.
        covariance: linearised covariance (P, P) of the positions, from which a profile starts.
        t: square root of the rise of the sum of squares at the ends of an interval.
    """

    residuals: Vector
    jacobian: Vector
    best: Array
    slope: Array
    covariance: Array
    t: float

    @staticmethod
    def around(residuals: Vector, jacobian: Vector, best: Array, t: float) -> Valley:
        """Return the neighbourhood of a fit."""
        slope = jacobian(best)
        covariance = np.asarray(np.linalg.pinv(slope.T @ slope, rcond=1e-14), dtype=np.float64)
        return Valley(residuals, jacobian, best, slope, covariance, t)

    def interval(self, key: int) -> Interval:
        """Return the interval of a key by its profile."""
        least = float(np.sum(self.residuals(self.best) ** 2))
        (low, at_low), (high, at_high) = (self._end(key, least, sign) for sign in (-1, 1))
        return Interval(low, high, at_low, at_high)

    def _end(self, key: int, least: float, sign: int) -> tuple[float, bool]:
        """Return an end of an interval, and whether it is a bound."""
        best, t, spread = float(self.best[key]), self.t, float(self.covariance[key, key])
        along = self.covariance[:, key] / spread
        room = best if sign < 0 else 1 - best
        if room < EDGE:
            return (0.0 if sign < 0 else 1.0), True
        distance = min(t * math.sqrt(spread), room)
        low, high = (0.0, 0.0), (math.inf, math.inf)
        for _ in range(TRIES):
            rise = self._rise(self.best + sign * distance * along, key, least)
            if distance >= room and rise <= t:
                return (0.0 if sign < 0 else 1.0), True
            if abs(rise - t) <= CLOSE * t:
                break
            low, high = ((distance, rise), high) if rise < t else (low, (distance, rise))
            guess = distance * t / rise if rise > 0.1 * t else 3 * distance
            if math.isfinite(high[0]):
                share = (t - low[1]) / (high[1] - low[1])
                guess = low[0] + share * (high[0] - low[0])
            distance = min(guess, room)
        return best + sign * distance, False

    def _rise(self, point: Array, key: int, least: float) -> float:
        """Return the square root of the rise of the sum of squares with one key fixed and all others fitted: by the
        derivatives at the fit, or if that fails, by new ones."""
        others = np.delete(np.arange(len(point)), key)
        point = np.clip(point, 0.0, 1.0)
        residuals = self.residuals(point)
        total = float(residuals @ residuals)
        for _ in range(INNER if len(others) else 0):
            nearer = point.copy()
            nearer[others] = np.clip(
                point[others] - np.linalg.lstsq(self.slope[:, others], residuals, rcond=None)[0], 0.0, 1.0
            )
            residuals = self.residuals(nearer)
            gain = total - float(residuals @ residuals)
            if gain < -CLOSE * self.t**2:
                point = self._refitted(point, others)
                total = float(np.sum(self.residuals(point) ** 2))
                break
            point, total = nearer, total - gain
            if gain < CLOSE * self.t**2:
                break
        return math.sqrt(max(total - least, 0.0))

    def _refitted(self, x0: Array, others: NDArray[np.int64]) -> Array:
        """Return the positions with those of ``others`` fitted again, if they have any influence."""

        def whole(shares: Array) -> Array:
            positions = x0.copy()
            positions[others] = shares
            return positions

        if not np.any(self.jacobian(x0)[:, others]):
            return x0
        best = fit(
            lambda x: self.residuals(whole(x)), lambda x: self.jacobian(whole(x))[:, others], x0[others], INNER, LOOSE
        )
        return whole(np.asarray(best.x))
