"""What Krylov spaces of every kind have in common: they grow until the Green's function in them is right."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from impact.greens.base import GreensFunction
from impact.greens.pulse import error_times
from impact.progress import Progress
from seatfem.structures.damping import Damping
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.convergence import History
from seatfem.structures.reduction.modes import ConvergenceError

G = TypeVar("G", bound=GreensFunction)


class Grown(NamedTuple):
    """A space after a step of growth.

    Attributes:
        response: (p, p, nt) g after the pulse, with all that is in the space [m/(N s)].
        complete: whether nothing more can be found.
        full: whether no further vector is allowed.
        size: vectors in it, where their number says how far it has come; see `History.add`.
    """

    response: Array
    complete: bool
    full: bool
    size: int | None = None


class Space(ABC, Generic[G]):
    """A space of vectors, and the Green's function g in it, judged after the Hann pulse of the band.

    Attributes:
        model, damping: what is reduced.
        aims: what g must reach.
        history: of the checks so far.
        t: (nt,) times at which g is looked at [s].
        omega: (k,) of the undamped pairs in the space [rad/s], once it has grown.
        step: ratio of the cutoffs that are tried.
    """

    step: ClassVar[float] = 1.25
    omega: Array

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> None:
        self.model, self.damping, self.aims = model, damping, aims
        self.history = History(aims.tolerance)
        self.t = error_times(aims.duration, aims.width)

    @abstractmethod
    def grow(self) -> Grown:
        """Add vectors, and look at g with all of them."""

    @abstractmethod
    def truncated(self, above: float) -> tuple[G, float]:
        """Return (g with the pairs up to ``above`` [rad/s] and a residual for the others, its error relative to the
        whole)."""

    @abstractmethod
    def shortfall(self, error: float) -> str:
        """Return what is to be said where the space is full and leaves ``error``."""

    def converge(self, progress: Progress) -> tuple[G, float]:
        """Return (g, its estimated error): what `History` says of the vectors still to come, plus what the cut leaves
        out.

        Raises:
            ConvergenceError: the space is full before the tolerance is reached.
        """
        tolerance = self.aims.tolerance
        while True:
            response, complete, full, size = self.grow()
            error = 0.0 if complete else self.history.add(response, size)
            if error <= tolerance / 2:
                greens, cut = self._cut(tolerance / 2)
                if complete and cut > tolerance / 2:
                    greens, cut = self.truncated(np.inf)  # there are no more: all of them are exact
                error += cut
                if error <= tolerance or complete:
                    progress("reduction", 1.0)
                    return greens, error
            progress("reduction", self.history.fraction(error))
            if full:
                raise ConvergenceError(self.shortfall(error))

    def _cut(self, allowed: float) -> tuple[G, float]:
        """Return `truncated` at the lowest cutoff that costs less than ``allowed``, else at the one that costs
        least."""
        above = 2 * self.aims.band
        best, lowest = self.truncated(above)
        while lowest > allowed and np.any(self.omega > above * self.step):
            above *= self.step
            greens, error = self.truncated(above)
            if error < lowest:
                best, lowest = greens, error
        return best, lowest
