"""Common poles of measured responses by relaxed vector fitting.

Sources: Gustavsen and Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052; Gustavsen, ibid. 21 (2006) 1587 (relaxed
non-triviality); Deschrijver et al., IEEE Microw. Wirel. Compon. Lett. 18 (2008) 383 (one QR per response).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.greens.base import Array, ComplexArray


@dataclass(frozen=True)
class Poles:
    """``pairs`` (K,) with Im > 0 and Re < 0, and ``rates`` (R,) > 0 of the real poles [1/s]."""

    pairs: ComplexArray
    rates: Array

    @property
    def order(self) -> int:
        """Number of real states."""
        return 2 * len(self.pairs) + len(self.rates)


def starting_poles(s: ComplexArray, pairs: int, peaks: Array) -> Poles:
    """At the given peaks [rad/s], then spread over the lines, lightly damped."""
    w = s.imag
    spread = np.linspace(w[0], w[-1], max(pairs - len(peaks), 0) + 2)[1:-1]
    start = np.sort(np.concatenate([peaks[:pairs], spread]))
    return Poles((-0.01 + 1j) * start, np.zeros(0))


def basis(s: ComplexArray, poles: Poles) -> ComplexArray:
    """(n, 2K + R): 1/(s - p) + 1/(s - p*), i/(s - p) - i/(s - p*) for each pair; 1/(s + rate)."""
    one, two = 1 / (s[:, None] - poles.pairs), 1 / (s[:, None] - poles.pairs.conj())
    pairs = np.stack([one + two, 1j * (one - two)], axis=2).reshape(len(s), -1)
    return np.concatenate([pairs, 1 / (s[:, None] + poles.rates)], axis=1)


def relocate(s: ComplexArray, responses: ComplexArray, weights: Array, extra: ComplexArray, poles: Poles) -> Poles:
    """Poles of the next iteration: zeros of sigma(s) = d + sum c_k phi_k(s) in sigma H ~ sum r_k phi_k + extra.

    ``responses`` and ``weights`` (n, q); ``extra`` (n, e) columns beside the poles. Unstable zeros are mirrored.
    """
    scale = float(np.abs(s).max())
    s, poles = s / scale, Poles(poles.pairs / scale, poles.rates / scale)
    phi = basis(s, poles)
    order, n = phi.shape[1], len(s)
    sigma = np.concatenate([phi, np.ones((n, 1))], axis=1)
    left = np.concatenate([phi, extra / np.linalg.norm(extra, axis=0)], axis=1)
    blocks = []
    for h, w in zip(responses.T, weights.T, strict=True):
        both = np.concatenate([left * w[:, None], -sigma * (w * h)[:, None]], axis=1)
        r = np.asarray(np.linalg.qr(np.concatenate([both.real, both.imag]), mode="r"))
        blocks.append(r[left.shape[1] : left.shape[1] + order + 1, left.shape[1] :])
    size = float(np.linalg.norm(weights * responses)) / n
    relaxed = size * np.concatenate([phi.real.sum(axis=0), [n]])
    matrix = np.concatenate([*blocks, relaxed[None]])
    columns = np.linalg.norm(matrix, axis=0)
    goal = np.zeros(len(matrix))
    goal[-1] = size * n
    c = np.linalg.lstsq(matrix / columns, goal, rcond=None)[0] / columns
    d = c[-1] if abs(c[-1]) > 1e-8 else np.copysign(1e-8, c[-1])
    a, b = _realisation(poles)
    found = np.linalg.eigvals(a - np.outer(b, c[:-1]) / d) * scale
    return _stable(np.asarray(found, dtype=complex))


def fitted_poles(
    s: ComplexArray, responses: ComplexArray, weights: Array, extra: ComplexArray, start: Poles, iterations: int = 12
) -> Poles:
    """Relocated until they stand still to 1e-8."""
    poles = start
    for _ in range(iterations):
        new = relocate(s, responses, weights, extra, poles)
        same = len(new.pairs) == len(poles.pairs) and len(new.rates) == len(poles.rates)
        moved = np.abs(new.pairs / poles.pairs - 1).max(initial=0.0) if same else np.inf
        poles = new
        if moved < 1e-8:
            break
    return poles


def _realisation(poles: Poles) -> tuple[Array, Array]:
    order, k = poles.order, len(poles.pairs)
    a, b = np.zeros((order, order)), np.ones(order)
    for number, pole in enumerate(poles.pairs):
        rows = slice(2 * number, 2 * number + 2)
        a[rows, rows] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        b[rows] = 2.0, 0.0
    a[range(2 * k, order), range(2 * k, order)] = -poles.rates
    return a, b


def _stable(found: ComplexArray) -> Poles:
    upper = found[found.imag > 1e-9 * np.abs(found)]
    real = found[np.abs(found.imag) <= 1e-9 * np.abs(found)].real
    pairs = np.minimum(-np.abs(upper.real), -1e-7 * np.abs(upper)) + 1j * upper.imag
    return Poles(pairs[np.argsort(pairs.imag)], np.sort(np.abs(real[real != 0])))
