"""Noise of a measured frequency response, line by line, from the record itself.

Sources: McKelvey and Guerin, IFAC Proc. 45 (2012) 424, and Schoukens et al., Mech. Syst. Signal Process. 20 (2006) 897
(local rational and polynomial models of a frequency response); Bendat and Piersol, Random Data, 4th ed., 9.2 (the
variance of a response from its coherence).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.base import Array, ComplexArray

HALF: Final = 7  # lines on either side that a local model is fitted to
SMOOTH: Final = 61  # lines at least over which the noise keeps its course
_MODELS: Final = ((7, 2), (7, 4), (4, 2))  # half width and degree of numerator and denominator
_MUCH_LESS: Final = 0.3  # of the variance that another local model leaves: it resolves what the first does not
_OUTLIER: Final = 30.0  # times its model, from which on a local variance is a resonance that no local model resolves
_LEAST_COHERENCE: Final = 1e-4


def deviation_by_coherence(values: ArrayLike, coherence: ArrayLike, averages: int) -> Array:
    """Return the standard deviation of a complex response, whose squared magnitude is E|error|^2, from its coherence.

    The variance of |H| over |H|^2 is (1 - g2)/(2 g2 n); real and imaginary part together have twice that. It is taken
    over neighbouring lines: where noise outweighs a response, lines that it happens to make small would seem exact.
    """
    share = np.clip(np.asarray(coherence, dtype=float), _LEAST_COHERENCE, 1.0)
    variance = np.abs(np.asarray(values)) ** 2 * (1 - share) / (share * averages)
    width = min(2 * HALF + 1, (len(variance) - 1) | 1)
    around = np.pad(variance, width // 2, mode="reflect")
    return np.asarray(np.sqrt(np.convolve(around, np.ones(width) / width, mode="valid")))


def estimate_deviation(values: ComplexArray, frequency: Array) -> Array:
    """Return the standard deviation (n,) of one response, from what neighbouring lines have beyond a smooth course.

    A rational function is fitted to each line and its neighbours; what it leaves is noise. The noise's course is
    a sum of what electronics and conversions leave: a constant, a part of the response, and parts that fall and rise
    as the square of the frequency; times what the running median of the local estimates tells in addition.
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
    """Return the variance about rational functions of the line's number, and their magnitude in the middle."""
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
    """Return the variance (n,) as a positive sum of a few courses, by reweighted least squares without outliers."""
    from scipy.optimize import nnls  # here, for its import alone takes longer than many a scene

    middle = np.sqrt(frequency[0] * frequency[-1])
    courses = (np.ones_like(frequency), smooth**2, (frequency / middle) ** -4, (frequency / middle) ** 4)
    columns = np.stack([course / max(course.max(), 1e-300) for course in courses], axis=1)
    model = np.full(len(variance), float(np.median(variance)))
    for _ in range(12):
        near = variance < _OUTLIER * model
        if np.sum(near) < columns.shape[1] + 2:
            return model
        amplitudes = nnls(columns[near] / model[near, None], variance[near] / model[near])[0]
        model = np.maximum(columns @ amplitudes, 1e-6 * float(np.median(variance)))
    return model


def _running_median(values: Array, width: int) -> Array:
    from scipy.ndimage import median_filter  # as above

    return np.asarray(median_filter(values, size=min(width | 1, len(values)), mode="reflect"))
