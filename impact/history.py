"""Memory of the past inside the contact loop: exact pole recursion, and a blocked FFT for step weights.

The march is one compiled loop over steps. Poles are advanced exactly for a force constant over the step; step
weights are summed directly inside a block, and past blocks are folded in by FFT as soon as they are complete
(relaxed convolution: Hairer, Lubich & Schlichte, SIAM J. Sci. Stat. Comput. 6 (1985) 532), O(n log^2 n) in total.

All that the loop calls is in this file: numba's cache is renewed when the caller's own file changes, not when another
file that it calls into does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from impact import oscillator
from impact.greens import Array
from impact.laws import SIGNORINI, SPRING
from impact.modal import ModalGreens

BLOCK = 512


@dataclass(frozen=True)
class Recursion:
    """The poles of one body seen from one port, scaled so that the port's displacement is a plain sum.

    Attributes:
        coefficients: (6, M) rows a11, a12, a21, a22, b1, b2 of the exact step.
        q, p: (M,) state, advanced in place by the march.
        decay, gain, y: (R,) relaxations: y <- decay * y + gain * force.
    """

    coefficients: Array
    q: Array
    p: Array
    decay: Array
    gain: Array
    y: Array

    @staticmethod
    def of(greens: ModalGreens, port: int, dt: float, q: Array, p: Array) -> Recursion:
        """Recursion of ``greens`` at ``port``; ``q``, ``p`` initial modal coordinates and rates."""
        phi = greens.shapes[:, port]
        a, b = oscillator.transition(dt, greens.omega, greens.zeta)
        coefficients = np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], phi**2 * b[0], phi**2 * b[1]])
        seen = (phi != 0) & ((phi**2 * b[1] != 0) | (q != 0) | (p != 0) | (b[0] != 0))
        rates = greens.residual.rates
        gain = greens.residual.shapes[:, port] ** 2 * dt * oscillator.expm1_over(-rates * dt)
        return Recursion(
            np.ascontiguousarray(coefficients[:, seen]),
            (phi * q)[seen],
            (phi * p)[seen],
            np.exp(-rates * dt),
            gain,
            np.zeros(len(rates)),
        )

    @staticmethod
    def empty() -> Recursion:
        """A body without poles."""
        return Recursion(np.zeros((6, 0)), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _advance(body, force):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Add the last step's force, step the free motion, return the displacement."""
    c, q, p, decay, gain, y = body
    a11, a12, a21, a22, b1, b2 = c[0], c[1], c[2], c[3], c[4], c[5]
    u = 0.0
    for k in range(q.size):
        qk = q[k] + b1[k] * force
        pk = p[k] + b2[k] * force
        r = a11[k] * qk + a12[k] * pk
        q[k] = r
        p[k] = a21[k] * qk + a22[k] * pk
        u += r
    for k in range(y.size):
        r = decay[k] * (y[k] + gain[k] * force)
        y[k] = r
        u += r
    return u


@njit(cache=True)
def contact_force(code: int, k: float, pen: float, w0: float) -> float:  # pragma: no cover - compiled
    """The N >= 0 that solves N = law(pen - w0 N); unique because the law does not decrease."""
    if pen <= 0.0:
        return 0.0
    if code == SIGNORINI:
        return pen / w0
    if code == SPRING:
        return k * pen / (1.0 + k * w0)
    return _hertz_force(k, pen, w0)


@njit(cache=True)
def _hertz_force(k: float, pen: float, w0: float) -> float:  # pragma: no cover - compiled
    """Root of k (pen - w0 N)^1.5 - N in [0, pen/w0], by Newton on d = sqrt(pen - w0 N): d^2 + w0 k d^3 = pen.

    The polynomial is increasing and convex for d > 0, so Newton falls monotonically from above. Each term alone gives
    an upper bound; the lower of the two is within a factor of two of the root, whatever the stiffness.
    """
    d = math.sqrt(pen)
    if w0 * k * d > 1.0:
        d = (pen / (w0 * k)) ** (1.0 / 3.0)
    for _ in range(60):
        step = (d * d + w0 * k * d * d * d - pen) / (2.0 * d + 3.0 * w0 * k * d * d)
        d -= step
        if step <= 1e-16 * d:
            break
    return k * d * d * d


@njit(cache=True)
def march(start, stop, striker, target, free, history, weights, own, law, force, u_striker, u_target):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Steps ``start``..``stop``-1 of one contact. Arrays are filled in place, index n = end of step n.

    striker, target: the six arrays of a `Recursion`. free: gap without contact and without poles. history: what past
    blocks add to the gap through step weights; weights: step weights of both bodies together. own: (W0 of both, of
    the striker's poles, of the target's poles). law: (code, stiffness).
    """
    w0, w0_striker, w0_target = own
    code, stiffness = law
    for n in range(start, stop):
        last = force[n - 1] if n > 0 else 0.0
        us = _advance(striker, last)
        ut = _advance(target, -last)
        gap = free[n] + us - ut
        if weights.size > 0:
            memory = history[n]
            for m in range(start, n):
                memory += weights[n - m] * force[m]
            gap += memory
        f = contact_force(code, stiffness, -gap, w0)
        force[n] = f
        u_striker[n] = us + w0_striker * f
        u_target[n] = ut - w0_target * f


def fold_block(history: Array, force: Array, weights: Array, done: int, block: int) -> None:
    """Add what finished blocks do to later ones, after block number ``done`` (1, 2, ...), in place.

    With k the largest power of two dividing ``done``, the last k blocks of force act on the next k blocks; over the
    run every pair of blocks is met exactly once.
    """
    k = done & -done
    size = k * block
    end = done * block
    if end >= len(force):
        return
    stop = min(end + size, len(force))
    length = 2 * size
    kernel = weights[:length]
    product = np.fft.rfft(force[end - size : end], 2 * length) * np.fft.rfft(kernel, 2 * length)
    history[end:stop] += np.fft.irfft(product, 2 * length)[size : size + stop - end]


def convolve(weights: Array, force: Array) -> Array:
    """u[n] = sum_m weights[n - m] force[m], by FFT."""
    n = len(force)
    size = 1 << (2 * n - 1).bit_length()
    return np.asarray(np.fft.irfft(np.fft.rfft(weights[:n], size) * np.fft.rfft(force, size), size)[:n])


def direct_sum(weights: Array, force: Array) -> Array:
    """The same sum, term by term: the oracle."""
    return np.array([weights[: n + 1] @ force[n::-1] for n in range(len(force))])
