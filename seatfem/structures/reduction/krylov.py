"""A Krylov space of (K + s^2 M)^-1 M: one factorization, and far fewer vectors than modes in the band."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.progress import Progress, silent
from seatfem.structures.damping import Damping
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.growth import Grown, History, RitzSpace
from seatfem.structures.reduction.krylov_basis import Here, KrylovBasis, backend_of
from seatfem.structures.reduction.modes import ConvergenceError, Modes, eigen_residuals
from seatfem.structures.reduction.reducer import USUAL, Cost, Reducer, Reduction, factorized
from seatfem.structures.reduction.residual import passivity

if TYPE_CHECKING:
    from seatfem.structures.reduction.slepc import Ranks

_BLOCK = 10  # fewest vectors between two checks
_CRAWLS = 60  # vectors for each port, damped bodies take 30 to 50: beyond, a higher shift takes half as many
_HIGHER = 2.5  # that shift, over the band's; what a tight tolerance lacks lies at two to four times the band. Undamped
# bodies begin with it: up to 65 % fewer vectors over 2.5 to 12 periods of the band, at most 12 % more


@dataclass(frozen=True)
class Krylov(Reducer):
    """V grows until the estimated error of g after the Hann pulse of the band over the duration is in tolerance.

    The modes handed back are those Ritz pairs in the band that are converged modes of the body, the ones that the ports
    excite: for pictures.

    Attributes:
        most: vectors, unless the aims say otherwise.
    """

    most: int = 800

    name = "krylov"
    distributes = True

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the cost of far fewer vectors than there are modes in the band."""
        vectors = USUAL * len(model.ports)
        return Cost(factorized(model, vectors), f"one factorization and about {vectors} vectors")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`; raises `ConvergenceError` too where the basis loses its orthogonality."""
        with backend_of(model, aims) as backend:
            space = _Vectors(model, damping, aims, aims.max_vectors or self.most, backend, progress)
            greens, error = space.converge(progress)
            basis = space.basis
            if (lost := basis.orthogonality_error()) > 1e-8:
                raise ConvergenceError(
                    f"the Krylov basis lost orthogonality: |V'MV - I| = {lost:.1e} (limit 1e-8); use method='lanczos'"
                )
            modes = _converged(basis, space.omega, space.coefficients, aims.band)
        origin = {
            "vectors": basis.size,
            "rigid_modes": basis.rigid,
            "shift_rad_per_s": basis.shift,
            "factorization": basis.factor.backend,
            "checks": {"reciprocity": basis.reciprocity, **passivity(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin), modes)


class _Vectors(RitzSpace):
    """The basis so far, and its Ritz pairs."""

    def __init__(
        self,
        model: SecondOrderModel,
        damping: Damping,
        aims: Aims,
        most: int,
        backend: Here | Ranks,
        progress: Progress,
    ) -> None:
        super().__init__(model, damping, aims)
        self.most, self.backend, self.progress = most, backend, progress
        undamped = damping == Damping() and damping.loss is None
        self.basis = self._start((_HIGHER if undamped else 1.0) * aims.band)

    def grow(self) -> Grown:
        basis, band, loss = self.basis, self.aims.band, None
        if basis.shift == band and basis.size >= _CRAWLS * len(self.model.ports) and not basis.complete:
            basis = self._start(_HIGHER * band)
            self.basis, self.history = basis, History(self.aims.tolerance)
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        omega, shapes, self.coefficients = basis.ritz()
        if self.damping.loss is not None:
            loss = self.damping.losses(basis.combined(self.coefficients))
        return self.see(omega, shapes, loss=loss), basis.complete, basis.size == basis.limit, basis.size

    def shortfall(self, error: float) -> str:
        return (
            f"{self.basis.size} Krylov vectors leave an estimated error of {error:.1e}, which must be below half the "
            f"tolerance, {self.aims.tolerance / 2:.1e}: lower the bandwidth or the duration, or raise max_vectors "
            "(seat.greens.max_vectors in a scene)"
        )

    def _start(self, shift: float) -> KrylovBasis:
        self.progress("factorization", 0.0)
        basis = self.backend.basis(shift, min(self.most, self.model.size))
        self.progress("factorization", 1.0)
        self.progress("reduction", 0.0)
        return basis


def _converged(basis: KrylovBasis, omega: Array, coefficients: Array, band: float) -> Modes:
    """Return the Ritz pairs up to the band edge (40 at most) whose eigenvalue residual is below 1e-3."""
    chosen = np.flatnonzero(omega <= band)[:40]
    shapes = basis.combined(coefficients[:, chosen])
    residuals = eigen_residuals(basis.model, omega[chosen] ** 2, shapes, band)
    good = residuals < 1e-3
    frequencies = omega[chosen][good] / (2 * np.pi)
    return Modes(frequencies, shapes[:, good], residuals[good], False, f"krylov, {basis.factor.backend}")
