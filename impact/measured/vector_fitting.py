"""Common poles of measured responses by relaxed vector fitting.

Sources: Gustavsen and Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052; Gustavsen, ibid. 21 (2006) 1587 (relaxed
non-triviality); Deschrijver et al., IEEE Microw. Wirel. Compon. Lett. 18 (2008) 383 (one QR per response); Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, and Kaufman, BIT 15 (1975) 49 (least squares for the poles alone).
"""

from dataclasses import dataclass, replace

import numpy as np

from impact.greens.base import Array, ComplexArray


@dataclass(frozen=True)
class Poles:
    """Complex poles ``pairs`` (K,) with Im > 0 and Re < 0, and ``rates`` (R,) > 0 of real poles [1/s]."""

    pairs: ComplexArray
    rates: Array

    @property
    def order(self) -> int:
        """Return the number of real states."""
        return 2 * len(self.pairs) + len(self.rates)


@dataclass(frozen=True)
class Lines:
    """Lines s (n,), responses (n, q), weights (n,) one over the noise, and terms (n, e) besides the poles."""

    s: ComplexArray
    responses: ComplexArray
    weights: Array
    terms: ComplexArray

    def posed(self, poles: Poles) -> tuple[Array, Array]:
        """Return the weighted real equations of all amplitudes: matrix (2n, 2K + R + e) and right-hand sides (2n,
        q)."""
        columns = np.concatenate([basis(self.s, poles), self.terms], axis=1) * self.weights[:, None]
        goal = self.responses * self.weights[:, None]
        return np.concatenate([columns.real, columns.imag]), np.concatenate([goal.real, goal.imag])


def starting_poles(s: ComplexArray, pairs: int, peaks: Array) -> Poles:
    """Return initial poles at the given peaks [rad/s], and if there are fewer, others spread over the lines, lightly
    damped."""
    w = s.imag
    spread = np.linspace(w[0], w[-1], max(pairs - len(peaks), 0) + 2)[1:-1]
    start = np.sort(np.concatenate([peaks[:pairs], spread]))
    return Poles((-0.01 + 1j) * start, np.zeros(0))


def basis(s: ComplexArray, poles: Poles) -> ComplexArray:
    """Return the basis (n, 2K + R): 1/(s - p) + 1/(s - p*), i/(s - p) - i/(s - p*) for each pair; 1/(s + rate)."""
    one, two = 1 / (s[:, None] - poles.pairs), 1 / (s[:, None] - poles.pairs.conj())
    pairs = np.stack([one + two, 1j * (one - two)], axis=2).reshape(len(s), -1)
    return np.concatenate([pairs, 1 / (s[:, None] + poles.rates)], axis=1)


def relocate(lines: Lines, poles: Poles) -> Poles:
    """Return the poles of the next iteration: zeros of sigma(s) = d + sum c_k phi_k(s) in sigma H ~ sum r_k phi_k +
    terms.

    Unstable zeros are reflected about the imaginary axis.
    """
    scale, w = float(np.abs(lines.s).max()), lines.weights
    poles = Poles(poles.pairs / scale, poles.rates / scale)
    phi = basis(lines.s / scale, poles)
    order, n = phi.shape[1], len(w)
    sigma = np.concatenate([phi, np.ones((n, 1))], axis=1)
    functions = np.concatenate([phi, lines.terms / np.linalg.norm(lines.terms, axis=0)], axis=1)
    blocks = []
    for h in lines.responses.T:
        both = np.concatenate([functions * w[:, None], -sigma * (w * h)[:, None]], axis=1)
        r = np.asarray(np.linalg.qr(np.concatenate([both.real, both.imag]), mode="r"))
        blocks.append(r[functions.shape[1] : functions.shape[1] + order + 1, functions.shape[1] :])
    size = float(np.linalg.norm(w[:, None] * lines.responses)) / n
    relaxed = size * np.concatenate([phi.real.sum(axis=0), [n]])
    matrix = np.concatenate([*blocks, relaxed[None]])
    columns = np.linalg.norm(matrix, axis=0)
    goal = np.zeros(len(matrix))
    goal[-1] = size * n
    c = np.linalg.lstsq(matrix / columns, goal, rcond=None)[0] / columns
    d = c[-1] if abs(c[-1]) > 1e-8 else np.copysign(1e-8, c[-1])
    a, b = _realisation(poles)
    zeros = np.asarray(np.linalg.eigvals(a - np.outer(b, c[:-1]) / d) * scale, dtype=complex)
    real = zeros[np.abs(zeros.imag) <= 1e-9 * np.abs(zeros)].real
    pairs = _stable(zeros[zeros.imag > 1e-9 * np.abs(zeros)])
    return Poles(pairs[np.argsort(pairs.imag)], np.sort(np.abs(real[real != 0])))


def converge_poles(lines: Lines, poles: Poles) -> Poles:
    """Return the poles relocated until they are constant to 1e-8, in at most twelve iterations."""
    for _ in range(12):
        new = relocate(lines, poles)
        same = len(new.pairs) == len(poles.pairs) and len(new.rates) == len(poles.rates)
        moved = np.abs(new.pairs / poles.pairs - 1).max(initial=0.0) if same else np.inf
        poles = new
        if moved < 1e-8:
            break
    return poles


def find_misfit(lines: Lines, poles: Poles) -> float:
    """Return the weighted sum of squared residuals with the best residues for these poles."""
    return float(np.sum(_projected(lines, poles)[2] ** 2))


def refined(lines: Lines, poles: Poles, iterations: int = 6) -> Poles:
    """Return the poles of the least weighted sum of squares near ``poles``, by Gauss-Newton steps that decrease it.

    The poles of vector fitting, which weights its equations by the poles, are biased by large noise; these are not.
    """
    if poles.order == 0:
        return poles
    scale = float(np.abs(lines.s).max())
    lines, poles = replace(lines, s=lines.s / scale), Poles(poles.pairs / scale, poles.rates / scale)
    q, amplitudes, residuals = _projected(lines, poles)
    least = float(np.sum(residuals**2))
    for _ in range(iterations):
        slopes = np.concatenate([_slopes(lines, poles, column) for column in amplitudes.T])
        blocks = slopes.reshape(amplitudes.shape[1], len(q), -1)
        blocks = blocks - q @ (q.T @ blocks)
        matrix, goal = blocks.reshape(len(slopes), -1), residuals.T.ravel()
        size = np.linalg.norm(matrix, axis=0)
        size = np.where(size > 0, size, 1.0)
        step = np.linalg.lstsq(matrix / size, goal, rcond=1e-10)[0] / size
        before = least
        for share in (1.0, 0.3, 0.1, 0.01):
            k, turned = 2 * len(poles.pairs), share * step
            pairs = _stable(poles.pairs + turned[0:k:2] + 1j * turned[1:k:2])
            moved = Poles(pairs, np.maximum(np.abs(poles.rates + turned[k:]), 1e-12))
            projection = _projected(lines, moved)
            if (total := float(np.sum(projection[2] ** 2))) < least:
                poles, least, (q, amplitudes, residuals) = moved, total, projection
                break
        if before - least <= 1e-7 * before:
            break
    return Poles(poles.pairs * scale, poles.rates * scale)


def _projected(lines: Lines, poles: Poles) -> tuple[Array, Array, Array]:
    """Return an orthonormal basis (2n, m) of the columns, their amplitudes (m, q) and the residuals (2n, q)."""
    a, b = lines.posed(poles)
    size = np.linalg.norm(a, axis=0)
    size = np.where(size > 0, size, 1.0)
    q, r = np.linalg.qr(a / size)
    inside = q.T @ b
    amplitudes = np.linalg.lstsq(r, inside, rcond=1e-13)[0] / size[:, None]
    return np.asarray(q), np.asarray(amplitudes), np.asarray(b - q @ inside)


def _slopes(lines: Lines, poles: Poles, amplitudes: Array) -> Array:
    """Return derivatives (2n, 2K + R) of one response with respect to real and imaginary parts of pairs, and rates."""
    s, k = lines.s, len(poles.pairs)
    residues = amplitudes[0 : 2 * k : 2] + 1j * amplitudes[1 : 2 * k : 2]
    one, two = residues / (s[:, None] - poles.pairs) ** 2, residues.conj() / (s[:, None] - poles.pairs.conj()) ** 2
    pairs = np.stack([one + two, 1j * (one - two)], axis=2).reshape(len(s), -1)
    real = -amplitudes[2 * k : 2 * k + len(poles.rates)] / (s[:, None] + poles.rates) ** 2
    columns = np.concatenate([pairs, real], axis=1) * lines.weights[:, None]
    return np.concatenate([columns.real, columns.imag])


def _realisation(poles: Poles) -> tuple[Array, Array]:
    order, k = poles.order, len(poles.pairs)
    a, b = np.zeros((order, order)), np.ones(order)
    for number, pole in enumerate(poles.pairs):
        rows = slice(2 * number, 2 * number + 2)
        a[rows, rows] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        b[rows] = 2.0, 0.0
    a[range(2 * k, order), range(2 * k, order)] = -poles.rates
    return a, b


def _stable(pairs: ComplexArray) -> ComplexArray:
    return np.asarray(np.minimum(-np.abs(pairs.real), -1e-7 * np.abs(pairs)) + 1j * np.abs(pairs.imag))
