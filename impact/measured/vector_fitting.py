"""Common poles of measured responses by relaxed vector fitting, and the passivity of a sum of poles.

Sources: Gustavsen and Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052; Gustavsen, ibid. 21 (2006) 1587 (relaxed
non-triviality); Deschrijver et al., IEEE Microw. Wirel. Compon. Lett. 18 (2008) 383 (one QR per response); Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, and Kaufman, BIT 15 (1975) 49 (least squares for the poles alone).
"""

from dataclasses import dataclass, replace

import numpy as np

from impact.greens.base import Array, ComplexArray
from impact.greens.poles import PoleGreens


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


TOLERANCE = 1e-9  # largest negative eigenvalue that counts as round-off, over the sum of the sizes of the terms
_AROUND = np.concatenate([-np.geomspace(30, 0.03, 10), [0.0], np.geomspace(0.03, 30, 10)])  # in half widths from a pole
_CHUNK = 2_000_000  # number of values evaluated at once


@dataclass(frozen=True)
class PolePassivity:
    """Frequency at which the real part of a body's mobility is smallest.

    Attributes:
        margin: smallest eigenvalue of Re[iw G(iw)] over the sum of the sizes of its terms at that frequency, least over
            w, -1 ... 1; < 0 is an energy gain.
        frequency: the frequency [Hz].
        tolerance: the body counts as passive if ``margin`` >= -``tolerance``.
    """

    margin: float
    frequency: float
    tolerance: float = TOLERANCE

    @property
    def passive(self) -> bool:
        """Return whether the body is passive within the tolerance."""
        return self.margin >= -self.tolerance

    def __str__(self) -> str:
        verdict = "passive" if self.passive else "not passive"
        return f"{verdict}: margin {self.margin:.3g} at {self.frequency:.4g} Hz (limit {-self.tolerance:.1g})"


def pole_passivity(greens: PoleGreens, *, tolerance: float = TOLERANCE) -> PolePassivity:
    """Report whether any force history can draw energy from the body.

    A force N does the work integral of N u' = (1/pi) integral over w > 0 of N^ Re[iw G(iw)] N: never negative if and
    only if Re[iw G(iw)] (symmetric, p x p) is positive semidefinite at all w, including its limits at 0 and infinity. A
    pole on the imaginary axis also needs r r' = -i times a positive matrix.

    The terms are summed in a form free of cancellation (`real_mobility`); frequencies are refined around each pole, and
    around the least values by two rounds of subdivision. A violation narrower than that grid is not detected.

    ``tolerance``: relative tolerance of the margin. Source: Anderson and Vongpanitlerd, Network Analysis and Synthesis
    (1973), ch. 2.
    """
    w = passivity_grid(greens)
    margins = passivity_margins(greens, w)
    for _ in range(2):  # neighbourhood of the eight least values
        least = np.argsort(margins)[:8]
        fine = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, len(w) - 1)], 33)[1:-1] for k in least]
        w = np.concatenate([w, *fine])
        margins = np.concatenate([margins, passivity_margins(greens, np.concatenate(fine))])
        order = np.argsort(w)
        w, margins = w[order], margins[order]
    worst = int(np.argmin(margins))
    margin, frequency = float(margins[worst]), float(w[worst])
    for k in np.flatnonzero(greens.poles.real == 0):
        r = greens.shapes[k]
        size = float(np.sum(np.abs(r) ** 2))
        turned = 1j * np.outer(r, r)  # must be real and positive
        worst_turn = float(np.linalg.eigvalsh(turned.real)[0] - np.abs(turned.imag).max())
        if size and worst_turn / size < min(margin, -tolerance):
            margin, frequency = worst_turn / size, float(greens.poles[k].imag)
    return PolePassivity(margin, frequency / (2 * np.pi), tolerance)


def real_mobility(greens: PoleGreens, omega: Array) -> tuple[Array, Array]:
    """Return Re[iw G(iw)] (n, p, p), and the sum of the sizes (traces) of its terms (n,) [m/(N s)].

    A pair R = r r' at s gives w^2 (2 sigma B - A (|s|^2 - w^2))/((|s|^2 - w^2)^2 + 4 w^2 sigma^2), sigma = -Re s, A = 2
    Re R, B = -2 Re(R s*); a real pole sign a a' w^2/(w^2 + rate^2); rigid bodies and compliance contribute nothing.
    """
    n, p = len(omega), len(greens.port_names)
    total, size = np.zeros((n, p, p)), np.zeros(n)
    residues = np.einsum("ki,kj->kij", greens.shapes, greens.shapes)
    a, b = 2 * residues.real, -2 * (residues * greens.poles.conj()[:, None, None]).real
    sigma, square = -greens.poles.real, np.abs(greens.poles) ** 2
    real = greens.signs[:, None, None] * np.einsum("mi,mj->mij", greens.real_shapes, greens.real_shapes)
    chunk = max(1, _CHUNK // max(1, len(sigma) + len(real)))
    sizes = [np.abs(np.einsum("kii->ki", x)).sum(axis=1) for x in (a, b, real)]
    for start in range(0, n, chunk):
        w2 = omega[start : start + chunk, None] ** 2
        away = square - w2
        below = away**2 + 4 * w2 * sigma**2
        below = np.where(below == 0, np.inf, below)  # on an undamped pole
        weight_b, weight_a = 2 * w2 * sigma / below, -w2 * away / below
        weight_r = w2 / np.where((w2 == 0) & (greens.rates == 0), 1.0, w2 + greens.rates**2)
        terms = ((weight_b, b), (weight_a, a), (weight_r, real))
        total[start : start + chunk] = sum(np.tensordot(weight, x, axes=1) for weight, x in terms)
        size[start : start + chunk] = sum(
            np.abs(weight) @ x for (weight, _), x in zip(terms, (sizes[1], sizes[0], sizes[2]), strict=True)
        )
    return total, size


def passivity_margins(greens: PoleGreens, omega: Array) -> Array:
    """Return the smallest eigenvalue (n,) of Re[iw G(iw)] over the sum of the sizes of its terms."""
    total, size = real_mobility(greens, omega)
    least = total[:, 0, 0] if total.shape[1] == 1 else np.linalg.eigvalsh(total)[:, 0]
    return np.asarray(least / np.where(size > 0, size, 1.0))


def passivity_grid(greens: PoleGreens) -> Array:
    """Return angular frequencies around each pole in multiples of its half width, around each real pole in octaves, and
    far below and above all."""
    s, width = greens.poles, np.maximum(-greens.poles.real, 1e-6 * np.abs(greens.poles))
    near = (s.imag[:, None] + width[:, None] * _AROUND).ravel()
    rates = greens.rates[greens.rates > 0]
    octaves = (rates[:, None] * 2.0 ** np.arange(-4, 5)).ravel()
    scale = np.concatenate([np.abs(s), rates])
    if not scale.size:
        return np.ones(1)
    wide = np.geomspace(1e-4 * scale.min(), 1e4 * scale.max(), 600)
    w = np.unique(np.concatenate([near, octaves, wide]))
    return np.asarray(w[w > 0])
