"""Block Lanczos on A = M^-1/2 K M^-1/2 with a diagonal M: three-term, two blocks of vectors in memory."""

from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
import scipy.linalg

from impact.progress import silent
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.gauss_rule import gauss_rule
from seatfem.structures.reduction.rigid import rigid_shapes


class Recursion:
    """T = tridiag(B_j, A_j, B_j+1') with p x p blocks, grown step by step from q = M^-1/2 B = Q_1 R, M diagonal.

    Known rigid-body motions are taken out of q and kept apart.

    Attributes:
        start: (w, p) R; w <= p is the rank of q.
        rigid: (r, p) port components of the M-orthonormal rigid-body shapes.
        steps: blocks in T.
        complete: whether q spans an invariant subspace of that size: nothing more can be found.
    """

    def __init__(self, model: SecondOrderModel) -> None:
        self._K, self._root = model.K, 1 / np.sqrt(model.M.diagonal())
        shapes = rigid_shapes(model)
        self.rigid = shapes.T @ model.port_matrix
        q = self._root[:, None] * model.port_matrix - (shapes / self._root[:, None]) @ self.rigid
        basis, sizes, right = np.linalg.svd(q, full_matrices=False)
        kept = sizes > 1e-12 * np.linalg.norm(self._root[:, None] * model.port_matrix)
        self._now, self.start = np.ascontiguousarray(basis[:, kept]), sizes[kept, None] * right[kept]
        self._before, self._link = np.zeros_like(self._now), np.zeros((self.width, self.width))
        self._diagonal: list[Array] = []
        self._below: list[Array] = []  # B_j+1 of step j
        self.complete = self.width == 0

    @property
    def width(self) -> int:
        """Return the number of columns of a block."""
        return int(self._now.shape[1])

    @property
    def steps(self) -> int:
        """Return the number of blocks in T."""
        return len(self._diagonal)

    def extend(self, steps: int, progress: Callable[[int], None] = lambda done: silent("", 0.0)) -> None:
        """Go on until there are ``steps`` blocks."""
        while self.steps < steps and not self.complete:
            block = self._step()
            self._diagonal.append((block + block.T) / 2)
            self._below.append(self._link)
            scale = max(np.abs(self._diagonal[0]).max(), np.abs(block).max())
            self.complete = bool(np.abs(self._link).max() < 1e-13 * scale)  # no sooner: round-off adds copies of nodes
            if self.steps % 50 == 0:
                progress(self.steps)

    def _step(self) -> Array:
        """Return the next block of vectors and its link; the diagonal block of T."""
        root = self._root[:, None]
        w = root * (self._K @ (root * self._now))
        _subtract(w, self._before, np.ascontiguousarray(self._link.T))
        block = _gram(self._now, w)
        _subtract(w, self._now, block)
        self._before = self._now
        self._now, self._link = _orthonormal(w)
        return block

    def banded(self) -> Array:
        """Return the (2 w, k w) lower bands of T; blocks B are upper triangular, so that T has w bands below its
        diagonal."""
        k, w = self.steps, self.width
        bands = np.zeros((w + 1, k * w))
        for j, block in enumerate(self._diagonal):
            for column in range(w):
                at = j * w + column
                bands[: w - column, at] = block[column:, column]
                if j + 1 < k:
                    link = self._below[j][: column + 1, column]
                    bands[w - column : w + 1, at] = link
        return bands

    def highest(self) -> float:
        """Return the largest eigenvalue of T [1/s^2]: within a per cent of A's from a few dozen steps on, from
        below."""
        bands = self.banded()
        last = bands.shape[1] - 1
        return float(
            scipy.linalg.eig_banded(bands, lower=True, eigvals_only=True, select="i", select_range=(last, last))[0]
        )

    def eigen(self, below: float) -> tuple[Array, Array]:
        """Return (values (m,), first block rows (m, w) of the vectors) of the eigenvalues of T up to ``below``
        [1/s^2]."""
        bands = self.banded()
        if self.width == 1:
            values, components = gauss_rule(bands[0], bands[1, :-1])
            first = components[:, None]
        else:
            values, vectors = np.linalg.eigh(_dense(bands))
            first = vectors[: self.width].T
        return values[values <= below], np.asarray(first[values <= below])

    def resolvent(self, square: float) -> Array:
        """Return (p, p) Gauss value of q'(A + s^2)^-1 q, s^2 = ``square``, without the rigid motions: a lower bound."""
        bands = self.banded()
        bands[0] += square
        return self._corner(bands)

    def bracket(self, s: float) -> dict[str, float]:
        """Return the bounds of trace q'(A + s^2)^-1 q [m/N], Gauss below and Gauss-Radau with a node at 0 above.

        The prescribed node replaces the next diagonal block by B (E_k'T^-1 E_k) B'.
        """
        w = self.width
        lower = float(np.trace(self.resolvent(s**2)))
        upper = lower
        if not self.complete:
            bands = self.banded()
            bands[0] += 1e-13 * np.abs(bands[0]).max()  # T may be singular to round-off: a node just below 0
            last = np.zeros((bands.shape[1], w))
            last[-w:] = np.eye(w)
            corner = scipy.linalg.solveh_banded(bands, last, lower=True)[-w:]
            self._diagonal.append(self._link @ (corner + corner.T) / 2 @ self._link.T)
            self._below.append(np.zeros_like(self._link))
            upper = float(np.trace(self.resolvent(s**2)))
            self._diagonal.pop()
            self._below.pop()
        return {"s": s, "lower": lower, "upper": upper, "relative_width": (upper - lower) / lower if lower else 0.0}

    def _corner(self, bands: Array) -> Array:
        right = np.zeros((bands.shape[1], self.start.shape[1]))
        right[: self.width] = self.start
        try:
            solved = scipy.linalg.solveh_banded(bands, right, lower=True)
        except np.linalg.LinAlgError as error:
            raise ModelError(
                "K is indefinite, or a body is free whose rigid motions are not known; hold it, or give dofs="
            ) from error
        return np.asarray(self.start.T @ solved[: self.width])


@numba.njit(cache=True)
def _subtract(w: Array, block: Array, factors: Array) -> None:
    """Do w -= block @ factors, for few columns: one pass; threads of a BLAS would cost more than they bring."""
    for i in range(w.shape[0]):
        for j in range(w.shape[1]):
            for k in range(w.shape[1]):
                w[i, j] -= block[i, k] * factors[k, j]


@numba.njit(cache=True)
def _gram(a: Array, b: Array) -> Array:
    """Return a'b of two tall blocks."""
    out = np.zeros((a.shape[1], b.shape[1]))
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            for k in range(b.shape[1]):
                out[j, k] += a[i, j] * b[i, k]
    return out


def _orthonormal(w: Array) -> tuple[Array, Array]:
    """Return the QR factors of a tall block; one column without LAPACK."""
    if w.shape[1] == 1:
        size = float(np.sqrt(_gram(w, w)[0, 0]))
        return (w / size if size > 0 else w), np.array([[size]])
    q, r = np.linalg.qr(w)
    return np.ascontiguousarray(q), r


def _dense(bands: Array) -> Array:
    n = bands.shape[1]
    full = np.zeros((n, n))
    for k, band in enumerate(bands):
        full[np.arange(k, n), np.arange(n - k)] = band[: n - k]
    return full
