"""Two-level orthogonal Arnoldi: the growing M-orthonormal basis of a second-order Krylov space."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.checks import reciprocity
from seatfem.structures.reduction.factorization import Factorization


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
        factor: Factorization,
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
        self.reciprocity = reciprocity(model.port_matrix.T @ first)
        for column in first.T:
            upper = self._append(column)
            self._add_pair(upper, np.zeros(len(upper)))

    @property
    def Q(self) -> Array:
        """Return the (n, size) basis."""
        return self._q[:, : self.size]

    @property
    def complete(self) -> bool:
        """Return whether Q spans an invariant subspace: nothing more can be found."""
        return self.size == self.model.size or self._done == len(self._pairs)

    def damping(self) -> Array:
        """Return Q'CQ."""
        return self._c[: self.size, : self.size]

    def stiffness(self) -> Array:
        """Return Q'KQ."""
        return self._k[: self.size, : self.size]

    def ports(self) -> Array:
        """Return the (size, p) Q'B."""
        return np.asarray(self.Q.T @ self.model.port_matrix)

    def grow(self, size: int) -> None:
        """Append vectors until there are ``size``, or the limit or the end is reached."""
        while self.size < min(size, self.limit) and not self.complete:
            upper, lower = self._pairs[self._done]
            self._done += 1
            u, low = self._q[:, : len(upper)] @ upper, self._mq[:, : len(lower)] @ lower
            mass = self._mq[:, : len(upper)] @ upper
            # in units of the shift: r_j -> s^j r_j keeps both halves of a pair of one size
            right = 2 * self.shift**2 * mass + self.shift * (self.C @ u) + self.shift**2 * low
            self._add_pair(self._append(-self.factor.solve(right)), upper)

    def _append(self, w: Array) -> Array:
        """Orthonormalise ``w`` against Q, append the rest unless it is nothing; return its coefficients."""
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
        """Orthonormalise (upper, lower) against the pairs so far; drop what is dependent."""
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
