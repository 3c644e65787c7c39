"""What every reduction answers for itself. A new one is a subclass of `Reducer` in a file of its own."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

from impact.brief import brief
from impact.greens.stated import StatedGreens
from impact.progress import Progress, silent
from seatfem.structures.damping import Damping
from seatfem.structures.method import Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modes import Modes

USUAL: Final = 100  # Krylov vectors that one port usually takes
_FACTOR, _FACTOR_ORDER = 2.5e-7, 1.47  # s, of unknowns, P2 tetrahedra by PARDISO on two cores
_VECTOR = 8e-7  # s for each unknown and Krylov vector: solve, two products and the orthogonalisation


@dataclass(frozen=True)
class Reduction:
    """A Green's function, and the modes of the body that were found on the way (krylov and modes; else ``None``)."""

    greens: StatedGreens
    modes: Modes | None = None

    __repr__ = brief


@dataclass(frozen=True)
class Cost:
    """Predicted effort of a reduction.

    Attributes:
        seconds: on one machine of reference; only ratios are used.
        effort: what takes them, in a few words.
    """

    seconds: float
    effort: str


class Reducer(ABC):
    """One way from a model to the Green's function of its ports.

    A concrete subclass with a ``name`` of its own is registered by being defined: ``method=name`` and a scene's
    ``seat.greens.method`` find it, and "auto" asks it too.

    Attributes:
        name: what asks for it.
        oscillators: whether its g is a sum of oscillators; others are convolved by step weights.
        any_time: whether its g holds beyond the duration it was computed for, as modes of the body do.
        factorizes: whether it takes the memory of a sparse factorization.
        diagonal_mass: whether it is meant for models of a diagonal mass, others being slow or refused.
        modal_damping: whether it takes damping by ratios, which have no sparse matrix.
        distributes: whether it can work on the ranks of PETSc.
    """

    name: ClassVar[str]
    oscillators: ClassVar[bool] = True
    any_time: ClassVar[bool] = False
    factorizes: ClassVar[bool] = True
    diagonal_mass: ClassVar[bool] = False
    modal_damping: ClassVar[bool] = True
    distributes: ClassVar[bool] = False

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used, with the remedy; "" where it can. Here: damping that modes cannot carry."""
        return damping.refusal

    @abstractmethod
    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the predicted effort on a model that it can reduce; infinite: only where nothing else works."""

    @abstractmethod
    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Return g of all ports with ``error_estimate.reduction``, and in ``origin`` what it took.

        ``damping`` is the model's with what is asked for beside it.

        Raises:
            ConvergenceError: the tolerance is not reached.
        """

    def advice(self, model: SecondOrderModel) -> str:
        """Return what would have been better, of one that was asked for by name; "" where nothing."""
        return ""


def defined(base: type[Reducer] = Reducer) -> Iterator[type[Reducer]]:
    """Yield every reduction that is imported by now: concrete subclasses with a name of their own, however deep."""
    for kind in base.__subclasses__():
        if not inspect.isabstract(kind) and "name" in vars(kind):
            yield kind
        yield from defined(kind)


def factorized(model: SecondOrderModel, vectors: int) -> float:
    """Return the predicted time of one factorization and so many vectors [s]."""
    return float(_FACTOR * model.size**_FACTOR_ORDER + vectors * _VECTOR * model.size)
