"""Krylov reduction at a real shift: from (M, K, b) to a Green's function with one factorization.

V is an M-orthonormal basis of span{x, (K + s^2 M)^-1 M x, ...}, x = (K + s^2 M)^-1 b, with s > 0 at the band edge, so
that the factorized matrix is positive definite. Rayleigh-Ritz of (K, M) on V gives pairs that are used like modes: few
of them are modes of the body, all of them together reproduce b'(K - w^2 M)^-1 b over the band. Projection by a
congruence keeps K, M positive, hence g passive.

K = A - s^2 M with A = K + s^2 M, so the same space is the one that conjugate gradients on K u = b, preconditioned by A,
would search: the static compliance of the Ritz pairs is the k-th iterate's and needs no solve with K.

Sources: Wilson, Yuan & Dickens, Earthq. Eng. Struct. Dyn. 10 (1982);
Gu, Ma & Hulbert, Finite Elem. Anal. Des. 36 (2000).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.greens import ErrorEstimate
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from seatfem.damping import Damping, truncate
from seatfem.factorization import Backend, Factorization, factorize
from seatfem.model import Array, ModelError, SecondOrderModel
from seatfem.modes import ConvergenceError, Modes, eigen_residuals
from seatfem.pulse import error_times, filtered

_BLOCK = 10  # fewest vectors between two checks


@dataclass
class _Basis:
    """A growing M-orthonormal basis V with V'KV and V'B."""

    model: SecondOrderModel
    vectors: Array
    stiffness: Array
    ports: Array
    size: int = 0

    @staticmethod
    def empty(model: SecondOrderModel, limit: int) -> _Basis:
        n, p = model.port_matrix.shape
        return _Basis(model, np.empty((n, 0), order="F"), np.zeros((limit, limit)), np.zeros((limit, p)))

    @property
    def V(self) -> Array:
        return self.vectors[:, : self.size]

    def append(self, w: Array) -> bool:
        """Orthonormalise ``w`` against V and append it; ``False`` if it lies in the span of V already."""
        k, M, K = self.size, self.model.M, self.model.K
        before = np.sqrt(w @ (M @ w))
        for _ in range(2):  # twice is enough (Kahan, Parlett)
            w = w - self.V @ (self.V.T @ (M @ w))
        norm = np.sqrt(w @ (M @ w))
        if not norm > 1e-11 * before:
            return False
        if k == self.vectors.shape[1]:
            grown = np.empty((len(w), max(2 * k, 32)), order="F")
            grown[:, :k] = self.vectors
            self.vectors = grown
        self.vectors[:, k] = w / norm
        self.size = k + 1
        self.stiffness[: k + 1, k] = self.stiffness[k, : k + 1] = self.V.T @ (K @ self.vectors[:, k])
        self.ports[k] = self.vectors[:, k] @ self.model.port_matrix
        return True

    def ritz(self, shift: float) -> tuple[Array, Array, Array]:
        """(omega (k,), shapes at the ports (k, p), coefficients (k, k)) of the Ritz pairs."""
        values, vectors = np.linalg.eigh(self.stiffness[: self.size, : self.size])
        if values[0] < -1e-8 * shift**2:
            raise ModelError(f"K is indefinite: it has the Ritz value {values[0]:.2e} 1/s^2 relative to M")
        square = np.where(values < 1e-10 * shift**2, 0.0, values)
        return np.sqrt(square), vectors.T @ self.ports[: self.size], vectors

    def check(self) -> float:
        """Largest entry of V'MV - I."""
        return float(np.abs(self.V.T @ (self.model.M @ self.V) - np.eye(self.size)).max())


def krylov_greens(
    model: SecondOrderModel,
    damping: Damping,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    backend: Backend = "auto",
    max_vectors: int = 800,
    progress: Progress = silent,
) -> tuple[ModalGreens, Modes]:
    """Grow V until the estimated error of g after the Hann pulse of ``bandwidth`` over ``duration`` is in tolerance.

    Returns the Green's function and those Ritz pairs in the band that are converged modes of the body (the ones the
    ports excite), for pictures.

    Raises:
        ConvergenceError: the error after ``max_vectors`` vectors, or the loss of orthogonality, is too large.
    """
    shift, width = 2 * np.pi * bandwidth, 1 / bandwidth
    factor = factorize(model.K + shift**2 * model.M, backend=backend)
    progress("reduction", 0.0)
    limit = min(max_vectors, model.size)
    basis = _Basis.empty(model, limit)
    history = _History(error_times(duration, width), width)
    block, exhausted = factor.solve(model.port_matrix), False
    while True:
        block, exhausted = _grow(basis, block, factor, min(basis.size + max(_BLOCK, basis.size // 8), limit))
        omega, shapes, coefficients = basis.ritz(shift)
        complete = exhausted or basis.size == model.size
        everything = truncate(omega, shapes, np.inf, np.zeros((shapes.shape[1],) * 2), model, damping)
        error = history.add(everything, complete)
        progress("reduction", history.fraction(error, tolerance))
        if error <= tolerance / 2:
            greens, cut = _cut(everything, omega, shapes, model, damping, history, bandwidth, tolerance / 2)
            error += cut
            if error <= tolerance or complete:
                break
        if basis.size == limit:
            raise ConvergenceError(
                f"{basis.size} Krylov vectors leave an estimated error of {error:.1e} (tolerance {tolerance:.1e}): "
                "lower the bandwidth or the duration, or raise max_vectors"
            )
    if (lost := basis.check()) > 1e-8:
        raise ConvergenceError(f"the Krylov basis lost orthogonality: |V'MV - I| = {lost:.1e} (limit 1e-8)")
    origin = {"vectors": basis.size, "shift_rad_per_s": shift, "factorization": factor.backend}
    progress("reduction", 1.0)
    return greens.with_error(ErrorEstimate(reduction=error), origin), _converged(
        model, basis, omega, coefficients, shift, factor.backend
    )


def _grow(basis: _Basis, block: Array, factor: Factorization, size: int) -> tuple[Array, bool]:
    """Append blocks until ``size`` vectors; returns the next block, and whether the space is exhausted."""
    while basis.size < size:
        first = basis.size
        for column in block.T[: size - first]:
            basis.append(column)
        new = basis.vectors[:, first : basis.size]
        if new.shape[1] == 0:
            return block, True
        block = factor.solve(basis.model.M @ new)
    return block, False


@dataclass
class _History:
    """g after the pulse from one check to the next, and what the differences say about the error that is left."""

    t: Array
    width: float
    last: Array | None = None
    difference: float = np.inf
    first_error: float = np.inf

    def add(self, greens: ModalGreens, complete: bool) -> float:
        """Estimated error of ``greens`` relative to its maximum: twice the last difference, or half the one before.

        Differences fall unevenly; measured on blocks and rods, the true error stays below this and mostly within a
        factor of three of it.
        """
        response = filtered(greens, self.t, self.width)
        before, self.last = self.last, response
        if complete:
            return 0.0
        if before is None:
            return np.inf
        previous = self.difference
        self.difference = float(np.abs(response - before).max() / np.abs(response).max())
        return 2 * max(self.difference, previous / 4)

    def fraction(self, error: float, tolerance: float) -> float:
        """Progress: on a logarithmic scale, as convergence is geometric."""
        if not np.isfinite(error):
            return 0.0
        self.first_error = min(self.first_error, max(error, 2 * tolerance))
        done = np.log(self.first_error / max(error, tolerance)) / np.log(self.first_error / tolerance)
        return float(np.clip(done, 0.0, 0.99))


def _cut(
    everything: ModalGreens,
    omega: Array,
    shapes: Array,
    model: SecondOrderModel,
    damping: Damping,
    history: _History,
    bandwidth: float,
    allowed: float,
) -> tuple[ModalGreens, float]:
    """Drop the Ritz pairs above the lowest cutoff that costs less than ``allowed`` into the residual; (g, its error).

    High Ritz pairs stand for no mode of the body; kept, they would ring in the contact. Their compliance is kept.
    """
    assert history.last is not None
    scale = float(np.abs(history.last).max())
    best, lowest = everything, np.inf
    above = 4 * np.pi * bandwidth
    while np.any(omega > above) and lowest > allowed:
        greens = truncate(omega, shapes, above, np.zeros((shapes.shape[1],) * 2), model, damping)
        error = float(np.abs(filtered(greens, history.t, history.width) - history.last).max()) / scale
        if error < lowest:
            best, lowest = greens, error
        above *= 1.25
    return (best, lowest) if np.isfinite(lowest) else (everything, 0.0)


def _converged(
    model: SecondOrderModel, basis: _Basis, omega: Array, coefficients: Array, shift: float, backend: str
) -> Modes:
    """The Ritz pairs up to the shift frequency (40 at most) whose eigenvalue residual is below 1e-3."""
    chosen = np.flatnonzero(omega <= shift)[:40]
    shapes = basis.V @ coefficients[:, chosen]
    residuals = eigen_residuals(model, omega[chosen] ** 2, shapes, shift)
    good = residuals < 1e-3
    return Modes(omega[chosen][good] / (2 * np.pi), shapes[:, good], residuals[good], False, f"krylov, {backend}")
