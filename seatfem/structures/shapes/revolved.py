"""Geometries of solids of revolution, and their construction in gmsh: seats, stoppers and the ball."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from seatfem.structures.errors import GeometryError
from seatfem.structures.rings import ring_borders
from seatfem.structures.shapes import selectors, shape
from seatfem.structures.shapes.profile import Edge, Point, Profile, polygon, rounded
from seatfem.units import write_quantity


class Turning(shape.Shape):
    """A solid of revolution about z, built from its ``profile``."""

    @property
    @abstractmethod
    def profile(self) -> Profile:
        """Return the half section."""

    def build(self, occ: Any) -> None:
        """Revolve the profile once around, in the given gmsh OpenCASCADE model."""
        section, _ = _surface(self.profile, occ, lambda r, z: (r, 0.0, z))
        occ.revolve([(2, section)], 0, 0, 0, 0, 0, 1, 2 * math.pi)
        occ.remove([(2, section)], recursive=True)


@dataclass(frozen=True)
class Drawing:
    """Curve tags of a section: ``groups`` by name; ``arcs``: arc -> least number of elements."""

    groups: dict[str, list[int]]
    arcs: dict[int, int]


def section(spec: Turning, occ: Any, rings: int = 1) -> Drawing:
    """Add the profile as a surface in the plane x = r, y = z, with corners of the contact edge at the borders of rings;
    return its curves."""
    profile = spec.profile.cut("contact", ring_borders(rings)[1:-1].tolist())
    _, curves = _surface(profile, occ, lambda r, z: (r, z, 0.0))
    groups: dict[str, list[int]] = {name: [] for name in profile.names}
    for edge, tag in zip(profile.edges, curves, strict=True):
        if edge.name:
            groups[edge.name].append(tag)
    arcs = {tag: edge.elements for edge, tag in zip(profile.edges, curves, strict=True) if edge.centre is not None}
    return Drawing(groups, arcs)


def _surface(profile: Profile, occ: Any, place: Any) -> tuple[int, list[int]]:
    def point(where: Point) -> int:
        return int(occ.addPoint(*place(1e3 * where[0], 1e3 * where[1])))

    corners = [point(edge.start) for edge in profile.edges]
    curves, centres = [], []
    for edge, a, b in zip(profile.edges, corners, corners[1:] + corners[:1], strict=True):
        if edge.centre is None:
            curves.append(int(occ.addLine(a, b)))
        else:
            centres.append(point(edge.centre))
            curves.append(int(occ.addCircleArc(a, centres[-1], b)))
    occ.remove([(0, tag) for tag in centres])
    return int(occ.addPlaneSurface([occ.addCurveLoop(curves)])), curves


PER_FILLET: Final = 16
"""Number of elements along the quarter circle of a fillet, for an error of its largest stress of 1 %."""


@dataclass(frozen=True)
class AnnularSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres).

    The group "contact" is the flat top of the lip, of a flat seat its innermost ring of width ``lip_width`` (it needs
    ``lip_edge_radius`` = 0), and that of a second lip around an annular port; "fixed" is the underside.
    """

    family: ClassVar[str] = "annular"

    bore_radius: float = shape.key("radius of the port", 4e-3)
    lip_width: float = shape.key("radial width of the lip, its rounded edges included", 1e-3)
    lip_height: float = shape.key("height of the lip above the plate; 0 mm for a flat seat", "0.5 mm", "gap")
    lip_edge_radius: float = shape.key("radius of the lip's upper edges; 0 mm for sharp ones", "0.1 mm", "gap")
    lip_fillet: float = shape.key(
        "radius of the fillet at the lip's foot; 0 mm for a sharp corner, where elastic stress has no limit",
        "0 mm",
        "gap",
    )
    second_lip_radius: float | None = shape.key(
        "inner radius of a second lip of the same height, beyond an annular port that both seal; absent: one lip",
        None,
    )
    second_lip_width: float | None = shape.key("radial width of the second lip; absent: lip_width", None)
    port_depth: float = shape.key("depth of the annular port between two lips, below the plate's top", "0 mm", "gap")
    outer_radius: float = shape.key("radius of the plate", "12 mm")
    thickness: float = shape.key("thickness of the plate", "8 mm")

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_second()
        if self.lip_edge_radius != 0.0:
            narrowest = min(high - low for low, high in self.lips)
            shape.require_below(self, "lip_edge_radius", narrowest / 2, "half the lip_width: the lip needs a flat top")
            shape.require_below(self, "lip_edge_radius", self.lip_height, "the lip_height")
        shape.require_above(self, "outer_radius", self.bore_radius + self.lip_width, "bore_radius + lip_width")
        if self.lip_fillet != 0.0:
            room = self.lip_height - self.lip_edge_radius
            shape.require_below(self, "lip_fillet", room, "lip_height less lip_edge_radius: the side's flat part")
            room = self.outer_radius - self.lips[-1][1]
            shape.require_below(self, "lip_fillet", room, "the plate's width beside the lip")
            if len(self.lips) > 1:
                half = (self.lips[1][0] - self.lips[0][1]) / 2
                shape.require_below(self, "lip_fillet", half, "half the width of the annular port")

    def _check_second(self) -> None:
        """Raise `GeometryError` of a second lip that overlaps the first or leaves the plate, and of keys without it."""
        if self.second_lip_radius is None:
            for name in ("second_lip_width", "port_depth"):
                if getattr(self, name):
                    length = write_quantity(getattr(self, name), "length")
                    raise GeometryError(
                        f"AnnularSeat.{name} = {length}: has no effect without second_lip_radius; state it, or remove "
                        f"{name}"
                    )
            return
        first = self.bore_radius + self.lip_width
        shape.require_above(self, "second_lip_radius", first, "bore_radius + lip_width: the lips must not overlap")
        shape.require_above(self, "outer_radius", self.lips[-1][1], "second_lip_radius + second_lip_width")
        shape.require_below(self, "port_depth", self.thickness, "the thickness")

    @property
    def lips(self) -> tuple[tuple[float, float], ...]:
        """Return the inner and the outer radius of each lip, rounded edges included [m]."""
        first = (self.bore_radius, self.bore_radius + self.lip_width)
        if (radius := self.second_lip_radius) is None:
            return (first,)
        return first, (radius, radius + (self.lip_width if self.second_lip_width is None else self.second_lip_width))

    @property
    def patches(self) -> selectors.Patches:
        top, edge = self.thickness + self.lip_height, self.lip_edge_radius
        contact = tuple(
            selectors.PlaneFace((0.0, 0.0, 1.0), top, radius_min=low + edge, radius_max=high - edge)
            for low, high in self.lips
        )
        return {"contact": contact, "fixed": (selectors.PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def profile(self) -> Profile:
        """Return the half section."""
        plate, top, floor = self.thickness, self.thickness + self.lip_height, self.thickness - self.port_depth
        points: list[Point] = [(self.bore_radius, 0.0), (self.outer_radius, 0.0), (self.outer_radius, plate)]
        names, feet = ["fixed", "", ""], []
        for number, (low, high) in enumerate(reversed(self.lips)):
            outside = plate if number == 0 else floor
            if outside != top:
                points, names = [*points, (high, outside)], [*names, ""]
                feet.append((high, outside))
            points, names = [*points, (high, top), (low, top)], [*names, "contact", ""]
            if number + 1 < len(self.lips) and floor != top:
                points, names = [*points, (low, floor)], [*names, ""]
                feet.append((low, floor))
        edges = polygon(points, names)
        for corner in (corner for low, high in self.lips for corner in ((high, top), (low, top))):
            edges = rounded(edges, corner, self.lip_edge_radius)
        for corner in feet:
            edges = rounded(edges, corner, self.lip_fillet, PER_FILLET)
        return Profile(edges)


@dataclass(frozen=True)
class ConicalSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres, radians).

    The bore widens upwards in a cone; the group "contact" is a band in the middle of it, "fixed" the underside.
    """

    family: ClassVar[str] = "conical"

    bore_radius: float = shape.key("radius of the port", 4e-3)
    half_angle: float = shape.key("between the cone's generators and the axis", "45 deg", "angle")
    face_width: float = shape.key("width of the cone along its generators", 2e-3)
    contact_width: float | None = shape.key("width of the band that is struck; all of the cone if absent", None)
    outer_radius: float = shape.key("radius of the ring", "12 mm")
    thickness: float = shape.key("thickness of the ring", "8 mm")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.half_angle < math.pi / 2:
            raise GeometryError(f"ConicalSeat.half_angle = {self.half_angle:g}: must be between 0 and pi/2 (radians)")
        if self.contact_width is not None:
            shape.require_below(self, "contact_width", self.face_width, "the face_width", inclusive=True)
        shape.require_above(self, "thickness", self.face_width * math.cos(self.half_angle), "the cone's depth")
        shape.require_above(self, "outer_radius", self._along(self.face_width)[0], "cone's top")

    @property
    def band(self) -> tuple[float, float]:
        """Return the contact's distances from the cone's lower edge, along a generator."""
        width = self.face_width if self.contact_width is None else self.contact_width
        return (self.face_width - width) / 2, (self.face_width + width) / 2

    @property
    def patches(self) -> selectors.Patches:
        low, high = (self._along(s)[0] for s in self.band)
        contact = selectors.ConeFace(self.half_angle, radius_min=low, radius_max=high)
        return {"contact": (contact,), "fixed": (selectors.PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def profile(self) -> Profile:
        """Return the half section."""
        low, high = self.band
        marks = [self.face_width, high, low, 0.0] if low > 0.0 else [high, low]
        cone = ["", "contact", ""] if low > 0.0 else ["contact"]
        base: list[Point] = [(self.bore_radius, 0.0), (self.outer_radius, 0.0), (self.outer_radius, self.thickness)]
        return Profile(polygon([*base, *map(self._along, marks)], ["fixed", "", "", *cone, ""]))

    def _along(self, distance: float) -> Point:
        """Return (r, z) on the cone at this distance from its lower edge."""
        down = self.face_width - distance
        return (
            self.bore_radius + distance * math.sin(self.half_angle),
            self.thickness - down * math.cos(self.half_angle),
        )


@dataclass(frozen=True)
class Ball(Turning):
    """Solid sphere about z that touches the plane z = 0 (metres), cut off flat at its upper pole.

    The group "contact" is the facet, a disc of ``contact_radius``; nothing is clamped.
    """

    family: ClassVar[str] = "ball"

    diameter: float
    contact_radius: float

    def __post_init__(self) -> None:
        shape.require_positive(self, "diameter", "contact_radius")
        shape.require_below(self, "contact_radius", self.diameter / 4, "half of the ball's radius: a facet is small")

    @property
    def top(self) -> float:
        """Return the height of the facet [m]."""
        radius = self.diameter / 2
        return radius + math.sqrt(radius**2 - self.contact_radius**2)

    @property
    def patches(self) -> selectors.Patches:
        return {"contact": (selectors.PlaneFace((0.0, 0.0, 1.0), self.top),)}

    @property
    def profile(self) -> Profile:
        """Return the half section, its side on the axis included."""
        radius = self.diameter / 2
        pole, side, rim, middle = (0.0, 0.0), (radius, radius), (self.contact_radius, self.top), (0.0, self.top)
        round_parts = Edge(pole, side, (0.0, radius)), Edge(side, rim, (0.0, radius))
        return Profile((*round_parts, Edge(rim, middle, name="contact"), Edge(middle, pole, name="axis")))


INSIDE = 1e-2  # azimuth of a point that lies in every sector [rad]


@dataclass(frozen=True)
class Stopper(Turning):
    """Solid disc about z, underside at z = 0 (metres).

    The group "contact" is the patch, "fixed" the underside; a meridian's edge on the axis is called "axis".
    """

    family: ClassVar[str] = "stopper"

    radius: float = shape.key("radius of the disc", 6e-3)
    thickness: float = shape.key("thickness of the disc, at its axis", 5e-3)
    contact_radius: float = shape.key("radius of the contact face", 2e-3)
    dome_radius: float | None = shape.key("radius of the spherical top; a flat one if absent", None)

    def __post_init__(self) -> None:
        super().__post_init__()
        shape.require_below(self, "contact_radius", self.radius, "the radius", inclusive=True)
        if self.dome_radius is None:
            return
        shape.require_above(self, "dome_radius", self.radius, "the radius")
        shape.require_above(self, "thickness", self.thickness - self.top(self.radius), "the dome's height")

    def top(self, r: float) -> float:
        """Return the height of the upper side at the radius r."""
        if self.dome_radius is None:
            return self.thickness
        return self.thickness - self.dome_radius + math.sqrt(self.dome_radius**2 - r * r)

    @property
    def patches(self) -> selectors.Patches:
        r = self.contact_radius / 2
        beside_the_axis = r * math.cos(INSIDE), r * math.sin(INSIDE), self.top(r)
        contact = (
            selectors.PlaneFace((0.0, 0.0, 1.0), self.thickness, radius_max=self.contact_radius)
            if self.dome_radius is None
            else selectors.PointFace(beside_the_axis)
        )
        return {"contact": (contact,), "fixed": (selectors.PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def profile(self) -> Profile:
        """Return the half section, its side on the axis included."""
        rim: list[Point] = [(0.0, 0.0), (self.radius, 0.0), (self.radius, self.top(self.radius))]
        split = self.contact_radius < self.radius
        ring: list[Point] = [(self.contact_radius, self.top(self.contact_radius))] if split else []
        names = ["fixed", "", *([""] if split else []), "contact", "axis"]
        edges = polygon([*rim, *ring, (0.0, self.thickness)], names)
        if self.dome_radius is None:
            return Profile(edges)
        centre = (0.0, self.thickness - self.dome_radius)
        domed = tuple(Edge(edge.start, edge.end, centre, edge.name) for edge in edges[2:-1])
        return Profile((*edges[:2], *domed, edges[-1]))
