"""Miner's sum over the cycles of a block, the life in blocks, and how much stress there is to spare."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from impact.advice import Advice
from impact.life.curves import LifeError
from impact.life.cycles import Cycles
from impact.life.mean_stress import MeanStress
from impact.life.strength import Strength

_STEEPEST = 700.0  # of log(damage): further out it is none or infinite
_WIDEST = 1e12  # stresses that are looked at, over the curve's own, and their inverse


@dataclass(frozen=True)
class Life:
    """The effect of repeated blocks on one point.

    Attributes:
        damage: of one block, by Miner's sum; 1 is failure.
        blocks: to failure, 1/damage.
        margin: factor on all stresses with which the part fails just at the end of the design number of blocks.
        survival: the share of parts for which this holds.
        advice: stresses at which the part breaks at once.
    """

    damage: float
    blocks: float
    margin: float
    survival: float
    advice: tuple[Advice, ...] = ()


def damage(cycles: Cycles, strength: Strength, judge: MeanStress, *, survival: float | None = None) -> float:
    """Return the damage of one block, D = sum n_i / N(S_i); ``inf`` where a mean stress breaks the part.

    S_i is the amplitude that is as damaging at the loading ratio of the S-N curve as the cycle is at its mean, by the
    criterion ``judge`` of mean stresses. ``survival``: share of the parts that lives on; ``None``: that of the curve.
    Raises `LifeError` without a curve, or for a survival that it cannot give.

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
    """Return the factor f on all stresses, amplitudes and means, with which ``blocks`` D(f) = 1; ``inf`` where nothing
    fails.

    D grows with f, so that there is one root, or one jump (an endurance limit, a mean that breaks the part) which is
    the margin then. ``blocks``: design number of repetitions, > 0; else as in `damage`. Raises `LifeError` as it does,
    and for a number of blocks that is not positive and finite.
    """
    from scipy.optimize import brentq  # takes long to load, and runs without a life need none

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
    root = float(brentq(excess, -reach, reach, xtol=1e-13, rtol=1e-14))
    return float(curve.stresses[0] * math.exp(root) / largest)


def life(
    cycles: Cycles,
    strength: Strength,
    judge: MeanStress,
    *,
    blocks: float,
    survival: float | None = None,
) -> Life:
    """Return `damage` and `margin`, a factor on the stress, together, and advice; arguments and errors are theirs."""
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
