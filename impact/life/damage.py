"""Rainflow cycles of a stress history, Miner's sum over the cycles of a block, and the life in blocks.

To add a criterion: a frozen dataclass that is a `MeanStress`, with its ``name``; its fields without a default are
fields of `impact.life.strength.Strength`. `mean_stress` finds it by its name, wherever it is defined.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy
from numba import njit
from numpy.typing import ArrayLike
from rainflow import extract_cycles

from impact.greens.base import Array
from impact.life.strength import LifeError, Strength, criterion
from impact.notices import Advice
from impact.quantities import brief


@dataclass(frozen=True, repr=False)
class Cycles:
    """The m cycles of one block: ``ranges`` smax - smin, ``means`` (smax + smin)/2 [Pa] and ``counts``, each (m,)."""

    ranges: Array
    means: Array
    counts: Array

    __repr__ = brief


def reversals(history: ArrayLike) -> Array:
    """Return the (r,) turning points of an (n,) history [Pa], including its ends; equal neighbours count once.

    Raises:
        LifeError: no values, or some that are not finite.
    """
    values = np.asarray(history, dtype=float)
    if values.ndim != 1 or not values.size:
        raise LifeError(f"a stress history is one row of values, at least one, not an array {values.shape}")
    if not np.isfinite(values).all():
        raise LifeError(f"the stress history must be finite, {np.sum(~np.isfinite(values))} values are not")
    steps = np.diff(values)
    moving = steps != 0
    if not moving.all():
        values, steps = values[np.append(True, moving)], steps[moving]
    rising = steps > 0
    turns = np.ones(len(values), dtype=bool)
    np.not_equal(rising[1:], rising[:-1], out=turns[1:-1])
    return values[turns]


def from_peak(history: ArrayLike) -> Array:
    """Return the (r,) turning points [Pa] of the periodic history, from its highest peak to the next one.

    Raises:
        LifeError: as in `reversals`.
    """
    points = reversals(history)
    top = int(points.argmax())
    return reversals(np.concatenate([points[top:], points[: top + 1]]))


def rainflow(history: ArrayLike, *, repeated: bool = True) -> Cycles:
    """Return the cycles of a history by rainflow counting.

    For three consecutive turning points with ranges Y, X, Y is a cycle if X >= Y. A ``repeated`` history begins at its
    highest peak and has full cycles only; the four-point method with the residue repeated gives the same. Otherwise
    ranges that contain the beginning, and those remaining at the end, are half cycles, in their order.

    Args:
        history: (n,) stress, one block [Pa].
        repeated: whether the block is repeated endlessly.

    Raises:
        LifeError: as in `reversals`.

    Source: ASTM E1049-85, 5.4.4 (simple) and 5.4.5 (repeating histories), by the package `rainflow`.
    """
    if repeated:
        return Cycles(*counted(from_peak(history)))
    cycles = [cycle[:3] for cycle in extract_cycles(reversals(history))]
    ranges, means, counts = np.array(cycles, dtype=float).reshape(-1, 3).T
    return Cycles(ranges, means, counts)


def counted(points: Array) -> tuple[Array, Array, Array]:
    """Return the ranges, means and counts of turning points that begin and end at the highest one.

    It is the rule of the package `rainflow` in a compiled loop, about a hundred times as fast, for maps of many points.
    """
    ranges, means = _whole_cycles(points)
    return ranges, means, np.ones(len(ranges))


@njit(cache=True)
def _whole_cycles(points):  # type: ignore[no-untyped-def]
    stack = np.empty(len(points))
    ranges, means = np.empty(len(points) // 2), np.empty(len(points) // 2)
    depth, count = 0, 0
    for value in points:
        stack[depth] = value
        depth += 1
        while depth >= 3 and abs(value - stack[depth - 2]) >= abs(stack[depth - 2] - stack[depth - 3]):
            ranges[count] = abs(stack[depth - 2] - stack[depth - 3])
            means[count] = 0.5 * (stack[depth - 2] + stack[depth - 3])
            count += 1
            depth -= 2
            stack[depth - 1] = value
    return ranges[:count], means[:count]


class MeanStress(ABC):
    """A mean-stress criterion."""

    name: ClassVar[str]

    @abstractmethod
    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        """Return the (...,) equivalent fully reversed amplitudes [Pa] of cycles with amplitudes >= 0 and means [Pa];
        ``inf`` for static failure."""

    @abstractmethod
    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        """Return the (...,) amplitudes S [Pa] that are equivalent at the mean slant S, slant = (1 + R)/(1 - R)."""

    @property
    def breaks_at(self) -> float:
        """Return the mean stress of static failure [Pa]."""
        return math.inf


def _over(stress: Array, factor: Array) -> Array:
    """Return stress/factor, ``inf`` where the factor is not positive."""
    return np.asarray(np.divide(stress, factor, out=np.full(np.shape(factor), np.inf), where=factor > 0))


class _Straight(MeanStress):
    """sa/(1 - sm/limit): a straight line in Haigh's diagram; ``inf`` for means at or above the limit."""

    compression: bool

    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        return _over(amplitude, 1 - (mean if self.compression else np.maximum(mean, 0.0)) / self.breaks_at)

    def at_ratio(self, equivalent: Array, slant: float) -> Array:
        pull = slant if self.compression else max(slant, 0.0)
        return _over(equivalent, 1 + equivalent * pull / self.breaks_at)


@dataclass(frozen=True)
class Goodman(_Straight):
    """sa/(1 - sm/UTS); a compressive mean has no effect unless ``compression`` is set.

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
    """sa/(1 - sm/sf'); a compressive mean has no effect unless ``compression`` is set.

    Attributes:
        fatigue_strength: sf', the amplitude at 1/2 cycle to failure [Pa].

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
        walker_exponent: gamma, a measured ratio; 1: no effect of the mean, 1/2: Smith, Watson and Topper.

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


_STEEPEST = 700.0  # bound on |log(damage)| in the search for a margin
_WIDEST = 1e12  # largest stress in that search, over the first stress of the curve; its inverse is the smallest


def damage(cycles: Cycles, strength: Strength, judge: MeanStress, *, survival: float | None = None) -> float:
    """Return the damage of one block, D = sum n_i / N(S_i); ``inf`` for static failure.

    S_i is the amplitude at the loading ratio of the S-N curve that is equivalent to the cycle by the mean-stress
    criterion ``judge``. ``survival``: fraction of parts that survives; ``None``: that of the curve. Raises `LifeError`
    without a curve, or for another survival without scatter.

    Source: M. A. Miner, J. Appl. Mech. 12 (1945) A159.
    """
    [curve] = strength.needed("a life", "curve")
    amplitudes = judge.equivalent(cycles.ranges / 2, cycles.means)
    slant = (1 + strength.loading_ratio) / (1 - strength.loading_ratio)
    lasting = np.isfinite(amplitudes)
    amplitudes[lasting] = judge.at_ratio(amplitudes[lasting], slant)
    with np.errstate(divide="ignore", over="ignore"):
        return float(np.sum(cycles.counts / curve.life(amplitudes, survival)))


def margin(
    cycles: Cycles,
    strength: Strength,
    judge: MeanStress,
    *,
    blocks: float,
    survival: float | None = None,
) -> float:
    """Return the factor f on all stresses, amplitudes and means, with which ``blocks`` D(f) = 1; ``inf`` if no factor
    causes failure.

    D increases with f, so that there is one root, or one jump (endurance limit, static failure), which is then the
    margin. ``blocks``: design number of repetitions, > 0; other arguments and errors as in `damage`, and `LifeError`
    for a number of blocks that is not positive and finite.
    """
    if not (math.isfinite(blocks) and blocks > 0):
        raise LifeError(f"blocks = {blocks:g}, the design number of repetitions, must be positive and finite")

    [curve] = strength.needed("a life", "curve")
    largest = float((np.abs(cycles.means) + cycles.ranges / 2).max(initial=0.0))
    if largest == 0.0:
        return math.inf
    ranges, means = cycles.ranges / largest, cycles.means / largest

    def excess(exponent: float) -> float:
        """Return log(blocks D), the largest stress being e^exponent times the curve's first."""
        level = curve.stresses[0] * math.exp(exponent)
        sum_ = damage(Cycles(level * ranges, level * means, cycles.counts), strength, judge, survival=survival) * blocks
        return float(np.clip(math.log(sum_) if sum_ > 0 else -_STEEPEST, -_STEEPEST, _STEEPEST))

    reach = math.log(_WIDEST)
    if excess(reach) < 0:
        return math.inf
    if excess(-reach) > 0:
        return 0.0
    root = float(scipy.optimize.brentq(excess, -reach, reach, xtol=1e-13, rtol=1e-14))
    return float(curve.stresses[0] * math.exp(root) / largest)


@dataclass(frozen=True)
class Life:
    """Fatigue life at one point under repeated blocks.

    Attributes:
        damage: damage of one block, by Miner's sum; 1 is failure.
        blocks: number of blocks to failure, 1/damage.
        margin: factor on all stresses with which the part fails at the design number of blocks.
        survival: fraction of parts for which this holds.
        advice: warnings of stresses that cause static failure.
    """

    damage: float
    blocks: float
    margin: float
    survival: float
    advice: tuple[Advice, ...] = ()


def life(
    cycles: Cycles,
    strength: Strength,
    judge: MeanStress,
    *,
    blocks: float,
    survival: float | None = None,
) -> Life:
    """Return `damage`, `margin` (a factor on the stress) and advice together; arguments and errors as in these."""
    [curve] = strength.needed("a life", "curve")
    sum_ = damage(cycles, strength, judge, survival=survival)
    spare = margin(cycles, strength, judge, blocks=blocks, survival=survival)
    share = curve.survival if survival is None else survival
    return Life(sum_, math.inf if sum_ == 0 else 1 / sum_, spare, share, tuple(_advice(cycles, strength, judge)))


def _advice(cycles: Cycles, strength: Strength, judge: MeanStress) -> Iterator[Advice]:
    mean = float(cycles.means.max(initial=-math.inf))
    largest = float((cycles.means + cycles.ranges / 2).max(initial=-math.inf))
    remedy = "the part breaks in the first block: lower the stress"
    if mean >= judge.breaks_at:
        yield Advice("mean_stress", mean, judge.breaks_at, f"no cycle survives that mean, says {judge.name}", remedy)
    if strength.ultimate is not None and largest >= strength.ultimate:
        yield Advice("largest_stress", largest, strength.ultimate, "it is above the tensile strength", remedy)
