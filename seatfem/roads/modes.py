"""Natural modes by shift-invert Lanczos, checked for completeness, and the modal road to a Green's function."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from impact.greens import ErrorEstimate
from impact.modal import ModalGreens, Residual
from impact.progress import Progress, silent
from impact.pulse import error_times
from seatfem.model import Array, ModelError, SecondOrderModel
from seatfem.roads.checks import passivity
from seatfem.roads.damping import Damping, truncate
from seatfem.roads.factorization import Backend, Factorization, factorize
from seatfem.roads.mode_shift import lower_shift, null_limit
from seatfem.roads.rigid import default_shift, rigid_shapes

_SURE = 1e-6  # of s^2: an eigenvalue above it is not zero, whatever the largest of K/M
_DENSE = 600  # unknowns up to which LAPACK is the quickest and finds all modes
_STARTS = 6
_COUNTED = 1e-3  # residual of a first solve up to which pivots are counted
_RESTARTS = 12  # of Lanczos, before a lower shift is tried; bodies whose shift suits them take 2 to 5


class ConvergenceError(ArithmeticError):
    """An iteration that did not reach its tolerance; the message gives the measured error and a remedy."""


@dataclass(frozen=True)
class Modes:
    """Undamped natural modes, K y = w^2 M y, lowest first.

    Attributes:
        frequencies_hz: (m,) natural frequencies [Hz]; exactly 0 for rigid-body modes.
        shapes: (n, m) mass-normalised shapes y [1/sqrt(kg)].
        residuals: (m,) ||K y - w^2 M y|| / ((w^2 + s^2) ||M y||), s the shift used.
        complete: whether a count of eigenvalues (Sylvester's law of inertia) proved that none is missing.
        backend: what solved them.
    """

    frequencies_hz: Array
    shapes: Array
    residuals: Array
    complete: bool
    backend: str

    @property
    def omega(self) -> Array:
        """(m,) angular frequencies [rad/s]."""
        return 2 * np.pi * self.frequencies_hz


def solve_modes(
    model: SecondOrderModel,
    n: int = 20,
    *,
    shift_hz: float | None = None,
    check: bool = True,
    backend: Backend = "auto",
    progress: Progress = silent,
) -> Modes:
    """The ``n`` lowest undamped modes; free bodies include their rigid-body modes at exactly 0 Hz.

    Lanczos (ARPACK) on (K + s^2 M)^-1 M: the negative shift -s^2 keeps the factorized matrix positive definite, also
    for a free body. The start vector is fixed, so runs repeat.
    Source: Grimes, Lewis & Simon, SIAM J. Matrix Anal. Appl. 15 (1994).

    Args:
        n: number of modes; all of them if the model has fewer.
        shift_hz: s/(2 pi); default: near the lowest elastic frequency, from the size of the model, and lowered where
            Lanczos does not get there, as for thin bodies: their 1/(w^2 + s^2) all crowd together.
        check: count the eigenvalues below the last gap by the inertia of a second factorization.
        progress: called with ("modes", fraction).

    Raises:
        ConvergenceError: modes are missing even after a restart.
    """
    if n < 1:
        raise ModelError(f"n = {n} modes asked for: give at least 1")
    shift = default_shift(model) if shift_hz is None else 2 * np.pi * shift_hz
    flat = null_limit(model) > _SURE * shift**2  # elements: round-off of K, but not of 1/(w^2 + s^2)
    if model.size <= n + 2 or (model.size <= _DENSE and not flat):
        return _dense_modes(model, min(n, model.size), shift)
    wanted, missing, name = min(n + 4, model.size - 1), n, "K + s^2 M"
    factor = factorize(model.K + shift**2 * model.M, backend=backend, name=name)
    for seed in range(_STARTS):
        progress("modes", 0.3)
        lower = lower_shift(model, shift) if shift_hz is None else shift
        found = _lanczos(model, factor, shift, wanted, seed, _RESTARTS if lower < shift else None)
        if found is not None:
            values, shapes = found
            missing = _missing(model, values, n, shift, backend) if check else 0
            if missing == 0:
                progress("modes", 1.0)
                return _modes(model, values[:n], shapes[:, :n], shift, check, f"arpack, {factor.backend}")
            wanted = min(wanted + max(missing, 0) + 4, model.size - 1)
        if lower < shift:
            shift = lower
            factor = factorize(model.K + shift**2 * model.M, backend=backend, name=name)
    raise ConvergenceError(
        f"{missing} modes below the {n}th are still missing after {_STARTS} starts: give another shift_hz"
    )


def modal_greens(
    model: SecondOrderModel,
    damping: Damping,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    backend: Backend = "auto",
    max_modes: int = 1500,
    progress: Progress = silent,
) -> tuple[ModalGreens, Modes]:
    """All modes up to a cutoff, the residual flexibility of the others as a passive exponential.

    The cutoff rises until the estimated error is within the tolerance. It is the sum of what the exponential's lag
    does (against a bare spring) and of what the modes left out still ring after the pulse: with x = cutoff/bandwidth
    at most R0 2 bandwidth/(x^2 - 1), all in phase, and usually near what dropping the top 30 % changes.

    Raises:
        ConvergenceError: more than ``max_modes`` modes would be needed.
    """
    width = 1 / bandwidth
    t = error_times(duration, width)
    cutoff, found, error = 3.0 * bandwidth, 0, np.inf
    modes: Modes | None = None
    while True:
        n = _count_below(model, cutoff, backend)
        if n > max_modes:
            raise ConvergenceError(
                f"{n} modes lie below {cutoff:.3g} Hz (limit {max_modes}) and {found} leave an error of {error:.1e} "
                f"(tolerance {tolerance:.1e}): use method='krylov'"
            )
        progress("reduction", min(0.9, n / max_modes))
        if modes is None or found < model.size:  # all of a small model are found at once
            modes = _counted(model, n, cutoff, backend, progress)
        found = len(modes.omega)
        shapes = modes.shapes.T @ model.port_matrix
        extra = _left_out(model, modes, shapes, backend)
        zeta = damping.ratios(modes.omega, damping.losses(modes.shapes))
        greens = truncate(modes.omega, zeta, shapes, 2 * np.pi * cutoff, extra, model, damping)
        error = _modal_error(greens, t, bandwidth, cutoff)
        if error <= tolerance or (found == model.size and 2 * np.pi * cutoff > modes.omega[-1]):
            progress("reduction", 1.0)
            origin = {
                "modes": found,
                "cutoff_Hz": cutoff,
                "counted": True,
                "checks": {"reciprocity": 0.0, **passivity(greens)},
            }
            return greens.with_error(ErrorEstimate(reduction=error), origin), modes
        cutoff *= 1.3


def _counted(model: SecondOrderModel, n: int, cutoff: float, backend: Backend, progress: Progress) -> Modes:
    """The ``n`` modes that the inertia counts below ``cutoff`` [Hz]: all of them, repeated ones included."""
    modes = solve_modes(model, max(n, 1), check=False, backend=backend, progress=progress)
    if n == 0 or modes.frequencies_hz[n - 1] <= cutoff * (1 + 1e-9) or len(modes.omega) == model.size:
        return modes
    return solve_modes(model, n, backend=backend, progress=progress)  # one was missed: counts and restarts


def _modal_error(greens: ModalGreens, t: Array, bandwidth: float, cutoff: float) -> float:
    """Error of a modal Green's function with modes up to ``cutoff`` [Hz], see `modal_greens`."""
    left_out = greens.residual.static()
    spring = replace(greens, residual=Residual.spring(left_out))
    top = greens.omega > 0.7 * 2 * np.pi * cutoff
    dropped = greens.shapes[top] / greens.omega[top, None]
    lower = replace(
        spring,
        omega=greens.omega[~top],
        zeta=greens.zeta[~top],
        shapes=greens.shapes[~top],
        residual=Residual.spring(left_out + dropped.T @ dropped),
    )
    full, bare = greens.filtered_matrix(t, 1 / bandwidth), spring.filtered_matrix(t, 1 / bandwidth)
    bound = float(np.abs(left_out).max()) * 2 * bandwidth / ((cutoff / bandwidth) ** 2 - 1)
    rings = 2 * float(np.abs(bare - lower.filtered_matrix(t, 1 / bandwidth)).max()) if np.sum(top) >= 10 else bound
    lag = float(np.abs(full - bare).max())
    return 1.2 * (lag + float(np.clip(rings, bound / 10, bound))) / float(np.abs(full).max())  # ratios scatter


def _left_out(model: SecondOrderModel, modes: Modes, shapes: Array, backend: Backend) -> Array:
    """(p, p) static compliance of the modes not in ``modes``: B'(K + s^2 M)^-1 B minus theirs, s far below them."""
    if len(modes.omega) == model.size:
        return np.zeros((shapes.shape[1], shapes.shape[1]))
    shift = min(default_shift(model), 1e-3 * float(modes.omega[-1]))
    factor = factorize(model.K + shift**2 * model.M, backend=backend, name="K + s^2 M")
    static = model.port_matrix.T @ factor.solve(model.port_matrix)
    rest = static - (shapes / (modes.omega**2 + shift**2)[:, None]).T @ shapes
    values, vectors = np.linalg.eigh((rest + rest.T) / 2)
    if values[0] < -1e-6 * np.abs(static).max():
        raise ConvergenceError(
            f"the modes exceed the static compliance by {-values[0]:.2e} m/N: they are not converged"
        )
    return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)


def _count_below(model: SecondOrderModel, frequency_hz: float, backend: Backend) -> int:
    """Number of modes below a frequency by Sylvester's law of inertia."""
    if model.size <= _DENSE:
        return model.size
    square = (2 * np.pi * frequency_hz) ** 2
    count = factorize(model.K - square * model.M, definite=False, backend=backend, name="K - w^2 M").negative_pivots
    if count is None:
        raise ConvergenceError("this factorization cannot count eigenvalues: use method='krylov'")
    return count


def _missing(model: SecondOrderModel, values: Array, n: int, shift: float, backend: Backend) -> int:
    """How many eigenvalues below the widest gap after the n-th were not found."""
    gaps = np.diff(values[n - 1 :]) / (values[n:] + shift**2)
    last = n - 1 + int(np.argmax(gaps))
    middle = (values[last] + values[last + 1]) / 2
    shifted = model.K - middle * model.M
    count = factorize(
        shifted, definite=False, backend=backend, tolerance=_COUNTED, name="K - w^2 M"
    ).negative_pivots  # of a matrix within round-off of K - w^2 M, however hard it is to solve with
    return 0 if count is None else count - (last + 1)


def _lanczos(
    model: SecondOrderModel, factor: Factorization, shift: float, n: int, seed: int, restarts: int | None
) -> tuple[Array, Array] | None:
    """``n`` eigenvalues, lowest first, and their vectors; ``None`` where ``restarts`` do not bring them."""
    size = model.size
    inverse = LinearOperator((size, size), matvec=lambda x: factor.solve(np.ravel(x)), dtype=np.float64)
    start = np.random.default_rng(seed).standard_normal(size)
    try:
        values, shapes = eigsh(model.K, n, model.M, sigma=-(shift**2), OPinv=inverse, v0=start, maxiter=restarts)
    except ArpackNoConvergence:
        return None
    order = np.argsort(values)
    return np.asarray(values[order]), np.asarray(shapes[:, order])


def _dense_modes(model: SecondOrderModel, n: int, shift: float) -> Modes:
    values, shapes = scipy.linalg.eigh(model.K.toarray(), model.M.toarray(), subset_by_index=(0, n - 1))
    return _modes(model, np.asarray(values), np.asarray(shapes), shift, True, "lapack")


def _modes(model: SecondOrderModel, values: Array, shapes: Array, shift: float, complete: bool, backend: str) -> Modes:
    limit = null_limit(model)
    if values[0] < -limit:
        raise ModelError(f"K is indefinite: it has the eigenvalue {values[0]:.2e} 1/s^2 relative to M")
    zero = values < limit
    rigid = rigid_shapes(model) if zero.any() else shapes[:, :0]
    if known := min(rigid.shape[1], len(values)):  # exact ones for the computed; they span the same null space
        shapes = np.concatenate([rigid[:, :known], shapes[:, known:]], axis=1)
        zero = np.arange(len(values)) < known
    elif zero.any() and limit > _SURE * shift**2:
        zero = values < _SURE * shift**2
        if backend == "lapack":
            raise ConvergenceError(
                f"round-off of K, {limit:.1e} 1/s^2, hides the lowest eigenvalues: some elements are far flatter than "
                "the others; mesh the body more evenly"
            )
    square = np.where(zero, 0.0, np.maximum(values, 0.0))
    return Modes(
        np.sqrt(square) / (2 * np.pi), shapes, eigen_residuals(model, square, shapes, shift), complete, backend
    )


def eigen_residuals(model: SecondOrderModel, square: Array, shapes: Array, shift: float) -> Array:
    """(m,) ||K y - w^2 M y|| / ((w^2 + s^2) ||M y||) with w^2 = ``square``."""
    mass = model.M @ shapes
    left = np.linalg.norm(model.K @ shapes - mass * square, axis=0)
    return np.asarray(left / ((square + shift**2) * np.linalg.norm(mass, axis=0)))
