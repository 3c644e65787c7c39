"""Where on a body stress changes most: the points whose fatigue is judged, with their histories."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.life.multiaxial import deviators
from seatfem.structures.fields.peaks import TIMES_PER_RADIAN, Field
from seatfem.structures.fields.recovery import StressField, histories

EACH: Final = 4  # of the points of a region
_HELD: Final = 16  # points whose whole histories are held at once


def mises_range(field: Field, force: Array, dt: float, *, since: int = 0) -> Array:
    """Return the (P,) sqrt 3 times the diagonal of the box, in Ilyushin's space, that holds the deviators of each point
    [Pa].

    Under proportional stress it is the von Mises stress of the difference of the two states furthest apart, otherwise
    that at least and sqrt 5 times it at most: no point with a large range is passed over. Looked at two times a radian
    of the highest frequency retained.

    Args:
        field: stress of a body.
        force, dt: as in `seatfem.structures.fields.recovery.histories`.
        since: number of the step from which on.
    """
    stride = max(1, int(1.0 / (TIMES_PER_RADIAN * float(field.radians.max()) * dt)))
    parts = [part.T for part in field.coordinates(force, dt, stride)]
    course, ranges = np.concatenate(parts, axis=1)[:, since // stride :], np.zeros(len(field.points))
    single = course.astype(np.float32)
    for first in range(0, len(ranges), _HELD):
        some = field.at(np.arange(first, min(first + _HELD, len(ranges))))
        for number, path in enumerate(_paths(some, course, single)):
            ranges[first + number] = np.sqrt(3) * float(np.linalg.norm(np.ptp(path, axis=1)))
    return ranges


def _paths(field: Field, course: Array, single: NDArray[np.float32]) -> Iterator[Array]:
    """Yield the (5, m) deviators of each point, of coordinates (K, m); ``single``: these in single precision."""
    if isinstance(field, StressField):
        turned = deviators(np.swapaxes(field.fields, 1, 2).reshape(-1, 6)).reshape(len(field.points), -1, 5)
        yield from (np.asarray(each.T.astype(np.float32) @ single, dtype=np.float64) for each in turned)
        return
    every = np.arange(len(field.bounds)), np.arange(len(field.radians))
    for stress in field.stress(every[0], course, every[1]):
        yield from (deviators(each.T).T for each in stress.reshape(-1, 6, course.shape[1]))


def hottest(ranges: Array, regions: NDArray[np.str_], each: int = EACH) -> NDArray[np.int64]:
    """Return the numbers of the points (P,) with the largest ranges, so many of each region."""
    order = np.argsort(-ranges, kind="stable")
    return np.concatenate([order[regions[order] == name][:each] for name in np.unique(regions)]).astype(np.int64)


def tensor_histories(field: Field, force: Array, dt: float) -> Iterator[Array]:
    """Yield the (n + 1, 6) stress of each of its points, one after the other; memory holds a few of them."""
    for first in range(0, len(field.points), _HELD):
        some = np.arange(first, min(first + _HELD, len(field.points)))
        yield from np.swapaxes(histories(field.at(some), force, dt), 1, 2)
