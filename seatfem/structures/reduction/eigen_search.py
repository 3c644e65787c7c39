"""Where to shift: factorizations of K - sigma M whose inertia counts, and the search for one that counts enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import Backend, Factorization, FactorizationError, factorize
from seatfem.units import write_quantity

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
    """Return where the count is about ``target``: between the nearest counts known on both sides of it, or beyond them
    all.

    Counts grow with a power of w: beyond them all with that of a solid body, 3, or what the nearest two say, down to
    that of a bar in bending, 1/2.
    """
    low = sorted((one for one in counts if one.count < target), key=lambda one: -one.value)
    high = sorted((one for one in counts if one.count >= target), key=lambda one: one.value)
    if low and high:
        part = np.log(target / _some(low[0])) / max(np.log(_some(high[0]) / _some(low[0])), 1e-3)
        return float(low[0].value * (high[0].value / low[0].value) ** np.clip(part, 0.1, 0.9))
    nearest = (low or high)[0]
    power = _power(low, 2 / 3) if low else _power(high, 1.0)
    limits = (1.1, 100.0) if low else (1e-4, 0.7)
    return float(nearest.value * np.clip((target / _some(nearest)) ** power, *limits))


def _power(counts: Sequence[Counted], usual: float) -> float:
    """Return the power by which w^2 grows with the count, of the first two."""
    if len(counts) < 2 or counts[0].count == counts[1].count:
        return usual
    first, second = counts[:2]
    grown = np.log(first.value / second.value) / np.log(_some(first) / _some(second))
    return float(np.clip(grown, 2 / 3, 4.0))


def _some(counted: Counted) -> float:
    return max(counted.count, _FEWEST)
