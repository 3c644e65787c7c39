"""What Krylov spaces of every kind have in common: they grow until the Green's function in them is right."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from impact.greens.base import GreensFunction
from impact.greens.pulse import error_times
from impact.progress import Progress
from seatfem.structures.method import Aims
from seatfem.structures.model import Array
from seatfem.structures.reduction.convergence import History
from seatfem.structures.reduction.modes import ConvergenceError

G = TypeVar("G", bound=GreensFunction)


class Space(ABC, Generic[G]):
    """A space of vectors, and the Green's function g in it, judged after the Hann pulse of the band.

    Attributes:
        aims: what g must reach.
        history: of the checks so far.
        t: (nt,) times at which g is looked at [s].
    """

    def __init__(self, aims: Aims) -> None:
        self.aims, self.history = aims, History(aims.tolerance)
        self.t = error_times(aims.duration, aims.width)

    @property
    @abstractmethod
    def complete(self) -> bool:
        """Whether nothing more can be found."""

    @property
    @abstractmethod
    def full(self) -> bool:
        """Whether no further vector is allowed."""

    @abstractmethod
    def grow(self) -> Array:
        """Add vectors; (p, p, nt) g after the pulse with all of them [m/(N s)]."""

    @abstractmethod
    def cut(self, allowed: float) -> tuple[G, float]:
        """(g without what is too high to be a mode of the body, its error), best below ``allowed``."""

    @abstractmethod
    def shortfall(self, error: float) -> str:
        """What is to be said where the space is full and leaves ``error``."""

    def converge(self, progress: Progress) -> tuple[G, float]:
        """(g, its estimated error): what `History` says of the vectors still to come, plus what the cut leaves out.

        Raises:
            ConvergenceError: the space is full before the tolerance is reached.
        """
        tolerance = self.aims.tolerance
        while True:
            response = self.grow()
            error = 0.0 if self.complete else self.history.add(response)
            if error <= tolerance / 2:
                greens, cut = self.cut(tolerance / 2)
                error += cut
                if error <= tolerance or self.complete:
                    progress("reduction", 1.0)
                    return greens, error
            progress("reduction", self.history.fraction(error))
            if self.full:
                raise ConvergenceError(self.shortfall(error))
