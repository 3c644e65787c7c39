"""The damped oscillator q'' + 2 zeta w q' + w^2 q = f, exact for any w >= 0 and zeta >= 0, and the Hann pulse that
defines a bandwidth.

One set of formulas covers rigid bodies (w = 0), light, critical and heavy damping without loss of digits; all functions
broadcast. Source: Duhamel's integral, e.g. Clough & Penzien, Dynamics of Structures, ch. 6.

p(s) = (1 - cos(2 pi s/T))/T on [0, T], T = 1/bandwidth: unit area, -6 dB at the bandwidth, zero at twice it, decaying
like 1/f^3 above. Reduction errors are measured on g convolved with p, since g itself has jumps.
"""

import math
from typing import TypeVar

import numpy as np

from impact.greens.base import Array, ComplexArray

_Numbers = TypeVar("_Numbers", Array, ComplexArray)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def expm1_over(x: _Numbers) -> _Numbers:
    """Return (exp(x) - 1)/x, and 1 at x = 0."""
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, 1.0, np.expm1(safe) / safe)


def decaying_pair(t: Array, omega: Array, zeta: Array) -> tuple[Array, Array]:
    """Return exp(-zeta w t) times (cos(wd t), sin(wd t)/wd); hyperbolic for zeta > 1, t for wd = 0. Units 1 and s."""
    t, omega, zeta = np.broadcast_arrays(np.asarray(t, float), np.asarray(omega, float), np.asarray(zeta, float))
    wd = omega * np.sqrt(np.abs((1.0 - zeta) * (1.0 + zeta)))
    under = zeta < 1
    if np.all(under):  # the same in a third of the time
        decay, phase = np.exp(-zeta * omega * t), wd * t
        return decay * np.cos(phase), decay * t * np.sinc(phase / np.pi)
    # slow and fast rates of the overdamped pair; the slow one without cancellation
    fast = np.where(under, zeta * omega, zeta * omega + wd)
    slow = np.where(under, zeta * omega, omega / np.where(under, 1.0, zeta + np.sqrt(np.maximum(zeta**2 - 1, 0.0))))
    decay = np.exp(-slow * t)
    phase = np.where(under, wd * t, 0.0)
    cosine = np.where(under, decay * np.cos(phase), (decay + np.exp(-fast * t)) / 2)
    sine = np.where(
        under, decay * t * np.sinc(phase / np.pi), decay * t * expm1_over(np.where(under, 0.0, -2 * wd * t))
    )
    return cosine, sine


def impulse_response(t: Array, omega: Array, zeta: Array) -> Array:
    """Return h(t) = exp(-zeta w t) sin(wd t)/wd [s]."""
    return decaying_pair(t, omega, zeta)[1]


def step_response(t: Array, omega: Array, zeta: Array) -> Array:
    """Return the integral of h from 0 to t [s^2]: (1 - exp(-zeta w t)(cos wd t + zeta w sin(wd t)/wd))/w^2, t^2/2 for w
    = 0."""
    t, omega, zeta = np.broadcast_arrays(np.asarray(t, float), np.asarray(omega, float), np.asarray(zeta, float))
    cosine, sine = decaying_pair(t, omega, zeta)
    short = omega * t * (1 + zeta) < 0.5  # where 1 - cos loses digits, Gauss quadrature of h is exact to round-off
    safe = np.where(short, 1.0, omega)
    closed: Array = (1.0 - cosine - zeta * omega * sine) / safe**2
    heavy = (zeta > 2) & ~short
    if np.any(heavy):  # t [E(s t) - E(f t)]/(f - s), E(x) = (1 - exp(-x))/x, slow and fast rates
        closed, (time, w, z) = np.array(closed), (each[heavy] for each in (t, omega, zeta))
        wd = w * np.sqrt((z - 1) * (z + 1))
        fast = z * w + wd
        closed[heavy] = time * (expm1_over(-(w * (w / fast)) * time) - expm1_over(-fast * time)) / (2 * wd)
    if not np.any(short):
        return closed
    out = np.array(closed)
    out[short] = _integrate(t[short], omega[short], zeta[short], 1)
    return out


def _integrate(t: Array, omega: Array, zeta: Array, times: int) -> Array:
    """Return h integrated from 0 to t once or several ``times``, the integral of h(s) (t - s)^(times - 1)/(times - 1)!,
    by Gauss quadrature that is exact to round-off for short times t [s^(times + 1)]."""
    s, rest = t[:, None] * (1 + _NODES) / 2, t[:, None] * (1 - _NODES) / 2
    kernel = rest ** (times - 1) / math.factorial(times - 1)
    return np.asarray(t / 2 * ((impulse_response(s, omega[:, None], zeta[:, None]) * kernel) @ _WEIGHTS))


def ramp_response(t: Array, omega: Array, zeta: Array) -> Array:
    """Return the integral of the step response from 0 to t [s^3]: the response to a force t."""
    t, omega, zeta = np.broadcast_arrays(np.asarray(t, float), np.asarray(omega, float), np.asarray(zeta, float))
    short = omega * t * (1 + zeta) < 0.5  # where the difference below loses digits
    safe = np.where(short, 1.0, omega)
    stepped, impulse = step_response(t, omega, zeta), impulse_response(t, omega, zeta)
    out: Array = (t - impulse - 2 * zeta * omega * stepped) / safe**2
    if np.any(short):
        out[short] = _integrate(t[short], omega[short], zeta[short], 2)
    return out


def ramp_integral(t: Array, omega: Array, zeta: Array) -> Array:
    """Return the integral of the ramp response from 0 to t [s^4]: the response to a force t^2/2."""
    t, omega, zeta = np.broadcast_arrays(np.asarray(t, float), np.asarray(omega, float), np.asarray(zeta, float))
    short = omega * t * (1 + zeta) < 0.5  # where the difference below loses digits
    safe = np.where(short, 1.0, omega)
    ramped, stepped = ramp_response(t, omega, zeta), step_response(t, omega, zeta)
    out: Array = (t**2 / 2 - stepped - 2 * zeta * omega * ramped) / safe**2
    if np.any(short):
        out[short] = _integrate(t[short], omega[short], zeta[short], 3)
    return out


def transition(dt: float, omega: Array, zeta: Array) -> tuple[Array, Array]:
    """Return the exact step for a constant force: [q, q'] <- A [q, q'] + B f; A (2, 2, M), B (2, M)."""
    step = np.full(np.shape(omega), dt)
    a = free_transition(step, omega, zeta)
    return a, np.array([step_response(step, omega, zeta), a[0, 1]])


def free_transition(t: Array, omega: Array, zeta: Array) -> Array:
    """Return A (2, 2, ...) over times ``t`` without force: [q, q'] <- A [q, q']; a rigid motion has w = 0."""
    cosine, sine = decaying_pair(t, omega, zeta)
    return np.array([[cosine + zeta * omega * sine, sine], [-(omega**2) * sine, cosine - zeta * omega * sine]])


def dissipation_form(dt: float, omega: Array, zeta: Array) -> Array:
    """Return D (4, 4, M) with 2 zeta w * integral of q'^2 over one step = x' D x, x = (q, q', f, b) at its start.

    The force is f + b (t/dt - 1/2). The integral of products of exponentials is in closed form if that keeps its
    digits, otherwise by Gauss quadrature on panels that resolve both the oscillation and the decay.
    """
    out = np.zeros((4, 4, len(omega)))
    closed = (omega * dt > 0.5) & (zeta > 0) & (zeta < 0.5)
    out[:, :, closed] = _closed_gram(dt, omega[closed], zeta[closed])
    others = ~closed & (omega > 0) & (zeta > 0)
    slow = others & (omega * dt * np.maximum(1.0, 2 * zeta) <= 0.5)  # one panel each, all at once
    whole = np.zeros((1, 1)), np.full((1, 1), dt)
    out[:, :, slow] = _panel_gram(dt, *whole, omega[slow, None], zeta[slow, None])
    for k in np.flatnonzero(others & ~slow):
        edges = _panels(dt, float(omega[k]), float(zeta[k]))
        panels = _panel_gram(dt, edges[:-1, None], edges[1:, None], omega[k], zeta[k])
        out[:, :, k] = panels.sum(axis=-1)
    return np.asarray(2 * zeta * omega * out)


def _closed_gram(dt: float, w: Array, z: Array) -> Array:
    """Return the integral (4, 4, M) over [0, dt] of v v' with v = k + Re(c exp(lambda t)), for light damping."""
    wd = w * np.sqrt((1 - z) * (1 + z))
    rate = -z * w + 1j * wd
    twice = np.expm1(2 * rate * dt) / (2 * rate)
    once = -np.expm1(-2 * z * w * dt) / (2 * z * w)
    c = np.array([1j * w**2 / wd, 1 + 1j * z * w / wd, -1j / wd, 0.5j / wd - (1 - 1j * z * w / wd) / (w**2 * dt)])
    out = np.asarray(np.real(c[:, None] * c[None] * twice + c[:, None] * c[None].conj() * once) / 2)
    even = 1 / (w**2 * dt)  # the part k, of b alone
    crossed = even * np.real(c * np.expm1(rate * dt) / rate)
    out[3] += crossed
    out[:, 3] += crossed
    out[3, 3] += even**2 * dt
    return out


def _panel_gram(dt: float, start: Array, end: Array, w: Array, z: Array) -> Array:
    """Return the integrals (4, 4, m) of v v' over each [start, end] (m, 1), where q'(t) = v(t) . (q0, q'0, f, b)."""
    half = (end - start) / 2
    t = (end + start) / 2 + half * _NODES
    cosine, sine = decaying_pair(t, w, z)
    v = np.array([-(w**2) * sine, cosine - z * w * sine, sine, step_response(t, w, z) / dt - sine / 2])
    return np.asarray(np.einsum("ian,jan,n->ija", v, v, _WEIGHTS) * half[:, 0])


def _panels(dt: float, w: float, z: float) -> Array:
    """Return panel edges: half a radian (or a decay time) wide at first, geometric after the fast part has decayed."""
    width = 0.5 / (w * max(1.0, 2 * z))
    slow = z * w if z < 1 else w / (2 * z)
    end = 40.0 / slow if slow * dt > 40.0 else dt
    if end <= width:
        return np.array([0.0, end])
    dense = min(end, 40.0 / (z * w))
    n = int(np.ceil(dense / width))
    edges = np.linspace(0.0, dense, n + 1) if n <= 100_000 else np.linspace(0.0, dense, 100_001)
    if dense < end:
        m = int(np.ceil(np.log2(end / dense) * 4)) + 1
        edges = np.concatenate([edges, np.geomspace(dense, end, m + 1)[1:]])
    return edges


def hann(t: Array, width: float) -> Array:
    """Return the Hann pulse p(t) of unit area and total ``width`` [s], in 1/s."""
    return np.where((t >= 0) & (t <= width), 1 - np.cos(2 * np.pi * t / width), 0.0) / width


def error_times(duration: float, width: float) -> Array:
    """Return the times of error measurements: ten per pulse width (forty in the first two), at most 4000."""
    n = int(np.clip(np.ceil(10 * duration / width), 16, 4000))
    return np.unique(np.concatenate([np.linspace(0, min(2 * width, duration), 81), np.linspace(0, duration, n + 1)]))


def mode_responses(omega: Array, zeta: Array, t: Array, width: float) -> Array:
    """Return the displacement (M, nt) of each oscillator of unit mass after the pulse [s]."""
    rigid, late = omega == 0, np.maximum(t, 0.0)
    out = np.zeros((len(omega), len(t)))
    early = late**2 / 2 - (1 - np.cos(2 * np.pi * late / width)) * (width / (2 * np.pi)) ** 2
    out[rigid] = np.where(late < width, early / width, late - width / 2)
    out[~rigid] = _oscillators(t, width, omega[~rigid], zeta[~rigid])
    return out


def combine(rows: Array, responses: Array, columns: Array) -> Array:
    """Return the sum over modes of rows_ki columns_kj responses_kt (p, q, nt)."""
    return np.stack([(columns * row[:, None]).T @ responses for row in rows.T])


def _oscillators(t: Array, width: float, omega: Array, zeta: Array) -> Array:
    """Return the responses (M, nt) of oscillators with w > 0, by the difference of those of their two poles."""
    ratio = np.where(np.abs(zeta - 1) < 1e-7, 1 - 1e-7, zeta)  # a double pole is changed by 1e-7
    wd = omega * np.sqrt((1 - ratio**2).astype(complex))
    out = np.empty((len(omega), len(t)))
    under = ratio < 1
    out[under] = exponentials((-ratio * omega + 1j * wd)[under], t, width).imag / wd[under].real[:, None]
    if np.any(~under):
        gap = wd[~under].imag
        fast = (ratio * omega)[~under] + gap
        slow = omega[~under] ** 2 / fast
        pair = [decay_responses(rate, t, width) for rate in (slow, fast)]
        out[~under] = (pair[0] - pair[1]) / (2 * gap[:, None])
    return out


def decay_responses(rates: Array, t: Array, width: float) -> Array:
    """Return the responses (R, nt), each exp(-rate t) after the pulse."""
    return exponentials(-rates.astype(complex), t, width).real


def exponentials(poles: ComplexArray, t: Array, width: float) -> ComplexArray:
    """Return the integral (poles, nt) of p(s) exp(pole (t - s)) over 0 < s < min(t, T); 0 for t < 0."""
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
        total += weight * np.exp(frequency * t) * t * expm1_over(np.outer(poles - frequency, t))
    return np.asarray(total / width, dtype=complex)
