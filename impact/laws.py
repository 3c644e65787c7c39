"""Contact laws: force N >= 0 from penetration.

Every law is stepped passively: the force of a step is the law's at the end of the step, N = law(pen_free - W0 N),
which for a convex potential Psi loses energy, never gains it:

    N (pen_end - pen_start) >= Psi(pen_end) - Psi(pen_start).

To add a law: a frozen dataclass with ``code``, ``parameters`` and ``potential`` here, and its branch in
`history.contact_force`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from impact.greens import Array

SIGNORINI, SPRING, HERTZ = 0, 1, 2


class LawError(ValueError):
    """A contact law with an impossible parameter."""


class Law(Protocol):
    """What the solver needs of a law."""

    @property
    def code(self) -> int:
        """Branch of `history.contact_force`."""

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


def _positive(name: str, value: float) -> None:
    if not (value > 0 and math.isfinite(value)):
        raise LawError(f"{name} = {value:g} must be positive and finite")
