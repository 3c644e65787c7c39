"""Euler-Bernoulli beam clamped at both ends, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from impact.beams.euler_bernoulli import EulerBernoulliBeam
from impact.beams.modes import bisected
from impact.greens.base import Array


@dataclass(frozen=True)
class ClampedClamped(EulerBernoulliBeam):
    """Uniform beam of rectangular section, w = w' = 0 at x = 0 and x = length (all SI)."""

    family: ClassVar[str] = "clamped-clamped beam"

    @property
    def free_point(self) -> float:
        """Return the middle [m]."""
        return self.length / 2

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L: roots of cos x cosh x = 1 near (n + 1/2) pi, by bisection of cos x - 1/cosh x."""
        n = np.arange(1, n_modes + 1)
        centre = (n + 0.5) * np.pi

        def past(k: Array) -> NDArray[np.bool_]:
            return np.asarray((np.cos(k) - 1 / np.cosh(np.minimum(k, 700.0))) * (-1.0) ** n < 0)

        return bisected(past, centre - 0.5, centre + 0.5)

    def end_condition(self, k: Array) -> Array:
        """Return s = (cosh k - cos k)/(sinh k - sin k)."""
        growth = np.exp(-k)
        denominator = (1 - growth**2) / 2 - growth * np.sin(k)  # (sinh k - sin k) exp(-k)
        return np.asarray((np.cos(k) - np.sin(k) - growth) / denominator)

    def compliance(self, x: float, load: float) -> float:
        """Return a^2 c^2 (3 b L - a (3 b + c))/(6 EI L^3) [m/N], a <= b the distances from the clamp, c = L - b."""
        a, b = sorted((x, load))
        c = max(self.length - b, 0.0)
        return a**2 * c**2 * (3 * b * self.length - a * (3 * b + c)) / (6 * self.rigidity * self.length**3)
