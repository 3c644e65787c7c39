"""The Hann pulse that states a bandwidth, and the exact response of oscillators and exponentials to it.

p(s) = (1 - cos(2 pi s/T))/T on [0, T], T = 1/bandwidth: unit area, -6 dB at the bandwidth, zero at twice it, falling
like 1/f^3 beyond. Reduction errors are measured on g convolved with p, since g itself jumps.
"""

from __future__ import annotations

import numpy as np

from impact.greens.answers import Array, ComplexArray


def hann(t: Array, width: float) -> Array:
    """Return p(t) [1/s]."""
    return np.where((t >= 0) & (t <= width), 1 - np.cos(2 * np.pi * t / width), 0.0) / width


def error_times(duration: float, width: float, limit: int = 4000) -> Array:
    """Return times at which errors are measured: ten per pulse width (forty in the first two), ``limit`` at most."""
    n = int(np.clip(np.ceil(10 * duration / width), 16, limit))
    return np.unique(np.concatenate([np.linspace(0, min(2 * width, duration), 81), np.linspace(0, duration, n + 1)]))


def mode_responses(omega: Array, zeta: Array, t: Array, width: float) -> Array:
    """Return the (M, nt) displacement of each oscillator of unit mass after the pulse [s]."""
    rigid, late = omega == 0, np.maximum(t, 0.0)
    out = np.zeros((len(omega), len(t)))
    early = late**2 / 2 - (1 - np.cos(2 * np.pi * late / width)) * (width / (2 * np.pi)) ** 2
    out[rigid] = np.where(late < width, early / width, late - width / 2)
    out[~rigid] = _oscillators(t, width, omega[~rigid], zeta[~rigid])
    return out


def combine(rows: Array, responses: Array, columns: Array | None = None) -> Array:
    """Return the (p, q, nt) sum over modes of rows_ki columns_kj responses_kt; ``columns`` as ``rows`` by default."""
    columns = rows if columns is None else columns
    return np.stack([(columns * row[:, None]).T @ responses for row in rows.T])


def _oscillators(t: Array, width: float, omega: Array, zeta: Array) -> Array:
    """Return the difference of the responses of the two poles, divided by their distance."""
    apart = np.where(np.abs(zeta - 1) < 1e-7, 1 - 1e-7, zeta)  # the double pole, to 1e-7
    wd = omega * np.sqrt((1 - apart**2).astype(complex))
    out = np.empty((len(omega), len(t)))
    under = apart < 1
    out[under] = exponentials((-apart * omega + 1j * wd)[under], t, width).imag / wd[under].real[:, None]
    if np.any(~under):
        gap = wd[~under].imag
        fast = (apart * omega)[~under] + gap
        slow = omega[~under] ** 2 / fast
        pair = [decay_responses(rate, t, width) for rate in (slow, fast)]
        out[~under] = (pair[0] - pair[1]) / (2 * gap[:, None])
    return out


def decay_responses(rates: Array, t: Array, width: float) -> Array:
    """Return the (R, nt) responses, each exp(-rate t) after the pulse."""
    return exponentials(-rates.astype(complex), t, width).real


def exponentials(poles: ComplexArray, t: Array, width: float) -> ComplexArray:
    """Return the (poles, nt) integral of p(s) exp(pole (t - s)) over 0 < s < min(t, T); 0 for t < 0."""
    t = np.maximum(t, 0.0)
    out = np.empty((len(poles), len(t)), dtype=complex)
    early = t < width
    out[:, early] = _during(t[early], width, poles)
    out[:, ~early] = _during(np.array([width]), width, poles) * np.exp(np.outer(poles, t[~early] - width))
    return out


def _during(t: Array, width: float, poles: ComplexArray) -> ComplexArray:
    total = np.zeros((len(poles), len(t)), dtype=complex)
    for turn, weight in ((0.0, 1.0), (1.0, -0.5), (-1.0, -0.5)):
        frequency = 2j * np.pi * turn / width
        x = np.outer(poles - frequency, t)
        safe = np.where(x == 0, 1.0, x)
        ratio = np.where(np.abs(x) < 1e-8, 1 + x / 2, np.expm1(safe) / safe)
        total += weight * np.exp(frequency * t) * t * ratio
    return np.asarray(total / width, dtype=complex)
