"""The road without a factorization, for a diagonal mass: Gauss quadrature of g by Lanczos' recursion.

With A = M^-1/2 K M^-1/2 and q = M^-1/2 B,

    g(t) = q' sin(sqrt(A) t)/sqrt(A) q  ~  R' [sin(sqrt(T) t)/sqrt(T)]_11 R,      q = Q_1 R

T the block tridiagonal matrix of k block Lanczos steps: the Gauss quadrature of the spectral measure, nodes theta_j
(eigenvalues of T), weights from the first rows of its eigenvectors. Only two blocks of vectors are kept, and no
vector is orthogonalised again: the copies of converged nodes that appear share one weight between them. sin(sqrt(x) t)/
sqrt(x) is of degree t sqrt(theta_max)/2 in x to any accuracy, a k-point Gauss rule exact to degree 2 k - 1, so the
quadrature is exact to round-off while t < 4 k/sqrt(theta_max), and worth nothing beyond.

Sources: Golub and Meurant, Matrices, Moments and Quadrature with Applications (2010); Druskin and Knizhnerman, Numer.
Linear Algebra Appl. 2 (1995) 205 (without orthogonalisation); Zimmerling, Druskin and Simoncini, J. Sci. Comput. 103
(2025) (block Gauss-Radau).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from impact.greens.base import ErrorEstimate
from impact.greens.modal import ModalGreens
from impact.greens.pulse import error_times
from impact.progress import Progress, silent
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.checks import passivity
from seatfem.structures.reduction.convergence import History
from seatfem.structures.reduction.damping import Damping
from seatfem.structures.reduction.lanczos_recursion import Recursion
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.ritz import RitzPairs

_CEILING = 12.0  # bandwidths; nodes above follow the pulse as a spring, to 1/144


def lanczos_greens(
    model: SecondOrderModel,
    damping: Damping,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    max_steps: int = 20_000,
    progress: Progress = silent,
) -> ModalGreens:
    """Lanczos steps until the estimated error of g after the Hann pulse over ``duration`` is in tolerance.

    The steps grow by an eighth from check to check; the estimate is that of `convergence.History`,
    plus what the nodes left out of the band do that the residual does not. ``origin["brackets"]`` holds Gauss (lower)
    and Gauss-Radau (upper) bounds of the trace of B'(K + s^2 M)^-1 B at s = 1/duration and s = 2 pi bandwidth.

    Raises:
        ModelError: the mass is not diagonal, the loss matrix is not eta K, K is indefinite.
        ConvergenceError: the error after ``max_steps`` steps is too large.
    """
    if damping.loss is not None:
        raise ModelError(
            "loss factors that differ by region need shapes of modes, which Lanczos does not keep: use method='krylov'"
        )
    width, ceiling = 1 / bandwidth, 2 * np.pi * bandwidth * _CEILING
    t = error_times(duration, width)
    recursion = Recursion(model)
    recursion.extend(min(30, max_steps))
    highest = recursion.highest()
    valid = int(np.ceil(duration * np.sqrt(highest) / 4))
    wanted = min(max(30, valid // 2), max_steps)
    history = History(tolerance)
    while True:
        recursion.extend(wanted, lambda done: progress("reduction", min(0.99, done / max(valid, 1))))
        omega, shapes, beyond = nodes(recursion, ceiling)
        pairs = RitzPairs(model, damping, omega, shapes, t, width, beyond=beyond)
        error = 0.0 if recursion.complete else history.add(pairs.response)
        if error <= tolerance / 2:
            greens, cut = pairs.cut(2 * np.pi * bandwidth, tolerance / 2)
            error += cut
            if error <= tolerance or recursion.complete:
                break
        if recursion.steps >= max_steps:
            raise ConvergenceError(
                f"{recursion.steps} Lanczos steps leave an estimated error of {error:.1e} (tolerance {tolerance:.1e}); "
                f"about {valid} would do: shorten the duration, raise max_vectors (seat.greens.max_vectors in a "
                "scene), or use method='krylov', whose cost does not grow with the duration"
            )
        wanted = min(max_steps, recursion.steps + max(10, recursion.steps // 8))
    progress("reduction", 1.0)
    origin = {
        "steps": recursion.steps,
        "products": recursion.steps * recursion.width,
        "highest_frequency_Hz": float(np.sqrt(recursion.highest()) / (2 * np.pi)),
        "valid_s": 4 * recursion.steps / float(np.sqrt(recursion.highest())),
        "rigid_modes": recursion.rigid.shape[0],
        "brackets": [recursion.bracket(s) for s in (1 / duration, 2 * np.pi * bandwidth)],
        "checks": {"reciprocity": 0.0, **passivity(greens)},
    }
    return greens.with_error(ErrorEstimate(reduction=error), origin)


def nodes(recursion: Recursion, ceiling: float) -> tuple[Array, Array, Array]:
    """(omega (m,), shapes (m, p), beyond (p, p)): Gauss nodes up to ``ceiling`` [rad/s], static compliance of the rest.

    Rigid-body motions come first, at exactly 0.
    """
    values, first = recursion.eigen(ceiling**2)
    noise = 1e-12 * recursion.highest()
    if values.size and values[0] < -noise:
        raise ModelError(f"K is indefinite: it has the eigenvalue {values[0]:.2e} 1/s^2 relative to M")
    unknown = 0.0 if len(recursion.rigid) else 1e-14 * recursion.highest()
    values = np.where(values < unknown, 0.0, np.maximum(values, 0.0))
    shapes = first @ recursion.start
    soft = values > 0
    listed = shapes[soft] / np.sqrt(values[soft])[:, None]
    rest = np.zeros((shapes.shape[1],) * 2)
    if np.all(soft):
        total, weights = scipy.linalg.eigh(recursion.resolvent(0.0) - listed.T @ listed)
        rest = weights * np.where(total > 1e-9 * np.abs(total).max(), total, 0.0) @ weights.T
    omega = np.concatenate([np.zeros(len(recursion.rigid)), np.sqrt(values)])
    return omega, np.concatenate([recursion.rigid, shapes]), rest
