"""Reduction to a Krylov space of (K + s^2 M)^-1 M, with an orthonormal basis of fewer vectors than modes in the band.

Rigid-body shapes, if known, are its first vectors, with a stiffness of exactly zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.notices import Progress, silent
from seatfem.structures.method import Aims, allowed_error, cheapest_solver, compactness
from seatfem.structures.model import Array, Damping, ModelError, SecondOrderModel
from seatfem.structures.reduction import eigen_search, reducer
from seatfem.structures.reduction.factorization import Backend, Factorization, factorize, solve_on_two_grids
from seatfem.structures.reduction.modes import ConvergenceError, Modes, eigen_residuals
from seatfem.structures.reduction.reducer import USUAL, Cost, Grown, History, Reducer, Reduction, RitzSpace, factorized


class KrylovBasis:
    """V with V'MV = I, grown block by block, and the projections V'KV and V'B.

    Args:
        model: M, K and the ports B.
        factor: factorization of K + s^2 M.
        shift: s > 0 [rad/s].
        limit: largest number of vectors.
        rigid: (n, r) M-orthonormal with K rigid = 0; (n, 0) for none.
    """

    def __init__(self, model: SecondOrderModel, factor: Factorization, shift: float, limit: int, rigid: Array) -> None:
        self.model, self.factor, self.shift, self.limit = model, factor, shift, limit
        self.rigid = self.size = int(rigid.shape[1])
        self._vectors = np.asfortranarray(rigid)
        self._stiffness = np.zeros((limit, limit))
        self._ports = np.zeros((limit, model.port_matrix.shape[1]))
        self._ports[: self.rigid] = self._vectors.T @ model.port_matrix
        self._next = factor.solve(model.port_matrix)  # candidates
        compliance = model.port_matrix.T @ self._next
        self.reciprocity = float(np.abs(compliance - compliance.T).max() / np.abs(compliance).max())

    @property
    def V(self) -> Array:
        """Return the (n, size) basis."""
        return self._vectors[:, : self.size]

    @property
    def complete(self) -> bool:
        """Return whether V spans an invariant subspace, which no further vector enlarges."""
        return self.size == self.model.size or self._next.shape[1] == 0

    def grow(self, size: int) -> None:
        """Append whole blocks until there are at least ``size`` vectors, or the limit or the end is reached."""
        while self.size < min(size, self.limit) and not self.complete:
            first = self.size
            for column in self._next.T:
                if self.size < self.limit:
                    self._append(column)
            self._next = self.factor.solve(self.model.M @ self._vectors[:, first : self.size])

    def _append(self, w: Array) -> None:
        """Orthonormalise ``w`` against V and append it, unless it lies in the span of V."""
        k, M, K = self.size, self.model.M, self.model.K
        before = square = 0.0
        for again in range(2):  # twice is enough (Kahan, Parlett)
            momentum = M @ w
            parts = self.V.T @ momentum
            square = float(w @ momentum)
            before = before if again else math.sqrt(square)
            w = w - self.V @ parts
        norm = math.sqrt(max(square - float(parts @ parts), 0.0))  # without cancellation, as the second parts are small
        if not norm > 1e-11 * before:
            return
        if k == self._vectors.shape[1]:
            grown = np.empty((len(w), max(2 * k, 32)), order="F")
            grown[:, :k] = self._vectors
            self._vectors = grown
        self._vectors[:, k] = w / norm
        self.size = k + 1
        first = self.rigid
        column = self._vectors[:, first : k + 1].T @ (K @ self._vectors[:, k])
        self._stiffness[first : k + 1, k] = self._stiffness[k, first : k + 1] = column
        self._ports[k] = self._vectors[:, k] @ self.model.port_matrix

    def ritz(self, size: int = 0) -> tuple[Array, Array, Array]:
        """Return (omega (k,), shapes at the ports (k, p), coefficients (k, k)) of the Ritz pairs of (K, M) on V, or on
        its first ``size`` vectors."""
        k = size or self.size
        omega, coefficients = ritz_pairs(self._stiffness[:k, :k], self.rigid, self.shift)
        return omega, coefficients.T @ self._ports[:k], coefficients

    def combined(self, coefficients: Array) -> Array:
        """Return the (n, m) product of V and ``coefficients`` (size, m)."""
        return np.asarray(self.V @ coefficients)

    def orthogonality_error(self) -> float:
        """Return the largest entry of V'MV - I."""
        return float(np.abs(self.V.T @ (self.model.M @ self.V) - np.eye(self.size)).max())


def ritz_pairs(stiffness: Array, rigid: int, shift: float) -> tuple[Array, Array]:
    """Return (omega (k,), coefficients (k, k)) of the Ritz pairs of a projected K on vectors with V'MV = I, the first
    ``rigid`` of which are rigid motions. Raises `ModelError` for an indefinite K."""
    values, vectors = np.linalg.eigh(stiffness[rigid:, rigid:])
    if values.min(initial=0.0) < -1e-8 * shift**2:
        raise ModelError(f"K is indefinite, check its constraints: Ritz value {values[0]:.2e} 1/s^2 relative to M")
    zero = 0.0 if rigid else 1e-10 * shift**2  # free bodies whose rigid shapes are not known
    coefficients = np.eye(len(stiffness))
    coefficients[rigid:, rigid:] = vectors
    return np.sqrt(np.concatenate([np.zeros(rigid), np.where(values < zero, 0.0, values)])), coefficients


_LOOSER: Final = (
    10.0  # error allowed to solves on two grids over that of factors: solves off by 0.1 % changed g by 0.03 %
)


def begin_basis(model: SecondOrderModel, shift: float, limit: int, backend: Backend, tolerance: float) -> KrylovBasis:
    """Return a basis about -``shift``^2 that contains the rigid motions only.

    ``tolerance``: that of g, from which the allowed error of solves follows.
    """
    factor, allowed = None, allowed_error(model.size, tolerance)
    matrix = model.K + shift**2 * model.M
    mesh: Any = None if model.dofs is None else model.dofs.mesh
    if mesh is not None and backend == "auto":
        compact = compactness(mesh.nelements, mesh.boundary_facets().size)
        if cheapest_solver(model.size, len(model.ports), compact, tolerance) == "two grids":
            factor = solve_on_two_grids(matrix, model.dofs, _LOOSER * allowed)
    factor = factor or factorize(matrix, backend=backend, allowed=allowed, name="K + s^2 M")
    return KrylovBasis(model, factor, shift, limit, eigen_search.rigid_shapes(model))


_BLOCK = 10  # fewest vectors between two checks
_CRAWLS = (
    60  # vectors per port beyond which a higher shift is taken, which needs half as many; damped bodies need 30 to 50
)
_HIGHER = (
    2.5  # that shift over the band's: errors at tight tolerances lie at two to four times the band. Undamped bodies
)
# begin with it: up to 65 % fewer vectors over 2.5 to 12 periods of the band, at most 12 % more


@dataclass(frozen=True)
class Krylov(Reducer):
    """Reduction to a Krylov space V, which grows until the error of g after the Hann pulse is within tolerance.

    Its modes, for pictures, are the Ritz pairs in the band that are converged modes, which the ports excite.

    Attributes:
        most: most vectors, unless the aims state a number.
    """

    most: int = 800

    name = "krylov"
    bears_rounding = True

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the cost of one factorization and `USUAL` vectors for each port."""
        vectors = USUAL * len(model.ports)
        return Cost(factorized(model, vectors), f"one factorization and about {vectors} vectors")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`; raises `ConvergenceError` also if the basis loses its orthogonality."""
        space = _Vectors(model, damping, aims, aims.max_vectors or self.most, progress)
        greens, error = space.converge(progress)
        basis = space.basis
        if (lost := basis.orthogonality_error()) > 1e-8:
            raise ConvergenceError(
                f"the Krylov basis lost orthogonality: |V'MV - I| = {lost:.1e} (limit 1e-8); use method='modes'"
            )
        modes = _converged(basis, space.omega, space.coefficients, aims.band)
        origin = {
            "vectors": basis.size,
            "rigid_modes": basis.rigid,
            "shift_rad_per_s": basis.shift,
            "factorization": basis.factor.backend,
            "checks": {"reciprocity": basis.reciprocity, **reducer.passivity(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin), modes)


class _Vectors(RitzSpace):
    """The Krylov basis so far, and its Ritz pairs."""

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims, most: int, progress: Progress) -> None:
        super().__init__(model, damping, aims)
        self.most, self.progress = most, progress
        undamped = damping == Damping() and damping.loss is None
        self.basis = self._start((_HIGHER if undamped else 1.0) * aims.band)

    def grow(self) -> Grown:
        basis, band = self.basis, self.aims.band
        if basis.shift == band and basis.size >= _CRAWLS * len(self.model.ports) and not basis.complete:
            basis = self._start(_HIGHER * band)
            self.basis, self.history = basis, History(self.aims.tolerance)
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        omega, shapes, self.coefficients = basis.ritz()
        loss = 0.0 if self.damping.loss is None else self.damping.losses(basis.combined(self.coefficients))
        return self.see(omega, shapes, loss=loss), basis.complete, basis.size == basis.limit, basis.size

    def shortfall(self, error: float) -> str:
        return (
            f"{self.basis.size} Krylov vectors leave an estimated error of {error:.1e}, which must be below half the "
            f"tolerance, {self.aims.tolerance / 2:.1e}: lower the bandwidth or the duration, or raise max_vectors "
            "(seat.greens.max_vectors in a scene)"
        )

    def _start(self, shift: float) -> KrylovBasis:
        self.progress("factorization", 0.0)
        limit = min(self.most, self.model.size)
        basis = begin_basis(self.model, shift, limit, self.aims.backend, self.aims.tolerance)
        self.progress("factorization", 1.0)
        self.progress("reduction", 0.0)
        return basis


def _converged(basis: KrylovBasis, omega: Array, coefficients: Array, band: float) -> Modes:
    """Return the Ritz pairs up to the band edge (40 at most) whose eigenvalue residual is below 1e-3."""
    chosen = np.flatnonzero(omega <= band)[:40]
    shapes = basis.combined(coefficients[:, chosen])
    residuals = eigen_residuals(basis.model, omega[chosen] ** 2, shapes, band)
    good = residuals < 1e-3
    frequencies = omega[chosen][good] / (2 * np.pi)
    return Modes(frequencies, shapes[:, good], residuals[good], False, f"krylov, {basis.factor.backend}")
