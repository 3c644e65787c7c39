from __future__ import annotations

import numpy as np

from impact.greens import ErrorEstimate
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.pulse import error_times
from seatfem.model import Array, SecondOrderModel
from seatfem.roads.checks import passivity
from seatfem.roads.convergence import History
from seatfem.roads.damping import Damping
from seatfem.roads.factorization import Backend, factorize
from seatfem.roads.krylov_basis import KrylovBasis
from seatfem.roads.modes import ConvergenceError, Modes, eigen_residuals
from seatfem.roads.rigid import rigid_shapes
from seatfem.roads.ritz import RitzPairs

_BLOCK = 10  # fewest vectors between two checks
_CRAWLS = 60  # vectors for each port, damped bodies take 30 to 50: beyond, a higher shift takes half as many
_HIGHER = 2.5  # that shift, over the band's; what a tight tolerance lacks lies at two to four times the band


def krylov_greens(
    model: SecondOrderModel,
    damping: Damping,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    backend: Backend = "auto",
    max_vectors: int = 800,
    progress: Progress = silent,
) -> tuple[ModalGreens, Modes]:
    """Grow V until the estimated error of g after the Hann pulse of ``bandwidth`` over ``duration`` is in tolerance.

    The estimate is what the last checks say of the vectors still to come, see `History`, plus what the pairs above
    the cutoff do that the residual does not; both measured on g after the pulse.

    Returns the Green's function and those Ritz pairs in the band that are converged modes of the body (the ones the
    ports excite), for pictures.

    Raises:
        ConvergenceError: the error after ``max_vectors`` vectors, or the loss of orthogonality, is too large.
    """
    band, width = 2 * np.pi * bandwidth, 1 / bandwidth
    basis, history = _start(model, band, max_vectors, backend, progress), History(tolerance)
    while True:
        if basis.shift == band and basis.size >= _CRAWLS * len(model.ports) and not basis.complete:
            basis, history = _start(model, _HIGHER * band, max_vectors, backend, progress), History(tolerance)
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        omega, shapes, coefficients = basis.ritz()
        loss = None if damping.loss is None else damping.losses(basis.V @ coefficients)
        ritz = RitzPairs(model, damping, omega, shapes, error_times(duration, width), width, loss=loss)
        error = 0.0 if basis.complete else history.add(ritz.response, basis.size)
        if error <= tolerance / 2:
            greens, cut = ritz.cut(2 * np.pi * bandwidth, tolerance / 2)
            error += cut
            if error <= tolerance or basis.complete:
                break
        progress("reduction", history.fraction(error))
        if basis.size == basis.limit:
            raise ConvergenceError(
                f"{basis.size} Krylov vectors leave an estimated error of {error:.1e}, which must be below half the "
                f"tolerance, {tolerance / 2:.1e}: lower the bandwidth or the duration, or raise max_vectors "
                "(seat.greens.max_vectors in a scene)"
            )
    if (lost := basis.orthogonality_error()) > 1e-8:
        raise ConvergenceError(f"the Krylov basis lost orthogonality: |V'MV - I| = {lost:.1e} (limit 1e-8)")
    origin = {
        "vectors": basis.size,
        "rigid_modes": basis.rigid,
        "shift_rad_per_s": basis.shift,
        "factorization": basis.factor.backend,
        "checks": {"reciprocity": basis.reciprocity, **passivity(greens)},
    }
    progress("reduction", 1.0)
    return greens.with_error(ErrorEstimate(reduction=error), origin), _converged(basis, omega, coefficients, band)


def _start(model: SecondOrderModel, shift: float, most: int, backend: Backend, progress: Progress) -> KrylovBasis:
    progress("factorization", 0.0)
    factor = factorize(model.K + shift**2 * model.M, backend=backend, name="K + s^2 M")
    progress("factorization", 1.0)
    progress("reduction", 0.0)
    return KrylovBasis(model, factor, shift, min(most, model.size), rigid_shapes(model))


def _converged(basis: KrylovBasis, omega: Array, coefficients: Array, band: float) -> Modes:
    """The Ritz pairs up to the band edge (40 at most) whose eigenvalue residual is below 1e-3."""
    chosen = np.flatnonzero(omega <= band)[:40]
    shapes = basis.V @ coefficients[:, chosen]
    residuals = eigen_residuals(basis.model, omega[chosen] ** 2, shapes, band)
    good = residuals < 1e-3
    frequencies = omega[chosen][good] / (2 * np.pi)
    return Modes(frequencies, shapes[:, good], residuals[good], False, f"krylov, {basis.factor.backend}")
