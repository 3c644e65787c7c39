"""Eigenpairs near a shift: factorizations that count eigenvalues by inertia, and block shift-invert Lanczos.

OP = (K - sigma M)^-1 M is self-adjoint in the M-inner product, with eigenvalues theta = 1/(lambda - sigma). Its block
Krylov space grows from random vectors, many right-hand sides at a time.
Source: R. Grimes, J. Lewis and H. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg

from impact.notices import SeatfemError
from seatfem.structures.model import Array, DofMap, SecondOrderModel
from seatfem.structures.reduction.factorization import Backend, Factorization, FactorizationError, factorize
from seatfem.units import write_quantity

_NULL = 1e-11  # eigenvalue over default_shift^2 below which a motion is rigid; round-off is 1e-14


def rigid_shapes(model: SecondOrderModel) -> Array:
    """Return (n, r) M-orthonormal shapes R with K R = 0 among translations and rotations; (n, 0) if unknown.

    The rigid part of g is B'R R'B t, exactly: R (R'MR)^-1 R' does not depend on the basis of the null space.
    """
    candidates = np.zeros((model.size, 0)) if model.dofs is None else _candidates(model.dofs)
    if candidates.shape[1] == 0 or len(candidates) != model.size:
        return np.zeros((model.size, 0))
    inertia = np.einsum("ij,ij->j", candidates, model.M @ candidates)
    candidates = candidates[:, inertia > 0] / np.sqrt(inertia[inertia > 0])  # normalised for bodies of any size
    mass = candidates.T @ (model.M @ candidates)
    _, directions = scipy.linalg.eigh(mass)
    independent = np.diag(directions.T @ mass @ directions) > 1e-12 * np.trace(mass)
    candidates = candidates @ directions[:, independent]
    stiffness, mass = (candidates.T @ (a @ candidates) for a in (model.K, model.M))
    values, vectors = scipy.linalg.eigh(stiffness, mass)
    return np.asarray(candidates @ vectors[:, values < _NULL * default_shift(model) ** 2])


def default_shift(model: SecondOrderModel) -> float:
    """Return an estimate of the lowest elastic frequency, c/L, from the local c/h and the number of nodes [rad/s]."""
    local = float(np.median(model.K.diagonal() / model.M.diagonal()))
    return float(np.sqrt(0.1 * local) * model.size ** (-1 / 3))


def _candidates(dofs: DofMap) -> Array:
    """Return (n_free, m) translations and rotations (with normalised coordinates) of the nodes, in the unknowns."""
    if dofs.rigid is not None:
        return dofs.rigid
    dim, count = dofs.points.shape
    x = dofs.points - dofs.points.mean(axis=1, keepdims=True)
    x = x / max(float(np.abs(x).max()), 1e-300)
    motions = [np.repeat(axis[:, None], count, axis=1) for axis in np.eye(dim)]
    for i in range(dim):
        for j in range(i):
            turn = np.zeros_like(x)
            turn[i], turn[j] = -x[j], x[i]
            motions.append(turn)
    full = np.stack([motion.T.ravel() for motion in motions], axis=1)
    if dofs.turned is not None:
        return np.asarray(dofs.turned.T @ full)
    known = dofs.free.max(initial=-1) < len(full)  # otherwise the unknowns are no nodal displacements
    return np.asarray(full[dofs.free]) if known else np.zeros((len(dofs.free), 0))


_ZERO: Final = (
    10.0  # limit of zero eigenvalues over eps max(K_ii/M_ii); free discs of h/a = 0.1 to 0.01 have up to 0.02
)


def null_limit(model: SecondOrderModel) -> float:
    """Return w^2 [1/s^2] below which an eigenvalue is zero to round-off, eps max(K_ii/M_ii) times 10.

    A thin body of thickness h and radius a has bending modes with w^2 of the order of (h/a)^4 max(K_ii/M_ii): the limit
    must be near round-off, and cannot be relative to the size of the elements.
    """
    return float(_ZERO * np.finfo(float).eps * np.max(model.K.diagonal() / model.M.diagonal()))


_MOVES: Final = (0.0, 1e-4, -1e-3, 7e-3, -2e-2)  # relative changes of a shift that cannot be factorized
_COUNTED: Final = 1e-3  # largest residual of a first solve; thin bodies have 1e-6, which does no harm
_DENSITY: Final = 0.7  # number of modes below w over the sum of (w^2 M_ii/K_ii)^(3/2), for second-order elements
_FEWEST: Final = 0.5  # replaces a count of zero in logarithms


class ConvergenceError(SeatfemError, ArithmeticError):
    """An iteration that did not reach its tolerance; the message gives the measured error and a remedy."""


class CountError(ConvergenceError):
    """No factorization counts eigenvalues, or its count contradicts the eigenvalues found."""


class CrowdedError(ConvergenceError):
    """More eigenvalues (``count``) than are allowed."""

    def __init__(self, text: str, count: int) -> None:
        super().__init__(text)
        self.count = count


@dataclass(frozen=True)
class Counted:
    """The ``count`` of eigenvalues below ``value`` [1/s^2]."""

    value: float
    count: int


@dataclass(frozen=True)
class Shift(Counted):
    """K - value M, factorized, with ``count`` eigenvalues below ``value`` [1/s^2]."""

    factor: Factorization


def counting_shift(model: SecondOrderModel, value: float, backend: Backend) -> Shift:
    """Return the factorized shift ``value``, or one close to it if that is an eigenvalue.

    Raises:
        CountError: no shift near it can be factorized with a count of negative pivots.
    """
    for move in _MOVES:
        moved = value * (1 + move)
        try:
            factor = factorize(
                model.K - moved * model.M,
                definite=False,
                backend=backend,
                tolerance=_COUNTED,
                name="K - w^2 M",
            )
        except FactorizationError as error:
            if "memory" in str(error):
                raise
            problem = error
        else:
            return Shift(moved, factor.negative_pivots, factor)
    raise CountError(
        f"no factorization near {write_quantity(np.sqrt(abs(value)) / (2 * np.pi), 'frequency', 4)} counts "
        f"eigenvalues ({problem}): too badly scaled matrices, check their units"
    )


def expected(model: SecondOrderModel, count: float) -> float:
    """Return w^2 [1/s^2] below which about ``count`` modes of a compact body lie: Weyl's law, summed node by node.

    (M_ii/K_ii)^(3/2) is of the order of the cube of an element's size over the wave speed; in a section its square is
    used. A consistent mass is scaled such that its diagonal sums to the body's mass.
    """
    dim = 3 if model.dofs is None else len(model.dofs.points)
    mass = model.M.diagonal()
    spread = float(np.clip(model.M.sum() / mass.sum(), 1.0, 4.0))
    sizes = spread * mass / np.maximum(model.K.diagonal(), 1e-300)
    total = float(np.sum(np.minimum(sizes, 1e3 * np.median(sizes)) ** (dim / 2)))
    return float((max(count, _FEWEST) / (_DENSITY * total)) ** (2 / dim))


def between(counts: Sequence[Counted], target: float) -> float:
    """Return the value at which the count is about ``target``, by interpolation between the nearest counts, or by
    extrapolation with a power of w: 3 as for a solid, or by the nearest two counts, at least 1/2 as for bending of
    a bar."""
    low = sorted((one for one in counts if one.count < target), key=lambda one: -one.value)
    high = sorted((one for one in counts if one.count >= target), key=lambda one: one.value)
    if low and high:
        part = np.log(target / _count_of(low[0])) / max(np.log(_count_of(high[0]) / _count_of(low[0])), 1e-3)
        return float(low[0].value * (high[0].value / low[0].value) ** np.clip(part, 0.1, 0.9))
    nearest = (low or high)[0]
    power = _power(low, 2 / 3) if low else _power(high, 1.0)
    limits = (1.1, 100.0) if low else (1e-4, 0.7)
    return float(nearest.value * np.clip((target / _count_of(nearest)) ** power, *limits))


def _power(counts: Sequence[Counted], usual: float) -> float:
    """Return the power with which w^2 grows with the count, by the first two; ``usual`` if they are not enough."""
    if len(counts) < 2 or counts[0].count == counts[1].count:
        return usual
    first, second = counts[:2]
    grown = np.log(first.value / second.value) / np.log(_count_of(first) / _count_of(second))
    return float(np.clip(grown, 2 / 3, 4.0))


def _count_of(counted: Counted) -> float:
    return max(counted.count, _FEWEST)


_DEPENDENT: Final = 1e-24  # squared length after over before orthogonalisation, below which a vector is dependent
_ILL: Final = 1e-4  # eigenvalue of a block's Gram matrix below which it is orthonormalised again


@dataclass(frozen=True)
class RitzValues:
    """Approximate eigenpairs, nearest to the shift first.

    Attributes:
        values: (m,) eigenvalues lambda [1/s^2].
        theta: (m,) 1/(lambda - sigma).
        errors: (m,) ||OP y - theta y|| / |theta| in the M-norm.
        coefficients: (m, m) coefficients of their vectors in the basis.
    """

    values: Array
    theta: Array
    errors: Array
    coefficients: Array


class BlockLanczos:
    """V with V'MV = I and OP V = V T + Q E, grown block by block in the complement of known eigenvectors.

    Args:
        factor: factorization of K - sigma M, definite or not.
        known: (n, k) M-orthonormal eigenvectors to be excluded; (n, 0) without.
        block: number of right-hand sides that are solved at once.
        room: number of vectors for which there is room at first.
    """

    def __init__(
        self,
        model: SecondOrderModel,
        factor: Factorization,
        sigma: float,
        known: Array,
        *,
        block: int,
        room: int,
    ) -> None:
        n = model.size
        self.model, self.factor, self.sigma, self.known = model, factor, sigma, known
        self.block = min(block, n - known.shape[1])
        self.size = 0  # vectors whose image by OP is computed
        self.solves = 0  # right-hand sides solved so far
        self._rng = np.random.default_rng(0)
        self._vectors = np.empty((n, room), order="F")
        self._projected = np.zeros((room, room))
        self._coupled = 0  # the first vector that the newest block is coupled to
        self._mass_block = np.empty((n, 0))  # M Q of the newest block Q
        self._link = np.zeros((0, 0))
        self.renew()

    @property
    def width(self) -> int:
        """Return the number of columns of the newest block, whose image is not computed yet."""
        return int(self._mass_block.shape[1])

    @property
    def unseen(self) -> int:
        """Return the number of dimensions outside known vectors, basis and newest block."""
        return self.model.size - int(self.known.shape[1]) - self.size - self.width

    @property
    def exhausted(self) -> bool:
        """Return whether the basis spans the whole space, with all images computed."""
        return self.width == 0 and self.unseen == 0

    def expand(self) -> None:
        """Solve for the newest block and append the next."""
        first, last = self.size, self.size + self.width
        image = self.factor.solve(self._mass_block)
        self.solves += last - first
        momentum = self.model.M @ image
        before = np.sum(image * momentum, axis=0)
        overlap = np.zeros((last, last - first))
        for start in (self._coupled, 0):  # by the recurrence, then against all vectors for round-off
            V = self._vectors[:, start:last]
            part = V.T @ momentum
            image -= V @ part
            momentum = self.model.M @ image
            overlap[start:] += part
        if self.known.shape[1]:
            image -= self.known @ (self.known.T @ momentum)
            momentum = self.model.M @ image
        own = overlap[first:]
        self._projected[:last, first:last] = overlap
        self._projected[first:last, :last] = overlap.T
        self._projected[first:last, first:last] = (own + own.T) / 2
        self._coupled, self.size = first, last
        following, mass, self._link = _orthonormal(self.model, image, momentum, _DEPENDENT * before)
        self._append(following)
        self._mass_block = mass
        if self.width == 0 and self.unseen > 0:  # the space is invariant: continue outside it
            self.renew()

    def renew(self) -> None:
        """Widen the newest block by random directions, for eigenvalues repeated more often than the block is wide."""
        new, mass = self._fresh()
        self._append(new, self.width)
        self._mass_block = np.concatenate([self._mass_block, mass], axis=1)
        self._link = np.concatenate([self._link, np.zeros((new.shape[1], self._link.shape[1]))])

    def _append(self, new: Array, width: int = 0) -> None:
        """Store vectors after the basis and the first ``width`` of the newest block."""
        end = self.size + width + new.shape[1]
        if (more := end - self._vectors.shape[1]) > 0:
            more += self._vectors.shape[1] // 2
            room = np.empty((len(self._vectors), more), order="F")
            self._vectors = np.asfortranarray(np.concatenate([self._vectors, room], axis=1))
            self._projected = np.pad(self._projected, (0, more))
        self._vectors[:, self.size + width : end] = new

    def ritz(self) -> RitzValues:
        """Return the Ritz pairs of the space with their errors."""
        theta, coefficients = np.linalg.eigh(self._projected[: self.size, : self.size])
        order = np.argsort(-np.abs(theta))
        theta, coefficients = theta[order], coefficients[:, order]
        safe = np.where(np.abs(theta) < 1e-300, 1e-300, theta)
        errors = np.linalg.norm(self._residual(coefficients), axis=0) / np.abs(safe)
        return RitzValues(self.sigma + 1 / safe, theta, errors, coefficients)

    def vectors(self, ritz: RitzValues, chosen: Array) -> Array:
        """Return the (n, len(chosen)) M-normalised OP y/theta of chosen Ritz vectors y, a step of inverse iteration."""
        coefficients = ritz.coefficients[:, chosen]
        residual = self._residual(coefficients) / ritz.theta[chosen]
        together = np.concatenate([coefficients, residual]) / np.sqrt(1 + np.sum(residual**2, axis=0))
        return np.asarray(self._vectors[:, : len(together)] @ together)

    def _residual(self, coefficients: Array) -> Array:
        """Return Q' M (OP y - theta y) of vectors y in the basis."""
        return np.asarray(self._link @ coefficients[self.size - self._link.shape[1] : self.size])

    def _fresh(self) -> tuple[Array, Array]:
        """Return random vectors, M-orthonormal to all vectors so far, and M times these."""
        count = min(self.block, self.unseen)
        new = self.factor.solve(self.model.M @ self._rng.standard_normal((self.model.size, count)))
        self.solves += count
        for _ in range(2):
            for basis in (self.known, self._vectors[:, : self.size + self.width]):
                new -= basis @ (basis.T @ (self.model.M @ new))
            new, mass, _ = _orthonormal(self.model, new, self.model.M @ new, np.zeros(new.shape[1]))
        return new, mass


def _orthonormal(model: SecondOrderModel, block: Array, mass: Array, least: Array) -> tuple[Array, Array, Array]:
    """Return (Q, M Q, R) with block = Q R and Q'MQ = I, without the directions shorter than the root of ``least``;
    ``mass``: M times the block.

    By eigenvectors of the scaled Gram matrix. Source: A. Stathopoulos and K. Wu, SIAM J. Sci. Comput. 23 (2002) 2165.
    """
    upper = np.eye(block.shape[1])
    for again in range(3):
        mass = model.M @ block if again else mass
        gram = block.T @ mass
        lengths = np.sqrt(np.maximum(np.diag(gram), 0.0))
        scale = np.where(lengths**2 > least, lengths, np.inf)
        squares, turns = np.linalg.eigh(gram / np.outer(scale, scale))
        kept = squares > 1e-14
        turns, roots = turns[:, kept], np.sqrt(squares[kept])
        change = turns / roots / scale[:, None]
        block, mass = block @ change, mass @ change
        upper = (roots[:, None] * turns.T * np.where(np.isfinite(scale), scale, 0.0)) @ upper
        least = np.zeros(block.shape[1])
        if squares[kept].min(initial=1.0) > _ILL:
            break
    return block, mass, upper
