"""Euler-Bernoulli cantilever reed in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impact.beams.euler_bernoulli import EulerBernoulliBeam
from impact.beams.modes import clamped_curvature
from impact.greens.base import Array


@dataclass(frozen=True)
class Cantilever(EulerBernoulliBeam):
    """Uniform clamped-free beam of rectangular section, bending about its thin side (all SI).

    EI w'''' + rho A w'' = p, w = w' = 0 at x = 0, M = Q = 0 at x = length.
    """

    family: ClassVar[str] = "cantilever"

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L: roots of cos x cosh x = -1 by Newton on cos x + 1/cosh x."""
        k = np.arange(1, n_modes + 1)
        x = (k - 0.5) * np.pi
        x[0] = 1.875
        for _ in range(8):
            sech = 1 / np.cosh(np.minimum(x, 700.0))
            x = x + (np.cos(x) + sech) / (np.sin(x) + sech * np.tanh(x))
        return np.asarray(x)

    def end_condition(self, k: Array) -> Array:
        """Return s = (sinh k - sin k)/(cosh k + cos k); the shapes are 2 (-1)^(n+1)/sqrt(mass) at the tip."""
        growth = np.exp(-k)
        return np.asarray(2 * (growth + np.cos(k) + np.sin(k)) / (1 + growth**2 + 2 * growth * np.cos(k)))

    def curvatures(self, n_modes: int, x: ArrayLike) -> Array:
        """Return the (n, ...) second derivatives of the mode shapes at ``x`` [1/(m^2 sqrt(kg))]; 2 (k_n/L)^2/sqrt(mass)
        at 0."""
        k, xi = self.wave_numbers(n_modes), self.relative(x)
        squares = np.reshape((k / self.length) ** 2, (-1, *[1] * xi.ndim))
        return squares * self._on_modes(clamped_curvature, k, xi)
