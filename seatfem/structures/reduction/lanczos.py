"""Reduction without a factorization: Gauss quadrature of g by Lanczos' recursion.

With A = M^-1/2 K M^-1/2 and q = M^-1/2 B,

    g(t) = q' sin(sqrt(A) t)/sqrt(A) q  ~  R' [sin(sqrt(T) t)/sqrt(T)]_11 R,      q = Q_1 R

T the block tridiagonal matrix of k block Lanczos steps: the Gauss quadrature of the spectral measure, nodes theta_j
(eigenvalues of T), weights from the first rows of its eigenvectors. Only two blocks of vectors are stored, and no
vector is reorthogonalised: spurious copies of converged nodes share their weight. sin(sqrt(x) t)/sqrt(x) is
approximated to any accuracy by a polynomial of degree t sqrt(theta_max)/2 in x, and a k-point Gauss rule is exact to
degree 2 k - 1, so the quadrature is exact to round-off for t < 4 k/sqrt(theta_max), and useless beyond. A mass that is
not diagonal takes ten times as long.

Sources: Golub and Meurant, Matrices, Moments and Quadrature with Applications (2010); Druskin and Knizhnerman, Numer.
Linear Algebra Appl. 2 (1995) 205 (without orthogonalisation); Zimmerling, Druskin and Simoncini, J. Sci. Comput. 103
(2025) (block Gauss-Radau).
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from impact.greens.base import ErrorEstimate
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, ModelError, SecondOrderModel
from seatfem.structures.reduction import lanczos_recursion, residual
from seatfem.structures.reduction.reducer import Cost, Grown, Reducer, Reduction, RitzSpace

_CEILING = 12.0  # frequency over the bandwidth above which nodes are springs, with an error of 1/144
_PRODUCT = 1.2e-9  # time for each entry of K in a product [s], measured
_ROW = 3e-8  # further time for each unknown in a step [s]


@dataclass(frozen=True)
class Lanczos(Reducer):
    """Reduction by Lanczos steps, until the estimated error of g after the Hann pulse is within tolerance.

    Their number grows by an eighth between checks. ``origin["brackets"]`` has Gauss (lower) and Gauss-Radau (upper)
    bounds of the trace of B'(K + s^2 M)^-1 B at s = 1/duration and s = 2 pi bandwidth.

    Attributes:
        most: most steps, unless the aims state a number.
    """

    most: int = 20_000

    name = "lanczos"
    factorizes = False
    diagonal_mass = True

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used: it needs damping ratios that depend on a mode's frequency only."""
        if damping.refusal:
            return damping.refusal
        if damping.loss is not None:
            return (
                "loss factors that differ by region need shapes of modes, which Lanczos does not keep: use "
                "method='krylov'"
            )
        return ""

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the cost of 1.2 T sqrt(theta_max)/4 steps over the duration T, with one product a port in each,
        theta_max by 20 steps; infinite for a mass that is not diagonal, as a last resort if memory allows no
        factorization."""
        if not model.mass_is_diagonal:
            return Cost(math.inf, "products with K, and M inverted by conjugate gradients")
        recursion = lanczos_recursion.Recursion(model)
        recursion.extend(20)
        products = (int(1.2 * aims.duration * np.sqrt(recursion.highest()) / 4) + 30) * len(model.ports)
        return Cost(products * (_PRODUCT * model.K.nnz + _ROW * model.size), f"{products} products with K")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`; raises `ModelError` also for an indefinite K."""
        space = _Nodes(model, damping, aims, aims.max_vectors or self.most, progress)
        greens, error = space.converge(silent)
        progress("reduction", 1.0)
        recursion = space.recursion
        highest = float(np.sqrt(recursion.highest()))
        origin = {
            "steps": recursion.steps,
            "products": recursion.steps * recursion.width,
            "highest_frequency_Hz": highest / (2 * np.pi),
            "valid_s": 4 * recursion.steps / highest,
            "rigid_modes": recursion.rigid.shape[0],
            "brackets": [recursion.bracket(s) for s in (1 / aims.duration, aims.band)],
            "checks": {"reciprocity": 0.0, **residual.passivity(greens)},
        }
        return Reduction(greens.with_error(ErrorEstimate(reduction=error), origin))


class _Nodes(RitzSpace):
    """The recursion so far, and the Gauss nodes of its T."""

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims, most: int, progress: Progress) -> None:
        super().__init__(model, damping, aims)
        self.most, self.progress = most, progress
        self.recursion = lanczos_recursion.Recursion(model)
        self.recursion.extend(min(30, most))
        self.valid = int(np.ceil(aims.duration * np.sqrt(self.recursion.highest()) / 4))
        self.wanted = min(max(30, self.valid // 2), most)

    def grow(self) -> Grown:
        recursion, valid = self.recursion, max(self.valid, 1)
        recursion.extend(self.wanted, lambda done: self.progress("reduction", min(0.99, done / valid)))
        omega, shapes, beyond = nodes(recursion, _CEILING * self.aims.band)
        self.wanted = min(self.most, recursion.steps + max(10, recursion.steps // 8))
        return self.see(omega, shapes, beyond=beyond), recursion.complete, recursion.steps >= self.most, None

    def shortfall(self, error: float) -> str:
        return (
            f"{self.recursion.steps} Lanczos steps leave an estimated error of {error:.1e} (tolerance "
            f"{self.aims.tolerance:.1e}); about {self.valid} would do: shorten the duration, raise max_vectors "
            "(seat.greens.max_vectors in a scene), or use method='krylov', whose cost does not grow with the duration"
        )


def nodes(recursion: lanczos_recursion.Recursion, ceiling: float) -> tuple[Array, Array, Array]:
    """Return the Gauss nodes up to ``ceiling`` [rad/s] as omega (m,) and shapes (m, p), rigid-body motions first at
    exactly 0, and the static compliance (p, p) of the higher nodes [m/N]."""
    values, first = recursion.eigen(ceiling**2)
    noise = 1e-12 * recursion.highest()
    if values.size and values[0] < -noise:
        raise ModelError(f"K is indefinite, check its constraints: eigenvalue {values[0]:.2e} 1/s^2 relative to M")
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
