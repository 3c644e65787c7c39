"""Where a model is factorized and its vectors are kept: in this process, or on the ranks of PETSc."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from impact.progress import Progress
from seatfem.structures.method import Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import Backend, Factorization, factorize
from seatfem.structures.reduction.krylov_basis import KrylovBasis
from seatfem.structures.reduction.rigid import rigid_shapes
from seatfem.structures.reduction.spectrum import Spectrum

if TYPE_CHECKING:
    from seatfem.structures.reduction.slepc import Ranks, RanksSpectrum


@dataclass(frozen=True)
class Here:
    """This process; `slepc.Ranks` answers the same."""

    model: SecondOrderModel
    backend: Backend

    def factorize(self, square: float) -> Factorization:
        """Return the factorization of K + ``square`` M, positive definite."""
        return factorize(self.model.K + square * self.model.M, backend=self.backend, name="K + s^2 M")

    def basis(self, shift: float, limit: int) -> KrylovBasis:
        """Return a basis that is empty but for the rigid motions, about -``shift``^2."""
        return KrylovBasis(self.model, self.factorize(shift**2), shift, limit, rigid_shapes(self.model))

    def spectrum(self, progress: Progress) -> Spectrum | RanksSpectrum:
        """Return a spectrum of which nothing is known yet."""
        return Spectrum(self.model, backend=self.backend, progress=progress)


@contextmanager
def backend_of(model: SecondOrderModel, aims: Aims) -> Iterator[Here | Ranks]:
    """Yield what the aims ask for, while it is needed."""
    if not aims.distributed:
        yield Here(model, aims.backend)
        return
    from seatfem.structures.reduction.slepc import on_ranks  # of such reductions only

    with on_ranks(model) as ranks:
        yield ranks
