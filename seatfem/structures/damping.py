"""How a model is damped: stated by whoever makes the model, or found in its matrices once, when it is made."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.errors import ModelError

Array = NDArray[np.float64]
_SAME = 1e-9  # relative difference of matrices that are taken for equal


@dataclass(frozen=True)
class Damping:
    """Parts of damping that add; with none of them, the model is undamped.

    The mode (w, phi), mass-normalised, has the ratio zeta = ratio + alpha/(2 w) + beta w/2 + phi' H phi/(2 w^2):
    uniform modal damping, Rayleigh's C = alpha M + beta K, and the modal strain energy of a loss matrix H = sum of
    eta_m K_m over regions m, whose special case H = eta K is the uniform ratio eta/2. Source: Johnson and Kienholz,
    AIAA Journal 20 (1982) 1284 (modal strain energy); Clough and Penzien, Dynamics of Structures (Rayleigh).

    Attributes:
        ratio, alpha, beta: uniform part [-], [1/s], [s].
        loss: (n, n) H where it is not eta K, else ``None``.
        coupling: whether the model's C is not alpha M + beta K: then it couples the modes, and alpha and beta are 0.
    """

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    loss: sparse.csr_array | None = field(default=None, repr=False, compare=False)
    coupling: bool = False

    @staticmethod
    def found(
        M: sparse.csr_array, C: sparse.csr_array | None, K: sparse.csr_array, loss: sparse.csr_array | None
    ) -> Damping:
        """Return what the matrices say: C is fitted by alpha M + beta K and H by eta K, each to 1e-9 of its Frobenius
        norm."""
        rayleigh, eta = _fitted(C, M, K), _fitted(loss, K)
        alpha, beta = rayleigh or (0.0, 0.0)
        ratio, rest = (0.0, loss) if eta is None else (eta[0] / 2, None)
        return Damping(ratio, alpha, beta, rest, rayleigh is None)

    @staticmethod
    def of_regions(
        rayleigh: Array, eta: Array, loss: sparse.csr_array | None, *, springs: bool, dashpots: bool
    ) -> Damping:
        """Return what a body of several regions has.

        Args:
            rayleigh: (m, 2) alpha [1/s] and beta [s] of each region.
            eta: (m,) loss factor of each.
            loss: (n, n) H = sum of eta_m K_m, or ``None``.
            springs: whether K holds supports beside the regions, which neither beta nor eta damps.
            dashpots: whether C holds more than the regions'.
        """
        alpha, beta = rayleigh[0].tolist()
        uneven = bool(np.ptp(rayleigh, axis=0).any()) or (springs and beta != 0)
        whole = not np.ptp(eta) and not springs
        if uneven or dashpots:
            alpha = beta = 0.0
        ratio, rest = (float(eta[0]) / 2, None) if whole else (0.0, loss)
        return Damping(ratio, alpha, beta, rest, uneven or dashpots)

    def plus(self, ratio: float) -> Damping:
        """Return the same with uniform modal damping of ``ratio`` added."""
        return replace(self, ratio=self.ratio + ratio)

    @property
    def refusal(self) -> str:
        """Return why modes cannot carry it, in words; "" where they can."""
        if self.coupling:
            return "C is not alpha M + beta K, so the modes are coupled by damping: use method='second_order'"
        if self.alpha < 0 or self.beta < 0:
            return f"C = {self.alpha:g} M + {self.beta:g} K would feed energy: both coefficients must be >= 0"
        return ""

    def ratios(self, omega: Array, loss: Array | None = None) -> Array:
        """Return the (m,) damping ratio of each mode of ``omega`` (m,) [rad/s], ``loss`` (m,) its phi' H phi [1/s^2].

        Raises:
            ModelError: mass-proportional damping of a rigid-body mode (w = 0).
        """
        if self.alpha > 0 and np.any(omega == 0):
            raise ModelError(
                f"alpha = {self.alpha:g} 1/s damps the rigid motion of a free body: use alpha = 0 or fix it"
            )
        safe = np.where(omega > 0, omega, np.inf)
        lost = 0.0 if loss is None else np.maximum(loss, 0.0) / (2 * safe**2)
        return np.asarray(self.ratio + self.alpha / (2 * safe) + self.beta * omega / 2 + lost)

    def losses(self, shapes: Array) -> Array | None:
        """Return the (m,) phi' H phi of the columns of ``shapes`` (n, m) [1/s^2]; ``None`` without a loss matrix."""
        return None if self.loss is None else np.asarray(np.einsum("nm,nm->m", shapes, self.loss @ shapes))

    def first_velocity(self) -> float:
        """Return g(0+) relative to the undamped 1/Z.

        Where g(0+) is finite the modes' participation per unit frequency is constant at high w, and the sum over
        modes at t -> 0 is the integral of exp(-zeta w t) sin(wd t)/w dw: pi/2 undamped, acos(zeta)/sqrt(1 - zeta^2)
        damped, with acosh and sqrt(zeta^2 - 1) beyond critical damping.
        """
        z = self.ratio
        if abs(z - 1) < 1e-9:
            return 2 / np.pi
        arc = np.arccos(z) / np.sqrt(1 - z**2) if z < 1 else np.arccosh(z) / np.sqrt(z**2 - 1)
        return float(2 / np.pi * arc)


def _fitted(matrix: sparse.csr_array | None, *basis: sparse.csr_array) -> tuple[float, ...] | None:
    """Return the coefficients of ``matrix`` as a sum of the ``basis``, by least squares; ``None`` where it is no such
    sum."""
    if matrix is None or matrix.nnz == 0:
        return (0.0,) * len(basis)
    scale = [sparse.linalg.norm(a) for a in basis]
    units = [a / s for a, s in zip(basis, scale, strict=True)]
    gram = np.array([[a.multiply(b).sum() for b in units] for a in units])
    x = np.linalg.solve(gram, [a.multiply(matrix).sum() for a in units])
    rest = matrix
    for factor, unit in zip(x, units, strict=True):
        rest = rest - factor * unit
    if sparse.linalg.norm(rest) > _SAME * sparse.linalg.norm(matrix):
        return None
    small = 1e-12 * np.abs(x).max()
    return tuple(0.0 if abs(v) < small else float(v / s) for v, s in zip(x, scale, strict=True))
