"""Damping of modes, and the passive residual that stands for the modes left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from impact.modal import ModalGreens, Residual
from seatfem.model import Array, ModelError, SecondOrderModel


@dataclass(frozen=True)
class Damping:
    """zeta(w) = ratio + alpha/(2 w) + beta w/2: uniform modal damping, or Rayleigh's C = alpha M + beta K."""

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0

    def ratios(self, omega: Array) -> Array:
        """Damping ratio of each mode; `ModelError` for mass-proportional damping of a rigid-body mode (w = 0)."""
        if self.alpha > 0 and np.any(omega == 0):
            raise ModelError(
                f"alpha = {self.alpha:g} 1/s damps the rigid motion of a free body: use alpha = 0 or fix it"
            )
        safe = np.where(omega > 0, omega, np.inf)
        return np.asarray(self.ratio + self.alpha / (2 * safe) + self.beta * omega / 2)

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


def damping_of(model: SecondOrderModel, ratio: float) -> Damping:
    """The model's Rayleigh damping, or uniform modal damping of ``ratio``.

    Raises:
        ModelError: both at once, a negative ratio, a C that is not alpha M + beta K, a damped rigid body.
    """
    if not ratio >= 0:
        raise ModelError(f"damping_ratio = {ratio} must be >= 0")
    if model.C is None:
        return Damping(ratio)
    if ratio > 0:
        raise ModelError(f"damping_ratio = {ratio} and a damping matrix C at once: give one of them")
    rayleigh = model.rayleigh
    if rayleigh is None:
        raise ModelError("C is not alpha M + beta K, so the modes are coupled by damping: use method='transient'")
    alpha, beta = rayleigh
    if alpha < 0 or beta < 0:
        raise ModelError(f"C = {alpha:g} M + {beta:g} K would feed energy: both coefficients must be >= 0")
    return Damping(0.0, alpha, beta)


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
    omega: Array, shapes: Array, above: float, extra: Array, model: SecondOrderModel, damping: Damping
) -> ModalGreens:
    """Modes up to the angular frequency ``above``; the others' static compliance, plus ``extra``, in the residual.

    Args:
        omega, shapes: (M,) and (M, p) mass-normalised modes.
        above: highest retained angular frequency [rad/s].
        extra: (p, p) static compliance known to be in no mode at all [m/N].
    """
    kept = omega <= above
    dropped = shapes[~kept] / omega[~kept, None]
    rest = residual(dropped.T @ dropped + extra, model, damping)
    return ModalGreens(omega[kept], damping.ratios(omega[kept]), shapes[kept], rest, model.port_names)
