"""Geometry of a flat sheet with holes and any outline of straight edges and arcs, a part of which is clamped."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.quantities import percent
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import flat, loops, selectors, shape

Place = tuple[float, float]
Corner = tuple[float, ...]
"""(x, y) [m], or (x, y, bulge) with the bulge of the edge that follows (`seatfem.structures.shapes.loops`)."""
SAME: Final = 1e-6  # largest distance of coincident points, over the outline's size
MOST_POINTS: Final = 1000  # most corners of outline and holes
MOST_CHORDS: Final = 8000  # most chords of arcs and straight edges: the work grows with the square of their number
ROUND_OFF: Final = 1e-9  # round-off of coordinates in a file, over the outline's size


@dataclass(frozen=True)
class Outlined(flat.Flat):
    """Sheet with its underside at z = 0 (metres), of straight edges and circular arcs.

    The group "contact" is the upper side.

    Attributes:
        outline: corners in order, clockwise or anticlockwise.
        thickness: thickness of the sheet.
        touched: centre of the contact; if it lies in a hole, the contact is a ring about the hole.
        segment: both ends of the clamped straight part of the outline; or
        side: (n_x, n_y, offset): the part beyond the line n.x = offset is clamped, and not modelled; or
        hole: a point in the hole, or on its edge, whose edge is clamped.
        holes: closed loops of corners inside; those beyond the line are ignored.
    """

    family: ClassVar[str] = "outlined"

    outline: tuple[Corner, ...]
    thickness: float
    touched: Place
    segment: tuple[Place, Place] | None = None
    side: tuple[float, float, float] | None = None
    holes: tuple[tuple[Corner, ...], ...] = ()
    hole: Place | None = None

    def __post_init__(self) -> None:
        shape.require_positive(self, "thickness")
        self._check_chords()
        self._check_loop(self.outline, "outline", f"{len(self.outline)} points", MOST_POINTS - self._holed)
        for number, hole in enumerate(self.holes, 1):
            self._check_loop(hole, "holes", f"number {number}", MOST_POINTS)
        self._check_holes()
        if sum(each is not None for each in (self.segment, self.side, self.hole)) != 1:
            raise GeometryError("Outlined.clamped = None: give one of segment, hole, and a normal with its offset")
        if self.hole is not None:
            if self.held_loop is None:
                x, y = self.hole
                raise GeometryError(
                    f"Outlined.clamped = hole ({x:g}, {y:g}) m: this point must lie in one of its holes"
                )
        elif self.segment is not None:
            for x, y in self.segment:
                if loops.nearest(self._outer, np.array([x, y])) > SAME * self._size:
                    raise GeometryError(f"Outlined.clamped = ({x:g}, {y:g}) m: this point must lie on the outline")
            if not self._held.any():
                raise GeometryError("Outlined.clamped = its two points: a straight part of the outline must join them")
        elif len(self.loop) < 3 or not self._held.any() or loops.crossing(self.corners, self._within) is not None:
            raise GeometryError(
                f"Outlined.clamped = {self.side}: the line must cut the sheet or touch an edge, and leave one piece"
            )
        if not loops.holds(self.corners, self.touched):
            x, y = self.touched
            raise GeometryError(f"Outlined.contact_at = ({x:g}, {y:g}) m: this point must lie on the part that bends")
        shape.require_below(self, "thickness", self.narrowest, f"its narrowest part: {flat.THINNER}")

    @property
    def _holed(self) -> int:
        return sum(map(len, self.holes))

    def _check_chords(self) -> None:
        """Raise `GeometryError` if there are too many points or arcs."""
        if self._holed > MOST_POINTS - 3:
            raise GeometryError(
                f"Outlined.holes = {len(self.holes)} holes: they have {self._holed} points together: must have at most "
                f"{MOST_POINTS - 3}; leave small holes out"
            )
        chords = sum(loops.chord_count(loops.as_loop(loop)) for loop in (self.outline, *self.holes))
        if chords > MOST_CHORDS:
            raise GeometryError(
                f"Outlined.outline = {len(self.outline)} points with {len(self.holes)} holes: their straight edges and "
                f"arcs, in chords of 5 degrees, are {chords:.0f}: must be at most {MOST_CHORDS}; leave small holes out"
            )

    def _check_loop(self, corners: tuple[Corner, ...], field: str, what: str, most: int) -> None:
        """Raise `GeometryError` if a loop encloses no area, or crosses itself."""

        def wrong(why: str) -> GeometryError:
            return GeometryError(f"Outlined.{field} = {what}: {why}")

        loop = loops.as_loop(corners)
        straight = not loop[:, 2].any()
        if not (3 if straight else 2) <= len(corners) <= most or not np.isfinite(loop).all():
            raise wrong(f"3 to {most} finite points are needed to enclose an area")
        steps = np.linalg.norm(np.roll(loop, -1, axis=0)[:, :2] - loop[:, :2], axis=1)
        if steps[same := int(np.argmin(steps))] <= self._within:
            raise wrong(
                f"point {same + 1} and the one after it are the same; remove one (the last is joined to the first)"
            )
        polygon, edge = loops.polygon(loop)
        if (crossed := loops.crossing(polygon, self._within)) is not None:
            first, second = (edge[place] + 1 for place in crossed)
            raise wrong(f"it must not cross or touch itself: its edges {first} and {second} meet")
        if abs(loops.area(loop)) <= SAME * self._size**2:
            raise wrong("it must enclose an area")

    def _check_holes(self) -> None:
        """Raise `GeometryError` if a hole meets the outline, another hole or the clamping line, or lies outside."""
        outer, holes = loops.polygon(self._outer)[0], [loops.polygon(loops.as_loop(hole))[0] for hole in self.holes]
        for number, hole in enumerate(holes, 1):
            before = holes[: number - 1]
            others = [each for each in before if loops.holds(each, hole[0]) or loops.holds(hole, each[0])]
            if others or not loops.holds(outer, hole[0]):
                where = "in or about another hole" if others else "beyond the outline"
                raise GeometryError(f"Outlined.holes = number {number}: it lies {where}; move it")
            if any(loops.touching(hole, other, self._within) for other in (outer, *before)):
                raise GeometryError(f"Outlined.holes = number {number}: it must not meet the outline or another hole")
            if self.side is not None and 0 < np.mean(heights := self._height(hole) > 0) < 1:
                raise GeometryError(
                    f"Outlined.holes = number {number}: the line of clamped cuts it, "
                    f"{percent(heights.mean())} lies beyond; move the line"
                )

    @property
    def length(self) -> float:
        return float(self.corners[:, 0].max())

    @cached_property
    def _size(self) -> float:
        return float(np.ptp(loops.as_loop(self.outline)[:, :2], axis=0).max())

    @property
    def _within(self) -> float:
        return SAME * self._size

    @cached_property
    def _outer(self) -> Array:
        """Return the (n, 3) outline of the table, anticlockwise."""
        return loops.ordered(loops.as_loop(self.outline))

    @cached_property
    def loop(self) -> Array:
        """Return the (n, 3) loop around the unclamped part, anticlockwise, with corners at the ends of the clamped
        segment."""
        if self.side is None:
            return np.concatenate(list(self._joined()))
        normal, offset = self._line
        return loops.below(self._outer, normal, offset, self._within)

    @cached_property
    def openings(self) -> tuple[Array, ...]:
        """Return the loops (n, 3) around the holes of the unclamped part, clockwise."""
        hole_loops = (loops.ordered(loops.as_loop(hole), clockwise=True) for hole in self.holes)
        return tuple(hole for hole in hole_loops if self.side is None or self._height(hole[:, :2])[0] <= 0)

    @cached_property
    def held_loop(self) -> Array | None:
        if self.hole is None:
            return None
        point = np.array(self.hole)
        around = (
            hole
            for hole in self.openings
            if loops.holds(loops.polygon(hole)[0], self.hole) or loops.nearest(hole, point) <= self._within
        )
        return next(around, None)

    @cached_property
    def corners(self) -> Array:
        """Return the (n, 2) corners of a polygon around the unclamped part, anticlockwise, with chords for arcs."""
        return loops.polygon(self.loop)[0]

    def _joined(self) -> Iterator[Array]:
        """Yield the outline's corners, and between them the ends of the segment that lie on a straight edge."""
        points = np.array(self.segment or ()).reshape(-1, 2)
        for start, end in loops.edges(self._outer):
            run = end[:2] - start[:2]
            on = loops.distances(start[None, :2], end[None, :2], points)[0] <= self._within
            at = np.sort((points[on] - start[:2]) @ run / (run @ run))
            edge = self._within / np.linalg.norm(run)
            inner = at[(at > edge) & (at < 1 - edge)] if start[2] == 0 else at[:0]
            yield loops.pieces(start, end, np.append(0.0, inner))

    @property
    def _line(self) -> tuple[Array, float]:
        """Return the unit normal and offset of the line beyond which it is clamped."""
        assert self.side is not None
        scale = math.hypot(*self.side[:2])
        return np.array(self.side[:2]) / scale, self.side[2] / scale

    def _height(self, points: Array) -> Array:
        """Return the distance of points beyond the line, negative on the unclamped side."""
        normal, offset = self._line
        return np.asarray(points @ normal - offset)

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        if (edge := self.held_loop) is not None:
            corners = loops.polygon(edge)[0]
            low, high = corners.min(axis=0) - self._within, corners.max(axis=0) + self._within
            on = ((points >= low) & (points <= high)).all(axis=1)
            on[on] = [loops.nearest(edge, point) <= self._within for point in points[on]]
            return np.asarray(on)
        if self.segment is not None:
            start, end = np.array(self.segment)[:, None]
            return np.asarray(loops.distances(start, end, points)[0] <= self._within)
        return np.asarray(self._height(points) >= -2 * self._within)

    @property
    def _held(self) -> NDArray[np.bool_]:
        """Return (n,) flags of the clamped edges of the loop."""
        corners = self.loop[:, :2]
        ahead = np.roll(corners, -1, axis=0)
        on = self.clamped(corners) & self.clamped(ahead) & self.clamped((corners + ahead) / 2)
        return np.asarray(on & (self.loop[:, 2] == 0))

    @property
    def centre(self) -> Place:
        return self.touched

    @property
    def room(self) -> tuple[float, float]:
        """Return the radii by the hole about the centre and the nearest edge beyond it."""
        point, inner = np.array(self.touched), 0.0
        edge = [loops.nearest(self.loop, point)]
        for hole in self.openings:
            corners = loops.polygon(hole)[0]
            if loops.holds(corners, self.touched):
                inner = float(np.linalg.norm(corners - point, axis=1).max())
            else:
                edge.append(loops.nearest(hole, point))
        return inner, min(edge)

    @property
    def is_mirrored(self) -> bool:
        held = np.concatenate([self._held, *(np.full(len(hole), hole is self.held_loop) for hole in self.openings)])
        return loops.mirrored((self.loop, *self.openings), held, ROUND_OFF * self._size)

    @property
    def area(self) -> float:
        return sum(loops.area(loop) for loop in (self.loop, *self.openings))

    @cached_property
    def narrowest(self) -> float:
        width = loops.narrowest((self.corners, *(loops.polygon(hole)[0] for hole in self.openings)), self._within)
        return min(width, math.sqrt(self.area))

    @property
    def patches(self) -> selectors.Patches:
        if self.held_loop is not None:
            return {**super().patches, "fixed": tuple(_faces(self.held_loop))}
        corners, held = self.loop[:, :2], self._held
        edge = (np.roll(corners, -1, axis=0) - corners)[held][0]
        normal = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        x, y = float(normal[0]), float(normal[1])
        return {**super().patches, "fixed": (selectors.PlaneFace((x, y, 0.0), float(corners[held][0] @ normal)),)}

    @property
    def around(self) -> tuple[Array, ...]:
        return (self.loop, *map(loops.ordered, self.openings))

    @property
    def drawn(self) -> tuple[Array, ...]:
        return (self._outer, *(loops.ordered(loops.as_loop(hole)) for hole in self.holes))


def _faces(loop: Array) -> Iterator[selectors.Selector]:
    """Yield the faces of a solid sheet along a loop."""
    for start, end in loops.edges(loop):
        if start[2]:
            x, y = map(float, loops.circle(start, end, float(start[2]))[0])
            radius = float(np.hypot(*(start[:2] - (x, y))))
            yield selectors.CylinderFace(radius, (0.0, 0.0, 1.0), (x, y, 0.0), several=True)
            continue
        run = end[:2] - start[:2]
        x, y = map(float, np.array([run[1], -run[0]]) / np.linalg.norm(run))
        yield selectors.PlaneFace((x, y, 0.0), float(start[:2] @ (x, y)))
