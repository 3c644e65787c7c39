"""Damping of modes, and the passive residual that stands for the modes left out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy import sparse

from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.model import Array, ModelError, SecondOrderModel


@dataclass(frozen=True)
class Damping:
    """zeta = ratio + alpha/(2 w) + beta w/2 + phi' H phi/(2 w^2) of the mode (w, phi).

    Uniform modal damping, Rayleigh's C = alpha M + beta K, and the modal strain energy of a loss matrix
    H = sum of eta_m K_m over regions m; H = eta K is the uniform ratio eta/2. Source: Johnson and Kienholz, AIAA
    Journal 20 (1982) 1284 (modal strain energy); Clough and Penzien, Dynamics of Structures (Rayleigh).

    Attributes:
        ratio, alpha, beta: uniform part [-], [1/s], [s].
        loss: H where it is not eta K.
    """

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    loss: sparse.csr_array | None = field(default=None, repr=False, compare=False)

    def ratios(self, omega: Array, loss: Array | None = None) -> Array:
        """Damping ratio of each mode, ``loss`` (M,) its phi' H phi [1/s^2].

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
        """(M,) phi' H phi of the columns of ``shapes`` [1/s^2]; ``None`` without a loss matrix."""
        return None if self.loss is None else np.asarray(np.einsum("nm,nm->m", shapes, self.loss @ shapes))

    def first_velocity(self) -> float:
        """g(0+) relative to the undamped 1/Z.

        Where g(0+) is finite the modes' participation per unit frequency is constant at high w, and the sum over
        modes at t -> 0 is the integral of exp(-zeta w t) sin(wd t)/w dw: pi/2 undamped, acos(zeta)/sqrt(1 - zeta^2)
        damped, with acosh and sqrt(zeta^2 - 1) beyond critical damping.
        """
        z = self.ratio
        if abs(z - 1) < 1e-9:
            return 2 / np.pi
        arc = np.arccos(z) / np.sqrt(1 - z**2) if z < 1 else np.arccosh(z) / np.sqrt(z**2 - 1)
        return float(2 / np.pi * arc)


def damping_of(model: SecondOrderModel, ratio: float = 0.0) -> Damping:
    """The model's Rayleigh damping and loss factors, plus uniform modal damping of ``ratio``: the ratios add.

    Raises:
        ModelError: a negative ratio or coefficient, a C that is not alpha M + beta K.
    """
    if not ratio >= 0:
        raise ModelError(f"damping_ratio = {ratio} must be >= 0")
    rayleigh = model.rayleigh
    if rayleigh is None:
        raise ModelError("C is not alpha M + beta K, so the modes are coupled by damping: use method='second_order'")
    alpha, beta = rayleigh
    if alpha < 0 or beta < 0:
        raise ModelError(f"C = {alpha:g} M + {beta:g} K would feed energy: both coefficients must be >= 0")
    eta = uniform_loss(model)
    return Damping(ratio + (eta or 0.0) / 2, alpha, beta, model.loss if eta is None else None)


def uniform_loss(model: SecondOrderModel) -> float | None:
    """eta if the loss matrix is H = eta K to 1e-9, else ``None``; 0 without H."""
    if model.loss is None or model.loss.nnz == 0:
        return 0.0
    eta = float(model.loss.multiply(model.K).sum() / model.K.multiply(model.K).sum())
    left = sparse.linalg.norm(model.loss - eta * model.K)
    return eta if left <= 1e-9 * sparse.linalg.norm(model.loss) else None


def residual(left_out: Array, model: SecondOrderModel, damping: Damping) -> Residual:
    """Passive stand-in for modes above the band, of static compliance R0 = ``left_out`` (p, p) [m/N].

    An exponential with integral R0 and g(0+) of the continuum, 1/Z times `Damping.first_velocity`: tau = R0 Z for one
    port. Stiffness-proportional damping slows it to tau + beta: modes far above 2/beta are overdamped and creep as
    exp(-t/beta), and a spring beside a dashpot of ratio beta does the same. If a port's impedance is unknown, a
    bare spring (no statement about g(0+)).
    """
    impedances = [port.impedance for port in model.ports.values()]
    if any(z is None for z in impedances):
        if damping.beta == 0:
            return Residual.spring(left_out)
        impedances = [1e-9 * damping.beta / max(r, 1e-300) for r in np.diag(left_out)]
    root = np.sqrt(damping.first_velocity() / np.array(impedances, dtype=float))
    taus, vectors = np.linalg.eigh((left_out + left_out.T) / 2 / np.outer(root, root))
    taus = np.maximum(taus, 0.0)  # round-off
    start = np.where(taus > 0, taus / (np.where(taus > 0, taus, 1.0) + damping.beta), 1.0)
    g0 = root[:, None] * (vectors * start @ vectors.T) * root
    r0 = root[:, None] * (vectors * taus @ vectors.T) * root
    return Residual.exponential(r0, g0)


def truncate(
    omega: Array, zeta: Array, shapes: Array, above: float, extra: Array, model: SecondOrderModel, damping: Damping
) -> ModalGreens:
    """Modes up to the angular frequency ``above``; the others' static compliance, plus ``extra``, in the residual.

    Args:
        omega, zeta, shapes: (M,), (M,) and (M, p) mass-normalised modes.
        above: highest retained angular frequency [rad/s].
        extra: (p, p) static compliance known to be in no mode at all [m/N].
    """
    kept = omega <= above
    dropped = shapes[~kept] / omega[~kept, None]
    tail = damping
    if damping.loss is not None:  # the patch's loss: of the dropped modes, by their share of the compliance
        elastic = omega > 0 if kept.all() else ~kept
        share = np.sum((shapes[elastic] / omega[elastic, None]) ** 2, axis=1)
        lost = (zeta - damping.ratios(omega))[elastic]
        tail = replace(damping, ratio=damping.ratio + float(share @ lost / share.sum()))
    rest = residual(dropped.T @ dropped + extra, model, tail)
    return ModalGreens(omega[kept], zeta[kept], shapes[kept], rest, model.port_names)
