"""The impact on undamped modes without a time step: from one opening or closing of the contact to the next.

Open and closed, the mass and the modes are each a linear system without damping, known by its own modes. So the motion
is exact at any time, and only the times of change are searched for, by bisection within a fine grid.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

from benchmarks.peers.impact_scene import DURATION, MASS, SPEED, STIFFNESS, Array, Course


def march(omega: Array, shares: Array, dt: float) -> Course:
    """Mean force over each step of ``dt`` [N], from the momentum of the mass."""
    n = len(omega)
    b = np.array([*shares, -1 / np.sqrt(MASS)])  # penetration = b q, mass-normalised
    open_ = np.array([*omega**2, 0.0]), np.eye(n + 1)
    closed = eigh(np.diag(open_[0]) + STIFFNESS * np.outer(b, b))
    times = dt * np.arange(round(DURATION / dt) + 1)
    q, v = np.zeros(n + 1), np.zeros(n + 1)
    v[n] = -SPEED * np.sqrt(MASS)
    speeds, at, now, pressed = [np.array([v[n]])], 0.0, 1, True
    while now < len(times):
        squares, shapes = closed if pressed else open_
        turns = np.sqrt(np.maximum(squares, 0.0)), shapes.T @ q, shapes.T @ v
        after = times[now:] - at
        moved, speed = _motion(*turns, after)
        wrong = np.flatnonzero(((b @ shapes @ moved) < 0) == pressed)
        until = int(wrong[0]) if len(wrong) else len(after)
        speeds.append((shapes @ speed[:, :until])[n])
        if until == len(after):
            break
        start = after[until - 1] if until else 1e-6 * dt
        root = brentq(_penetration, start, after[until], args=(b @ shapes, *turns), xtol=1e-18)
        q, v = (shapes @ found[:, 0] for found in _motion(*turns, np.array([root])))
        at, now, pressed = at + root, now + until, not pressed
    return Course(np.diff(np.sqrt(MASS) * np.concatenate(speeds)) / dt, dt, 0.0)


def _motion(turn: Array, start: Array, rate: Array, times: Array) -> tuple[Array, Array]:
    """Free motion and velocity (modes, times) of oscillators at angular frequencies ``turn``, 0 for a free body."""
    phase, still = np.outer(turn, times), turn[:, None] == 0
    sine = np.where(still, times, np.sin(phase) / np.where(still, 1.0, turn[:, None]))
    moved = start[:, None] * np.cos(phase) + rate[:, None] * sine
    return moved, rate[:, None] * np.cos(phase) - start[:, None] * turn[:, None] * np.sin(phase)


def _penetration(time: float, shares: Array, turn: Array, start: Array, rate: Array) -> float:
    """At one time [m]."""
    return float(shares @ _motion(turn, start, rate, np.array([time]))[0][:, 0])
