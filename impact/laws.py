"""Contact laws: force N >= 0 from penetration.

Every law is stepped passively: the force of a step is the law's at the end of the step, N = law(pen_free - W0 N),
which for a convex potential Psi loses energy, never gains it:

    N (pen_end - pen_start) >= Psi(pen_end) - Psi(pen_start).

To add a law: a frozen dataclass with ``code``, ``parameters`` and ``potential`` here, and its branch in
`contact_force`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit

from impact.greens import Array

SIGNORINI, SPRING, HERTZ = 0, 1, 2


class LawError(ValueError):
    """A contact law with an impossible parameter."""


class Law(Protocol):
    """What the solver needs of a law."""

    @property
    def code(self) -> int:
        """Branch of `contact_force`."""

    @property
    def parameters(self) -> tuple[float, float]:
        """Its two numbers."""

    def potential(self, penetration: Array) -> Array:
        """Stored energy Psi [J]."""


@dataclass(frozen=True)
class Signorini:
    """Rigid unilateral contact: gap >= 0, N >= 0, N gap = 0. Source: Signorini 1933."""

    code = SIGNORINI
    parameters = (0.0, 0.0)

    def potential(self, penetration: Array) -> Array:
        """Zero."""
        return np.zeros_like(penetration)


@dataclass(frozen=True)
class LinearSpring:
    """N = k max(0, pen); ``stiffness`` k [N/m]."""

    stiffness: float
    code = SPRING

    def __post_init__(self) -> None:
        _positive("LinearSpring.stiffness", self.stiffness)

    @property
    def parameters(self) -> tuple[float, float]:
        """k."""
        return (self.stiffness, 0.0)

    def potential(self, penetration: Array) -> Array:
        """k pen^2/2."""
        return np.asarray(self.stiffness * np.maximum(penetration, 0.0) ** 2 / 2)


@dataclass(frozen=True)
class Hertz:
    """N = k max(0, pen)^(3/2); ``stiffness`` k [N/m^1.5], (4/3) E* sqrt(R) for a sphere. Source: Hertz 1882."""

    stiffness: float
    code = HERTZ

    def __post_init__(self) -> None:
        _positive("Hertz.stiffness", self.stiffness)

    @property
    def parameters(self) -> tuple[float, float]:
        """k."""
        return (self.stiffness, 0.0)

    def potential(self, penetration: Array) -> Array:
        """(2/5) k pen^(5/2)."""
        return np.asarray(0.4 * self.stiffness * np.maximum(penetration, 0.0) ** 2.5)


@njit(cache=True)
def contact_force(code: int, k: float, pen: float, w0: float) -> float:  # pragma: no cover - compiled
    """The N >= 0 that solves N = law(pen - w0 N); unique because the law does not decrease."""
    if pen <= 0.0:
        return 0.0
    if code == SIGNORINI:
        return pen / w0
    if code == SPRING:
        return k * pen / (1.0 + k * w0)
    return _hertz_force(k, pen, w0)


@njit(cache=True)
def _hertz_force(k: float, pen: float, w0: float) -> float:  # pragma: no cover - compiled
    """Root of k (pen - w0 N)^1.5 - N in [0, pen/w0], by Newton on d = sqrt(pen - w0 N): d^2 + w0 k d^3 = pen.

    The polynomial is increasing and convex for d > 0, so Newton falls monotonically from above. Each term alone gives
    an upper bound; the lower of the two is within a factor of two of the root, whatever the stiffness.
    """
    d = math.sqrt(pen)
    if w0 * k * d > 1.0:
        d = (pen / (w0 * k)) ** (1.0 / 3.0)
    for _ in range(60):
        step = (d * d + w0 * k * d * d * d - pen) / (2.0 * d + 3.0 * w0 * k * d * d)
        d -= step
        if step <= 1e-16 * d:
            break
    return k * d * d * d


def _positive(name: str, value: float) -> None:
    if not (value > 0 and math.isfinite(value)):
        raise LawError(f"{name} = {value:g} must be positive and finite")
