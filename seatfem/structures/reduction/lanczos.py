"""Reduction without a factorization: Gauss quadrature of g by block Lanczos recursion on M^-1 K.

With A = M^-1/2 K M^-1/2 and q = M^-1/2 B,

    g(t) = q' sin(sqrt(A) t)/sqrt(A) q  ~  R' [sin(sqrt(T) t)/sqrt(T)]_11 R,      q = Q_1 R

T the block tridiagonal matrix of k block Lanczos steps: the Gauss quadrature of the spectral measure, nodes theta_j
(eigenvalues of T), weights from the first rows of its eigenvectors. The recursion has three terms; only two blocks of
vectors are stored, and none is reorthogonalised: spurious copies of converged nodes share their weight. sin(sqrt(x)
t)/sqrt(x) is approximated to any accuracy by a polynomial of degree t sqrt(theta_max)/2 in x, and a k-point Gauss rule
is exact to degree 2 k - 1, so the quadrature is exact to round-off for t < 4 k/sqrt(theta_max), and useless beyond. A
mass that is not diagonal takes ten times as long.

Sources: Golub and Meurant, Matrices, Moments and Quadrature with Applications (2010); Druskin and Knizhnerman, Numer.
Linear Algebra Appl. 2 (1995) 205 (without orthogonalisation); Zimmerling, Druskin and Simoncini, J. Sci. Comput. 103
(2025) (block Gauss-Radau).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg

from impact.greens.base import ErrorEstimate
from impact.march.loop.compiled import compiled
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, ModelError, SecondOrderModel
from seatfem.structures.reduction import reducer
from seatfem.structures.reduction.eigen_search import rigid_shapes
from seatfem.structures.reduction.reducer import Cost, Grown, Reducer, Reduction, RitzSpace

TOLERANCE: Final = 1e-13  # relative residual of M z = r; the error of g is ten times as large
MOST: Final = 200  # most iterations of conjugate gradients; tetrahedra take 30 to 40
_DEPENDENT: Final = 1e-13  # eigenvalue of the normalised Gram matrix of ports below which they are linearly dependent


def gauss_rule(diagonal: Array, below: Array) -> tuple[Array, Array]:
    """Return (values (k,) ascending, first components (k,)) of the eigenpairs of a symmetric tridiagonal matrix.

    Implicit QL with Wilkinson's shift, applied to the first row of the vectors only: O(k^2) time, O(k) memory, and
    robust for the clusters of equal values that Lanczos produces, on which LAPACK's dstemr can fail. Source: Golub and
    Welsch, Math. Comp. 23 (1969) 221.

    Args:
        diagonal, below: (k,) and (k - 1,).
    """
    values, first = np.array(diagonal, dtype=float), np.zeros(len(diagonal))
    first[0] = 1.0
    _ql(values, np.append(below, 0.0), first)
    order = np.argsort(values)
    return values[order], first[order]


@compiled()
def _ql(d: Array, e: Array, z: Array) -> None:
    """Diagonalise in place: ``d`` becomes the values, ``z`` (the first row of the unit matrix) their components."""
    n = len(d)
    for low in range(n):
        while True:
            high = low
            while high < n - 1 and abs(e[high]) > 2.3e-16 * (abs(d[high]) + abs(d[high + 1])):
                high += 1
            if high == low:
                break
            ratio = (d[low + 1] - d[low]) / (2 * e[low])
            g = d[high] - d[low] + e[low] / (ratio + math.copysign(math.hypot(ratio, 1.0), ratio))
            sine, cosine, moved, split = 1.0, 1.0, 0.0, False
            for i in range(high - 1, low - 1, -1):
                f, b = sine * e[i], cosine * e[i]
                r = math.hypot(f, g)
                e[i + 1] = r
                if r == 0.0:
                    d[i + 1] -= moved
                    e[high] = 0.0
                    split = True
                    break
                sine, cosine = f / r, g / r
                g = d[i + 1] - moved
                r = (d[i] - g) * sine + 2 * cosine * b
                moved = sine * r
                d[i + 1] = g + moved
                g = cosine * r - b
                z[i + 1], z[i] = sine * z[i] + cosine * z[i + 1], cosine * z[i] - sine * z[i + 1]
            if not split:
                d[low] -= moved
                e[low] = g
                e[high] = 0.0


class Recursion:
    """T = tridiag(B_j, A_j, B_j+1') with p x p blocks, grown step by step from M^-1 B = Q_1 R, in M's inner product.

    It stores each block Q with its dual P = M Q, Q'P = 1. A mass that is not diagonal is inverted once a step by
    conjugate gradients: scaled by its diagonal, a finite-element mass has a condition number of 5 (linear) or about 10
    (quadratic tetrahedra) on any mesh. Source: A. Wathen, IMA J. Numer. Anal. 7 (1987) 449. Known rigid-body motions
    are removed from the ports and treated separately.

    Attributes:
        start: (w, p) R; w <= p is the rank of the ports.
        rigid: (r, p) port components of the M-orthonormal rigid-body shapes.
        steps: number of blocks in T.
        complete: whether the blocks span an invariant subspace, which no further block enlarges.
    """

    def __init__(self, model: SecondOrderModel) -> None:
        self._K, self._M, self._inverse = model.K, model.M, 1 / model.M.diagonal()[:, None]
        self._diagonal_mass = model.mass_is_diagonal
        shapes, ports = rigid_shapes(model), model.port_matrix
        self.rigid = shapes.T @ ports
        moved = self._solve(ports)
        whole = np.sum(ports * moved, axis=0)
        loads, moved = ports - model.M @ (shapes @ self.rigid), moved - shapes @ self.rigid
        gram = loads.T @ moved
        lengths = np.sqrt(np.maximum(np.diag(gram), 1e-24 * whole))
        squares, turn = np.linalg.eigh(gram / np.outer(lengths, lengths))
        independent = squares > _DEPENDENT * max(squares[-1], 1.0)
        change = turn[:, independent] / np.sqrt(squares[independent]) / lengths[:, None]
        self.start = np.sqrt(squares[independent])[:, None] * turn[:, independent].T * lengths
        self._now, self._dual = np.ascontiguousarray(moved @ change), np.ascontiguousarray(loads @ change)
        self._dual_before, self._link = np.zeros_like(self._now), np.zeros((self.width, self.width))
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
        """Continue the recursion until there are ``steps`` blocks."""
        while self.steps < steps and not self.complete:
            residual = np.asarray(self._K @ self._now)
            _subtract(residual, self._dual_before, np.ascontiguousarray(self._link.T))
            block = _gram(self._now, residual)
            _subtract(residual, self._dual, block)
            self._dual_before = self._dual
            self._now, self._dual, self._link = _orthonormal(self._solve(residual), residual)
            self._diagonal.append((block + block.T) / 2)
            self._below.append(self._link)
            scale = max(np.abs(self._diagonal[0]).max(), np.abs(block).max())
            self.complete = bool(np.abs(self._link).max() < 1e-13 * scale)
            if self.steps % 50 == 0:
                progress(self.steps)

    def _solve(self, right: Array) -> Array:
        """Return M^-1 ``right`` for all its columns.

        Raises:
            ModelError: the mass is not positive definite, or worse scaled than any of finite elements.
        """
        solution = self._inverse * right
        if self._diagonal_mass:
            return np.asarray(solution)
        wanted = TOLERANCE**2 * np.sum(right * solution, axis=0)
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

    def banded(self) -> Array:
        """Return (w + 1, k w) lower bands of T; blocks B are upper triangular, and T has w bands below its diagonal."""
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
        """Return the largest eigenvalue of T [1/s^2]: within 1 % of A's from a few dozen steps on, from below."""
        bands = self.banded()
        last = bands.shape[1] - 1
        return float(
            scipy.linalg.eig_banded(bands, lower=True, eigvals_only=True, select="i", select_range=(last, last))[0]
        )

    def eigen(self, below: float) -> tuple[Array, Array]:
        """Return (values (m,), first block rows (m, w) of the vectors) of T's eigenvalues up to ``below`` [1/s^2]."""
        bands = self.banded()
        if self.width == 1:
            values, components = gauss_rule(bands[0], bands[1, :-1])
            first = components[:, None]
        else:
            values, vectors = np.linalg.eigh(_dense(bands))
            first = vectors[: self.width].T
        return values[values <= below], np.asarray(first[values <= below])

    def resolvent(self, square: float) -> Array:
        """Return the (p, p) Gauss value of q'(A + s^2)^-1 q, s^2 = ``square``, without rigid motions: a lower bound."""
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


@compiled()
def _subtract(w: Array, block: Array, factors: Array) -> None:
    """Compute w -= block @ factors for few columns in one pass, which is faster than threads of a BLAS."""
    for i in range(w.shape[0]):
        for j in range(w.shape[1]):
            for k in range(w.shape[1]):
                w[i, j] -= block[i, k] * factors[k, j]


@compiled()
def _gram(a: Array, b: Array) -> Array:
    """Return a'b for two blocks of few columns."""
    out = np.zeros((a.shape[1], b.shape[1]))
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            for k in range(b.shape[1]):
                out[j, k] += a[i, j] * b[i, k]
    return out


def _orthonormal(moved: Array, left: Array) -> tuple[Array, Array, Array]:
    """Return (Q, P, R) with Q R = ``moved``, P R = ``left``, Q'P = 1, P = M Q and R upper triangular."""
    if left.shape[1] == 1:
        size = float(np.sqrt(max(_gram(left, moved)[0, 0], 0.0)))
        return (moved / size, left / size, np.array([[size]])) if size > 0 else (moved, left, np.array([[size]]))
    upper = np.eye(left.shape[1])
    for _ in range(2):
        squares, turn = np.linalg.eigh(left.T @ moved)
        roots = np.sqrt(np.maximum(squares, 1e-30 * max(squares[-1], 1e-300)))
        _, link = np.linalg.qr(roots[:, None] * turn.T)
        moved, left = (scipy.linalg.solve_triangular(link, each.T, trans="T").T for each in (moved, left))
        upper = link @ upper
    return np.ascontiguousarray(moved), np.ascontiguousarray(left), upper


def _dense(bands: Array) -> Array:
    n = bands.shape[1]
    full = np.zeros((n, n))
    for k, band in enumerate(bands):
        full[np.arange(k, n), np.arange(n - k)] = band[: n - k]
    return full


_CEILING = 12.0  # frequency over the bandwidth above which nodes are springs, with an error of 1/144
_PRODUCT = 1.2e-9  # time for each entry of K in a product [s], measured
_ROW = 3e-8  # further time for each unknown in a step [s]


@dataclass(frozen=True)
class Lanczos(Reducer):
    """Reduction by Lanczos steps, until the estimated error of g after the Hann pulse is within tolerance.

    Their number grows by an eighth between checks. ``origin["brackets"]`` has Gauss (lower) and Gauss-Radau (upper)
    bounds of the trace of B'(K + s^2 M)^-1 B at s = 1/duration and s = 2 pi bandwidth.

    Attributes:
        most: most steps, unless the aims state a number.
    """

    most: int = 20_000

    name = "lanczos"
    factorizes = False
    diagonal_mass = True

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used: it needs damping ratios that depend on a mode's frequency only."""
        if damping.refusal:
            return damping.refusal
        if damping.loss is not None:
            return (
                "loss factors that differ by region need shapes of modes, which Lanczos does not keep: use "
                "method='krylov'"
            )
        return ""

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the cost of 1.2 T sqrt(theta_max)/4 steps over the duration T, with one product a port in each,
        theta_max by 20 steps; infinite for a mass that is not diagonal, as a last resort if memory allows no
        factorization."""
        if not model.mass_is_diagonal:
            return Cost(math.inf, "products with K, and M inverted by conjugate gradients")
        recursion = Recursion(model)
        recursion.extend(20)
        products = (int(1.2 * aims.duration * np.sqrt(recursion.highest()) / 4) + 30) * len(model.ports)
        return Cost(products * (_PRODUCT * model.K.nnz + _ROW * model.size), f"{products} products with K")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`; raises `ModelError` also for an indefinite K."""
        space = _Nodes(model, damping, aims, aims.max_vectors or self.most, progress)
        greens, error = space.converge(silent)
        progress("reduction", 1.0)
        recursion = space.recursion
        highest = float(np.sqrt(recursion.highest()))
        origin = {
            "steps": recursion.steps,
            "products": recursion.steps * recursion.width,
            "highest_frequency_Hz": highest / (2 * np.pi),
            "valid_s": 4 * recursion.steps / highest,
            "rigid_modes": recursion.rigid.shape[0],
            "brackets": [recursion.bracket(s) for s in (1 / aims.duration, aims.band)],
            "checks": {"reciprocity": 0.0, **reducer.passivity(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin))


class _Nodes(RitzSpace):
    """The recursion so far, and the Gauss nodes of its T."""

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims, most: int, progress: Progress) -> None:
        super().__init__(model, damping, aims)
        self.most, self.progress = most, progress
        self.recursion = Recursion(model)
        self.recursion.extend(min(30, most))
        self.valid = int(np.ceil(aims.duration * np.sqrt(self.recursion.highest()) / 4))
        self.wanted = min(max(30, self.valid // 2), most)

    def grow(self) -> Grown:
        recursion, valid = self.recursion, max(self.valid, 1)
        recursion.extend(self.wanted, lambda done: self.progress("reduction", min(0.99, done / valid)))
        omega, shapes, beyond = nodes(recursion, _CEILING * self.aims.band)
        self.wanted = min(self.most, recursion.steps + max(10, recursion.steps // 8))
        return self.see(omega, shapes, beyond=beyond), recursion.complete, recursion.steps >= self.most, None

    def shortfall(self, error: float) -> str:
        return (
            f"{self.recursion.steps} Lanczos steps leave an estimated error of {error:.1e} (tolerance "
            f"{self.aims.tolerance:.1e}); about {self.valid} would do: shorten the duration, raise max_vectors "
            "(seat.greens.max_vectors in a scene), or use method='krylov', whose cost does not grow with the duration"
        )


def nodes(recursion: Recursion, ceiling: float) -> tuple[Array, Array, Array]:
    """Return the Gauss nodes up to ``ceiling`` [rad/s] as omega (m,) and shapes (m, p), rigid-body motions first at
    exactly 0, and the static compliance (p, p) of the higher nodes [m/N]."""
    values, first = recursion.eigen(ceiling**2)
    noise = 1e-12 * recursion.highest()
    if values.size and values[0] < -noise:
        raise ModelError(f"K is indefinite, check its constraints: eigenvalue {values[0]:.2e} 1/s^2 relative to M")
    unknown = 0.0 if len(recursion.rigid) else 1e-14 * recursion.highest()
    values = np.where(values < unknown, 0.0, np.maximum(values, 0.0))
    shapes = first @ recursion.start
    soft = values > 0
    listed = shapes[soft] / np.sqrt(values[soft])[:, None]
    rest = np.zeros((shapes.shape[1],) * 2)
    if np.all(soft):
        total, weights = scipy.linalg.eigh(recursion.resolvent(0.0) - listed.T @ listed)
        rest = weights * np.where(total > 1e-9 * np.abs(total).max(), total, 0.0) @ weights.T
    omega = np.concatenate([np.zeros(len(recursion.rigid)), np.sqrt(values)])
    return omega, np.concatenate([recursion.rigid, shapes]), rest
