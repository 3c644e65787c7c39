"""Averages and Fourier transforms of a force that is constant over each step, both exact."""

from __future__ import annotations

from typing import Literal

import numpy as np

from impact.greens.base import Array

Window = Literal["moving average", "hann"]
MOVING_AVERAGE: Window = "moving average"


def averaged(force: Array, dt: float, width: float, window: Window) -> Array:
    """Return the (n + 1,) average over ``width`` [s] around t = 0, dt ... n dt of ``force`` (n,) [N], zero outside."""
    n = len(force)
    if window == MOVING_AVERAGE:
        time = dt * np.arange(n + 1)
        integral = np.concatenate([[0.0], np.cumsum(force) * dt])
        after, before = (np.interp(time + shift, time, integral) for shift in (width / 2, -width / 2))
        return np.asarray((after - before) / width)
    reach = min(int(width / (2 * dt)) + 1, n)  # steps that the window sees on either side
    edges = np.clip(np.arange(-reach, reach + 1) * dt / width, -0.5, 0.5)
    weights = np.diff(edges + np.sin(2 * np.pi * edges) / (2 * np.pi))
    size = 1 << (n + 2 * reach).bit_length()
    whole = np.fft.irfft(np.fft.rfft(weights, size) * np.fft.rfft(force, size), size)
    return np.asarray(whole[reach - 1 : reach + n])


def largest_average(force: Array, dt: float, width: float) -> float:
    """Return the largest average of ``force`` (n,) over ``width`` [s]: its span begins or ends with a step [N]."""
    return float(largest_averages(force[:, None], dt, width)[0])


def largest_averages(force: Array, dt: float, width: float) -> Array:
    """Return the (N,) `largest_average` of each column of ``force`` (n, N)."""
    last, span = len(force), width / dt
    whole = min(int(span), last)
    share = span - whole if whole < last else 0.0
    integral = np.concatenate([np.zeros((1, force.shape[1])), np.cumsum(force, axis=0) * dt])
    held = np.concatenate(
        [np.repeat(integral[:1], whole + 1, axis=0), integral, np.repeat(integral[-1:], whole + 1, axis=0)]
    )
    rows = slice(whole + 1, whole + 2 + last)
    begins = (1 - share) * held[2 * whole + 1 :][: last + 1] + share * held[2 * whole + 2 :][: last + 1] - held[rows]
    ends = held[rows] - (1 - share) * held[1 : last + 2] - share * held[: last + 1]
    return np.asarray(np.maximum(begins.max(axis=0), ends.max(axis=0)) / width)


def transform(force: Array, dt: float, size: int) -> tuple[Array, Array]:
    """Return the frequencies [Hz] and |N(f)| [N s] of ``force`` (n,) [N], followed by zeros up to ``size`` steps."""
    frequencies = np.asarray(np.fft.rfftfreq(size, dt), dtype=np.float64)
    return frequencies, np.asarray(np.abs(np.fft.rfft(force, size)) * dt * np.sinc(frequencies * dt))
