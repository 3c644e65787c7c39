"""Selectors of faces of a solid in gmsh, by planes and other properties; a new one is a class and a row in
``SELECTORS``.

Lengths are in m, angles in rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.units import write_quantity

Vector = tuple[float, float, float]
Paint = tuple[int, int, int, int]
Colour = Paint | tuple[()]


@dataclass(frozen=True)
class Axis:
    """Axis of a cylinder or a cone: a point on it, its direction, and the cone's half angle (0: a cylinder;
    radians)."""

    point: Vector
    direction: Vector
    half_angle: float = 0.0


@dataclass(frozen=True, eq=False)
class Face:
    """One face of a solid, in metres.

    ``outline``: points on its boundary curves, (n, 3); ``curves``: tags of these curves. ``normal``: outward normal;
    None for a curved face. ``axis``: axis of a cylinder or cone. ``name``: name in the CAD file, or "". ``numbers``:
    positions in the file's order, from 1; a face shared by two solids has two, and pieces of one face have the same.
    ``distance``: function from a point to its distance from the face.
    """

    tag: int
    kind: str
    centre: Vector
    area: float
    outline: NDArray[np.float64]
    curves: frozenset[int]
    normal: Vector | None = None
    colour: Colour = ()
    axis: Axis | None = None
    name: str = ""
    numbers: tuple[int, ...] = ()
    distance: Callable[[Vector], float] = lambda point: math.inf

    def radii(self, point: Vector, direction: Vector) -> NDArray[np.float64]:
        """Return the distances of the outline from an axis."""
        n = np.asarray(direction) / np.linalg.norm(direction)
        arm = self.outline - point
        return np.asarray(np.linalg.norm(arm - np.outer(arm @ n, n), axis=1))

    @property
    def ends(self) -> tuple[float, ...]:
        """Return the least and the largest distance from its axis; () without one."""
        if self.axis is None:
            return ()
        radii = self.radii(self.axis.point, self.axis.direction)
        return float(radii.min()), float(radii.max())

    def __str__(self) -> str:
        x, y, z = (f"{1e3 * c:.4g}" for c in np.round(self.centre, 12) + 0.0)
        number = " = ".join(map(str, self.numbers)) or str(self.tag)
        text = f"face {number}: {self.kind}, centre ({x}, {y}, {z}) mm, area {1e6 * self.area:.4g} mm^2"
        if self.normal is not None:
            text += ", normal ({:.3g}, {:.3g}, {:.3g})".format(*(np.round(self.normal, 6) + 0.0))
        if self.axis is not None:
            ends = dict.fromkeys(f"{1e3 * r:.4g}" for r in self.ends)
            text += f", radius {' to '.join(ends)} mm"
            text += ", axis ({:.3g}, {:.3g}, {:.3g})".format(*(np.round(self.axis.direction, 6) + 0.0))
        if self.axis is not None and self.axis.half_angle > 0.0:
            text += f", half angle {math.degrees(self.axis.half_angle):.4g} deg"
        if self.name:
            text += f", name {self.name!r}"
        return text + (f", colour {self.colour}" if self.colour else ", no colour")


def joined_to(first: int, bounds: Mapping[int, Collection[int]]) -> set[int]:
    """Return the entities that hang together with the first one, as each shares a part of its bounds with another."""
    joined, reached = {first}, set(bounds[first])
    while more := [tag for tag, own in bounds.items() if tag not in joined and not reached.isdisjoint(own)]:
        joined.update(more)
        reached.update(*(bounds[tag] for tag in more))
    return joined


def connected(faces: Sequence[Face]) -> bool:
    """Return whether the faces form one patch, each sharing a curve with another."""
    return len(joined_to(0, {k: face.curves for k, face in enumerate(faces)})) == len(faces)


def listing(faces: Sequence[Face]) -> str:
    """Return one line per face, for error messages."""
    return "\n".join(f"  {face}" for face in faces)


@dataclass(frozen=True)
class Frame:
    """A plane in space: a point on it [m], and the unit vectors x and y in it."""

    origin: Vector
    x: Vector
    y: Vector

    @property
    def axes(self) -> Array:
        """Return the (2, 3) unit vectors."""
        return np.array([self.x, self.y])

    @property
    def normal(self) -> Array:
        """Return the (3,) normal x cross y."""
        return np.cross(self.x, self.y)

    def seen(self, points: Array) -> Array:
        """Return the coordinates x, y (..., 2) of points (..., 3) projected on the plane [m]."""
        return np.asarray((points - np.array(self.origin)) @ self.axes.T)

    def points(self, places: Array) -> Array:
        """Return the points (..., 3) with coordinates x, y (..., 2) on the plane [m]."""
        return np.asarray(np.array(self.origin) + places @ self.axes)


LENGTH_TOLERANCE = 1e-6  # accuracy of lengths in CAD exchange files [m]
ANGLE_TOLERANCE = 1e-3  # largest angle [rad] between directions that count as the same

UP: Vector = (0.0, 0.0, 1.0)
DOWN: Vector = (0.0, 0.0, -1.0)
ORIGIN: Vector = (0.0, 0.0, 0.0)

CONTACT_COLOUR: Paint = (255, 0, 0, 255)
FIXED_COLOUR: Paint = (0, 0, 255, 255)


@dataclass(frozen=True)
class PlaneFace:
    """The flat face with outward ``normal`` n in the plane n.x = ``offset`` (metres).

    ``radius_min`` and ``radius_max`` keep only faces whose boundary curves lie between these distances from the
    axis along n through ``axis_point``. ``several``: accept faces that do not touch each other.
    """

    normal: Vector
    offset: float
    radius_min: float = 0.0
    radius_max: float = math.inf
    axis_point: Vector = (0.0, 0.0, 0.0)
    several: bool = False

    def __post_init__(self) -> None:
        _check_direction("PlaneFace.normal", self.normal)

    def matches(self, face: Face) -> bool:
        if face.normal is None:
            return False
        n = np.asarray(self.normal) / np.linalg.norm(self.normal)
        aligned = np.linalg.norm(n - face.normal) < ANGLE_TOLERANCE
        in_plane = abs(n @ face.centre - self.offset) < LENGTH_TOLERANCE
        radii = face.radii(self.axis_point, self.normal)
        return bool(aligned and in_plane and _between(radii, self.radius_min, self.radius_max))

    def __str__(self) -> str:
        text = f"plane face with normal {self.normal}, offset {1e3 * self.offset:g} mm"
        if self.radius_min > 0.0 or math.isfinite(self.radius_max):
            text += f", radius {1e3 * self.radius_min:g} to {1e3 * self.radius_max:g} mm"
        return text


@dataclass(frozen=True)
class CylinderFace:
    """The cylindrical face of this ``radius`` (metres) about the line through ``axis_point`` along ``axis``.

    Without the two, about any line; if several separate faces match, those about the z axis are preferred.
    ``several``: accept faces that do not touch each other.
    """

    radius: float
    axis: Vector | None = None
    axis_point: Vector | None = None
    several: bool = False

    def __post_init__(self) -> None:
        _check_direction("CylinderFace.axis", UP if self.axis is None else self.axis)
        if not 0.0 < self.radius < math.inf:
            radius = write_quantity(self.radius, "length")
            raise GeometryError(f"CylinderFace.radius = {radius}: must be a finite length > 0")

    def matches(self, face: Face) -> bool:
        if face.axis is None or face.axis.half_angle > 0.0:
            return False
        if not self._anywhere and not _coaxial(face, self.axis or UP, self.axis_point or ORIGIN):
            return False
        return _between(face.radii(face.axis.point, face.axis.direction), self.radius, self.radius)

    def preferred(self, faces: Sequence[Face]) -> list[Face]:
        """Return the faces about the z axis if several separate ones match and no axis is stated, else all."""
        central = [face for face in faces if _coaxial(face, UP, ORIGIN)]
        return central if central and self._anywhere and not self.several and not connected(faces) else list(faces)

    @property
    def _anywhere(self) -> bool:
        return self.axis is None and self.axis_point is None

    def __str__(self) -> str:
        text = f"cylindrical face of radius {1e3 * self.radius:g} mm"
        if self._anywhere:
            return text
        place = ", ".join(f"{1e3 * c:g}" for c in self.axis_point or ORIGIN)
        return f"{text} about {self.axis or UP} through ({place}) mm"


@dataclass(frozen=True)
class ConeFace:
    """The conical face with this ``half_angle`` [rad] about the line through ``axis_point`` along ``axis``.

    ``radius_min`` and ``radius_max`` keep only faces between these distances from the axis. ``several``: accept
    faces that do not touch each other.
    """

    half_angle: float
    axis: Vector = (0.0, 0.0, 1.0)
    axis_point: Vector = (0.0, 0.0, 0.0)
    radius_min: float = 0.0
    radius_max: float = math.inf
    several: bool = False

    def __post_init__(self) -> None:
        _check_direction("ConeFace.axis", self.axis)
        if not 0.0 < self.half_angle < math.pi / 2:
            raise GeometryError(f"ConeFace.half_angle = {self.half_angle:g}: must be between 0 and pi/2 (radians)")

    def matches(self, face: Face) -> bool:
        if face.axis is None or not _coaxial(face, self.axis, self.axis_point):
            return False
        if abs(face.axis.half_angle - self.half_angle) > ANGLE_TOLERANCE:
            return False
        return _between(face.radii(self.axis_point, self.axis), self.radius_min, self.radius_max)

    def __str__(self) -> str:
        text = f"conical face of half angle {math.degrees(self.half_angle):g} deg about {self.axis}"
        if self.radius_min > 0.0 or math.isfinite(self.radius_max):
            text += f", radius {1e3 * self.radius_min:g} to {1e3 * self.radius_max:g} mm"
        return text


@dataclass(frozen=True)
class PointFace:
    """The one face that contains ``point``, to ``tolerance`` (metres)."""

    point: Vector
    tolerance: float = LENGTH_TOLERANCE

    def matches(self, face: Face) -> bool:
        return face.distance(self.point) <= self.tolerance

    def __str__(self) -> str:
        return "face at the point ({:g}, {:g}, {:g}) mm".format(*(1e3 * c for c in self.point))


@dataclass(frozen=True)
class NamedFace:
    """The faces that the CAD file calls ``name``."""

    name: str
    several: bool = True

    def __post_init__(self) -> None:
        if not self.name:
            raise GeometryError("NamedFace.name = '': must not be empty")

    def matches(self, face: Face) -> bool:
        return face.name == self.name

    def __str__(self) -> str:
        return f"faces named {self.name!r}"


@dataclass(frozen=True)
class NumberedFace:
    """The faces with these ``numbers`` in the file's order, from 1, as `seatfem faces` shows them."""

    numbers: tuple[int, ...]
    several: bool = True

    def __post_init__(self) -> None:
        if not self.numbers or min(self.numbers) < 1:
            raise GeometryError(f"NumberedFace.numbers = {self.numbers}: must be one or more numbers from 1")

    def matches(self, face: Face) -> bool:
        return bool(set(self.numbers) & set(face.numbers))

    def __str__(self) -> str:
        return f"number {', '.join(map(str, self.numbers))}"


@dataclass(frozen=True)
class HalfPlaneFace:
    """The flat faces in the half plane that the z axis bounds at this ``azimuth`` (radians from the x axis).

    They are the cut faces of a sector.
    """

    azimuth: float
    several: bool = True

    def matches(self, face: Face) -> bool:
        if face.normal is None:
            return False
        c, s = math.cos(self.azimuth), math.sin(self.azimuth)
        along, across = face.outline @ (c, s, 0.0), face.outline @ (-s, c, 0.0)
        return bool(np.all(np.abs(across) < LENGTH_TOLERANCE) and np.all(along > -LENGTH_TOLERANCE))

    def __str__(self) -> str:
        return f"flat faces at the azimuth {math.degrees(self.azimuth):g} deg"


@dataclass(frozen=True)
class ColourFace:
    """The faces painted in one colour (red, green, blue, alpha: 0-255); ``tolerance`` is per channel."""

    colour: Colour
    tolerance: int = 3
    several: bool = True

    def __post_init__(self) -> None:
        if len(self.colour) != 4 or not all(0 <= c <= 255 for c in self.colour):
            raise GeometryError(f"ColourFace.colour = {self.colour}: must be four numbers from 0 to 255")

    def matches(self, face: Face) -> bool:
        return bool(face.colour) and all(
            abs(a - b) <= self.tolerance for a, b in zip(self.colour, face.colour, strict=True)
        )

    def __str__(self) -> str:
        return f"faces of colour {self.colour}"


Selector = PlaneFace | CylinderFace | ConeFace | PointFace | NamedFace | NumberedFace | HalfPlaneFace | ColourFace
Patches = dict[str, tuple[Selector, ...]]
"""Surface groups by name, each the union of the faces by its selectors."""

SELECTORS: dict[str, type[Selector]] = {
    "plane": PlaneFace,
    "cylinder": CylinderFace,
    "cone": ConeFace,
    "point": PointFace,
    "name": NamedFace,
    "number": NumberedFace,
    "half_plane": HalfPlaneFace,
    "colour": ColourFace,
}


def matching(faces: Sequence[Face], selector: Selector) -> list[Face]:
    """Return the faces that the selector means, however many."""
    chosen = [face for face in faces if selector.matches(face)]
    return selector.preferred(chosen) if isinstance(selector, CylinderFace) and chosen else chosen


def select(faces: Sequence[Face], selector: Selector, name: str) -> list[Face]:
    """Return the faces for the group ``name``.

    Raises `GeometryError`, with a list of the faces, if none matches, or if the matching faces do not touch each other
    although the selector needs one patch.
    """
    chosen = matching(faces, selector)
    if not chosen:
        lost = ""
        if isinstance(selector, NamedFace) and not any(face.name for face in faces):
            lost = ", and no face of the file has a name: names did not survive the export; select by another way"
        raise GeometryError(f"no face for {name!r} ({selector}{lost}); the solid has:\n{listing(faces)}")
    if isinstance(selector, NumberedFace) and (
        lacking := set(selector.numbers) - {n for f in chosen for n in f.numbers}
    ):
        problem = f"number {', '.join(map(str, sorted(lacking)))}"
        raise GeometryError(f"no face for {name!r} ({problem}); choose one of the solid's:\n{listing(faces)}")
    if isinstance(selector, PointFace):
        if len(chosen) > 1:
            raise GeometryError(
                f"ambiguous selection for {name!r} ({selector}): {len(chosen)} faces meet there; choose a point inside "
                f"one of them. They are:\n{listing(chosen)}"
            )
    elif not selector.several and not connected(chosen):
        raise GeometryError(
            f"ambiguous selection for {name!r} ({selector}): {len(chosen)} separate faces match; "
            f"narrow it, or set several = true. They are:\n{listing(chosen)}"
        )
    return chosen


def _between(radii: NDArray[np.float64], low: float, high: float) -> bool:
    return bool(np.all((radii > low - LENGTH_TOLERANCE) & (radii < high + LENGTH_TOLERANCE)))


def _coaxial(face: Face, direction: Vector, point: Vector) -> bool:
    assert face.axis is not None
    n = np.asarray(direction) / np.linalg.norm(direction)
    arm = np.asarray(face.axis.point) - point
    parallel = np.linalg.norm(np.cross(n, face.axis.direction)) < ANGLE_TOLERANCE
    return bool(parallel and np.linalg.norm(arm - (arm @ n) * n) < LENGTH_TOLERANCE)


def _check_direction(field: str, given: Vector) -> None:
    if not np.linalg.norm(given) > 0.0:
        raise GeometryError(f"{field} = {given}: must not be zero")
