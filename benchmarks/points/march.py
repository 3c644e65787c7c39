"""Modes that meet at points: Strang splitting of free flight, exact for every mode, and kicks by the contact forces.

Of N points the openings are g = gap + B q, with B q the motion apart of all modes of both bodies, less what the seat
yields beyond its modes, R N. The force at a point is that of its law at the penetration x that the point itself has,

    x + R N(x) = -(gap + B q),    N_i = k_i max(x_i, 0)^p.

It is the slope of a convex energy of q, so that the march is symplectic where nothing damps, and of second order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from points.gll import Array

ITERATIONS = 40
CONVERGED = 1e-9  # relative change of forces of a law that is not linear


@dataclass(frozen=True)
class Modes:
    """Modes of both bodies: omega (m,) [rad/s], damping ratio (m,) < 1, and motions apart (points, m) at unit mass."""

    omega: Array
    damping: Array
    shapes: Array

    def flight(self, dt: float) -> tuple[Array, Array, Array, Array]:
        """Return the factors (m,) of q, q' in q and in q' after a step without forces."""
        decay, ringing = self.damping * self.omega, self.omega * np.sqrt(1 - self.damping**2)
        fall = np.exp(-decay * dt)
        cosine, sine = fall * np.cos(ringing * dt), fall * dt * np.sinc(ringing * dt / np.pi)
        return cosine + decay * sine, sine, -(self.omega**2) * sine, cosine - decay * sine


@dataclass(frozen=True)
class Law:
    """Force k x^power at each point, with stiffness (points,) [N/m^power]."""

    stiffness: Array
    power: float = 1.0


class PointForces:
    """Forces at the points from the openings of the modes, with the last ones as the first guess."""

    def __init__(self, law: Law, residual: Array | None) -> None:
        """Take a law and the compliance (points, points) beyond the modes [m/N], ``None`` of a rigid seat."""
        self._law, self._residual = law, residual
        self._local = np.zeros(len(law.stiffness))
        self._factored: tuple[bytes, tuple[Array, bool]] | None = None

    def solve(self, openings: Array) -> Array:
        """Return the forces (points,) [N]."""
        law = self._law
        if self._residual is None or openings.min() > 0:
            self._local = -openings
            return np.asarray(law.stiffness * np.maximum(-openings, 0.0) ** law.power)
        forces = np.zeros(len(openings))
        local = np.where(self._local > 0, self._local, -openings)
        closed = local > 0
        for _ in range(ITERATIONS):
            before, was_closed = forces, closed
            forces = np.zeros(len(openings))
            forces[closed] = self._on_closed(openings, local, closed)
            local = -openings - self._residual @ forces
            if law.power != 1.0:
                own = (np.maximum(forces, 0.0) / law.stiffness) ** (1 / law.power)
                local = np.where(forces > 0, own, local)
            closed = local > 0
            same = bool(np.array_equal(closed, was_closed))
            if same and (law.power == 1.0 or np.abs(forces - before).max() <= CONVERGED * forces.max()):
                break
        self._local = local
        return np.asarray(np.maximum(forces, 0.0))

    def _on_closed(self, openings: Array, local: Array, closed: Array) -> Array:
        """Return the forces of closed points, with the law's tangent at the penetrations ``local``."""
        assert self._residual is not None
        law, x = self._law, local[closed]
        tangent = law.power * law.stiffness[closed] * x ** (law.power - 1)
        right = -openings[closed] - x * (1 - 1 / law.power)
        key = closed.tobytes()
        if law.power == 1.0 and self._factored is not None and self._factored[0] == key:
            return np.asarray(cho_solve(self._factored[1], right))
        factor = cho_factor(self._residual[np.ix_(closed, closed)] + np.diag(1 / tangent))
        self._factored = (key, factor)
        return np.asarray(cho_solve(factor, right))


def march_landing(
    modes: Modes,
    gaps: Array,
    rates: Array,
    forces: PointForces,
    dt: float,
    duration: float,
    flight: float = math.inf,
) -> Array:
    """Return the total force (steps,) [N] at times 0, dt, ... of modes that start undeformed with rates (m,).

    The march ends after a duration, or when nothing has touched for as long as ``flight`` after a contact [s].
    """
    keep, gain, pull, hold = modes.flight(dt)
    place, rate = np.zeros_like(rates), rates.copy()
    total = np.zeros(round(duration / dt) + 1)
    transposed = np.ascontiguousarray(modes.shapes.T)
    last = math.inf
    for step in range(len(total)):
        kick = forces.solve(gaps + modes.shapes @ place)
        total[step] = kick.sum()
        if total[step] > 0:
            rate, last = rate + dt * (transposed @ kick), step
        elif (step - last) * dt >= flight:
            return total[: step + 1]
        place, rate = keep * place + gain * rate, pull * place + hold * rate
    return total


def impulse(force: Array, dt: float) -> float:
    """Return the impulse of forces (steps,) at steps of dt [N s]."""
    return float(force.sum() * dt)


def filtered_peak(force: Array, dt: float, width: float) -> float:
    """Return the largest mean of the force over a time ``width`` [N], the force linear between steps."""
    work = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * dt)])
    times = dt * np.arange(len(force))
    return float((np.interp(times + width, times, work) - work).max() / width)
