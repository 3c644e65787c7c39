"""Where on a body stress changes most: the points whose fatigue is judged, with their histories."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.after.stresses import coordinates
from impact.greens.base import Array
from impact.life.multiaxial import deviators
from seatfem.structures.fields.recovery import TIMES_PER_RADIAN, StressField, histories, pushes_of

EACH: Final = 4  # of the points of a region
_POINTS: Final = 512
_HELD: Final = 16  # points whose whole histories are held at once


def mises_range(field: StressField, force: Array, dt: float, *, since: int = 0) -> Array:
    """(P,) sqrt 3 times the diagonal of the box, in Ilyushin's space, that holds the deviators of each point [Pa].

    Under proportional stress it is the von Mises stress of the difference of the two states furthest apart, otherwise
    that at least and sqrt 5 times it at most: no point with a large range is passed over. Looked at two times a radian
    of the highest frequency retained.

    Args:
        field: stress of a body.
        force, dt: as in `seatfem.structures.fields.recovery.histories`.
        since: number of the step from which on.
    """
    greens = field.body.greens.modal
    assert greens is not None
    stride = max(1, int(1.0 / (TIMES_PER_RADIAN * float(greens.omega.max()) * dt)))
    parts = [part.T for part in coordinates(pushes_of(field, force), dt, field.body, stride)]
    course = np.concatenate(parts, axis=1)[:, since // stride :].astype(np.float32)
    found = np.zeros(len(field.points))
    for first in range(0, len(field.points), _POINTS):
        fields = field.at(np.arange(first, min(first + _POINTS, len(found)))).fields
        paths = np.swapaxes(fields, 1, 2).reshape(-1, 6)
        turned = deviators(paths).reshape(len(fields), -1, 5).swapaxes(1, 2).astype(np.float32)
        for number, each in enumerate(turned):
            found[first + number] = np.sqrt(3) * float(np.linalg.norm(np.ptp(each @ course, axis=1)))
    return found


def hottest(ranges: Array, regions: NDArray[np.str_], each: int = EACH) -> NDArray[np.int64]:
    """Numbers of the points (P,) with the largest ranges, so many of each region."""
    order = np.argsort(-ranges, kind="stable")
    return np.concatenate([order[regions[order] == name][:each] for name in np.unique(regions)]).astype(np.int64)


def tensor_histories(field: StressField, force: Array, dt: float) -> Iterator[Array]:
    """(n + 1, 6) of each of its points, one after the other; memory holds a few of them."""
    for first in range(0, len(field.points), _HELD):
        some = np.arange(first, min(first + _HELD, len(field.points)))
        yield from np.swapaxes(histories(field.at(some), force, dt), 1, 2)
