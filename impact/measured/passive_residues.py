"""The least change of the residues of a sum of poles that makes it passive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import nnls

from impact.greens.base import Array, ComplexArray
from impact.greens.poles import PoleGreens
from impact.measured.pole_passivity import passivity_grid, passivity_margins, pole_passivity, real_mobility
from impact.measured.vector_fitting import Poles, basis

_ROUNDS = 12
_MARGIN = 1e-4  # of the sum of the sizes of the terms: what each violation is lifted to


@dataclass(frozen=True)
class Residues:
    """G(s) = sum_k R_k/(s - p_k) + conjugates + sum_m A_m/(s + rate_m) + c + b/s^2, with p_k and rates the ``poles``.

    ``pairs`` (K, p, p) complex symmetric R_k, ``real`` (R, p, p) A_m, ``compliance`` and ``rigid`` (p, p) semidefinite.
    """

    poles: Poles
    pairs: ComplexArray
    real: Array
    compliance: Array
    rigid: Array

    def greens(self, port_names: tuple[str, ...]) -> PoleGreens:
        """Return the same as a Green's function: each residue as a sum of rank-one terms."""
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
    kept = np.flatnonzero(values > 1e-9 * max(values[-1], 0.0))
    return [np.sqrt(values[k]) * (vectors[:p, k] + 1j * vectors[p:, k]) for k in kept[::-1][:p]]


def signed_terms(matrix: Array, smallest: float = 1e-9) -> list[tuple[float, Array]]:
    """Return sign and a with sum sign a a' = ``matrix``, real symmetric."""
    values, vectors = np.linalg.eigh(matrix)
    limit = smallest * np.abs(values).max(initial=0.0)
    return [(float(np.sign(v)), np.sqrt(abs(v)) * x) for v, x in zip(values, vectors.T, strict=True) if abs(v) > limit]


def made_passive(residues: Residues, port_names: tuple[str, ...], s: ComplexArray, weights: Array) -> Residues | None:
    """Return the nearest passive function with the same poles, or ``None`` if twelve rounds do not find one.

    Minimises the weighted squares of the change of G on the lines ``s`` under v' Re[iw G(iw)] v >= 0 for the
    eigenvectors v at all violations met so far: a quadratic programme, solved through its dual.

    Source: Gustavsen and Semlyen, IEEE Trans. Power Systems 16 (2001) 97.
    """
    poles, p = residues.poles, len(port_names)
    pairs_of_ports = [(i, j) for i in range(p) for j in range(i, p)]
    phi = basis(s, poles) * weights[:, None]
    gram = np.real(phi.conj().T @ phi)
    scale = 1 / np.sqrt(np.diag(gram))
    factor = cho_factor(gram * np.outer(scale, scale) + 1e-10 * np.eye(len(gram)))
    rows: list[Array] = []
    goals: list[float] = []
    for _ in range(_ROUNDS):
        greens = residues.greens(port_names)
        if pole_passivity(greens).passive:
            return residues
        grid = passivity_grid(greens)
        margins = passivity_margins(greens, grid)
        beside = np.concatenate([[np.inf], margins, [np.inf]])
        for w in grid[(margins < 0) & (margins <= beside[:-2]) & (margins <= beside[2:])]:  # local minima
            mobility, size = real_mobility(greens, np.array([w]))
            values, vectors = np.linalg.eigh(mobility[0])
            for value, v in zip(values, vectors.T, strict=True):
                if value < _MARGIN * size[0]:
                    rows.append(
                        np.array([(1 + (i != j)) * v[i] * v[j] for i, j in pairs_of_ports])[:, None] * _row(poles, w)
                    )
                    goals.append(_MARGIN * float(size[0]) - float(value))
        if not rows:  # a violation narrower than the grid
            return None
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
    return None


def _row(poles: Poles, w: float) -> Array:
    """Return the (2K + R,) derivatives of Re[iw G] with respect to Re R_k, Im R_k (interleaved) and A_m."""
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
