"""The article's own scheme, written from its printed equations (3), (11) and (12); nothing of `impact` is used.

The bracket of (11) and (12), sin(w t_i) sum F_k cos(w t_k) - cos(w t_i) sum F_k sin(w t_k), is the imaginary part of
S_i = sum_k F_k exp(i w (t_i - t_k)), and S_i = exp(i w dt) S_(i-1) + F_i. Undamped this is what is printed; a damping
ratio z turns i w into -z w + i w sqrt(1 - z^2), and the 1/w in front into 1/(w sqrt(1 - z^2)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import brentq

YOUNG, DENSITY = 200e9, 7850.0  # Table 1, both bodies [Pa, kg/m^3]
REED_LENGTH, REED_WIDTH, REED_THICKNESS, REED_DAMPING = 25.4e-3, 10e-3, 0.305e-3, 0.03
ROD_DAMPING = 0.10
DEFLECTION = 1e-3  # y(L, 0) [m]
REED_MASS = DENSITY * REED_LENGTH * REED_WIDTH * REED_THICKNESS
RIGIDITY = YOUNG * REED_WIDTH * REED_THICKNESS**3 / 12


@dataclass(frozen=True)
class Modes:
    """The modes of one body as its contact point feels them.

    Attributes:
        omega: undamped angular frequencies [rad/s].
        inverse_mass: phi_n^2/m at the contact point [1/kg].
        damping_ratio: of every mode.
    """

    omega: np.ndarray
    inverse_mass: np.ndarray
    damping_ratio: float

    @property
    def exponent(self) -> np.ndarray:
        """-z w + i w sqrt(1 - z^2) [1/s]."""
        return self.omega * (-self.damping_ratio + 1j * math.sqrt(1 - self.damping_ratio**2))


def reed_modes(count: int, damping_ratio: float = REED_DAMPING) -> Modes:
    """Return the lowest modes of the cantilever at its tip, where phi_n^2 = 4."""
    bounds = [(max(n * math.pi, 1.0), (n + 1) * math.pi) for n in range(count)]
    roots = np.array([brentq(lambda k: math.cos(k) + 1 / math.cosh(k), *bound) for bound in bounds])
    omega = roots**2 * math.sqrt(RIGIDITY / (REED_MASS * REED_LENGTH**3))
    return Modes(omega, np.full(count, 4 / REED_MASS), damping_ratio)


def rod_modes(count: int, length: float, area: float, damping_ratio: float = ROD_DAMPING) -> Modes:
    """Return the lowest modes of the fixed rod at its free end, where phi_n^2 = 2."""
    omega = (np.arange(count) + 0.5) * math.pi * math.sqrt(YOUNG / DENSITY) / length
    return Modes(omega, np.full(count, 2 / (DENSITY * area * length)), damping_ratio)


def free_motion(reed: Modes, time: np.ndarray) -> np.ndarray:
    """Return the tip's motion before the impact, sum phi_n(L) eta_n(t) [m], let go from a static force at the tip."""
    force = DEFLECTION * 3 * RIGIDITY / REED_LENGTH**3
    start = force * reed.inverse_mass / reed.omega**2
    ring = np.exp(np.outer(time, reed.exponent))
    return (ring.real - reed.exponent.real / reed.exponent.imag * ring.imag) @ start


def shape_integrals(reed: Modes, wave: float) -> np.ndarray:
    """Return phi_n(L) times the integral of phi_n(x) exp(-i k x) over the reed [m], ``wave`` = k [rad/m].

    Four integrations by parts, and b^4 phi for the fourth derivative of phi, leave the ends alone: the second and
    third derivatives 2 b^2 and -2 s b^3 at the clamp, 2 and the slope 2 s b at the tip, the latter two of either sign.
    """
    b = (reed.omega**2 * REED_MASS / (RIGIDITY * REED_LENGTH)) ** 0.25
    decay, turn = np.exp(-b * REED_LENGTH), b * REED_LENGTH
    s = (1 - decay**2 - 2 * decay * np.sin(turn)) / (1 + decay**2 + 2 * decay * np.cos(turn))
    tip = np.where(np.arange(len(b)) % 2, -2.0, 2.0)
    ends = -tip * (wave**2 * s * b + 1j * wave**3) * np.exp(-1j * wave * REED_LENGTH) + 2 * s * b**3 - 2j * wave * b**2
    return tip * ends / (b**4 - wave**4)


def pressed_motion(reed: Modes, time: np.ndarray, peak: float, rate: complex, wave: float) -> np.ndarray:
    """Return what a pressure peak Re exp(rate t - i k x) adds to the tip's motion, the first integral of (2) [m].

    Duhamel's integral of exp(rate t): the forced exponential and the free ones that bring displacement and velocity to
    zero at t = 0.
    """
    own = reed.exponent
    forced = 1 / (rate**2 + 2 * reed.damping_ratio * reed.omega * rate + reed.omega**2)
    share = (rate - own.conj()) / (own - own.conj())
    t = np.asarray(time)[:, None]
    ring = np.exp(rate * t) - share * np.exp(own * t) - (1 - share) * np.exp(own.conj() * t)
    return (peak * REED_WIDTH / REED_MASS * (ring * forced) @ shape_integrals(reed, wave)).real


def march(free: np.ndarray, step: float, reed: Modes, seat: Modes | float) -> np.ndarray:
    """Return the contact force at the times step, 2 step, ... [N] (N,), for the tip's motion ``free`` without contact.

    ``seat``: the modes of the rod, whose end stays at the tip while they touch, -F = N and u(l, t_i) = y(x*, t_i), or
    a constant stiffness K [N/m], y(x*, t_i) = -N/K. The force is the one that closes the gap; where the newest force
    would not push the bodies apart (a sum of sines at w dt may be negative) there is none.
    """
    bodies = [reed, *([seat] if isinstance(seat, Modes) else [])]
    turn = np.concatenate([np.exp(body.exponent * step) for body in bodies])
    scale = np.concatenate([body.inverse_mass * step / body.exponent.imag for body in bodies])
    return _march(free, turn, scale, 0.0 if isinstance(seat, Modes) else 1 / seat)


@njit
def _march(free, turn, scale, compliance):  # type: ignore[no-untyped-def]
    """Take y - u, the modes of both bodies in one list, from step to step."""
    newest = compliance + np.sum(scale * turn.imag)  # the terms F(t_i) sin(w dt)
    sums, force = np.zeros(len(turn), np.complex128), np.zeros(len(free))
    for i in range(len(free)):
        sums *= turn
        gap = free[i] + np.sum(scale * sums.imag)
        if gap < 0 < newest:
            force[i] = -gap / newest
            sums += force[i]
    return force


def largest_force(step: float, reed: Modes, seat: Modes | float, duration: float = 3e-3) -> float:
    """Return the largest contact force of a run of Table 1 [N]; 0 where the scheme finds none."""
    time = step * np.arange(1, round(duration / step) + 1)
    return float(march(free_motion(reed, time), step, reed, seat).max())
