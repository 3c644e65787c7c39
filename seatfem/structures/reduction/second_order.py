"""Reduction to a second-order Krylov space, for damping that couples the modes, and to the poles of the small model.

A second-order Krylov space at one real s0, with P = s0^2 M + s0 C + K (symmetric positive definite, factorized once),

    r_0 = P^-1 B,    r_j = -P^-1 ((2 s0 M + C) r_(j-1) + M r_(j-2))

is spanned by Q, Q'MQ = I, grown by the two-level orthogonal Arnoldi process: the pairs (r_j, r_(j-1)) are kept
orthonormal as Q times small coefficients, which is stable where the plain recursion breaks down after a dozen vectors.
The one-sided projections Q'MQ, Q'CQ, Q'KQ stay symmetric and positive, so the small model is passive; its quadratic
eigenvalue problem gives the poles and symmetric rank-one residues of `impact.greens.poles.PoleGreens`.

Source: Lu, Su and Bai, SIAM J. Matrix Anal. Appl. 37 (2016) 195 (TOAR); Bai and Su, SIAM J. Sci. Comput. 26 (2005) 1692
(projection of the second-order structure); Tisseur and Meerbergen, SIAM Review 43 (2001) 235.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy import sparse

from impact.greens.base import ErrorEstimate
from impact.greens.poles import PoleGreens
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, SecondOrderModel, as_csr
from seatfem.structures.reduction import eigen_search, factorization, krylov, reducer
from seatfem.structures.reduction.reducer import Cost, Grown, Reducer, Reduction, Space

Complex = NDArray[np.complex128]
_COUPLED = 1e-8  # off-diagonal entry of a Gram matrix over its diagonal, above which vectors share a repeated pole


@dataclass(frozen=True)
class Coupled:
    """q'' + C q' + diag(w^2) q = ports F: undamped pairs, coupled by damping.

    Attributes:
        omega: (k,) ascending angular frequencies [rad/s]; exactly 0 for rigid motions.
        C: (k, k) symmetric positive semidefinite damping [1/s].
        ports: (k, p) shapes at the ports [1/sqrt(kg)].
    """

    omega: Array
    C: Array
    ports: Array

    def below(self, above: float) -> Coupled:
        """Return the system of the pairs up to ``above`` [rad/s], passive as the whole."""
        kept = self.omega <= above
        return Coupled(self.omega[kept], self.C[np.ix_(kept, kept)], self.ports[kept])

    def left_out(self, above: float) -> Array:
        """Return the (p, p) static compliance of the pairs above ``above`` [rad/s] [m/N]."""
        dropped = self.omega > above
        parts = self.ports[dropped] / self.omega[dropped, None]
        return np.asarray(parts.T @ parts)


def poles(system: Coupled, port_names: tuple[str, ...]) -> PoleGreens:
    """Return the poles s and shapes r = ports'y / sqrt(y'(2 s + C) y) of (s^2 + s C + w^2) y = 0.

    Rigid motions are removed first: undamped ones are a ramp in time, damped ones a pole at exactly 0.
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
    """Return the vectors with unit length, and Y'(s_i + s_j + C) Y, which is diagonal except for repeated poles."""
    y = y / np.linalg.norm(y, axis=0)
    plain = y.T @ y
    return y, np.asarray(y.T @ (C @ y) + plain * (s[:, None] + s[None, :]))


def _groups(gram: Complex) -> list[NDArray[np.int64]]:
    """Return groups of indices of vectors that are not orthogonal to each other, as they share a repeated pole."""
    size = np.sqrt(np.abs(np.diag(gram)))
    linked = sparse.csr_matrix((np.abs(gram) > _COUPLED * np.outer(size, size)).astype(float))
    count, label = sparse.csgraph.connected_components(linked, directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if count else []


class SecondOrderBasis:
    """Q with Q'MQ = I, and its projections of C, K and the ports.

    The Arnoldi vectors of the linearised problem are (Q U_j, Q L_j), orthonormal in the coefficients; the next one is
    (-P^-1 ((2 s M + C) Q U_j + M Q L_j), Q U_j), so Q gains one vector for each.

    Args:
        C: (n, n) damping.
        factor: factorization of P = s^2 M + s C + K.
        shift: s > 0 [rad/s].
        limit: largest number of vectors.
        rigid: (n, r) M-orthonormal with K rigid = 0: the first vectors, so that g holds them exactly.
    """

    def __init__(
        self,
        model: SecondOrderModel,
        C: sparse.csr_array,
        factor: factorization.Factorization,
        shift: float,
        limit: int,
        rigid: Array,
    ) -> None:
        self.model, self.C, self.factor, self.shift, self.limit = model, C, factor, shift, limit
        self.rigid = self.size = rigid.shape[1]
        self._q = np.empty((model.size, limit), order="F")
        self._q[:, : self.rigid] = rigid
        self._mq = np.empty((model.size, limit), order="F")
        self._mq[:, : self.rigid] = model.M @ rigid
        self._c, self._k = np.zeros((limit, limit)), np.zeros((limit, limit))
        self._c[: self.rigid, : self.rigid] = rigid.T @ (C @ rigid)
        self._pairs: list[tuple[Array, Array]] = []  # (U_j, L_j), the second scaled by the shift
        self._done = 0
        first = factor.solve(model.port_matrix)
        self.reciprocity = reducer.reciprocity(model.port_matrix.T @ first)
        for column in first.T:
            upper = self._append(column)
            self._add_pair(upper, np.zeros(len(upper)))

    @property
    def Q(self) -> Array:
        """Return the (n, size) basis."""
        return self._q[:, : self.size]

    @property
    def complete(self) -> bool:
        """Return whether Q spans an invariant subspace, which no further vector enlarges."""
        return self.size == self.model.size or self._done == len(self._pairs)

    def coupled(self, damping: Damping) -> Coupled:
        """Return the small model, its K diagonal, with 2 zeta w, zeta = ratio + phi' H phi/(2 w^2), added to its C."""
        k = self.size
        omega, vectors = krylov.ritz_pairs(self._k[:k, :k], self.rigid, self.shift)
        rotated = vectors.T @ self._c[:k, :k] @ vectors
        lost = 0.0 if damping.loss is None else damping.losses(self.Q @ vectors)
        modal = Damping(damping.ratio).ratios(omega, lost)
        ports = vectors.T @ (self.Q.T @ self.model.port_matrix)
        return Coupled(omega, (rotated + rotated.T) / 2 + np.diag(2 * modal * omega), ports)

    def grow(self, size: int) -> None:
        """Append vectors until there are ``size``, or the limit or the end is reached."""
        while self.size < min(size, self.limit) and not self.complete:
            upper, lower = self._pairs[self._done]
            self._done += 1
            u, low = self._q[:, : len(upper)] @ upper, self._mq[:, : len(lower)] @ lower
            mass = self._mq[:, : len(upper)] @ upper
            # scaled by the shift, r_j -> s^j r_j, so that both halves of a pair are of the same size
            right = 2 * self.shift**2 * mass + self.shift * (self.C @ u) + self.shift**2 * low
            self._add_pair(self._append(-self.factor.solve(right)), upper)

    def _append(self, w: Array) -> Array:
        """Orthonormalise ``w`` against Q and append it, unless it lies in the span of Q; return its coefficients."""
        before = np.sqrt(w @ (self.model.M @ w))
        coefficients = np.zeros(self.size)
        for _ in range(2):  # twice is enough (Kahan, Parlett)
            part = self._mq[:, : self.size].T @ w
            w = w - self.Q @ part
            coefficients += part
        mass = self.model.M @ w
        norm = np.sqrt(w @ mass)
        k = self.size
        if not norm > 1e-11 * before or k == self.limit:
            return coefficients
        self._q[:, k], self._mq[:, k] = w / norm, mass / norm
        self.size = k + 1
        new = self._q[:, k]
        self._c[: k + 1, k] = self._c[k, : k + 1] = self.Q.T @ (self.C @ new)
        first = self.rigid
        column = self._q[:, first : k + 1].T @ (self.model.K @ new)
        self._k[first : k + 1, k] = self._k[k, first : k + 1] = column
        return np.append(coefficients, norm)

    def _add_pair(self, upper: Array, lower: Array) -> None:
        """Orthonormalise (upper, lower) against the pairs so far and append it, unless it depends on them."""
        width = self.size
        x = np.concatenate([np.pad(upper, (0, width - len(upper))), np.pad(lower, (0, width - len(lower)))])
        before = np.linalg.norm(x)
        if self._pairs:
            known = np.zeros((2 * width, len(self._pairs)))
            for j, (u, low) in enumerate(self._pairs):
                known[: len(u), j], known[width : width + len(low), j] = u, low
            for _ in range(2):
                x = x - known @ (known.T @ x)
        norm = np.linalg.norm(x)
        if norm > 1e-11 * before:
            self._pairs.append((x[:width] / norm, x[width:] / norm))


_BLOCK = 10  # fewest vectors between two checks


@dataclass(frozen=True)
class SecondOrderKrylov(Reducer):
    """Reduction to a second-order Krylov space Q, which grows until the estimated error of g is within tolerance.

    The shift is s0 = 2 pi bandwidth. Undamped pairs of the small model above a cutoff are replaced by a passive
    exponential, as in the other reductions; a truncation of pairs, unlike one of poles, keeps the model passive. Modal
    damping is added to the model's C: the uniform ratio, and the loss matrix by modal strain energy.

    Attributes:
        most: most vectors, unless the aims state a number.
    """

    most: int = 500

    name = "second_order"
    oscillators = False

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used: the damping C must not add energy."""
        return reducer.feeding(model, damping)

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the cost of one factorization and twice the vectors of a Krylov space without C."""
        vectors = 2 * reducer.USUAL * len(model.ports)
        return Cost(reducer.factorized(model, vectors), f"one factorization with C and about {vectors} vectors")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`."""
        progress("factorization", 0.0)
        space = _Coupled(model, damping, aims, aims.max_vectors or self.most)
        progress("factorization", 1.0)
        progress("reduction", 0.0)
        greens, error = space.converge(progress)
        origin = {
            "vectors": space.basis.size,
            "shift_rad_per_s": aims.band,
            "factorization": space.basis.factor.backend,
            "checks": {"reciprocity": space.basis.reciprocity, **reducer.passivity_of_poles(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin))


class _Coupled(Space[PoleGreens]):
    """The basis so far, and the small model, whose pairs are coupled by damping."""

    step = 1.4

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims, most: int) -> None:
        super().__init__(model, replace(damping, alpha=0.0, beta=0.0), aims)  # both are in C
        s, C = aims.band, as_csr((model.size, model.size)) if model.C is None else model.C
        factor = factorization.factorize(model.K + s * C + s**2 * model.M, backend=aims.backend, name="K + s C + s^2 M")
        self.basis = SecondOrderBasis(model, C, factor, s, min(most, model.size), eigen_search.rigid_shapes(model))

    def grow(self) -> Grown:
        basis = self.basis
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        self.whole = basis.coupled(self.damping)
        self.omega = self.whole.omega
        self.response = poles(self.whole, self.model.port_names).filtered_matrix(self.t, self.aims.width)
        return self.response, basis.complete, bool(basis.size == basis.limit), 0

    def truncated(self, above: float) -> tuple[PoleGreens, float]:
        greens = poles(self.whole.below(above), self.model.port_names)
        rest = reducer.residual(self.whole.left_out(above), self.model, self.damping)
        greens = replace(
            greens,
            rates=np.concatenate([greens.rates, rest.rates]),
            real_shapes=np.concatenate([greens.real_shapes, rest.shapes]),
            signs=np.concatenate([greens.signs, np.ones(len(rest.rates))]),
            compliance=rest.compliance,
        )
        lost = np.abs(greens.filtered_matrix(self.t, self.aims.width) - self.response).max()
        return greens, float(lost / np.abs(self.response).max())

    def shortfall(self, error: float) -> str:
        return (
            f"{self.basis.size} second-order Krylov vectors leave an estimated error of {error:.1e} (tolerance "
            f"{self.aims.tolerance:.1e}): lower the bandwidth or the duration, raise max_vectors "
            "(seat.greens.max_vectors in a scene), or use method='transient'"
        )
