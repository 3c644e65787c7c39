"""What is known of a spectrum before it is computed: rigid motions, round-off, where to shift, counts by inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg

from seatfem.structures.model import Array, DofMap, SecondOrderModel
from seatfem.structures.reduction.factorization import Backend, Factorization, FactorizationError, factorize
from seatfem.units import write_quantity

_NULL = 1e-11  # of default_shift^2: round-off leaves 1e-14, and what is softer than this is no spring


def rigid_shapes(model: SecondOrderModel) -> Array:
    """Return (n, r) M-orthonormal shapes R with K R = 0 among translations and rotations; (n, 0) if unknown.

    The rigid part of g is B'R R'B t, exactly: R (R'MR)^-1 R' does not depend on the basis of the null space.
    """
    candidates = np.zeros((model.size, 0)) if model.dofs is None else _candidates(model.dofs)
    if candidates.shape[1] == 0 or len(candidates) != model.size:
        return np.zeros((model.size, 0))
    inertia = np.einsum("ij,ij->j", candidates, model.M @ candidates)
    candidates = candidates[:, inertia > 0] / np.sqrt(inertia[inertia > 0])  # turns of a body of any size count
    mass = candidates.T @ (model.M @ candidates)
    _, directions = scipy.linalg.eigh(mass)
    independent = np.diag(directions.T @ mass @ directions) > 1e-12 * np.trace(mass)
    candidates = candidates @ directions[:, independent]
    stiffness, mass = (candidates.T @ (a @ candidates) for a in (model.K, model.M))
    values, vectors = scipy.linalg.eigh(stiffness, mass)
    return np.asarray(candidates @ vectors[:, values < _NULL * default_shift(model) ** 2])


def default_shift(model: SecondOrderModel) -> float:
    """Return about the lowest elastic frequency, c/L, from the local c/h and the number of nodes [rad/s]."""
    local = float(np.median(model.K.diagonal() / model.M.diagonal()))
    return float(np.sqrt(0.1 * local) * model.size ** (-1 / 3))


def _candidates(dofs: DofMap) -> Array:
    """Return (n_free, m) translations and, lengths made relative, rotations of the nodes, in the unknowns."""
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
    known = dofs.free.max(initial=-1) < len(full)  # else other unknowns than one displacement for each coordinate
    return np.asarray(full[dofs.free]) if known else np.zeros((len(dofs.free), 0))


_ZERO: Final = 10.0  # of eps max(K_ii/M_ii); free discs, h/a = 0.1 to 0.01, leave up to 0.02 in their rigid modes


def null_limit(model: SecondOrderModel) -> float:
    """Return w^2 [1/s^2] below which an eigenvalue is zero but for round-off, eps max(K_ii/M_ii) times 10.

    A thin body, its thickness h far below its radius a, has bending modes with w^2 of the order (h/a)^4 of the
    largest K_ii/M_ii: the limit must follow round-off, not the size of the elements.
    """
    return float(_ZERO * np.finfo(float).eps * np.max(model.K.diagonal() / model.M.diagonal()))


_MOVES: Final = (0.0, 1e-4, -1e-3, 7e-3, -2e-2)  # of a shift that cannot be factorized, relative
_COUNTED: Final = 1e-3  # residual of a first solve: of thin bodies 1e-6, which Lanczos and the count bear
_DENSITY: Final = 0.7  # modes below w: this times the sum of (w^2 M_ii/K_ii)^(3/2), second-order elements
_FEWEST: Final = 0.5  # in the place of no mode at all, for logarithms


class ConvergenceError(ArithmeticError):
    """An iteration that did not reach its tolerance; the message gives the measured error and a remedy."""


class CountError(ConvergenceError):
    """No factorization counts eigenvalues, or its count contradicts what is found."""


class CrowdedError(ConvergenceError):
    """More eigenvalues than may be looked for: ``count``."""

    def __init__(self, text: str, count: int) -> None:
        super().__init__(text)
        self.count = count


@dataclass(frozen=True)
class Shift:
    """K - value M, factorized, with ``count`` eigenvalues below ``value`` [1/s^2]."""

    value: float
    count: int
    factor: Factorization


@dataclass(frozen=True)
class Counted:
    """So many eigenvalues below ``value`` [1/s^2]."""

    value: float
    count: int


def counting_shift(model: SecondOrderModel, value: float, backend: Backend) -> Shift:
    """Return the shift ``value``, or one close to it where that is an eigenvalue.

    Raises:
        CountError: none of several can be factorized with a count of its pivots.
    """
    problem: object = "its pivots cannot be counted"
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
            continue
        if factor.negative_pivots is not None:
            return Shift(moved, factor.negative_pivots, factor)
    raise CountError(
        f"no factorization near {write_quantity(np.sqrt(abs(value)) / (2 * np.pi), 'frequency', 4)} counts "
        f"eigenvalues: {problem}"
    )


def expected(model: SecondOrderModel, count: float) -> float:
    """Return w^2 [1/s^2] below which about ``count`` modes of a compact body lie: Weyl's law, summed node by node.

    The cube of an element's size over the wave speed is of the order of (M_ii/K_ii)^(3/2); in a section its square. A
    consistent mass is scaled to have all of the body's on its diagonal.
    """
    dim = 3 if model.dofs is None else len(model.dofs.points)
    mass = model.M.diagonal()
    spread = float(np.clip(model.M.sum() / mass.sum(), 1.0, 4.0))
    sizes = spread * mass / np.maximum(model.K.diagonal(), 1e-300)
    total = float(np.sum(np.minimum(sizes, 1e3 * np.median(sizes)) ** (dim / 2)))
    return float((max(count, _FEWEST) / (_DENSITY * total)) ** (2 / dim))


def between(counts: Sequence[Counted], target: float) -> float:
    """Return where the count is about ``target``: between the nearest counts on both sides, or beyond them all.

    Counts grow with a power of w: beyond them all with that of a solid body, 3, or what the nearest two say, down to
    that of a bar in bending, 1/2.
    """
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
    """Return the power by which w^2 grows with the count, of the first two."""
    if len(counts) < 2 or counts[0].count == counts[1].count:
        return usual
    first, second = counts[:2]
    grown = np.log(first.value / second.value) / np.log(_count_of(first) / _count_of(second))
    return float(np.clip(grown, 2 / 3, 4.0))


def _count_of(counted: Counted) -> float:
    return max(counted.count, _FEWEST)
