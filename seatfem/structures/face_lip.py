"""Lips of any outline: the faces of a land, rings and strips, divided into arcs along their centre lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.after.along import Pieces
from impact.greens.base import Array
from seatfem.structures.lands import Land
from seatfem.structures.lip import AnyLip, check_parts, widening
from seatfem.structures.rings import MOST_PORTS
from seatfem.structures.shapes.polygons import cross

SEEN: Final = 9  # points of each cut among which the nearest one to a place is looked for
ONWARDS: Final = 60  # cuts that are gone on by from there, at most
LOCALLY: Final = 1e-3  # of the area, in which it is seen how a strip widens
OF_AN_ARC: Final = 0.05  # that may lie on another face than the rest of it
NOTHING: Final = 1e-12  # of the area
ON_AXIS: Final = 1e-6  # angle by which a centre line may turn back


@dataclass(frozen=True)
class FaceLip(AnyLip):
    """A `Land` divided into arcs of equal areas and rings: face after face, those of one that no whole number of arcs
    fills end on the next; its ``offset`` is in metres.

    Raises:
        ModelError: numbers of parts below one or above `MOST_PORTS` together.
    """

    face: Land
    arcs: int = 1
    rings: int = 1
    offset: tuple[float, float] = (0.0, 0.0)
    side: str = ""

    def __post_init__(self) -> None:
        check_parts(self)

    @property
    def content(self) -> Mapping[str, object]:
        return {"face": self.face.digest, "arcs": self.arcs, "rings": self.rings, "offset": self.offset}

    @property
    def area(self) -> float:
        return float(self._table.swept[-1])

    @cached_property
    def lengths(self) -> Array:
        borders = np.arange(self.arcs + 1) / self.arcs * self.area
        return np.diff(np.interp(borders, self._table.swept, self._table.length))

    @cached_property
    def pieces(self) -> Pieces:
        ends = np.cumsum([strip.swept[-1] for strip in self.face.strips]) / self.area
        arcs = np.diff(np.round(ends * self.arcs).astype(int), prepend=0)
        pairs = zip(arcs, self.face.strips, strict=True)
        return tuple((int(number), strip.closed) for number, strip in pairs if number)

    def whole(self, arcs: int) -> int:
        ends = np.cumsum([strip.swept[-1] for strip in self.face.strips]) / self.area
        numbers = np.arange(arcs, MOST_PORTS // self.rings + 1)
        borders = numbers[:, None] * ends
        fit = numbers[np.abs(borders - np.round(borders)).max(axis=1) < OF_AN_ARC]
        return int(fit[0]) if len(fit) else arcs

    @property
    def _table(self) -> _Table:
        return _table(self.face)

    def cuts(self, shares: Array) -> tuple[Array, Array]:
        table, area = self._table, shares * self.area
        k = np.clip(np.searchsorted(table.swept, area, side="right") - 1, 0, len(table.swept) - 2)
        left_ends, right_ends = table.left[k], table.right[k]
        cut, ahead = right_ends - left_ends, table.right[k + 1] - table.left[k + 1]
        way = table.middles[k + 1] - table.middles[k]
        rate, more = cross(cut, way), cross(ahead - cut, way)  # area up to a share u of the step: rate u + more u^2/2
        rest = np.maximum(area - table.swept[k], 0.0)
        root = rate + np.sqrt(np.maximum(rate**2 + 2 * more * rest, 0.0))
        u = np.clip(np.divide(2 * rest, root, out=np.zeros(len(rest)), where=root > 0), 0.0, 1.0)[:, None]
        return left_ends + u * (table.left[k + 1] - left_ends), right_ends + u * (table.right[k + 1] - right_ends)

    def turns(self, shares: Array) -> Array | None:
        if len(self.face.strips) > 1 or not self.face.strips[0].closed:
            return None
        x, y = self._table.middles.T
        angles = np.unwrap(np.arctan2(y, x))
        if abs(angles[0]) > ON_AXIS or abs(angles[-1] - 2 * np.pi) > ON_AXIS or np.any(np.diff(angles) < -ON_AXIS):
            return None
        return np.asarray(np.interp(shares * self.area, self._table.swept, angles))

    def places(self, points: Array) -> tuple[Array, Array]:
        """Return the places (n,) along and across the lip, both shares of area, of points (n, 3) of its body [m]."""
        seen, table = self.face.seen(points), self._table
        k = table.nearest(seen)
        for _ in range(ONWARDS):  # a point lies between the cut behind and the one before it
            step = np.where(table.past(seen, k) < 0, -1, np.where(table.past(seen, k + 1) > 0, 1, 0))
            moved = table.beside(k, step)
            if np.array_equal(moved, k):
                break
            k = moved
        behind, before = table.past(seen, k), table.past(seen, k + 1)
        span = behind - before
        u = np.clip(np.divide(behind, span, out=np.zeros(len(k)), where=span > 0), 0.0, 1.0)
        along = (table.swept[k] + u * (table.swept[k + 1] - table.swept[k])) / self.area
        left_ends, right_ends = self.cuts(along)
        cut = right_ends - left_ends
        v = np.sum((seen - left_ends) * cut, axis=1) / np.maximum(np.sum(cut**2, axis=1), np.finfo(float).tiny)
        near = [self.cuts(np.clip(along + by, 0.0, 1.0)) for by in (-LOCALLY, LOCALLY)]
        inner, outer = (np.stack(lines, axis=1) for lines in zip(*near, strict=True))
        return along, v - widening(inner, outer) * (v - v**2)


@dataclass(frozen=True, eq=False)
class _Table:
    """The cuts of all faces, one after the other: their ends, (k, 2), the area up to each and the length of the centre
    line, and by cut the numbers of the first and the last one of its face, and whether that is closed."""

    left: Array
    right: Array
    swept: Array
    length: Array
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    closed: NDArray[np.bool_]

    @cached_property
    def middles(self) -> Array:
        """Return the (k, 2) middles of the cuts."""
        return np.asarray((self.left + self.right) / 2)

    def past(self, points: Array, k: NDArray[np.int64]) -> Array:
        """Return how far points (n, 2) lie beyond cuts, times the cuts' lengths."""
        return cross(self.right[k] - self.left[k], points - self.left[k])

    def beside(self, k: NDArray[np.int64], step: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the steps from cut to cut that are ``step`` further along the same face."""
        count = self.last[k] - self.first[k]
        on = k - self.first[k] + step
        return self.first[k] + np.where(self.closed[k], on % count, np.clip(on, 0, count - 1))

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree  # plans of other seats load none

        across = (np.arange(SEEN) + 0.5)[:, None, None] / SEEN
        return cKDTree((self.left + across * (self.right - self.left)).reshape(-1, 2))

    def nearest(self, points: Array) -> NDArray[np.int64]:
        """Return the (n,) step that begins at the nearest cut."""
        k = np.asarray(self._tree.query(points)[1]) % len(self.left)
        return self.beside(k, np.zeros_like(k))


@lru_cache(maxsize=8)
def _table(face: Land) -> _Table:
    strips, counts = face.strips, [len(strip.left) for strip in face.strips]
    last = np.cumsum(counts) - 1
    before = np.cumsum([0.0, *(strip.swept[-1] for strip in strips)])
    steps = []
    for strip in strips:  # straight ends are swept by nothing
        away, rises = np.diff(strip.middles, axis=0), np.diff(strip.swept) > NOTHING * strip.swept[-1]
        steps.append(np.concatenate([[0.0], np.hypot(*away.T) * rises]))
    return _Table(
        np.concatenate([strip.left for strip in strips]),
        np.concatenate([strip.right for strip in strips]),
        np.concatenate([start + strip.swept for start, strip in zip(before, strips, strict=False)]),
        np.cumsum(np.concatenate(steps)),
        np.repeat(last - np.array(counts) + 1, counts),
        np.repeat(last, counts),
        np.repeat([strip.closed for strip in strips], counts),
    )


@lru_cache(maxsize=32)
def face_lip(face: Land, arcs: int, rings: int) -> FaceLip:
    """Return a face in parts, kept as they are asked for again and again."""
    return FaceLip(face, arcs, rings)
