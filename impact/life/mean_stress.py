"""Fully reversed amplitudes that are as damaging as cycles with a mean stress.

To add a criterion: a frozen dataclass that is a `MeanStress`, with its ``name``; its fields without a default are
fields of `impact.life.strength.Strength`. `mean_stress` finds it by its name, wherever it is defined.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from impact.greens.base import Array
from impact.life.strength import Strength, criterion


class MeanStress(ABC):
    """The effect of a mean stress on an amplitude, by one criterion."""

    name: ClassVar[str]

    @abstractmethod
    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        """Return the (...,) fully reversed amplitudes [Pa] of cycles with amplitudes >= 0 and means [Pa]; ``inf``: it
        breaks."""

    @abstractmethod
    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        """Return (...,) amplitudes S [Pa] that are equivalent where the mean is slant S, slant = (1 + R)/(1 - R)."""

    @property
    def breaks_at(self) -> float:
        """Return the mean stress that no cycle survives [Pa]."""
        return math.inf


def _over(stress: Array, left: Array) -> Array:
    """Return the quotient, ``inf`` where nothing is left to bear it."""
    return np.asarray(np.divide(stress, left, out=np.full(np.shape(left), np.inf), where=left > 0))


class _Straight(MeanStress):
    """sa/(1 - sm/limit): on a straight line of Haigh's diagram; ``inf`` from the limit on."""

    compression: bool

    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        return _over(amplitude, 1 - (mean if self.compression else np.maximum(mean, 0.0)) / self.breaks_at)

    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        pull = slant if self.compression else max(slant, 0.0)
        return _over(equivalent, 1 + equivalent * pull / self.breaks_at)


@dataclass(frozen=True)
class Goodman(_Straight):
    """sa/(1 - sm/UTS); a compressive mean is no benefit unless ``compression`` is asked for.

    Attributes:
        ultimate: UTS [Pa].

    Source: J. Goodman, Mechanics Applied to Engineering, 1899.
    """

    name: ClassVar[str] = "goodman"
    ultimate: float
    compression: bool = False

    @property
    def breaks_at(self) -> float:
        return self.ultimate


@dataclass(frozen=True)
class Morrow(_Straight):
    """sa/(1 - sm/sf'); a compressive mean is no benefit unless ``compression`` is asked for.

    Attributes:
        fatigue_strength: sf', of cycles to failure 1/2 [Pa].

    Source: J. Morrow, Fatigue properties of metals, in Fatigue Design Handbook, SAE AE-4 (1968), 3.2.
    """

    name: ClassVar[str] = "morrow"
    fatigue_strength: float
    compression: bool = False

    @property
    def breaks_at(self) -> float:
        return self.fatigue_strength


@dataclass(frozen=True)
class Gerber(MeanStress):
    """sa/(1 - (sm/UTS)^2) in tension, sa in compression.

    Attributes:
        ultimate: UTS [Pa].

    Source: W. Gerber, Z. Bayer. Arch. Ing.-Ver. 6 (1874) 101.
    """

    name: ClassVar[str] = "gerber"
    ultimate: float

    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        return _over(amplitude, 1 - (np.maximum(mean, 0.0) / self.ultimate) ** 2)

    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        """Return the positive root of S = e (1 - (slant S/UTS)^2)."""
        pull = 2 * equivalent * max(slant, 0.0) / self.ultimate
        return np.asarray(2 * equivalent / (1 + np.sqrt(1 + pull**2)))

    @property
    def breaks_at(self) -> float:
        return self.ultimate


class _Power(MeanStress):
    """smax^(1 - gamma) sa^gamma; no damage where smax <= 0."""

    walker_exponent: float

    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        largest = np.maximum(amplitude + mean, 0.0)
        both = largest ** (1 - self.walker_exponent) * amplitude**self.walker_exponent
        return np.asarray(np.where(largest > 0, both, 0.0))

    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        return np.asarray(equivalent / (1 + slant) ** (1 - self.walker_exponent))


@dataclass(frozen=True)
class Walker(_Power):
    """smax^(1 - gamma) sa^gamma, smax = sm + sa; no damage where smax <= 0.

    Attributes:
        walker_exponent: gamma, a measured ratio; 1 knows no mean stress, 1/2 is Smith, Watson and Topper's.

    Source: K. Walker, ASTM STP 462 (1970) 1.
    """

    name: ClassVar[str] = "walker"
    walker_exponent: float


@dataclass(frozen=True)
class SmithWatsonTopper(_Power):
    """sqrt(smax sa), smax = sm + sa; no damage where smax <= 0. It needs no constant.

    Source: K. N. Smith, P. Watson and T. H. Topper, J. Materials 5 (1970) 767.
    """

    name: ClassVar[str] = "swt"
    walker_exponent: ClassVar[float] = 0.5  # type: ignore[misc]


def mean_stress(name: str, strength: Strength) -> MeanStress:
    """Return the criterion goodman, gerber, swt, walker or morrow; raises `LifeError` for others, or a missing
    constant."""
    return criterion(MeanStress, name, strength)  # type: ignore[type-abstract]
