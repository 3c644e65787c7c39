"""Rainflow cycles of a stress history, Miner's sum over the cycles of a block, and the life in blocks.

A new criterion is a frozen dataclass derived from `MeanStress` with a ``name``; its fields without a default must be
fields of `impact.life.strength.Strength`. `mean_stress` finds it by its name, wherever it is defined.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
import scipy
from numpy.typing import ArrayLike
from rainflow import extract_cycles

from impact.greens.base import Array
from impact.life.strength import OWN, LifeError, Strength, criterion
from impact.march.loop.compiled import compiled
from impact.notices import Advice
from impact.quantities import brief


@dataclass(frozen=True, repr=False)
class Cycles:
    """(m,) cycles of one block: ``ranges`` smax - smin and ``means`` (smax + smin)/2 [Pa], and ``counts`` of each."""

    ranges: Array
    means: Array
    counts: Array

    __repr__ = brief


def reversals(history: ArrayLike) -> Array:
    """Return the (r,) turning points of an (n,) history [Pa], both ends included; equal neighbours count once.

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
    """Return the (r,) turning points of the periodically repeated history, over one period from its highest peak on.

    Raises:
        LifeError: as `reversals`.
    """
    points = reversals(history)
    top = int(points.argmax())
    return reversals(np.concatenate([points[top:], points[: top + 1]]))


def rainflow(history: ArrayLike, *, repeated: bool = True) -> Cycles:
    """Return the rainflow cycles of a stress history.

    Of three consecutive turning points with ranges Y, X, Y is a cycle where X >= Y. A ``repeated`` history begins at
    its highest peak, so that all cycles are whole; the four-point method on its doubled residue gives the same.
    Otherwise ranges that contain the first point, and those of the residue, are half cycles, in their order.

    Args:
        history: (n,) stress of one block [Pa].
        repeated: whether the block repeats periodically, as over revolutions.

    Raises:
        LifeError: as `reversals`.

    Source: ASTM E1049-85, 5.4.4 (simple) and 5.4.5 (repeating histories), by the package `rainflow`.
    """
    if repeated:
        return Cycles(*count_cycles(from_peak(history)))
    cycles = [cycle[:3] for cycle in extract_cycles(reversals(history))]
    ranges, means, counts = np.array(cycles, dtype=float).reshape(-1, 3).T
    return Cycles(ranges, means, counts)


def count_cycles(points: Array) -> tuple[Array, Array, Array]:
    """Return the ranges, means and counts of the cycles of turning points that begin and end at the highest one.

    The rule of the package `rainflow` in a compiled loop, some hundred times as fast: maps have millions of points.
    """
    ranges, means = _whole_cycles(points)
    return ranges, means, np.ones(len(ranges))


@compiled()
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
    """A criterion for the effect of the mean stress of a cycle on its damage."""

    name: ClassVar[str]

    @abstractmethod
    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        """Return the (...,) equivalent fully reversed amplitudes [Pa] of cycles with amplitudes >= 0 and means [Pa];
        ``inf``: immediate failure."""

    @abstractmethod
    def convert_to_ratio(self, equivalent: Array, slant: float) -> Array:
        """Return (...,) amplitudes S [Pa] that are equivalent where the mean is slant S, slant = (1 + R)/(1 - R)."""

    @property
    def breaks_at(self) -> float:
        """Return the least mean stress at which any cycle means immediate failure [Pa]."""
        return math.inf


def _over(stress: Array, reserve: Array) -> Array:
    """Return ``stress``/``reserve``, ``inf`` where the reserve is not positive."""
    return np.asarray(np.divide(stress, reserve, out=np.full(np.shape(reserve), np.inf), where=reserve > 0))


class _Straight(MeanStress):
    """sa/(1 - sm/limit), a straight line in Haigh's diagram; ``inf`` for mean stresses from the limit on."""

    compression: bool

    def equivalent(self, amplitude: Array, mean: Array) -> Array:
        return _over(amplitude, 1 - (mean if self.compression else np.maximum(mean, 0.0)) / self.breaks_at)

    def convert_to_ratio(self, equivalent: Array, slant: float) -> Array:
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
        fatigue_strength: sf', the amplitude with 1/2 cycle to failure [Pa].

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

    def convert_to_ratio(self, equivalent: Array, slant: float) -> Array:
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

    def convert_to_ratio(self, equivalent: Array, slant: float) -> Array:
        return np.asarray(equivalent / (1 + slant) ** (1 - self.walker_exponent))


@dataclass(frozen=True)
class Walker(_Power):
    """smax^(1 - gamma) sa^gamma, smax = sm + sa; no damage where smax <= 0.

    Attributes:
        walker_exponent: gamma, a measured ratio; 1 neglects the mean stress, 1/2 is Smith, Watson and Topper's.

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


_STEEPEST = 700.0  # largest |log(blocks D)| in the search for a margin; zero and infinite damage are clipped to it
_WIDEST = 1e12  # largest stress in that search over the first stress of the S-N curve, and first over smallest


def damage(cycles: Cycles, strength: Strength, judge: MeanStress, *, survival: float = OWN) -> float:
    """Return the damage of one block, D = sum n_i / N(S_i); ``inf`` where a mean stress breaks the part.

    S_i is the amplitude at the loading ratio of the S-N curve that is equivalent to the cycle with its mean stress by
    the criterion ``judge``. ``survival``: fraction of the parts that survive, by default that of the curve. Raises
    `LifeError` without a curve, or for another survival if the scatter of the curve is unknown.

    Source: M. A. Miner, J. Appl. Mech. 12 (1945) A159.
    """
    [curve] = strength.needed("a life", "curve")
    amplitudes = judge.equivalent(cycles.ranges / 2, cycles.means)
    slant = (1 + strength.loading_ratio) / (1 - strength.loading_ratio)
    finite = np.isfinite(amplitudes)
    amplitudes[finite] = judge.convert_to_ratio(amplitudes[finite], slant)
    with np.errstate(divide="ignore", over="ignore"):
        return float(np.sum(cycles.counts / curve.life(amplitudes, survival)))


def margin(
    cycles: Cycles,
    strength: Strength,
    judge: MeanStress,
    *,
    blocks: float,
    survival: float = OWN,
) -> float:
    """Return the factor f on all stresses, amplitudes and means, with which ``blocks`` D(f) = 1; ``inf`` where nothing
    fails.

    D grows with f, so that there is one root, or one jump (endurance limit, mean stress of immediate failure), which is
    then the margin. ``blocks``: design number of repetitions, > 0; other arguments as in `damage`. Raises `LifeError`
    as `damage`, and for a number of blocks that is not positive and finite.
    """
    if not (math.isfinite(blocks) and blocks > 0):
        raise LifeError(f"blocks = {blocks:g}, the design number of repetitions, must be positive and finite")

    [curve] = strength.needed("a life", "curve")
    largest = float((np.abs(cycles.means) + cycles.ranges / 2).max(initial=0.0))
    if largest == 0.0:
        return math.inf
    ranges, means = cycles.ranges / largest, cycles.means / largest

    def excess(exponent: float) -> float:
        """Return log(blocks D) with the stresses scaled to a largest of e^exponent times the curve's first stress."""
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
    """The effect of repeated blocks on one point.

    Attributes:
        damage: damage of one block by Miner's sum; 1 is failure.
        blocks: number of blocks to failure, 1/damage.
        margin: factor on all stresses with which the part fails just at the end of the design number of blocks.
        survival: fraction of parts for which this holds.
        advice: warnings of stresses that mean immediate failure.
    """

    damage: float
    blocks: float
    margin: float
    survival: float
    advice: tuple[Advice, ...] = ()


UNSTRESSED: Final = Life(0.0, math.inf, math.inf, math.nan)
"""The life of a part without stress."""


def life(
    cycles: Cycles,
    strength: Strength,
    judge: MeanStress,
    *,
    blocks: float,
    survival: float = OWN,
) -> Life:
    """Return `damage` and `margin`, a factor on the stress, with advice; arguments and errors are as in `margin`."""
    [curve] = strength.needed("a life", "curve")
    sum_ = damage(cycles, strength, judge, survival=survival)
    spare = margin(cycles, strength, judge, blocks=blocks, survival=survival)
    share = curve.survival if math.isnan(survival) else survival
    return Life(sum_, math.inf if sum_ == 0 else 1 / sum_, spare, share, tuple(_advice(cycles, strength, judge)))


def _advice(cycles: Cycles, strength: Strength, judge: MeanStress) -> Iterator[Advice]:
    mean = float(cycles.means.max(initial=-math.inf))
    largest = float((cycles.means + cycles.ranges / 2).max(initial=-math.inf))
    remedy = "the part breaks in the first block: lower the stress"
    if mean >= judge.breaks_at:
        yield Advice("mean_stress", mean, judge.breaks_at, f"no cycle survives that mean, says {judge.name}", remedy)
    if largest >= strength.ultimate:
        yield Advice("largest_stress", largest, strength.ultimate, "it is above the tensile strength", remedy)
