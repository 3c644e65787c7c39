"""A march's motion and energy once more from its force alone, by another recursion than the program's."""

import cmath
import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from impact import Hertz, HuntCrossley, ImpactResult, LinearSpring, ModalGreens
from impact.greens.base import Array
from impact.march.laws import Law


@dataclass(frozen=True)
class Ledger:
    """What the force of a run does to undamped bodies.

    Attributes:
        gap: of the contact (n + 1,).
        energy: of both bodies and the contact, less the work of the push (n + 1,): constant, or falling with what is
            lost, whatever the bodies exchange.
    """

    gap: Array
    energy: Array


def ledger(
    result: ImpactResult,
    law: Law,
    target: ModalGreens | None,
    *,
    gap: float,
    omega: float,
    velocity: float,
    push: float,
) -> Ledger:
    """Follow a unit mass on a spring omega^2 (0: free) at ``velocity``, under a steady push, against undamped modes.

    Of a mode, z = q' + i w q obeys z' = i w z + f, exactly over a step with a constant force; its energy is |z|^2/2.
    A relaxation a^2 exp(-r t) moves by a^2 y, y' = f - r y, and stores r a^2 y^2/2. ``target``: ``None`` stands still.
    """
    dt, pressed = result.dt, np.asarray(result.force[1:], dtype=np.float64)
    moved, energy = _mode(omega, pressed + push, dt, velocity)
    total, opening = energy - push * moved, gap + moved
    if target is not None:
        for w, shape in zip(target.omega, target.shapes[:, 0], strict=True):
            moved, energy = _mode(float(w), float(shape) * pressed, dt, 0.0)
            opening += float(shape) * moved
            total += energy
        for a, rate in zip(target.residual.shapes[:, 0], target.residual.rates, strict=True):
            decay = math.exp(-rate * dt)
            y = np.concatenate([[0.0], lfilter([1.0], [1.0, -decay], (1 - decay) / rate * pressed)])
            opening += a**2 * y
            total += rate * a**2 * y**2 / 2
    return Ledger(opening, total + stored(law, np.maximum(-np.asarray(result.gap), 0.0)))


def _mode(omega: float, force: Array, dt: float, velocity: float) -> tuple[Array, Array]:
    """Return displacement and energy of a unit mass on a spring omega^2, at rest at x = 0 but for its velocity."""
    if omega == 0.0:
        v = velocity + dt * np.concatenate([[0.0], np.cumsum(force)])
        return dt * np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2)]), v**2 / 2
    turn = cmath.exp(1j * omega * dt)
    start = np.array([turn * velocity])
    z, _ = lfilter([1.0], [1.0, -turn], (turn - 1) / (1j * omega) * force, zi=start)
    z = np.concatenate([[velocity], z])
    return np.asarray(z.imag / omega), np.asarray(np.abs(z) ** 2 / 2)


def stored(law: Law, penetration: Array) -> Array:
    """Return the potential energy of the law."""
    if isinstance(law, LinearSpring):
        return np.asarray(law.stiffness * penetration**2 / 2)
    if isinstance(law, Hertz | HuntCrossley):
        return np.asarray(law.stiffness * penetration**2.5 / 2.5)
    return np.zeros_like(penetration)
