"""Euler-Bernoulli cantilever with a point mass at its tip, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from impact.beams.euler_bernoulli import EulerBernoulliBeam
from impact.beams.modes import bisected, positive
from impact.greens.base import Array


@dataclass(frozen=True)
class TipMassCantilever(EulerBernoulliBeam):
    """`Cantilever` with the point mass ``tip_mass`` [kg] at x = length:  EI w''' = tip_mass * w'' (in time) there.

    Frequency equation, mu = tip_mass/(rho A L):  1 + cos k cosh k + mu k (cos k sinh k - sin k cosh k) = 0.

    Source: Blevins, Formulas for Natural Frequency and Mode Shape, beams with concentrated masses; derived here.
    """

    tip_mass: float

    family: ClassVar[str] = "tip-mass cantilever"

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self.family, "tip_mass", self.tip_mass)

    @property
    def mass_ratio(self) -> float:
        """Return mu = tip_mass/(rho A L)."""
        return self.tip_mass / self.mass

    @property
    def end_mass(self) -> float:
        """Return the tip mass [kg]."""
        return self.tip_mass

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L, one between each clamped-pinned root (mu = inf) and clamped-free root (mu = 0), by
        bisection."""
        n = np.arange(n_modes)
        mu = self.mass_ratio

        def past(k: Array) -> NDArray[np.bool_]:
            sech = 1 / np.cosh(np.minimum(k, 700.0))
            return np.asarray((np.cos(k) + sech + mu * k * (np.cos(k) * np.tanh(k) - np.sin(k))) * (-1.0) ** n < 0)

        # clamped-pinned roots lie at most 4e-4 below (n + 1/4) pi, clamped-free ones within 0.31 of (n + 1/2) pi
        low = np.where(n == 0, 0.0, (n + 0.2495) * np.pi)
        return bisected(past, low, (n + 0.5) * np.pi + 0.31)

    def end_condition(self, k: Array) -> Array:
        """Return s = (cosh k + cos k)/(sinh k + sin k): no moment at the tip."""
        return np.asarray((np.sin(k) - np.cos(k) - np.exp(-k)) / _sines(k))

    def modal_mass(self, k: Array) -> Array:
        """Return the (n,) rho A L/4 ((1 + mu) w^2 + 2 mu w w') [kg], w and w' = dw/d(x/L) at the tip; the tip mass
        included."""
        growth, ratio, denominator, mu = np.exp(-k), self.end_condition(k), _sines(k), self.mass_ratio
        # tip: 2 (cosh k sin k - cos k sinh k)/(sinh k + sin k); by the frequency equation no digits go for large mu k
        direct = (1 + growth**2) / 2 * np.sin(k) - (1 - growth**2) / 2 * np.cos(k)
        by_mass = (growth + (1 + growth**2) / 2 * np.cos(k)) / (mu * k)
        tip = 2 * np.where(mu * k > 1, by_mass, direct) / denominator
        slope = k * (-growth + ratio * (1 + growth**2) / 2 + np.sin(k) + (1 - ratio * growth) * np.cos(k))
        return np.asarray(self.mass / 4 * ((1 + mu) * tip**2 + 2 * mu * tip * slope))


def _sines(k: Array) -> Array:
    """Return (sinh k + sin k) exp(-k)."""
    return np.asarray((1 - np.exp(-2 * k)) / 2 + np.exp(-k) * np.sin(k))
