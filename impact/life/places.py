"""Where a part fails first: maps of many points, critical planes, and the worst of named places."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.life.damage import Cycles, Life, MeanStress, life, rainflow
from impact.life.multiaxial import Multiaxial
from impact.life.strength import LifeError, Strength
from impact.quantities import brief

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


SAME: Final = 1e-4
"""Share of a stress's largest distance from its mean: turns that move no plane's stress by more decide no life."""
_SPAN, _PARTS = (
    256,
    4,
)  # steps that are looked at together, and the parts into which they fall where they are not straight
_NORM: Final = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # of the squares of a tensor's components


def thinned(stress: Array) -> Array:
    """Return the (m, 6) rows of an (n, 6) history that decide its life, in their order, both ends among them.

    A row is left out that lies within `SAME` of the straight line between its neighbours kept, in the norm of tensors.
    Every normal stress and pressure, and the smallest sphere around the path, keep their extremes to that: they take
    them at corners. Steps are shorter than a mode's period by hundreds, so that some hundredth of the rows is kept.
    """
    if stress.ndim != 2 or len(stress) <= _SPAN:
        return stress
    kept, starts, span = np.ones(len(stress), dtype=bool), np.arange(0, len(stress) - _SPAN, _SPAN), _SPAN
    courses = np.ascontiguousarray(stress.T)
    allowed = SAME**2 * float((_NORM @ (courses - courses.mean(axis=1, keepdims=True)) ** 2).max())
    while span > 1:
        rows = starts[:, None] + np.arange(1, span)
        share, squared = np.arange(1, span) / span, np.zeros(rows.shape)
        for weight, course in zip(_NORM, courses, strict=True):
            first, last = course[starts][:, None], course[starts + span][:, None]
            squared += weight * (course[rows] - first - share * (last - first)) ** 2
        straight = squared.max(axis=1, initial=0.0) <= allowed
        kept[rows[straight]] = False
        span //= _PARTS
        starts = (starts[~straight, None] + span * np.arange(_PARTS)).ravel()
    return np.asarray(stress[kept])


APART: Final = 10.0
"""Degrees between normals: one half of that off loses 1 - cos^2 = 0.8 % of the stress; along the axes nothing."""
_HELD: Final = 16  # planes at once


def normal_stresses(name: str, stress: Array) -> Iterator[tuple[str, Array]]:
    """Yield a place with the (n,) normal stress n' sigma n in time on each plane that may be critical, > 0 in tension
    [Pa].

    The normals are spread over half the sphere, from the principal axes of the stress that is furthest from the mean:
    proportional stress is judged along its own axes, exactly. Planes are passed over on which neither the range nor
    twice the largest tension reaches `SHARE` of the largest of all planes. ``stress``: (n, 6) of one block, xx, yy, zz,
    yz, xz, xy [Pa]; raises `LifeError` for another shape and for values that are not finite.
    """
    if stress.ndim != 2 or stress.shape[1] != 6 or not len(stress):
        raise LifeError(f"{name}: a history of stress tensors must be (n, 6), not {stress.shape}")
    if not np.isfinite(stress).all():
        raise LifeError(f"{name}: the stress history must be finite, {np.sum(~np.isfinite(stress))} values are not")
    turns = stress - stress.mean(axis=0)
    furthest = turns[int(np.argmax(turns**2 @ _NORM))]
    axes = np.linalg.eigh(furthest[[[0, 5, 4], [5, 1, 3], [4, 3, 2]]])[1]
    x, y, z = (_normals() @ axes.T).T
    across = np.stack([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y])
    parts = [np.arange(first, min(first + _HELD, len(x))) for first in range(0, len(x), _HELD)]
    tops, spans = [], []
    for part in parts:
        projected = stress @ across[:, part]
        tops.append(projected.max(axis=0))
        spans.append(tops[-1] - projected.min(axis=0))
    reach = np.stack([np.concatenate(spans), np.maximum(2 * np.concatenate(tops), 0.0)])  # range, twice the tension
    near = (reach >= SHARE * reach.max(axis=1, keepdims=True)).any(axis=0)
    for plane in np.flatnonzero(near):
        yield name, stress @ across[:, plane]


def on_planes(histories: Iterable[tuple[str, Array]], *, tensors: bool = False) -> Iterator[tuple[str, Array]]:
    """Yield named histories of one axis as they are, and in place of tensors, or beside them, their
    `normal_stresses`."""
    for name, history in histories:
        if history.ndim == 1:
            yield name, history
        else:
            yield from normal_stresses(name, history)
            yield from [(name, history)] if tensors else []


@cache
def _normals() -> Array:
    """Return the (N, 3) normals over half the sphere, the three axes among them; opposite normals are one plane."""
    normals = [(0.0, 0.0, 1.0)]
    for polar in np.radians(np.arange(APART, 90.0 + APART / 2, APART)):
        turn = math.tau if polar < math.pi / 2 - 1e-9 else math.pi
        count = 2 * math.ceil(turn / 2 * math.sin(polar) / math.radians(APART) - 1e-9)
        for angle in turn * np.arange(count) / count:
            normals.append((math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle), math.cos(polar)))
    return np.array(normals)


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


def margin_error(margin: float, bar: float) -> float:
    """Return the error bar of a margin of stresses that are known to the share ``bar``: a margin of f at stress 1 is
    f/(1 + b) at 1 + b, exactly, and the larger deviation is the one below, f b/(1 - b); ``inf`` from b = 1 on."""
    return margin * bar / (1 - bar) if bar < 1 else math.inf
