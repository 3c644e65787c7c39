"""The conical valve seat: a ring whose port has a conical face, as under a poppet valve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.profile import Point, Profile, polygon
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import ConeFace, Patches, PlaneFace
from seatfem.structures.shapes.shape import key, require_above, require_below, require_positive


@dataclass(frozen=True)
class ConicalSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres, radians).

    The bore widens upwards in a cone; the group "contact" is a band in the middle of it, "fixed" the underside.
    """

    family: ClassVar[str] = "conical"

    bore_radius: float = key("radius of the port", 4e-3)
    half_angle: float = key("between the cone's generators and the axis", "45 deg", "angle")
    face_width: float = key("width of the cone along its generators", 2e-3)
    contact_width: float | None = key("width of the band that is struck; all of the cone if absent", None)
    outer_radius: float = key("radius of the ring", "12 mm")
    thickness: float = key("thickness of the ring", "8 mm")

    def __post_init__(self) -> None:
        require_positive(self, "bore_radius", "face_width", "outer_radius", "thickness")
        if not 0.0 < self.half_angle < math.pi / 2:
            raise GeometryError(f"ConicalSeat.half_angle = {self.half_angle:g}: must be between 0 and pi/2 (radians)")
        if self.contact_width is not None:
            require_positive(self, "contact_width")
            require_below(self, "contact_width", self.face_width, "the face_width", inclusive=True)
        require_above(self, "thickness", self.face_width * math.cos(self.half_angle), "the cone's depth")
        require_above(self, "outer_radius", self._along(self.face_width)[0], "cone's top")

    @property
    def band(self) -> tuple[float, float]:
        """Return the contact's distances from the cone's lower edge, along a generator."""
        width = self.face_width if self.contact_width is None else self.contact_width
        return (self.face_width - width) / 2, (self.face_width + width) / 2

    @property
    def patches(self) -> Patches:
        low, high = (self._along(s)[0] for s in self.band)
        contact = ConeFace(self.half_angle, radius_min=low, radius_max=high)
        return {"contact": (contact,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

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
