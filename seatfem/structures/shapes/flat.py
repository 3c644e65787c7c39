"""Geometries of sheets of constant thickness: the disc, the ring plate, the disc held in its middle and the flapper."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import loops, selectors
from seatfem.structures.shapes.shape import Shape, key, require_above, require_below

ON_THE_EDGE: Final = 1e-6  # largest distance of a node from the edge of the hole on which it lies, over its radius
THINNER: Final = 'a sheet is thinner than it is wide; a solid reed is kind = "cad" or "mesh"'


class Flat(Shape):
    """A sheet with its underside at z = 0 (metres): a frozen dataclass with a ``thickness`` among its fields.

    The group "contact" is the upper side.
    """

    thickness: float

    @property
    @abstractmethod
    def centre(self) -> tuple[float, float]:
        """Return the centre of the contact [m]."""

    @property
    @abstractmethod
    def room(self) -> tuple[float, float]:
        """Return the radii of the smallest and the largest circle about the centre that lie on the sheet [m]; 0 for the
        smallest if there is no hole."""

    @property
    def length(self) -> float:
        """Return the largest x of the outline [m]."""
        return self.centre[0] + self.room[1]

    @property
    @abstractmethod
    def area(self) -> float:
        """Return the area of the outline [m^2]."""

    @property
    @abstractmethod
    def narrowest(self) -> float:
        """Return the width of the narrowest part that bends [m]."""

    @property
    def is_mirrored(self) -> bool:
        """Return whether sheet and clamp are exactly symmetric about the line y = 0: then one half is meshed."""
        return False

    @property
    def is_clamped(self) -> bool:
        """Return whether a part of the outline is clamped."""
        return True

    @property
    def held_loop(self) -> Array | None:
        """Return the loop (n, 3) around a hole whose edge is clamped; ``None`` if there is none."""
        return None

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of (n, 2) points [m] lie in the clamped part."""
        return np.zeros(len(points), dtype=bool)

    def regions(self, points: NDArray[np.float64]) -> NDArray[np.str_]:
        """Return the names of the parts on which (n, 2) points [m] lie."""
        return np.full(len(points), "plate")

    @property
    @abstractmethod
    def around(self) -> tuple[NDArray[np.float64], ...]:
        """Return the outline and then the holes as loops (n, 3) of `shapes.loops`, all anticlockwise."""

    @property
    def drawn(self) -> tuple[NDArray[np.float64], ...]:
        """Return the loops like `around`, but including a part that is cut off by the clamp."""
        return self.around

    def sheet(self, occ: Any) -> int:
        """Return the tag of the outline's surface (millimetres), added to the given gmsh OpenCASCADE model."""
        return int(occ.addPlaneSurface([loops.curve_loop(occ, loop) for loop in self.around]))

    @property
    def patches(self) -> selectors.Patches:
        return {"contact": (selectors.PlaneFace((0.0, 0.0, 1.0), self.thickness),)}

    def build(self, occ: Any) -> None:
        """Add the sheet (millimetres) to the given gmsh OpenCASCADE model."""
        occ.extrude([(2, self.sheet(occ))], 0.0, 0.0, 1e3 * self.thickness)


class Round(Flat):
    """An unsupported round sheet about the origin, with or without a round hole."""

    @property
    def centre(self) -> tuple[float, float]:
        return 0.0, 0.0

    @property
    def is_mirrored(self) -> bool:
        return True

    @property
    def is_clamped(self) -> bool:
        return False

    @property
    def area(self) -> float:
        hole, edge = self.room
        return math.pi / 4 * ((2 * edge) ** 2 - (2 * hole) ** 2)

    @property
    def around(self) -> tuple[Array, ...]:
        hole, edge = self.room
        return tuple(loops.whole(self.centre, radius) for radius in (edge, hole) if radius)


@dataclass(frozen=True)
class Disc(Round):
    """Round sheet about the origin, underside at z = 0 (metres). The group "contact" is the upper side."""

    family: ClassVar[str] = "disc"

    diameter: float = key("diameter")
    thickness: float = key("thickness, in the direction of the motion")

    def __post_init__(self) -> None:
        super().__post_init__()
        require_below(self, "thickness", self.diameter / 2, f"half the diameter: {THINNER}")

    @property
    def room(self) -> tuple[float, float]:
        return 0.0, self.diameter / 2

    @property
    def narrowest(self) -> float:
        return self.diameter


@dataclass(frozen=True)
class RingPlate(Round):
    """Annular sheet about the origin, underside at z = 0 (metres). The group "contact" is the upper side."""

    family: ClassVar[str] = "ring_plate"

    outer_diameter: float = key("outer diameter")
    inner_diameter: float = key("diameter of the hole")
    thickness: float = key("thickness, in the direction of the motion")

    def __post_init__(self) -> None:
        super().__post_init__()
        require_below(self, "inner_diameter", self.outer_diameter, "outer_diameter")
        require_below(self, "thickness", self.narrowest, f"the ring's radial width: {THINNER}")

    @property
    def room(self) -> tuple[float, float]:
        return self.inner_diameter / 2, self.outer_diameter / 2

    @property
    def narrowest(self) -> float:
        return (self.outer_diameter - self.inner_diameter) / 2


@dataclass(frozen=True)
class HeldDisc(RingPlate):
    """Annular sheet about the origin whose hole is clamped at its edge, underside at z = 0 (metres): a disc that is
    screwed on in its middle. The group "contact" is the upper side, "fixed" the wall of the hole."""

    family: ClassVar[str] = "held_disc"

    @property
    def is_clamped(self) -> bool:
        return True

    @property
    def held_loop(self) -> Array:
        return loops.whole(self.centre, self.inner_diameter / 2)

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.abs(np.hypot(*points.T) / (self.inner_diameter / 2) - 1) < ON_THE_EDGE)

    @property
    def patches(self) -> selectors.Patches:
        return {**super().patches, "fixed": (selectors.CylinderFace(self.inner_diameter / 2, several=True),)}


@dataclass(frozen=True)
class Flapper(Flat):
    """Sheet along the x axis, clamped at x = 0, underside at z = 0 (metres).

    The root narrows to the neck over ``taper_length``; the neck meets the paddle's circle at x = ``neck_length``. A
    slot with round ends, ``slot_length`` from end to end, may lie along the axis in the middle of the straight neck, a
    hole in the paddle's centre. The group "contact" is the upper side, "fixed" the root's end face.
    """

    family: ClassVar[str] = "flapper"

    root_width: float = key("width where it is clamped")
    taper_length: float = key("from the root, over which it narrows to the neck")
    neck_width: float = key("width of the neck")
    neck_length: float = key("from the clamped root to where the neck meets the paddle")
    paddle_diameter: float = key("diameter of the paddle")
    thickness: float = key("thickness, in the direction of the motion")
    slot_width: float | None = key("of a slot along the axis in the straight neck, its ends round", None)
    slot_length: float | None = key("of that slot from end to end; it lies in the neck's middle", None)
    hole_diameter: float | None = key("of a hole in the paddle's centre", None)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_below(self, "neck_width", self.root_width, "root_width: the root narrows to the neck", inclusive=True)
        require_below(self, "taper_length", self.neck_length, "neck_length, from the root to the paddle")
        require_above(self, "paddle_diameter", self.neck_width, "neck_width: the paddle is wider than the neck")
        require_below(self, "thickness", self.neck_width, f"neck_width: {THINNER}")
        if self.hole_diameter is not None:
            rim = self.paddle_diameter - 2 * self.thickness
            require_below(self, "hole_diameter", rim, "paddle_diameter less a rim as wide as the sheet is thick")
        for name, other in (("slot_width", "slot_length"), ("slot_length", "slot_width")):
            if getattr(self, name) is not None and getattr(self, other) is None:
                raise GeometryError(f"Flapper.{other} = None: {name} is given, a slot needs both")
        if self.slot_width is not None and self.slot_length is not None:
            sides = self.neck_width - 2 * self.thickness
            require_below(self, "slot_width", sides, "neck_width less two strips as wide as the sheet is thick")
            straight = self.neck_length - self.taper_length
            require_below(self, "slot_length", straight, "neck_length less taper_length: it lies in the straight neck")
            require_above(self, "slot_length", self.slot_width, "slot_width, for its ends are round")

    @property
    def centre(self) -> tuple[float, float]:
        """Return the centre of the paddle [m]."""
        return self.neck_length + math.sqrt(self.paddle_diameter**2 - self.neck_width**2) / 2, 0.0

    @property
    def room(self) -> tuple[float, float]:
        return (self.hole_diameter or 0.0) / 2, self.paddle_diameter / 2

    @property
    def slot(self) -> tuple[float, float, float]:
        """Return the centres of both round ends along x, and their radius [m]; (0, 0, 0) without a slot."""
        if self.slot_width is None or self.slot_length is None:
            return 0.0, 0.0, 0.0
        middle, half = (self.taper_length + self.neck_length) / 2, (self.slot_length - self.slot_width) / 2
        return middle - half, middle + half, self.slot_width / 2

    @property
    def is_mirrored(self) -> bool:
        return True

    @property
    def area(self) -> float:
        """Return the area of the outline [m^2]."""
        radius = self.paddle_diameter / 2
        cut = 2 * math.asin(self.neck_width / self.paddle_diameter)  # angle of the paddle's circle inside the neck
        paddle = math.pi * radius**2 - radius**2 / 2 * (cut - math.sin(cut))
        straight = (self.neck_length - self.taper_length) * self.neck_width
        start, end, slot = self.slot
        holes = math.pi * (slot**2 + self.room[0] ** 2) + 2 * slot * (end - start)
        return straight + self.taper_length * (self.root_width + self.neck_width) / 2 + paddle - holes

    @property
    def narrowest(self) -> float:
        neck = self.neck_width if self.slot_width is None else (self.neck_width - self.slot_width) / 2
        return min(neck, (self.paddle_diameter - (self.hole_diameter or 0.0)) / 2)

    def widths(self, n: int) -> tuple[tuple[float, float], ...]:
        """Return pairs (x, width) along the axis [m] from the root to the tip, where the width is zero; slot and hole
        are subtracted.

        The width is linear in between; round parts are replaced by up to ``n`` chords per quarter circle.
        """
        centre, radius, (start, end, slot) = self.centre[0], self.paddle_diameter / 2, self.slot
        turns = np.pi / 2 * np.arange(-n, n + 1) / n
        round_parts = [(centre, radius), (centre, self.room[0]), (start, slot), (end, slot)]
        places = np.concatenate([middle + size * np.sin(turns) for middle, size in round_parts if size])
        x = np.unique([0.0, self.taper_length, self.neck_length, *places[places > 0].round(12)])
        x = np.append(x[x < self.length * (1 - 1e-9)], self.length)

        def chord(middle: float, size: float) -> Array:
            return 2 * np.sqrt(np.maximum(size**2 - (x - middle) ** 2, 0.0))

        taper = np.interp(x, [0.0, self.taper_length], [self.root_width, self.neck_width])
        width = np.where(x < self.neck_length, taper, chord(centre, radius))
        within = (x > start) & (x < end)
        width -= np.where(within, 2 * slot, np.maximum(chord(start, slot), chord(end, slot)))
        width -= chord(centre, self.room[0])
        return tuple(zip(x.tolist(), width.tolist(), strict=True))

    def clamped(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.abs(points[:, 0]) < 1e-6 * self.length)

    def regions(self, points: NDArray[np.float64]) -> NDArray[np.str_]:
        ends = np.array([self.taper_length, self.neck_length])
        return np.array(["root", "neck", "paddle"])[np.searchsorted(ends, points[:, 0])]

    @property
    def patches(self) -> selectors.Patches:
        return {**super().patches, "fixed": (selectors.PlaneFace((-1.0, 0.0, 0.0), 0.0),)}

    @property
    def around(self) -> tuple[Array, ...]:
        """Return the loops; the paddle's circle consists of two arcs that meet at the tip, each slot end of two."""
        root, neck, taper, joint = self.root_width / 2, self.neck_width / 2, self.taper_length, self.neck_length
        x, (start, end, slot), (hole, paddle) = self.centre[0], self.slot, self.room
        half = math.tan((math.pi - math.asin(neck / paddle)) / 4)
        outline = [
            *((0.0, -root, 0.0), (taper, -neck, 0.0), (joint, -neck, half), (self.length, 0.0, half)),
            *((joint, neck, 0.0), (taper, neck, 0.0), (0.0, root, 0.0)),
        ]
        outlines = [np.array(outline)]
        if self.hole_diameter is not None:
            outlines.append(loops.whole((x, 0.0), hole))
        if slot:
            quarter = math.tan(math.pi / 8)
            first = [(start, slot, quarter), (start - slot, 0.0, quarter), (start, -slot, 0.0)]
            last = [(end, -slot, quarter), (end + slot, 0.0, quarter), (end, slot, 0.0)]
            outlines.append(np.array([*first, *last]))
        return tuple(outlines)
