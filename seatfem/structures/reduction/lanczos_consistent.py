"""Block Lanczos on M^-1 K with any mass, in the inner product of M, without a factorization.

The recursion of `Recursion` with Q'MQ = 1: beside each block Q it keeps P = M Q, and solves M z = r once a step by
conjugate gradients. Scaled by its diagonal, a consistent mass has a condition number that the element alone determines,
whatever the mesh: 5 of linear, about 10 of quadratic tetrahedra. Source: A. Wathen, IMA J. Numer. Anal. 7 (1987) 449.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import scipy.linalg

from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.lanczos_recursion import Recursion
from seatfem.structures.reduction.rigid import rigid_shapes

TOLERANCE: Final = 1e-13  # relative residual of M z = r; g is off by ten times as much
MOST: Final = 200  # iterations; tetrahedra take 30 to 40
_DEPENDENT: Final = 1e-13  # of the Gram matrix of ports, each made one


class ConsistentRecursion(Recursion):
    """A recursion as `Recursion`, for a mass that is not diagonal."""

    def __init__(self, model: SecondOrderModel) -> None:
        self._K, self._M, self._inverse = model.K, model.M, 1 / model.M.diagonal()[:, None]
        shapes = rigid_shapes(model)
        self.rigid = shapes.T @ model.port_matrix
        loads = model.port_matrix - model.M @ (shapes @ self.rigid)
        moved = self._solve(loads)
        gram = loads.T @ moved
        lengths = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        squares, turn = np.linalg.eigh(gram / np.outer(lengths, lengths))
        kept = squares > _DEPENDENT * squares[-1]
        change = turn[:, kept] / np.sqrt(squares[kept]) / lengths[:, None]
        self.start = np.sqrt(squares[kept])[:, None] * turn[:, kept].T * lengths
        self._now, self._dual = moved @ change, loads @ change
        self._dual_before, self._link = np.zeros_like(self._now), np.zeros((self.width, self.width))
        self._diagonal, self._below = [], []
        self.complete = self.width == 0

    def _step(self) -> Array:
        residual = self._K @ self._now - self._dual_before @ self._link.T
        block = np.asarray(self._now.T @ residual)
        residual -= self._dual @ block
        self._dual_before = self._dual
        self._now, self._dual, self._link = _orthonormal(self._solve(residual), residual)
        return block

    def _solve(self, right: Array) -> Array:
        """Return M^-1 right, column by column at once.

        Raises:
            ModelError: a mass that is not positive definite, or worse scaled than any of elements.
        """
        wanted = TOLERANCE**2 * np.sum(self._inverse * right**2, axis=0)
        solution = self._inverse * right
        residual = right - self._M @ solution
        scaled = self._inverse * residual
        direction, square = scaled, np.sum(residual * scaled, axis=0)
        for _ in range(MOST):
            if np.all(square <= wanted):
                return np.asarray(solution)
            image = self._M @ direction
            length = np.sum(direction * image, axis=0)
            if np.any((length <= 0) & (square > wanted)):
                break
            step = square / np.maximum(length, 1e-300)
            solution += step * direction
            residual -= step * image
            scaled = self._inverse * residual
            before, square = np.maximum(square, 1e-300), np.sum(residual * scaled, axis=0)
            direction = scaled + square / before * direction
        raise ModelError(
            f"the mass is none of elements: it is not positive definite, or so badly scaled that {MOST} iterations of "
            "conjugate gradients do not invert it; use method='krylov'"
        )


def _orthonormal(moved: Array, left: Array) -> tuple[Array, Array, Array]:
    """Return (Q, P, R) with Q R = ``moved``, P R = ``left``, Q'P = 1 and R upper triangular, of M Q = P."""
    upper = np.eye(left.shape[1])
    for _ in range(1 if left.shape[1] == 1 else 2):
        squares, turn = np.linalg.eigh(left.T @ moved)
        roots = np.sqrt(np.maximum(squares, 1e-30 * max(squares[-1], 1e-300)))
        _, link = np.linalg.qr(roots[:, None] * turn.T)
        moved, left = (scipy.linalg.solve_triangular(link, each.T, trans="T").T for each in (moved, left))
        upper = link @ upper
    return np.asarray(moved), np.asarray(left), upper
