"""Flat sheets with any outline of straight edges, a part of it clamped."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.flat import Flat
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import require_below, require_positive

Place = tuple[float, float]
SAME: Final = 1e-6  # of the outline's size: points nearer to each other are one
ALONG: Final = (0.1, 0.3, 0.5, 0.7, 0.9)  # of each edge: where the sheet's width is measured
MOST_POINTS: Final = 1000


@dataclass(frozen=True)
class Outlined(Flat):
    """Sheet with its underside at z = 0, of straight edges (metres). The group "contact" is the upper side.

    Attributes:
        outline: corners (x, y) in order, either way round.
        thickness: of the sheet.
        touched: where its contact is centred.
        segment: both ends of the straight part of the outline that is clamped; or
        side: (n_x, n_y, offset): all that lies beyond the line n.x = offset is clamped, so that the sheet ends there.
    """

    family: ClassVar[str] = "outlined"

    outline: tuple[Place, ...]
    thickness: float
    touched: Place
    segment: tuple[Place, Place] | None = None
    side: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        require_positive(self, "thickness")
        self._check_outline()
        if (self.segment is None) == (self.side is None):
            raise GeometryError("Outlined.clamped = None: give a segment, or a normal with its offset")
        if self.segment is not None:
            for x, y in self.segment:
                if _distances(self._loop, np.array([[x, y]])).min() > SAME * self._size:
                    raise GeometryError(f"Outlined.clamped = ({x:g}, {y:g}) m: this point is not on the outline")
            if not self._held.any():
                raise GeometryError("Outlined.clamped = its two points: no straight part of the outline joins them")
        elif len(self.corners) < 3 or not self._held.any() or _crossing(self.corners) is not None:
            raise GeometryError(
                f"Outlined.clamped = {self.side}: the line must cut the sheet or touch an edge, and leave one piece"
            )
        if not _holds(self.corners, self.touched):
            x, y = self.touched
            raise GeometryError(f"Outlined.contact_at = ({x:g}, {y:g}) m: this point is not on the part that bends")
        require_below(self, "thickness", self.narrowest, "its narrowest part: a sheet is thinner than it is wide")

    def _check_outline(self) -> None:
        """Raise `GeometryError` of what encloses no area, or crosses itself."""

        def wrong(what: str) -> GeometryError:
            return GeometryError(f"Outlined.outline = {len(self.outline)} points: {what}")

        if not 3 <= len(self.outline) <= MOST_POINTS or not np.isfinite(self.outline).all():
            raise wrong(f"3 to {MOST_POINTS} finite points enclose an area")
        steps = np.hypot(*(np.roll(self.outline, -1, axis=0) - self.outline).T)
        if (same := int(np.argmin(steps))) >= 0 and steps[same] <= SAME * self._size:
            raise wrong(
                f"point {same + 1} and the one after it are the same; the last is joined to the first by itself"
            )
        if (crossed := _crossing(np.array(self.outline))) is not None:
            raise wrong(f"it crosses or touches itself: its edges {crossed[0] + 1} and {crossed[1] + 1} meet")
        if abs(_area(np.array(self.outline))) <= SAME * self._size**2:
            raise wrong("it encloses no area")

    @property
    def length(self) -> float:
        return float(self.corners[:, 0].max())

    @property
    def _size(self) -> float:
        return float(np.ptp(self.outline, axis=0).max())

    @property
    def _loop(self) -> Array:
        """(n, 2) corners as they are given, anticlockwise."""
        points = np.array(self.outline, dtype=float)
        return points if _area(points) > 0 else points[::-1]

    @property
    def corners(self) -> Array:
        """(n, 2) of what bends, anticlockwise, with the ends of the clamped segment among them."""
        return np.array(list(self._joined() if self.side is None else self._cut()))

    def _joined(self) -> Iterator[Array]:
        """The outline's corners, and between them the ends of the segment that lie on an edge."""
        ends = np.array(self.segment or ())
        loop = self._loop
        for start, end in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            yield start
            length = float(np.linalg.norm(end - start))
            along = sorted(
                float((point - start) @ (end - start)) / length
                for point in ends
                if _on(start, end, point, SAME * self._size)
            )
            yield from (
                start + (end - start) * at / length
                for at in along
                if SAME * self._size < at < length - SAME * self._size
            )

    def _cut(self) -> Iterator[Array]:
        """What lies on this side of the line. Source: I. Sutherland and G. Hodgman, Comm. ACM 17 (1974) 32."""
        assert self.side is not None
        normal, loop = np.array(self.side[:2]) / math.hypot(*self.side[:2]), self._loop
        height = loop @ normal - self.side[2] / math.hypot(*self.side[:2])
        height[np.abs(height) <= SAME * self._size] = 0.0
        for k, (start, end) in enumerate(zip(loop, np.roll(loop, -1, axis=0), strict=True)):
            here, there = height[k], height[(k + 1) % len(loop)]
            if here <= 0:
                yield start
            if here * there < 0:
                yield start + (end - start) * here / (here - there)

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        if self.segment is not None:
            return np.asarray(_on(np.array(self.segment[0]), np.array(self.segment[1]), points, SAME * self._size))
        assert self.side is not None
        scale = math.hypot(*self.side[:2])
        return np.asarray(points @ np.array(self.side[:2]) / scale >= self.side[2] / scale - 2 * SAME * self._size)

    @property
    def _held(self) -> NDArray[np.bool_]:
        """(n,) which edges are clamped."""
        corners = self.corners
        ahead = np.roll(corners, -1, axis=0)
        return np.asarray(self.clamped(corners) & self.clamped(ahead) & self.clamped((corners + ahead) / 2))

    @property
    def centre(self) -> Place:
        return self.touched

    @property
    def room(self) -> tuple[float, float]:
        return 0.0, float(_distances(self.corners, np.array([self.touched])).min())

    @property
    def area(self) -> float:
        return _area(self.corners)

    @property
    def narrowest(self) -> float:
        """The shortest way across, square to an edge."""
        start, ahead = self.corners, np.roll(self.corners, -1, axis=0)
        edges = ahead - start
        inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1)[:, None]
        ways = []
        for at in ALONG:
            origin = start + at * edges
            across = _cross(inward[:, None], edges[None])
            apart = start[None] - origin[:, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                far, along = _cross(apart, edges[None]) / across, _cross(apart, inward[:, None]) / across
            hit = np.isfinite(far) & (along >= 0) & (along <= 1) & (far > SAME * self._size)
            ways.append(np.where(hit, far, np.inf).min())
        return float(min(ways))

    @property
    def patches(self) -> Patches:
        corners, held = self.corners, self._held
        edge = (np.roll(corners, -1, axis=0) - corners)[held][0]
        normal = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        x, y = float(normal[0]), float(normal[1])
        return {**super().patches, "fixed": (PlaneFace((x, y, 0.0), float(corners[held][0] @ normal)),)}

    def sheet(self, occ: Any) -> int:
        """The outline's surface (millimetres)."""
        points = [occ.addPoint(1e3 * x, 1e3 * y, 0.0) for x, y in self.corners]
        lines = [occ.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
        return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _area(loop: Array) -> float:
    """Of a polygon, positive where it runs anticlockwise."""
    middle = loop - loop.mean(axis=0)
    return float(_cross(middle, np.roll(middle, -1, axis=0)).sum() / 2)


def _on(start: Array, end: Array, points: Array, within: float) -> NDArray[np.bool_]:
    """Which points (..., 2) lie on the segment."""
    edge = end - start
    at = np.clip((points - start) @ edge / (edge @ edge), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - at[..., None] * edge, axis=-1) <= within)


def _distances(loop: Array, points: Array) -> Array:
    """(edges, points) from each edge of a polygon."""
    found = []
    for start, end in zip(loop, np.roll(loop, -1, axis=0), strict=True):
        edge = end - start
        at = np.clip((points - start) @ edge / (edge @ edge), 0.0, 1.0)
        found.append(np.linalg.norm(points - start - at[:, None] * edge, axis=1))
    return np.array(found)


def _holds(loop: Array, point: Place) -> bool:
    """Whether a polygon has a point inside: an odd number of edges cross the ray from it along x."""
    x, y = (loop - point).T
    ahead_x, ahead_y = np.roll(x, -1), np.roll(y, -1)
    crosses = (y > 0) != (ahead_y > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = x - y * (ahead_x - x) / (ahead_y - y)
    return bool(np.sum(crosses & (at > 0)) % 2)


def _crossing(loop: Array) -> tuple[int, int] | None:
    """The first two edges of a polygon that meet elsewhere than at a corner which they share."""
    n, ahead = len(loop), np.roll(loop, -1, axis=0)
    within = SAME * float(np.ptp(loop, axis=0).max())
    for i in range(n):
        edge = ahead[i] - loop[i]
        one, other = _cross(edge, loop - loop[i]), _cross(edge, ahead - loop[i])
        back = _cross(ahead - loop, loop[i] - loop), _cross(ahead - loop, ahead[i] - loop)
        meets = (one * other < 0) & (back[0] * back[1] < 0)
        meets |= _on(loop[i], ahead[i], loop, within) | _on(loop[i], ahead[i], ahead, within)
        meets[[i, (i + 1) % n, (i - 1) % n]] = False
        if n > 3 and _on(loop[i], ahead[i], ahead[(i + 1) % n][None], within)[0]:  # the next edge runs back on it
            meets[(i + 1) % n] = True
        if meets.any():
            return i, int(np.argmax(meets))
    return None
