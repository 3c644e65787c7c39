"""Krylov vectors for damping that couples the modes: dashpots, absorbing boundaries, Rayleigh damping by region.

A second-order Krylov space at one real s0, with P = s0^2 M + s0 C + K (symmetric positive definite, factorized once),

    r_0 = P^-1 B,    r_j = -P^-1 ((2 s0 M + C) r_(j-1) + M r_(j-2))

is spanned by Q, Q'MQ = I, grown by the two-level orthogonal Arnoldi process: the pairs (r_j, r_(j-1)) are kept
orthonormal as Q times small coefficients, which is stable where the plain recursion breaks down after a dozen vectors.
The one-sided projections Q'MQ, Q'CQ, Q'KQ stay symmetric and positive, so the small model is passive; its quadratic
eigenvalue problem gives the poles and symmetric rank-one residues of `impact.greens.poles.PoleGreens`.

Source: Lu, Su and Bai, SIAM J. Matrix Anal. Appl. 37 (2016) 195 (TOAR); Bai and Su, SIAM J. Sci. Comput. 26 (2005) 1692
(projection of the second-order structure); Tisseur and Meerbergen, SIAM Review 43 (2001) 235.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.greens.poles import PoleGreens
from impact.progress import Progress, silent
from seatfem.structures.damping import Damping
from seatfem.structures.method import Aims
from seatfem.structures.model import SecondOrderModel, as_csr
from seatfem.structures.reduction.checks import feeding, passivity_of_poles
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.growth import Grown, Space
from seatfem.structures.reduction.quadratic_pencil import coupled, poles, truncated
from seatfem.structures.reduction.reducer import USUAL, Cost, Reducer, Reduction, factorized
from seatfem.structures.reduction.rigid import rigid_shapes
from seatfem.structures.reduction.toar import SecondOrderBasis

_BLOCK = 10  # fewest vectors between two checks


@dataclass(frozen=True)
class SecondOrderKrylov(Reducer):
    """Q grows until the estimated error of g after the Hann pulse of the band over the duration is in tolerance.

    The shift is s0 = 2 pi bandwidth. What the undamped pairs of the small model above a cutoff leave is a passive
    exponential, as of the other reductions: a congruence, not a choice among the poles, so nothing gains energy.
    Modal damping is taken beside the model's C: the uniform ratio, and the loss matrix by modal strain energy.

    Attributes:
        most: vectors, unless the aims say otherwise.
    """

    most: int = 500

    name = "second_order"
    oscillators = False

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Say why it cannot be used: any C will do that feeds no energy."""
        return feeding(model, damping)

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return twice the vectors of a Krylov space without C."""
        vectors = 2 * USUAL * len(model.ports)
        return Cost(factorized(model, vectors), f"one factorization with C and about {vectors} vectors")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`."""
        progress("factorization", 0.0)
        space = _Coupled(model, damping, aims, aims.max_vectors or self.most)
        progress("factorization", 1.0)
        progress("reduction", 0.0)
        greens, error = space.converge(progress)
        origin = {
            "vectors": space.basis.size,
            "shift_rad_per_s": aims.band,
            "factorization": space.basis.factor.backend,
            "checks": {"reciprocity": space.basis.reciprocity, **passivity_of_poles(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin))


class _Coupled(Space[PoleGreens]):
    """The basis so far, and the small model whose pairs damping couples."""

    step = 1.4

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims, most: int) -> None:
        super().__init__(model, replace(damping, alpha=0.0, beta=0.0), aims)  # both are in C
        s, C = aims.band, as_csr((model.size, model.size)) if model.C is None else model.C
        factor = factorize(model.K + s * C + s**2 * model.M, backend=aims.backend, name="K + s C + s^2 M")
        self.basis = SecondOrderBasis(model, C, factor, s, min(most, model.size), rigid_shapes(model))

    def grow(self) -> Grown:
        basis, loss = self.basis, self.damping.loss
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        lost = None if loss is None else basis.Q.T @ (loss @ basis.Q)
        self.whole = coupled(
            basis.damping(), basis.stiffness(), basis.ports(), basis.rigid, basis.shift, self.damping, lost
        )
        self.omega = self.whole.omega
        self.response = poles(self.whole, self.model.port_names).filtered_matrix(self.t, self.aims.width)
        return Grown(self.response, basis.complete, bool(basis.size == basis.limit))

    def truncated(self, above: float) -> tuple[PoleGreens, float]:
        greens = truncated(self.whole, above, self.model, self.damping)
        lost = np.abs(greens.filtered_matrix(self.t, self.aims.width) - self.response).max()
        return greens, float(lost / np.abs(self.response).max())

    def shortfall(self, error: float) -> str:
        return (
            f"{self.basis.size} second-order Krylov vectors leave an estimated error of {error:.1e} (tolerance "
            f"{self.aims.tolerance:.1e}): lower the bandwidth or the duration, raise max_vectors "
            "(seat.greens.max_vectors in a scene), or use method='transient'"
        )
