"""The impact by scikit-fem and SciPy alone, as one would write it oneself: forms, a factorization, Newmark's rule."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from benchmarks.peers.impact_scene import DURATION, MASS, SPEED, STIFFNESS, Array

NAME = "scikit-fem and SciPy"


def stepping(K: Any, M: Any, b: Array, dt: float) -> tuple[Any, Array]:
    """SuperLU of M + dt^2/4 K, and what it makes of the patch's vector."""
    factor = splu((M + dt**2 / 4 * K).tocsc())
    return factor, factor.solve(b)


def newmark(K: Any, b: Array, dt: float, factor: Any, pushed: Array) -> Array:
    """Force at the end of each step [N], by the trapezoidal rule: that of the spring is one scalar equation."""
    u, v, a = np.zeros((3, len(b)))
    mass_at, mass_v, mass_a = 0.0, -SPEED, 0.0
    yielding = dt**2 / 4 * (b @ pushed + 1 / MASS)
    out = np.empty(round(DURATION / dt))
    for k in range(len(out)):
        u, v = u + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        mass_at, mass_v = mass_at + dt * mass_v + dt**2 / 4 * mass_a, mass_v + dt / 2 * mass_a
        a = factor.solve(-(K @ u))
        closed = b @ (u + dt**2 / 4 * a) - mass_at
        force = STIFFNESS * max(0.0, closed) / (1 + STIFFNESS * yielding)
        a, mass_a = a - force * pushed, force / MASS
        u, v = u + dt**2 / 4 * a, v + dt / 2 * a
        mass_at, mass_v = mass_at + dt**2 / 4 * mass_a, mass_v + dt / 2 * mass_a
        out[k] = force
    return out


class Diagonal:
    """A diagonal matrix and its factorization, which `newmark` takes for modes."""

    def __init__(self, values: Array) -> None:
        self.values = values

    def solve(self, right: Array) -> Array:
        """Its quotient."""
        return right / self.values

    def __matmul__(self, right: Array) -> Array:
        return self.values * right


def by_modes(squares: Array, shares: Array, dt: float) -> Array:
    """The same by modes alone, nothing for those left out; their ``squares`` of angular frequencies."""
    factor = Diagonal(1 + dt**2 / 4 * squares)
    return newmark(Diagonal(squares), shares, dt, factor, factor.solve(shares))
