"""The worst of named places of a part, each with its history of stress: where it fails first, and what is to spare."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from impact.greens.base import Array
from impact.life.curves import LifeError
from impact.life.cycles import Cycles, rainflow
from impact.life.damage import Life, life
from impact.life.maps import SHARE
from impact.life.mean_stress import MeanStress
from impact.life.multiaxial import Multiaxial
from impact.life.strength import Strength


@dataclass(frozen=True)
class Demand:
    """The demand on a part, and the rules by which it is judged.

    Attributes:
        strength: of its material.
        judge: of mean stresses, for stress of one axis; ``None``: there must be none.
        blocks: design number of repetitions, a factor on one block.
        survival: share of parts that lives on; ``None``: that of the S-N curve.
        several_axes: for stress tensors; ``None``: there must be none.
    """

    strength: Strength
    judge: MeanStress | None
    blocks: float
    survival: float | None = None
    several_axes: Multiaxial | None = None


@dataclass(frozen=True)
class Judged:
    """The worst places; ``None`` where no history of that kind was given.

    Attributes:
        at, life: of stress of one axis.
        tensor_at, tensor_margin: of stress of several axes; the margin, a factor on the stress, holds for the N
            of its two limits.
    """

    at: str | None = None
    life: Life | None = None
    tensor_at: str | None = None
    tensor_margin: float | None = None


def judged(histories: Iterable[tuple[str, Array]], demand: Demand) -> Judged:
    """Return where a block of stress that repeats without end leaves the least margin.

    Of stress of one axis, places are passed over where neither the largest range nor the largest range with its mean,
    twice the largest tension, reaches `SHARE` of the largest of all places.

    Args:
        histories: names with (n,) stress of one axis, > 0 in tension, or (n, 6) tensors, xx, yy, zz, yz, xz, xy [Pa];
            each is let go before the next is asked for.
        demand: what has to be endured.

    Raises:
        LifeError: arrays of another shape, values that are not finite, stress for which no criterion is stated;
            what `impact.life.damage.life` raises.
    """
    counted: list[tuple[float, str, Cycles]] = []
    most = 0.0
    tensors: list[tuple[float, str]] = []
    for name, history in histories:
        if history.ndim == 1 and demand.judge is not None:
            cycles = rainflow(history)
            tops = np.concatenate([cycles.ranges, 2 * cycles.means + cycles.ranges])  # ranges, twice the tensions
            if (reach := float(tops.max(initial=0.0))) > most:
                most = reach
                counted = [each for each in counted if each[0] >= SHARE * most]
            if reach >= SHARE * most:
                counted.append((reach, name, cycles))
        elif history.ndim == 1:
            raise LifeError(f"{name}: stress of one axis needs a criterion of mean stress (goodman, ...)")
        elif demand.several_axes is None:
            raise LifeError(f"{name}: stress of several axes needs a criterion for it (crossland, ...)")
        else:
            tensors.append((demand.several_axes.margin(history), name))
    judgement = Judged()
    if counted and demand.judge is not None:
        lives = [
            (name, life(cycles, demand.strength, demand.judge, blocks=demand.blocks, survival=demand.survival))
            for _, name, cycles in counted
        ]
        at, worst = min(lives, key=lambda place: place[1].margin)
        judgement = Judged(at, worst)
    if tensors:
        margin, name = min(tensors)
        judgement = Judged(judgement.at, judgement.life, name, margin)
    return judgement


def left_of(margin: float, bar: float) -> float:
    """Return the error bar of a margin of stresses that are known to the share ``bar``: a margin of f at stress 1 is
    f/(1 + b) at 1 + b, exactly, and the larger deviation is the one below, f b/(1 - b); ``inf`` from b = 1 on."""
    return margin * bar / (1 - bar) if bar < 1 else math.inf
