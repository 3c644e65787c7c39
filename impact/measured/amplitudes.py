"""Residues of given poles on the lines of a measured response, and the choice of number and initial positions of poles.

Residues are least-squares solutions, or the nearest passive ones. Poles are chosen by an information criterion, all
within the band.

Sources: Schwarz, Ann. Statist. 6 (1978) 461 (the information criterion); Ewins, Modal Testing, 2nd ed., 4.4 (residual
terms in place of modes below and above the band).
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import nnls

from impact.greens import passivity
from impact.greens.base import Array, ComplexArray
from impact.greens.modal import ModalGreens, Residual
from impact.greens.poles import PoleGreens
from impact.measured import vector_fitting
from impact.measured.frf import FrequencyResponseError
from impact.measured.vector_fitting import Lines, Poles, converge_poles, find_misfit, refined, starting_poles

_ROUNDS = 12
_MARGIN = 1e-4  # eigenvalue to which each violation is raised, over the sum of the sizes of the terms


@dataclass(frozen=True)
class Residues:
    """G(s) = sum_k R_k/(s - p_k) + conjugates + sum_m A_m/(s + rate_m) + c + b/s^2, with p_k and rates the ``poles``.

    ``pairs`` (K, p, p) complex symmetric R_k, ``real`` (R, p, p) A_m, ``compliance`` and ``rigid`` (p, p) semidefinite.
    """

    poles: vector_fitting.Poles
    pairs: ComplexArray
    real: Array
    compliance: Array
    rigid: Array

    def greens(self, port_names: tuple[str, ...]) -> PoleGreens:
        """Return the residues as a Green's function, each as a sum of rank-one terms."""
        p = len(port_names)
        pairs = [(s, shape) for s, r in zip(self.poles.pairs, self.pairs, strict=True) for shape in takagi(r)]
        real = [
            (rate, shape, sign)
            for rate, a in zip(self.poles.rates, self.real, strict=True)
            for sign, shape in signed_terms(a)
        ]
        poles, shapes = (np.array([pair[i] for pair in pairs], dtype=complex) for i in range(2))
        rates, real_shapes, signs = (np.array([term[i] for term in real]) for i in range(3))
        rigid = np.array([shape for _, shape in signed_terms(self.rigid)]).reshape(-1, p)
        shapes, real_shapes = shapes.reshape(-1, p), real_shapes.reshape(-1, p)
        return PoleGreens(poles, shapes, rates, real_shapes, signs, rigid, self.compliance, port_names)


def takagi(matrix: ComplexArray) -> list[ComplexArray]:
    """Return r_1, r_2, ... with sum r r' = ``matrix``, complex symmetric, without terms below 1e-9 of the largest.

    Source: Horn and Johnson, Matrix Analysis, 4.4 (through the real symmetric [[Re, Im], [Im, -Re]]).
    """
    p = len(matrix)
    values, vectors = np.linalg.eigh(np.block([[matrix.real, matrix.imag], [matrix.imag, -matrix.real]]))
    significant = np.flatnonzero(values > 1e-9 * max(values[-1], 0.0))
    return [np.sqrt(values[k]) * (vectors[:p, k] + 1j * vectors[p:, k]) for k in significant[::-1][:p]]


def signed_terms(matrix: Array, smallest: float = 1e-9) -> list[tuple[float, Array]]:
    """Return pairs (sign, a) with sum sign a a' = ``matrix``, real symmetric, without eigenvalues below
    ``smallest``."""
    values, vectors = np.linalg.eigh(matrix)
    limit = smallest * np.abs(values).max(initial=0.0)
    return [(float(np.sign(v)), np.sqrt(abs(v)) * x) for v, x in zip(values, vectors.T, strict=True) if abs(v) > limit]


def make_passive(residues: Residues, port_names: tuple[str, ...], s: ComplexArray, weights: Array) -> Residues:
    """Return the nearest passive function with the same poles; raises `FrequencyResponseError` if it is not found in
    `_ROUNDS` rounds.

    Minimises the weighted squares of the change of G on the lines ``s`` under v' Re[iw G(iw)] v >= 0 for the
    eigenvectors v of all violations so far: a quadratic programme, solved through its dual.

    Source: Gustavsen and Semlyen, IEEE Trans. Power Systems 16 (2001) 97.
    """
    poles, p = residues.poles, len(port_names)
    pairs_of_ports = [(i, j) for i in range(p) for j in range(i, p)]
    phi = vector_fitting.basis(s, poles) * weights[:, None]
    gram = np.real(phi.conj().T @ phi)
    scale = 1 / np.sqrt(np.diag(gram))
    factor = cho_factor(gram * np.outer(scale, scale) + 1e-10 * np.eye(len(gram)))
    rows: list[Array] = []
    goals: list[float] = []
    for _ in range(_ROUNDS):
        greens = residues.greens(port_names)
        if passivity.pole_passivity(greens).passive:
            return residues
        grid = passivity.passivity_grid(greens)
        margins = passivity.passivity_margins(greens, grid)
        padded = np.concatenate([[np.inf], margins, [np.inf]])
        for w in grid[(margins < 0) & (margins <= padded[:-2]) & (margins <= padded[2:])]:  # local minima
            mobility, size = passivity.real_mobility(greens, np.array([w]))
            values, vectors = np.linalg.eigh(mobility[0])
            for value, v in zip(values, vectors.T, strict=True):
                if value < _MARGIN * size[0]:
                    rows.append(
                        np.array([(1 + (i != j)) * v[i] * v[j] for i, j in pairs_of_ports])[:, None] * _row(poles, w)
                    )
                    goals.append(_MARGIN * float(size[0]) - float(value))
        if not rows:  # a violation is narrower than the grid
            break
        a, b = np.array(rows), np.array(goals)
        weight = np.array([1.0 + (i != j) for i, j in pairs_of_ports])
        inverse = np.stack(
            [scale[:, None] * cho_solve(factor, (a[:, e] * scale).T) / weight[e] for e in range(len(weight))]
        )
        dual = np.einsum("ven,enu->vu", a, inverse)
        size_of = 1 / np.sqrt(np.diag(dual))
        dual *= np.outer(size_of, size_of)
        root = cholesky(dual + 1e-9 * np.eye(len(dual)), lower=True)
        multipliers = nnls(root.T, solve_triangular(root, b * size_of, lower=True))[0] * size_of
        residues = _moved(residues, np.einsum("env,v->en", inverse, multipliers), pairs_of_ports)
        goals = list(b - np.einsum("ven,en->v", a, np.einsum("env,v->en", inverse, multipliers)))
    raise FrequencyResponseError(
        'the residues cannot be made passive by a small change: use form="modal", or fewer pole pairs'
    )


def _row(poles: vector_fitting.Poles, w: float) -> Array:
    """Return the derivatives (2K + R,) of Re[iw G] with respect to Re R_k, Im R_k (interleaved) and A_m."""
    s = poles.pairs
    away = np.abs(s) ** 2 - w**2
    common = w**2 / (away**2 + 4 * w**2 * s.real**2)
    pairs = np.stack([common * (4 * s.real**2 - 2 * away), common * 4 * s.real * s.imag], axis=1).ravel()
    return np.concatenate([pairs, w**2 / (w**2 + poles.rates**2)])


def _moved(residues: Residues, change: Array, ports: list[tuple[int, int]]) -> Residues:
    pairs, real = residues.pairs.copy(), residues.real.copy()
    k = 2 * len(pairs)
    for (i, j), row in zip(ports, change, strict=True):
        for a, b in {(i, j), (j, i)}:
            pairs[:, a, b] += row[0:k:2] + 1j * row[1:k:2]
            real[:, a, b] += row[k:]
    return Residues(residues.poles, pairs, real, residues.compliance, residues.rigid)


_ITERATIONS = 3000
_NOTHING = 1e-12  # compliance below which it is round-off, over the largest response


@dataclass(frozen=True)
class FitData:
    """Lines s (n,), responses (n, p, p), weights (n,) one over the noise, whether the body is free, names of its ports;
    ``above``: poles above the band that represent its modes there; ``alike``: number of neighbouring lines with
    correlated noise."""

    s: ComplexArray
    g: ComplexArray
    weights: Array
    free: bool
    port_names: tuple[str, ...]
    above: tuple[complex, ...] = ()
    alike: int = 1

    @property
    def elements(self) -> ComplexArray:
        """Return the responses (n, q) of the upper triangle."""
        p = len(self.port_names)
        return np.stack([self.g[:, i, j] for i in range(p) for j in range(i, p)], axis=1)

    @property
    def fixed(self) -> ComplexArray:
        """Return the columns (n, e) beside the poles in the band: `extra`, and oscillators at the poles ``above``."""
        return np.concatenate([self.extra, oscillators(self.s, np.array(self.above, dtype=complex))], axis=1)

    def lines(self, terms: ComplexArray) -> vector_fitting.Lines:
        """Return the lines of the upper triangle, with ``terms`` (n, e) beside the poles."""
        return vector_fitting.Lines(self.s, self.elements, self.weights, terms)

    def with_beyond(self, poles: vector_fitting.Poles) -> vector_fitting.Poles:
        """Return the poles together with those ``above``."""
        return vector_fitting.Poles(np.concatenate([poles.pairs, np.array(self.above, dtype=complex)]), poles.rates)

    @property
    def extra(self) -> ComplexArray:
        return np.stack([np.ones_like(self.s), *([1 / self.s**2] if self.free else [])], axis=1)

    @property
    def scale(self) -> float:
        return float(np.linalg.norm(self.weights[:, None, None] * self.g))


def oscillators(s: ComplexArray, pairs: ComplexArray) -> ComplexArray:
    """Return the columns 1/((s - p)(s - p*)) (n, K) of pairs of poles."""
    return np.asarray(1 / ((s[:, None] - pairs) * (s[:, None] - pairs.conj())))


def free_residues(data: FitData, poles: vector_fitting.Poles) -> Residues:
    """Return least-squares residues, passive or not, with positive semidefinite c and rigid-body term."""
    phi, extra, p = vector_fitting.basis(data.s, poles), data.extra, len(data.port_names)
    coefficients = least_squares(np.concatenate([phi, extra], axis=1), data.g, data.weights)
    extras = np.array([passivity.positive_part(matrix) for matrix in coefficients[phi.shape[1] :]])
    if np.abs(extras[0]).max() < _NOTHING * np.abs(data.g).max():
        extras[0] = 0.0
    if np.any(extras != coefficients[phi.shape[1] :]):
        coefficients = least_squares(phi, data.g - np.einsum("ne,eij->nij", extra, extras), data.weights)
    k = 2 * len(poles.pairs)
    rigid = extras[1] if data.free else np.zeros((p, p))
    return Residues(
        poles, coefficients[0:k:2] + 1j * coefficients[1:k:2], coefficients[k : phi.shape[1]], extras[0], rigid
    )


def least_squares(columns: ComplexArray, g: ComplexArray, weights: Array) -> Array:
    """Return the real amplitudes (m, p, p) of complex columns by weighted least squares."""
    a = columns * weights[:, None]
    b = (g * weights[:, None, None]).reshape(len(g), -1)
    a, b = np.concatenate([a.real, a.imag]), np.concatenate([b.real, b.imag])
    scale = np.linalg.norm(a, axis=0)
    x = np.linalg.lstsq(a / scale, b, rcond=1e-13)[0] / scale[:, None]
    return np.asarray(x.reshape(-1, *g.shape[1:]))


def response_of(residues: Residues, s: ComplexArray) -> ComplexArray:
    """Return the response (n, p, p) of residues at the lines ``s``."""
    r, real = residues.pairs, residues.real
    amplitudes = np.concatenate([np.stack([r.real, r.imag], axis=1).reshape(-1, *real.shape[1:]), real])
    constant = residues.compliance + residues.rigid / (s**2)[:, None, None]
    return np.asarray(
        np.einsum("nk,kij->nij", vector_fitting.basis(s, residues.poles), amplitudes) + constant, dtype=complex
    )


def modal_fit(data: FitData, poles: vector_fitting.Poles, smallest: float) -> ModalGreens:
    """Return positive semidefinite amplitudes of oscillators, in and above the band, relaxations, compliance, rigid
    body.

    ``smallest``: relative eigenvalue of a mode's amplitude matrix below which it is omitted.
    """
    pairs, p = data.with_beyond(poles).pairs, len(data.port_names)
    omega = np.abs(pairs)
    zeta = -pairs.real / omega
    s = data.s[:, None]
    columns = np.concatenate([1 / (s**2 + 2 * zeta * omega * s + omega**2), 1 / (s + poles.rates), data.extra], axis=1)
    amplitudes = _positive_least_squares(columns, data.g, data.weights)
    k, r = len(omega), len(poles.rates)
    modes = [
        (w, z, shape)
        for w, z, a in zip(omega, zeta, amplitudes, strict=False)
        for _, shape in signed_terms(a, smallest)
    ]
    if data.free:
        modes = [(0.0, 0.0, shape) for _, shape in signed_terms(amplitudes[-1])] + modes
    decays = [
        (rate, shape) for rate, a in zip(poles.rates, amplitudes[k:], strict=False) for _, shape in signed_terms(a)
    ]
    rates, relaxing = (np.array([term[i] for term in decays]) for i in range(2))
    w, z, shapes = (np.array([mode[i] for mode in modes]) for i in range(3))
    residual = Residual(relaxing.reshape(-1, p), rates, amplitudes[k + r])
    return ModalGreens(w, z, shapes.reshape(-1, p), residual, data.port_names)


def _positive_least_squares(columns: ComplexArray, g: ComplexArray, weights: Array) -> Array:
    """Return positive semidefinite amplitudes (m, p, p): by NNLS for one port, else by an accelerated projected
    gradient.

    Source: Lawson and Hanson, Solving Least Squares Problems (1974), ch. 23; Beck and Teboulle, SIAM J. Imaging Sci. 2
    (2009) 183.
    """
    a = columns * weights[:, None]
    b = (g * weights[:, None, None]).reshape(len(g), -1)
    real, goal = np.concatenate([a.real, a.imag]), np.concatenate([b.real, b.imag])
    scale = np.linalg.norm(real, axis=0)
    real = real / scale
    if goal.shape[1] == 1:
        return np.asarray(nnls(real, goal[:, 0])[0] / scale)[:, None, None]
    gram, right = real.T @ real, (real.T @ goal).reshape(-1, *g.shape[1:])
    step = 1 / float(np.linalg.eigvalsh(gram)[-1])
    x = y = passivity.positive_part(
        np.linalg.lstsq(gram, right.reshape(len(gram), -1), rcond=1e-12)[0].reshape(right.shape)
    )
    inertia = 1.0
    for _ in range(_ITERATIONS):
        new = passivity.positive_part(y - step * (np.tensordot(gram, y, axes=1) - right))
        if np.sum((y - new) * (new - x)) > 0:
            inertia = 1.0
        following = (1 + np.sqrt(1 + 4 * inertia**2)) / 2
        y = new + (inertia - 1) / following * (new - x)
        moved, x, inertia = float(np.abs(new - x).max()), new, following
        if moved < 1e-10 * float(np.abs(x).max()):
            break
    return np.asarray(x / scale[:, None, None])


ABOVE_NOISE: Final = 5.0  # least ratio of a resonance to the noise of its line
BEYOND: Final = (1.03, 1.08, 1.16, 1.3, 1.6, 2.5)  # frequencies of residual terms above the band, over the highest line
_PATIENCE: Final = 3  # number of rounds without improvement after which the search ends
_MOST_ROUNDS: Final = 20  # largest number of rounds with more poles, for records that no number of poles fits
_MOST_IDLE: Final = 12  # largest number of poles that are removed again
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
    best, least, idle_rounds = Poles(np.zeros(0, dtype=complex), np.zeros(0)), np.inf, 0
    tried = list[Candidate]()
    for _ in range(_MOST_ROUNDS):
        poles = within(data.s, converge_poles(lines, poles))
        poles = within(data.s, refined(lines, poles))
        cost = criterion(data, find_misfit(lines, poles), poles)
        tried.append(Candidate(poles, cost))
        idle_rounds = 0 if cost < least else idle_rounds + 1
        best, least = (poles, cost) if cost < least else (best, least)
        a, b = lines.posed(poles)
        size = np.linalg.norm(a, axis=0)
        residuals = b - (a / size) @ np.linalg.lstsq(a / size, b, rcond=1e-13)[0]  # misfit with the best residues
        misfit = (residuals[: len(data.s)] + 1j * residuals[len(data.s) :]) / data.weights[:, None]
        if np.mean(np.abs(misfit) ** 2 / floor[:, None] ** 2) <= 1:
            return poles, tuple(tried)
        if idle_rounds >= _PATIENCE or len(poles.pairs) >= most:
            break
        # more pairs at the highest peaks of the misfit, smoothed over five lines
        smooth = np.convolve(data.weights * np.linalg.norm(misfit, axis=1), np.ones(5) / 5, mode="same")
        peaks = scipy.signal.find_peaks(np.concatenate([[0.0], smooth, [0.0]]))[0] - 1
        worst = data.s.imag[peaks[np.argsort(-smooth[peaks])[: max(1, len(poles.pairs) // 6)]]]
        pairs = np.concatenate([poles.pairs, (-0.01 + 1j) * worst])
        poles = Poles(pairs[np.argsort(pairs.imag)], poles.rates)
    fewer = _remove_idle_poles(data, lines, best, least)
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


def _remove_idle_poles(data: FitData, lines: Lines, poles: Poles, cost: float) -> list[Candidate]:
    """Return candidates with poles removed one after the other, as long as this improves the information criterion."""
    candidates = list[Candidate]()
    for _ in range(_MOST_IDLE):
        if len(poles.pairs) == 0:
            break
        fewer = [Poles(np.delete(poles.pairs, k), poles.rates) for k in range(len(poles.pairs))]
        fewer += [Poles(poles.pairs, np.delete(poles.rates, k)) for k in range(len(poles.rates))]
        costs = [criterion(data, find_misfit(lines, each), each) for each in fewer]
        least = int(np.argmin(costs))
        moved = within(data.s, refined(lines, fewer[least]))
        new = criterion(data, find_misfit(lines, moved), moved)
        if new >= cost:
            break
        poles, cost = moved, new
        candidates.append(Candidate(moved, new))
    return candidates


def _peaks(data: FitData, most: int) -> tuple[int, Array]:
    """Return the initial number of pole pairs, and the frequencies of resonances above the noise [rad/s]."""
    size = np.linalg.norm(data.g, axis=(1, 2))
    peaks, _ = scipy.signal.find_peaks(np.log(np.maximum(size * data.s.imag, 1e-300)), prominence=_PROMINENCE)
    peaks = data.s.imag[peaks[(size * data.weights)[peaks] > ABOVE_NOISE]]
    return min(max(1, len(peaks)), most), peaks
