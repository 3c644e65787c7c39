"""Lands, the flat faces that a reed lands on as a drawing or a mesh has them, and lips made of them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.after.histories import Pieces
from impact.greens.base import Array
from impact.quantities import percent
from seatfem.structures import errors, lip
from seatfem.structures.rings import MOST_PORTS
from seatfem.structures.shapes.inspect import triple
from seatfem.structures.shapes.loops import chained, cross, inside, polygon_area
from seatfem.structures.shapes.selectors import Vector
from seatfem.structures.strips import LEAST, Strip, strip_of

SAME: Final = 1e-6  # distance of ends of edges that count as one point, over the face's size
FLAT: Final = 1e-3  # largest difference in height of a flat face, over its size
SQUARE_ON: Final = 1e-6  # largest part across x of a normal that counts as along x
FLUSH: Final = 0.99  # share of a land that counts as all of it, with an allowance for chords
OVER_A_PORT: Final = 9  # squares along each side of a port that carries a pressure
AROUND: Final = 1440  # chords of a circle: its area is right to 3e-6
TELLING: Final = 0.05  # least part of a stated unit direction along the face


class UncoveredError(errors.ModelError):
    """A land of which a reed covers too little."""


@dataclass(frozen=True, eq=False)
class Gate:
    """The way of gas over one land.

    Attributes:
        rim: length of its rim towards the port [m].
        share: of the port, 1/2 where two lands seal it.
        area: that share of the port's area [m^2].
        loops: (n, 2) around the port, the outer one first, from the centre [m].
    """

    rim: float
    share: float
    area: float
    loops: tuple[Array, ...]

    def points(self) -> Array:
        """Return (n, 2) points all over the port, each in the middle of an equal square."""
        outer = self.loops[0]
        low, high = outer.min(axis=0), outer.max(axis=0)
        x, y = (low[k] + (high[k] - low[k]) * (np.arange(OVER_A_PORT) + 0.5) / OVER_A_PORT for k in (0, 1))
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return points[inside(self.loops, points)]


def _length(loop: Array) -> float:
    """Return the length of a line through points (n, 2) [m]."""
    return float(np.hypot(*np.diff(loop, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Land:
    """One flat face or several in one plane, seen against their outward normal from their common centroid.

    Attributes:
        centre: the centroid [m]; x, y: the directions in which it is seen (`axes_along`).
        strips: its faces from that centre, by the x and then the y of their own centroids, those about one centroid
            from inside.
    """

    centre: Vector
    x: Vector
    y: Vector
    strips: tuple[Strip, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of its faces: "port 1", ... of rings beside each other, "inner land", "outer land" or
        "land 1", ... from inside of rings around each other, "face 1", ... of others."""
        count, rings = len(self.strips), [strip for strip in self.strips if strip.closed]
        if len(rings) < count:
            return tuple(f"face {number}" for number in range(1, count + 1))
        around = [
            sum(bool(inside([other.left], one.left[:1]).all()) for other in rings if other is not one) for one in rings
        ]
        if not any(around):
            return tuple(f"port {number}" for number in range(1, count + 1))
        if count == 2:
            return ("inner land", "outer land")
        return tuple(f"land {number}" for number in range(1, count + 1))

    @cached_property
    def gates(self) -> tuple[Gate, ...]:
        """Return the way of gas over each of its faces: of rings beside each other from a port within each, of rings
        around each other from the annular ports between pairs of them, from inside; none of other faces."""
        rings = self.strips
        if not all(strip.closed for strip in rings):
            return ()
        if self.names[0].startswith("port"):
            return tuple(Gate(_length(ring.left), 1.0, polygon_area(ring.left[:-1]), (ring.left,)) for ring in rings)
        gates = []
        for one, other in zip(rings[::2], rings[1::2], strict=False) if len(rings) % 2 == 0 else ():
            loops = other.left, one.right
            area = polygon_area(loops[0][:-1]) - polygon_area(loops[1][:-1])
            gates += [Gate(_length(rim), 0.5, area / 2, loops) for rim in reversed(loops)]
        return tuple(gates)

    @cached_property
    def digest(self) -> str:
        """Return a hash of the land's outlines and frame."""
        digest = hashlib.sha256(repr((self.centre, self.x, self.y)).encode())
        for strip in self.strips:
            digest.update(np.ascontiguousarray(np.stack([strip.left, strip.right])).tobytes())
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Land) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def seen(self, points: Array) -> Array:
        """Return the (n, 2) places on the face of points (n, 3) [m]."""
        return np.asarray((points - np.array(self.centre)) @ np.array([self.x, self.y]).T)


def axes_along(normal: Sequence[float] | Array, along: Sequence[float] = ()) -> Array:
    """Return the (3, 3) unit vectors x, y, z of a face with the outward normal z.

    x is the part along the face of the direction ``along``; (): of the body's own x axis, or of its y axis where
    the face lies across x.

    Raises:
        ModelError: a direction that is square to the face.
    """
    z = np.asarray(normal) / np.linalg.norm(normal)
    usual = np.array([1.0, 0.0, 0.0]) if np.hypot(z[1], z[2]) > SQUARE_ON else np.array([0.0, 1.0, 0.0])
    direction = np.asarray(along) / np.linalg.norm(along) if along else usual
    x = direction - (direction @ z) * z
    if along and np.linalg.norm(x) < TELLING:
        words = ", ".join(f"{each:.4g}" for each in direction)
        raise errors.ModelError(f"seat.along = ({words}) is square to the struck face; give a direction along it")
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def land_of(edges: Array, normal: Sequence[float] | Array, along: Sequence[float] = ()) -> Land:
    """Return the land that straight ``edges`` (e, 2, 3) bound, in any order [m], with its outward normal; ``along``: as
    of `axes_along`.

    Raises:
        ModelError: faces that are not flat, overlap, have several holes, or are neither rings nor strips, with what
            would help.
    """
    points = edges.reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    x, y, n = axes_along(normal, along)
    off = float(np.ptp(points @ n))
    if off > FLAT * size:
        raise errors.ModelError(
            f"the struck face is not flat: its edges lie {1e3 * off:.3g} mm apart along its normal; take flat faces, "
            "or strike it as a whole"
        )
    strips = [strip_of(outer, holes) for outer, holes in _nested(_loops(edges @ np.array([x, y]).T, SAME * size))]
    areas = np.array([strip.swept[-1] for strip in strips])
    middle = (areas[:, None] * [strip.centroid for strip in strips]).sum(axis=0) / areas.sum()
    moved = [strip.moved(-middle).begun_on_the_axis() for strip in strips]
    moved.sort(key=lambda strip: (*np.round(strip.centroid / (SAME * size)), float(np.hypot(*strip.left.T).max())))
    at = middle @ np.array([x, y]) + (points.mean(axis=0) @ n) * n
    return Land(triple(at), triple(x), triple(y), tuple(moved))


@lru_cache(maxsize=8)
def concentric(rings: tuple[tuple[float, float], ...], height: float) -> Land:
    """Return rings about the z axis as a land that looks up; their inner and outer radii, from inside, and height
    [m]."""
    angles = np.linspace(0.0, 2 * math.pi, AROUND + 1)
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    strips = tuple(Strip(low * rays, high * rays, closed=True) for low, high in rings)
    return Land((0.0, 0.0, height), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), strips)


@lru_cache(maxsize=8)
def under(face: Land, outline: tuple[bytes, ...], *, seals: bool) -> Land:
    """Return what of a land lies under an outline, loops (n, 2) of float64 [m]; from `FLUSH` on the land itself. Raises
    `UncoveredError` of less than `LEAST` of it, and of rings not covered all round where it ``seals`` ports."""
    loops = tuple(np.frombuffer(loop).reshape(-1, 2) for loop in outline)
    parts = [strip.within(loops) for strip in face.strips]
    part = Land(face.centre, face.x, face.y, tuple(strip for each in parts for strip in each))
    area, whole = (sum(strip.swept[-1] for strip in each.strips) for each in (part, face))
    if area >= FLUSH * whole:
        return face
    if area < LEAST * whole:
        raise UncoveredError(
            f"too little of it lies under the reed; limit: {percent(LEAST)} of the face: take a wider reed"
        )
    pairs = zip(face.strips, parts, strict=True)
    if seals and any(ring.closed and [strip.closed for strip in each] != [True] for ring, each in pairs):
        raise UncoveredError(f"leaves a port open; limit: {percent(LEAST)} of its land's width, all round")
    return part


def _loops(edges: Array, near: float) -> list[Array]:
    """Return the (c, 2) corners of each closed line of edges (e, 2, 2), in order. Raises `ModelError` of lines that
    touch."""
    points = edges.reshape(-1, 2)
    pairs = scipy.spatial.cKDTree(points).query_pairs(near, output_type="ndarray")
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    number, corner = scipy.sparse.csgraph.connected_components(graph, directed=False)
    ends = corner.reshape(-1, 2)
    ends = ends[ends[:, 0] != ends[:, 1]]
    if np.any(np.bincount(ends.ravel(), minlength=number) != 2):
        raise errors.ModelError(
            "contact: the lines that bound the struck faces are not closed, or touch each other: choose separate faces"
        )
    place = np.empty((number, 2))
    place[corner] = points
    return chained(place[ends], near)


def _nested(loops: list[Array]) -> list[tuple[Array, list[Array]]]:
    """Return each outer line with those of its holes, all anticlockwise. Raises `ModelError` of lines that cross."""
    loops = [loop if polygon_area(loop) > 0 else loop[::-1] for loop in loops]
    loops.sort(key=polygon_area, reverse=True)
    nests: list[tuple[Array, list[Array]]] = []
    for k, loop in enumerate(loops):
        around = [other for other, larger in enumerate(loops[:k]) if _inside(loop, larger)]
        if len(around) % 2 == 0:
            nests.append((loop, []))
        else:
            next(holes for outer, holes in nests if outer is loops[around[-1]]).append(loop)
    return nests


def _inside(loop: Array, larger: Array) -> bool:
    """Return whether all of a line lies within another one; raises `ModelError` of one that lies there in part."""
    within = inside([larger], loop)
    if 0 < within.sum() < len(within):
        raise errors.ModelError(
            "contact: the lines that bound the struck faces cross each other, as of faces that overlap: take faces "
            "that stand apart, or strike them as a whole"
        )
    return bool(within.any())


SEEN: Final = 9  # points of each cut among which the nearest one to a place is looked for
ONWARDS: Final = 60  # most cuts that the search moves on from there
LOCALLY: Final = 1e-3  # share of the area over which the widening of a strip is measured
OF_AN_ARC: Final = 0.05  # largest share of an arc that may lie on another face than the rest of it
NOTHING: Final = 1e-12  # share of the area that counts as none
ON_AXIS: Final = 1e-6  # largest angle [rad] by which a centre line may turn back


@dataclass(frozen=True)
class FaceLip(lip.AnyLip):
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
    is_part: bool = False

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
        pairs = zip(self._arcs_of_faces, self.face.strips, strict=True)
        return tuple((number, strip.closed) for number, strip in pairs if number)

    @property
    def names(self) -> tuple[str, ...]:
        numbers = self._arcs_of_faces
        return tuple(name for name, number in zip(self.face.names, numbers, strict=True) if number)

    @property
    def _arcs_of_faces(self) -> list[int]:
        ends = np.cumsum([strip.swept[-1] for strip in self.face.strips]) / self.area
        return [int(number) for number in np.diff(np.round(ends * self.arcs).astype(int), prepend=0)]

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

    def turns(self, shares: Array) -> Array:
        if len(self.face.strips) > 1 or not self.face.strips[0].closed:
            return np.zeros(0)
        x, y = self._table.middles.T
        angles = np.unwrap(np.arctan2(y, x))
        if abs(angles[0]) > ON_AXIS or abs(angles[-1] - 2 * np.pi) > ON_AXIS or np.any(np.diff(angles) < -ON_AXIS):
            return np.zeros(0)
        return np.asarray(np.interp(shares * self.area, self._table.swept, angles))

    def places(self, points: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the places (n,) along and across the lip, both shares of area, of points (n, 3) of its body [m], and
        whether they lie on it: of a part of the faces, not beside it."""
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
        u = np.divide(behind, span, out=np.zeros(len(k)), where=span > 0)
        held, u = (u >= 0) & (u <= 1), np.clip(u, 0.0, 1.0)
        along = (table.swept[k] + u * (table.swept[k + 1] - table.swept[k])) / self.area
        left_ends, right_ends = self.cuts(along)
        cut = right_ends - left_ends
        v = np.sum((seen - left_ends) * cut, axis=1) / np.maximum(np.sum(cut**2, axis=1), np.finfo(float).tiny)
        near = [self.cuts(np.clip(along + by, 0.0, 1.0)) for by in (-LOCALLY, LOCALLY)]
        inner, outer = (np.stack(lines, axis=1) for lines in zip(*near, strict=True))
        held = held & (v >= 0) & (v <= 1) if self.is_part else np.ones(len(v), dtype=bool)
        return along, v - lip.widening(inner, outer) * (v - v**2), held


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
        across = (np.arange(SEEN) + 0.5)[:, None, None] / SEEN
        return scipy.spatial.cKDTree((self.left + across * (self.right - self.left)).reshape(-1, 2))

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
