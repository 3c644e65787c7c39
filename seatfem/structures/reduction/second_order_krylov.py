"""The road for damping that couples the modes: dashpots, absorbing boundaries, Rayleigh damping that differs by region.

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

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.greens.poles import PoleGreens
from impact.greens.pulse import error_times
from impact.progress import Progress, silent
from seatfem.structures.model import ModelError, SecondOrderModel, as_csr
from seatfem.structures.reduction.checks import passivity
from seatfem.structures.reduction.convergence import History
from seatfem.structures.reduction.damping import Damping
from seatfem.structures.reduction.factorization import Backend, factorize
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.quadratic_pencil import coupled, cut, poles
from seatfem.structures.reduction.rigid import rigid_shapes
from seatfem.structures.reduction.toar import SecondOrderBasis

_BLOCK = 10  # fewest vectors between two checks


def second_order_greens(
    model: SecondOrderModel,
    damping: Damping,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    backend: Backend = "auto",
    max_vectors: int = 500,
    progress: Progress = silent,
) -> PoleGreens:
    """Grow Q until the estimated error of g after the Hann pulse of ``bandwidth`` over ``duration`` is in tolerance.

    The shift is s0 = 2 pi bandwidth. What the undamped pairs of the small model above a cutoff leave is a passive
    exponential, as on the other roads: a congruence, not a choice among the poles, so nothing gains energy.

    Args:
        damping: modal damping beside the model's C: uniform ratio, and the loss matrix by modal strain energy; its
            alpha and beta are not used.

    Raises:
        ModelError: C feeds energy.
        ConvergenceError: the error after ``max_vectors`` vectors is too large.
    """
    C = as_csr((model.size, model.size)) if model.C is None else model.C
    if C.diagonal().min(initial=0.0) < 0:
        raise ModelError(f"C has a diagonal value {C.diagonal().min():g}: it would feed energy")
    shift, width = 2 * np.pi * bandwidth, 1 / bandwidth
    progress("factorization", 0.0)
    factor = factorize(model.K + shift * C + shift**2 * model.M, backend=backend, name="K + s C + s^2 M")
    progress("factorization", 1.0)
    progress("reduction", 0.0)
    basis = SecondOrderBasis(model, C, factor, shift, min(max_vectors, model.size), rigid_shapes(model))
    history, t = History(tolerance), error_times(duration, width)
    while True:
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        loss = None if damping.loss is None else basis.Q.T @ (damping.loss @ basis.Q)
        whole = coupled(basis.damping(), basis.stiffness(), basis.ports(), basis.rigid, shift, damping, loss)
        response = poles(whole, model.port_names).filtered_matrix(t, width)
        error = 0.0 if basis.complete else history.add(response)
        if error <= tolerance / 2:
            greens, lost = cut(whole, response, t, width, tolerance / 2, model, damping)
            error += lost
            if error <= tolerance or basis.complete:
                break
        progress("reduction", history.fraction(error))
        if basis.size == basis.limit:
            raise ConvergenceError(
                f"{basis.size} second-order Krylov vectors leave an estimated error of {error:.1e} (tolerance "
                f"{tolerance:.1e}): lower the bandwidth or the duration, raise max_vectors (seat.greens.max_vectors in "
                "a scene), or use method='transient'"
            )
    origin = {
        "vectors": basis.size,
        "shift_rad_per_s": shift,
        "factorization": factor.backend,
        "checks": {"reciprocity": basis.reciprocity, **passivity(greens)},
    }
    progress("reduction", 1.0)
    return greens.with_error(ErrorEstimate(reduction=error), origin)
