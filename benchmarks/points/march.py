"""Modes that meet at points: Strang splitting of free flight, exact for every mode, and kicks by the contact forces.

Of N points the openings are g = gap + B q, with B q the motion apart of all modes of both bodies, less what the seat
yields beyond its modes, R N. The force at a point is that of its law at the penetration x that the point itself has,

    x + R N(x) = -(gap + B q),    N_i = k_i max(x_i, 0).

It is the slope of a convex energy of q, so that the march is symplectic where nothing damps, and of second order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from points.gll import Array

ITERATIONS = 40


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

    def step_compliance(self, dt: float) -> Array:
        """Return the openings (points, points) at the end of a step by unit forces over it [m/N]."""
        gain = self.flight(dt)[1]
        return dt * (self.shapes * gain) @ self.shapes.T


class PointForces:
    """Forces at the points from the openings of the modes, with the last closed points as the first guess."""

    def __init__(self, stiffness: Array, residual: Array | None = None, *, ahead: bool = False) -> None:
        """Take the stiffness (points,) of the law [N/m] and the compliance (points, points) beyond the modes [m/N];
        ``None``: there is none. ``ahead``: forces are those of the openings at the end of a step, not at its start, so
        that what meets a rigid point stays there until it is pulled off; the compliance is then that of a step."""
        self.ahead = ahead
        self._stiffness, self._residual = stiffness, residual
        self._closed = np.zeros(len(stiffness), dtype=bool)
        self._factored: tuple[bytes, tuple[Array, bool]] | None = None

    def solve(self, openings: Array) -> Array:
        """Return the forces (points,) [N]."""
        if self._residual is None:
            return np.asarray(self._stiffness * np.maximum(-openings, 0.0))
        forces = np.zeros(len(openings))
        if openings.min() > 0:
            self._closed = forces > 0
            return forces
        closed = self._closed | (openings < 0)
        for _ in range(ITERATIONS):
            before, forces = closed, np.zeros(len(openings))
            forces[closed] = self._on_closed(openings, closed)
            closed = openings + self._residual @ forces < 0
            if np.array_equal(closed, before):
                break
        self._closed = closed
        return np.asarray(np.maximum(forces, 0.0))

    def _on_closed(self, openings: Array, closed: Array) -> Array:
        """Return the forces of closed points."""
        key = closed.tobytes()
        if self._factored is None or self._factored[0] != key:
            yielding = self._residual[np.ix_(closed, closed)] + np.diag(1 / self._stiffness[closed])
            self._factored = (key, cho_factor(yielding))
        return np.asarray(cho_solve(self._factored[1], -openings[closed]))


@dataclass(frozen=True)
class MarchRun:
    """A landing: forces (steps, points) [N] at times 0, dt, ..., and by the step of each touch after an opening of all
    points the largest speed at which the points that touch close [m/s]."""

    forces: Array
    touches: dict[int, float]


def march_points(modes: Modes, gaps: Array, rates: Array, forces: PointForces, dt: float, duration: float) -> MarchRun:
    """Return the forces at the points under modes that start undeformed with rates (m,)."""
    keep, gain, pull, hold = modes.flight(dt)
    place, rate = np.zeros_like(rates), rates.copy()
    kicks, touches = np.zeros((round(duration / dt) + 1, len(gaps))), {}
    transposed = np.ascontiguousarray(modes.shapes.T)
    for step, kick in enumerate(kicks):
        kick[:] = forces.solve(gaps + modes.shapes @ (keep * place + gain * rate if forces.ahead else place))
        if (touching := kick > 0).any():
            if step == 0 or not kicks[step - 1].any():
                touches[step] = float(-(modes.shapes[touching] @ rate).min())
            rate = rate + dt * (transposed @ kick)
        place, rate = keep * place + gain * rate, pull * place + hold * rate
    return MarchRun(kicks, touches)


def march_landing(modes: Modes, gaps: Array, rates: Array, forces: PointForces, dt: float, duration: float) -> Array:
    """Return the total force (steps,) [N]; as `march_points`."""
    return march_points(modes, gaps, rates, forces, dt, duration).forces.sum(axis=1)


def impulse(force: Array, dt: float) -> float:
    """Return the impulse of forces (steps,) at steps of dt [N s]."""
    return float(force.sum() * dt)


def filtered_peak(force: Array, dt: float, width: float) -> float:
    """Return the largest mean of the force over a time ``width`` [N], the force linear between steps."""
    work = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2 * dt)])
    times = dt * np.arange(len(force))
    return float((np.interp(times + width, times, work) - work).max() / width)
