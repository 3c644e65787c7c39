"""A small second-order model with coupled damping, and its poles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy import sparse

from impact.greens.poles import PoleGreens
from seatfem.structures.damping import Damping
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.residual import residual

Complex = NDArray[np.complex128]
_COUPLED = 1e-8  # off-diagonal of X'EX relative to its diagonal, above which vectors share a repeated pole


@dataclass(frozen=True)
class Coupled:
    """q'' + C q' + diag(w^2) q = ports F: undamped pairs, coupled by damping.

    Attributes:
        omega: (k,) ascending [rad/s]; exactly 0 for rigid bodies.
        C: (k, k) symmetric positive semidefinite [1/s].
        ports: (k, p) [1/sqrt(kg)].
    """

    omega: Array
    C: Array
    ports: Array

    def below(self, above: float) -> Coupled:
        """Return the pairs up to ``above`` [rad/s]: a congruence, passive as the whole."""
        kept = self.omega <= above
        return Coupled(self.omega[kept], self.C[np.ix_(kept, kept)], self.ports[kept])

    def left_out(self, above: float) -> Array:
        """Return the (p, p) static compliance of the pairs above [m/N]."""
        dropped = self.omega > above
        parts = self.ports[dropped] / self.omega[dropped, None]
        return np.asarray(parts.T @ parts)


def coupled(
    C: Array, K: Array, ports: Array, rigid: int, shift: float, damping: Damping, loss: Array | None
) -> Coupled:
    """Diagonalise K; add modal damping, 2 zeta w with zeta = ratio + phi' H phi/(2 w^2), to C.

    Args:
        C, K, ports: (k, k), (k, k), (k, p) projections on a basis orthonormal in M.
        rigid: number of leading basis vectors with K exactly zero.
        shift: frequency of the band edge; squares below 1e-10 of its square are zero if ``rigid`` is 0 [rad/s].
        loss: (k, k) projection of the loss matrix, or ``None``.
    """
    values, inner = np.linalg.eigh(K[rigid:, rigid:])
    vectors = np.eye(len(K))
    vectors[rigid:, rigid:] = inner
    zero = 0.0 if rigid else 1e-10 * shift**2
    omega = np.sqrt(np.concatenate([np.zeros(rigid), np.where(values < zero, 0.0, values)]))
    rotated = vectors.T @ C @ vectors
    lost = None if loss is None else np.einsum("ji,jk,ki->i", vectors, loss, vectors)
    modal = Damping(damping.ratio).ratios(omega, lost)
    return Coupled(omega, (rotated + rotated.T) / 2 + np.diag(2 * modal * omega), vectors.T @ ports)


def truncated(whole: Coupled, above: float, model: SecondOrderModel, damping: Damping) -> PoleGreens:
    """Return the poles of the pairs up to ``above`` [rad/s], and the residual of the others."""
    greens, rest = poles(whole.below(above), model.port_names), residual(whole.left_out(above), model, damping)
    return replace(
        greens,
        rates=np.concatenate([greens.rates, rest.rates]),
        real_shapes=np.concatenate([greens.real_shapes, rest.shapes]),
        signs=np.concatenate([greens.signs, np.ones(len(rest.rates))]),
        compliance=rest.compliance,
    )


def poles(system: Coupled, port_names: tuple[str, ...]) -> PoleGreens:
    """Return the poles s and shapes r = ports'y / sqrt(y'(2 s + C) y) of (s^2 + s C + w^2) y = 0.

    Bodies free to move are taken out first: undamped they are a ramp, damped a pole at exactly 0.
    """
    free = system.omega == 0
    values, turn = np.linalg.eigh(system.C[np.ix_(free, free)])
    loose = values <= 1e-12 * max(float(np.abs(system.C).max(initial=0.0)), 1e-300)
    drift, count = turn.T @ system.ports[free], int(np.sum(~loose))
    basis = np.eye(len(free))[:, ~free]
    held = np.zeros((len(free), count))
    held[free] = turn[:, ~loose]
    basis = np.concatenate([held, basis], axis=1)
    C, square = basis.T @ system.C @ basis, np.concatenate([np.zeros(count), system.omega[~free] ** 2])
    rates, real_shapes, signs, s, shapes = _pencil(C, square, basis.T @ system.ports, count)
    return PoleGreens(
        s,
        shapes,
        np.concatenate([np.zeros(count), rates]),
        np.concatenate([drift[~loose] / np.sqrt(values[~loose])[:, None], real_shapes]),
        np.concatenate([np.ones(count), signs]),
        drift[loose],
        port_names=port_names,
    )


def _pencil(C: Array, square: Array, ports: Array, zeros: int) -> tuple[Array, Array, Array, Complex, Complex]:
    """Return (rates, real shapes, signs, complex poles, complex shapes) without the ``zeros`` poles at 0."""
    n, p = ports.shape
    if n == 0:
        nothing = np.zeros((0, p))
        return np.zeros(0), nothing, np.zeros(0), np.zeros(0, complex), nothing.astype(complex)
    scale = max(float(np.sqrt(square.max())), float(np.abs(C).max()))
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(square) / scale**2, -C / scale]])
    s, vectors = scipy.linalg.eig(companion)
    s, y = s * scale, vectors[:n]
    kept = np.ones(len(s), dtype=bool)
    kept[np.argsort(np.abs(s))[:zeros]] = False
    real, above = kept & (s.imag == 0), kept & (s.imag > 0)
    rates, (real_y, real_gram) = -s[real].real, _gram(C, s[real], y[:, real])
    real_shapes, signs = np.zeros((len(rates), p)), np.ones(len(rates))
    for group in _groups(real_gram):
        size, turn = np.linalg.eigh(real_gram[np.ix_(group, group)].real)
        signs[group] = np.sign(size)
        real_shapes[group] = (turn / np.sqrt(np.abs(size))).T @ (real_y[:, group].real.T @ ports)
    complex_y, gram = _gram(C, s[above], y[:, above])
    shapes = np.zeros((int(above.sum()), p), complex)
    for group in _groups(gram):
        block = gram[np.ix_(group, group)]
        root = np.sqrt(block) if len(group) == 1 else np.asarray(scipy.linalg.sqrtm(block))
        shapes[group] = np.linalg.solve(root, complex_y[:, group].T @ ports)
    poles = s[above]
    return np.maximum(rates, 0.0), real_shapes, signs, np.minimum(poles.real, 0.0) + 1j * poles.imag, shapes


def _gram(C: Array, s: Complex, y: Complex) -> tuple[Complex, Complex]:
    """Return (y of unit length, Y'(s_i + s_j + C) Y): diagonal but for repeated poles."""
    y = y / np.linalg.norm(y, axis=0)
    plain = y.T @ y
    return y, np.asarray(y.T @ (C @ y) + plain * (s[:, None] + s[None, :]))


def _groups(gram: Complex) -> list[NDArray[np.int64]]:
    """Return the indices of vectors that are not orthogonal to each other: they share a repeated pole."""
    size = np.sqrt(np.abs(np.diag(gram)))
    linked = sparse.csr_matrix((np.abs(gram) > _COUPLED * np.outer(size, size)).astype(float))
    count, label = sparse.csgraph.connected_components(linked, directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if count else []
