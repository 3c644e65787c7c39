"""The annular valve seat: a circular plate with a port bore and a raised, rounded lip around it, or a flat one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from seatfem.structures.shapes.profile import Point, Profile, polygon, rounded
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import key, require_above, require_below, require_positive

PER_FILLET: Final = 16
"""Elements along the quarter circle of a fillet: its largest stress is right to 1 %."""


@dataclass(frozen=True)
class AnnularSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres).

    The group "contact" is the flat top of the lip, of a flat seat its innermost ring of width ``lip_width`` (it needs
    ``lip_edge_radius`` = 0); "fixed" is the underside.
    """

    family: ClassVar[str] = "annular"

    bore_radius: float = key("radius of the port", 4e-3)
    lip_width: float = key("radial width of the lip, its rounded edges included", 1e-3)
    lip_height: float = key("height of the lip above the plate; 0 mm for a flat seat", "0.5 mm", "gap")
    lip_edge_radius: float = key("radius of the lip's upper edges; 0 mm for sharp ones", "0.1 mm", "gap")
    lip_fillet: float = key(
        "radius of the fillet at the lip's foot; 0 mm for a sharp corner, where elastic stress has no limit",
        "0 mm",
        "gap",
    )
    outer_radius: float = key("radius of the plate", "12 mm")
    thickness: float = key("thickness of the plate", "8 mm")

    def __post_init__(self) -> None:
        require_positive(self, "bore_radius", "lip_width", "outer_radius", "thickness")
        if self.lip_height != 0.0:
            require_positive(self, "lip_height")
        if self.lip_edge_radius != 0.0:
            require_positive(self, "lip_edge_radius")
            require_below(self, "lip_edge_radius", self.lip_width / 2, "half the lip_width: the lip needs a flat top")
            require_below(self, "lip_edge_radius", self.lip_height, "the lip_height")
        require_above(self, "outer_radius", self.bore_radius + self.lip_width, "bore_radius + lip_width")
        if self.lip_fillet != 0.0:
            require_positive(self, "lip_fillet")
            room = self.lip_height - self.lip_edge_radius
            require_below(self, "lip_fillet", room, "lip_height less lip_edge_radius: the side's flat part")
            room = self.outer_radius - self.bore_radius - self.lip_width
            require_below(self, "lip_fillet", room, "the plate's width beside the lip")

    @property
    def patches(self) -> Patches:
        top, edge = self.thickness + self.lip_height, self.lip_edge_radius
        inner, outer = self.bore_radius + edge, self.bore_radius + self.lip_width - edge
        contact = PlaneFace((0.0, 0.0, 1.0), top, radius_min=inner, radius_max=outer)
        return {"contact": (contact,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def profile(self) -> Profile:
        """Return the half section."""
        bore, lip = self.bore_radius, self.bore_radius + self.lip_width
        plate, top = self.thickness, self.thickness + self.lip_height
        base: list[Point] = [(bore, 0.0), (self.outer_radius, 0.0), (self.outer_radius, plate), (lip, plate)]
        if self.lip_height == 0.0:
            return Profile(polygon([*base, (bore, plate)], ["fixed", "", "", "contact", ""]))
        edges = polygon([*base, (lip, top), (bore, top)], ["fixed", "", "", "", "contact", ""])
        for corner in ((lip, top), (bore, top)):
            edges = rounded(edges, corner, self.lip_edge_radius)
        return Profile(rounded(edges, (lip, plate), self.lip_fillet, PER_FILLET))
