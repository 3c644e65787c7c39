from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from impact.greens import ErrorEstimate
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.pulse import combine, error_times, mode_responses
from seatfem.damping import Damping, truncate
from seatfem.factorization import Backend, factorize
from seatfem.krylov_basis import KrylovBasis
from seatfem.model import Array, SecondOrderModel
from seatfem.modes import ConvergenceError, Modes, eigen_residuals

_BLOCK = 10  # fewest vectors between two checks


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

    The estimate is what the last checks say of the vectors still to come, see `_History`, plus what the pairs above
    the cutoff do that the residual does not; both measured on g after the pulse.

    Returns the Green's function and those Ritz pairs in the band that are converged modes of the body (the ones the
    ports excite), for pictures.

    Raises:
        ConvergenceError: the error after ``max_vectors`` vectors, or the loss of orthogonality, is too large.
    """
    shift, width = 2 * np.pi * bandwidth, 1 / bandwidth
    progress("factorization", 0.0)
    factor = factorize(model.K + shift**2 * model.M, backend=backend)
    progress("factorization", 1.0)
    progress("reduction", 0.0)
    basis = KrylovBasis(model, factor, shift, min(max_vectors, model.size))
    history = _History(tolerance)
    while True:
        basis.grow(basis.size + max(_BLOCK, basis.size // 8))
        omega, shapes, coefficients = basis.ritz()
        ritz = _Pairs(model, damping, omega, shapes, error_times(duration, width), width)
        error = 0.0 if basis.complete else history.add(ritz.response)
        if error <= tolerance / 2:
            greens, cut = ritz.cut(2 * np.pi * bandwidth, tolerance / 2)
            error += cut
            if error <= tolerance or basis.complete:
                break
        progress("reduction", history.fraction(error))
        if basis.size == basis.limit:
            raise ConvergenceError(
                f"{basis.size} Krylov vectors leave an estimated error of {error:.1e} (tolerance {tolerance:.1e}): "
                "lower the bandwidth or the duration, or raise max_vectors"
            )
    if (lost := basis.orthogonality_error()) > 1e-8:
        raise ConvergenceError(f"the Krylov basis lost orthogonality: |V'MV - I| = {lost:.1e} (limit 1e-8)")
    origin = {"vectors": basis.size, "shift_rad_per_s": shift, "factorization": factor.backend}
    progress("reduction", 1.0)
    return greens.with_error(ErrorEstimate(reduction=error), origin), _converged(basis, omega, coefficients)


@dataclass
class _History:
    """How g after the pulse changed from one check to the next, and what is to be expected of the vectors to come."""

    tolerance: float
    last: Array | None = None
    changes: list[float] = field(default_factory=list)
    first_error: float = np.inf

    def add(self, response: Array) -> float:
        """Estimated error of ``response`` relative to its maximum.

        With d the last change (or half the median of three: changes are uneven) and r the mean ratio of the last
        changes, the changes to come sum to d r/(1 - r). Twice that is stated, and at least 2 d. On rods and blocks the
        true error stayed below, damped or not, mostly within a factor of five; only undamped meshes coarser than the
        waves of the band, which converge slowly to the end, exceeded it (threefold).
        """
        before, self.last = self.last, response
        if before is None:
            return np.inf
        self.changes.append(float(np.abs(response - before).max() / np.abs(response).max()))
        recent = self.changes[-4:]
        if len(recent) < 2:
            return np.inf
        ratio = float(np.clip((recent[-1] / recent[0]) ** (1 / (len(recent) - 1)), 0.0, 0.9))
        return 2 * max(recent[-1], float(np.median(recent[-3:])) / 2) * max(1.0, ratio / (1 - ratio))

    def fraction(self, error: float) -> float:
        """Progress: on a logarithmic scale, as convergence is geometric."""
        if not np.isfinite(error):
            return 0.0
        self.first_error = min(self.first_error, max(error, 2 * self.tolerance))
        done = np.log(self.first_error / max(error, self.tolerance)) / np.log(self.first_error / self.tolerance)
        return float(np.clip(done, 0.0, 0.99))


class _Pairs:
    """Ritz pairs and what each does after the pulse."""

    def __init__(
        self, model: SecondOrderModel, damping: Damping, omega: Array, shapes: Array, t: Array, width: float
    ) -> None:
        self.model, self.damping, self.omega, self.shapes, self.t, self.width = model, damping, omega, shapes, t, width
        self.each = mode_responses(omega, damping.ratios(omega), t, width)
        self.response = combine(shapes, self.each)

    def cut(self, band: float, allowed: float) -> tuple[ModalGreens, float]:
        """Drop the pairs above the lowest cutoff that costs less than ``allowed`` into the residual; (g, its error).

        High pairs stand for no mode of the body; kept, they would ring in the contact. Their compliance is kept.
        """
        nothing = np.zeros((self.shapes.shape[1],) * 2)
        scale = float(np.abs(self.response).max())
        best = truncate(self.omega, self.shapes, np.inf, nothing, self.model, self.damping)
        lowest, above = np.inf, 2 * band
        while lowest > allowed and np.any(self.omega > above):
            greens = truncate(self.omega, self.shapes, above, nothing, self.model, self.damping)
            dropped = self.omega > above
            stand_in = greens.residual.filtered(self.t, self.width)
            error = float(np.abs(stand_in - combine(self.shapes[dropped], self.each[dropped])).max()) / scale
            if error < lowest:
                best, lowest = greens, error
            above *= 1.25
        return best, lowest if np.isfinite(lowest) else 0.0


def _converged(basis: KrylovBasis, omega: Array, coefficients: Array) -> Modes:
    """The Ritz pairs up to the shift frequency (40 at most) whose eigenvalue residual is below 1e-3."""
    chosen = np.flatnonzero(omega <= basis.shift)[:40]
    shapes = basis.V @ coefficients[:, chosen]
    residuals = eigen_residuals(basis.model, omega[chosen] ** 2, shapes, basis.shift)
    good = residuals < 1e-3
    frequencies = omega[chosen][good] / (2 * np.pi)
    return Modes(frequencies, shapes[:, good], residuals[good], False, f"krylov, {basis.factor.backend}")
