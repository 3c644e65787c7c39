"""Location of the first fatigue failure: critical planes, and the worst of named places."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.life.damage import UNSTRESSED, Cycles, Life, MeanStress, damage, life, rainflow
from impact.life.multiaxial import Multiaxial
from impact.life.strength import OWN, LifeError, Strength

SHARE = 0.7
"""Least stress range, over that of the hot spot, of a place or plane that is evaluated; below it damage is less than
0.7^5 = 17 % of that of the hot spot for slopes of 5 and more."""


STRAIGHT: Final = 1e-4
"""Deviation from a straight path, over the largest distance from the mean, that is neglected."""
_SPAN = 256  # number of steps that are tested for a straight path at once
_PARTS = 4  # number of parts into which they are divided if they are not straight
_NORM: Final = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])  # weights of squared Voigt components in s:s


def thin_history(stress: Array) -> Array:
    """Return the (m, 6) rows of an (n, 6) history that matter for its life, in order, with both ends.

    A row is omitted if it deviates, in the Frobenius norm, by less than `STRAIGHT` from the line between the rows kept.
    To this accuracy the extremes of normal stresses and pressure, and the smallest sphere, remain: they follow from
    corners of the path. As steps are hundreds of times shorter than periods, about a hundredth of the rows is kept.
    """
    if stress.ndim != 2 or len(stress) <= _SPAN:
        return stress
    kept, starts, span = np.ones(len(stress), dtype=bool), np.arange(0, len(stress) - _SPAN, _SPAN), _SPAN
    stressed = stress.any(axis=0)  # in plane stress half of the components are zero
    courses, weights = np.ascontiguousarray(stress.T[stressed]), _NORM[stressed]
    allowed = STRAIGHT**2 * float((weights @ (courses - courses.mean(axis=1, keepdims=True)) ** 2).max())
    while span > 1:
        rows = starts[:, None] + np.arange(1, span)
        share, squared = np.arange(1, span) / span, np.zeros(rows.shape)
        for weight, course in zip(weights, courses, strict=True):
            first, last = course[starts][:, None], course[starts + span][:, None]
            squared += weight * (course[rows] - first - share * (last - first)) ** 2
        straight = squared.max(axis=1, initial=0.0) <= allowed
        kept[rows[straight]] = False
        span //= _PARTS
        starts = (starts[~straight, None] + span * np.arange(_PARTS)).ravel()
    return np.asarray(stress[kept])


APART: Final = 10.0
"""Angle between neighbouring normals [degrees]; at half of it off the critical plane, a stress is 1 - cos^2 = 0.8 %
too small."""
_ALONG_Z: Final = [2, 3, 4]  # Voigt components that are zero in plane stress
_AT_ONCE: Final = 16  # number of planes that are evaluated at once


def normal_stresses(name: str, stress: Array) -> Iterator[tuple[str, Array]]:
    """Yield the ``name`` with the (n,) history of the normal stress n' sigma n on each plane that may be critical, > 0
    in tension [Pa].

    The normals are spread over half the sphere, in plane stress over half the circle. They are aligned with the
    principal axes of the stress furthest from the mean, so that proportional stress is evaluated exactly. Planes are
    skipped on which neither the range nor twice the largest tension reaches `SHARE` of the largest of all planes.
    ``stress``: (n, 6) of one block, xx, yy, zz, yz, xz, xy [Pa]. Raises `LifeError` for another shape and for values
    that are not finite.
    """
    if stress.ndim != 2 or stress.shape[1] != 6 or not len(stress):
        raise LifeError(f"{name}: a history of stress tensors must be (n, 6), not {stress.shape}")
    if not np.isfinite(stress).all():
        raise LifeError(f"{name}: the stress history must be finite, {np.sum(~np.isfinite(stress))} values are not")
    deviations = stress - stress.mean(axis=0)
    furthest = deviations[int(np.argmax(deviations**2 @ _NORM))]
    if stress[:, _ALONG_Z].any():
        axes = np.linalg.eigh(furthest[[[0, 5, 4], [5, 1, 3], [4, 3, 2]]])[1]
        x, y, z = (_normals() @ axes.T).T
    else:  # plane stress: on an inclined plane it is that on a plane parallel to z times the cosine squared
        principal = math.atan2(2 * furthest[5], furthest[0] - furthest[1]) / 2
        angles = principal + np.radians(np.arange(0.0, 180.0, APART))
        x, y, z = np.cos(angles), np.sin(angles), np.zeros(len(angles))
    projections = np.stack([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y])
    parts = [np.arange(first, min(first + _AT_ONCE, len(x))) for first in range(0, len(x), _AT_ONCE)]
    largest, ranges = [], []
    for part in parts:
        normal = stress @ projections[:, part]
        largest.append(normal.max(axis=0))
        ranges.append(largest[-1] - normal.min(axis=0))
    reach = np.stack([np.concatenate(ranges), np.maximum(2 * np.concatenate(largest), 0.0)])  # range, twice the tension
    may_be_critical = (reach >= SHARE * reach.max(axis=1, keepdims=True)).any(axis=0)
    for plane in np.flatnonzero(may_be_critical):
        yield name, stress @ projections[:, plane]


def resolve_on_planes(histories: Iterable[tuple[str, Array]], *, tensors: bool = False) -> Iterator[tuple[str, Array]]:
    """Yield named uniaxial histories unchanged, and of tensors their `normal_stresses`; with ``tensors`` also the
    tensors themselves."""
    for name, history in histories:
        if history.ndim == 1:
            yield name, history
        else:
            yield from normal_stresses(name, history)
            yield from [(name, history)] if tensors else []


@cache
def _normals() -> Array:
    """Return (N, 3) normals over half the sphere, as opposite ones are one plane, the three axes among them."""
    normals = [(0.0, 0.0, 1.0)]
    for polar in np.radians(np.arange(APART, 90.0 + APART / 2, APART)):
        turn = math.tau if polar < math.pi / 2 - 1e-9 else math.pi
        count = 2 * math.ceil(turn / 2 * math.sin(polar) / math.radians(APART) - 1e-9)
        for angle in turn * np.arange(count) / count:
            normals.append((math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle), math.cos(polar)))
    return np.array(normals)


@dataclass(frozen=True)
class Demand:
    """Design life of a part, and the criteria for its evaluation.

    Attributes:
        strength: strength of its material.
        judge: mean-stress criterion for uniaxial stress; ``None`` if there is no such stress.
        blocks: design life as a number of repetitions of the block of stress.
        survival: fraction of parts that survives, by default that of the S-N curve.
        several_axes: criterion for stress tensors; ``None`` if there are none.
    """

    strength: Strength
    judge: MeanStress | None
    blocks: float
    survival: float = OWN
    several_axes: Multiaxial | None = None


@dataclass(frozen=True)
class Judged:
    """The places of least margin; "" and an unlimited life without histories of that kind.

    Attributes:
        at, life: place and life by uniaxial stress.
        tensor_at, tensor_margin: place and margin by stress tensors. The margin is a factor on the stress, for the
            number of cycles of the criterion's two limits.
    """

    at: str = ""
    life: Life = UNSTRESSED
    tensor_at: str = ""
    tensor_margin: float = math.inf


def judged(histories: Iterable[tuple[str, Array]], demand: Demand) -> Judged:
    """Return the places with the least margin under a block of stress that repeats without end.

    Places with uniaxial stress are skipped if neither the largest range nor twice the largest tension reaches `SHARE`
    of the largest of all places.

    Args:
        histories: names with (n,) uniaxial stress, > 0 in tension, or (n, 6) tensors, xx, yy, zz, yz, xz, xy [Pa]; only
            one history is in memory at a time.
        demand: design life and criteria.

    Raises:
        LifeError: arrays of another shape, values that are not finite, stress without a criterion; errors of
            `impact.life.damage.life`.
    """
    counted: list[tuple[float, str, Cycles]] = []
    most = 0.0
    tensors: list[tuple[float, str]] = []
    for name, history in histories:
        if history.ndim == 1 and demand.judge is not None:
            tension = float(history.max(initial=-math.inf))
            reach = max(tension - float(history.min(initial=math.inf)), 2 * tension)  # range, twice the tension
            if history.size and reach < SHARE * most:
                continue
            cycles = rainflow(history)
            if reach > most:
                most = reach
                counted = [each for each in counted if each[0] >= SHARE * most]
            counted.append((reach, name, cycles))
        elif history.ndim == 1:
            raise LifeError(f"{name}: stress of one axis needs a criterion of mean stress (goodman, ...)")
        elif demand.several_axes is None:
            raise LifeError(f"{name}: stress of several axes needs a criterion for it (crossland, ...)")
        else:
            tensors.append((demand.several_axes.margin(history), name))
    judgement = Judged()
    if counted and demand.judge is not None:
        judgement = _weakest(sorted(counted, key=lambda place: -place[0]), demand.judge, demand)
    if tensors:
        margin, name = min(tensors)
        judgement = replace(judgement, tensor_at=name, tensor_margin=margin)
    return judgement


def _weakest(places: Iterable[tuple[float, str, Cycles]], judge: MeanStress, demand: Demand) -> Judged:
    """Return the first of the places (reach, name, cycles) with the least margin.

    As damage grows with stress, the margin of a place is computed only if the place, with its stress times the least
    margin so far, would not endure its design life.
    """
    weakest = Judged()
    for _, name, cycles in places:
        if math.isfinite(least := weakest.life.margin):
            scaled = replace(cycles, ranges=least * cycles.ranges, means=least * cycles.means)
            if demand.blocks * damage(scaled, demand.strength, judge, survival=demand.survival) < 1:
                continue
        other = life(cycles, demand.strength, judge, blocks=demand.blocks, survival=demand.survival)
        if not weakest.at or other.margin < weakest.life.margin:
            weakest = Judged(name, other)
    return weakest


def margin_error(margin: float, bar: float) -> float:
    """Return the error of a margin f under a stress with the relative error b = ``bar``: f b/(1 - b), the change of the
    margin, inversely proportional to the stress, at a stress lower by b; ``inf`` for b >= 1."""
    return margin * bar / (1 - bar) if bar < 1 else math.inf
