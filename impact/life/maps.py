"""Damage and margins of many points: memory holds one block of histories and a number for each point."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from impact.brief import brief
from impact.greens.base import Array
from impact.life.curves import LifeError
from impact.life.cycles import Cycles, rainflow
from impact.life.multiaxial import Multiaxial

SHARE = 0.7
"""Of the hot spot's range: below it, damage by slopes of 5 and more is less than 0.7^5 = 17 % of the hot spot's."""


@dataclass(frozen=True, repr=False)
class PointMap:
    """The effect of cycles on P points.

    Attributes:
        values: (P,) what was asked for; NaN at points that were skipped.
        ranges: (P,) largest stress range of each point [Pa].
        share: points below this share of the largest range were skipped.
    """

    values: Array
    ranges: Array
    share: float

    @property
    def skipped(self) -> int:
        """Return how many points were not counted."""
        return int(np.isnan(self.values).sum())

    __repr__ = brief


def cycle_map(blocks: Iterable[Array], judged: Callable[[Cycles], float], share: float = SHARE) -> PointMap:
    """Return a number for each point by its cycles, where they may matter.

    A point is skipped where its largest range is below ``share`` of the largest of all points, 0 ... 1; 0 skips none.
    Ranges say nothing of means: where means differ much from point to point, take a lower share.

    Args:
        blocks: (p, n) histories of p points at a time, each repeated without end [Pa]; made one after the other.
        judged: of the `Cycles` of one point, as by `impact.life.damage.damage` or `margin`.

    Raises `LifeError`: a share out of its range, a block of another shape, values that are not finite, no points; and
    what ``judged`` raises.
    """
    if not 0 <= share <= 1:
        raise LifeError(f"share = {share:g} of the hot spot's range must lie between 0 and 1")
    ranges: list[float] = []
    values: list[float] = []
    hottest = 0.0
    for block in blocks:
        if block.ndim != 2 or not block.size:
            raise LifeError(f"a block of histories must be (points, times), not {block.shape}")
        reach = np.ptp(block, axis=1)
        if not np.isfinite(reach).all():
            at = len(ranges) + int(np.argmin(np.isfinite(reach)))
            raise LifeError(f"the stresses of the map must be finite, those of point {at} are not")
        hottest = max(hottest, float(reach.max()))
        near = reach >= share * hottest
        values += [judged(rainflow(row)) if hot else np.nan for row, hot in zip(block, near, strict=True)]
        ranges += reach.tolist()
    if not ranges:
        raise LifeError("no points: give the map a block at least")
    point_ranges = np.array(ranges)
    return PointMap(np.where(point_ranges >= share * hottest, values, np.nan), point_ranges, share)


def margin_map(blocks: Iterable[Array], criterion: Multiaxial) -> Array:
    """Return the (P,) margins of points by a criterion of several axes; ``blocks``: (p, n, 6) stress of p points each
    [Pa].

    Raises `LifeError` as the criterion's ``value``, and for no points.
    """
    margins = [criterion.margin(history) for block in blocks for history in block]
    if not margins:
        raise LifeError("no points: give the map a block at least")
    return np.array(margins)
