"""The annular valve seat: a circular plate with a port bore and a raised, rounded lip around it, or a flat one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from seatfem.structures.shapes.profile import Point, Profile, polygon, rounded
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import require_above, require_below, require_positive

PER_FILLET: Final = 16
"""Elements along the quarter circle of a fillet: its largest stress is right to 1 %."""


@dataclass(frozen=True)
class AnnularSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres).

    ``bore_radius``: of the port. ``lip_width``: radial, edges included. ``lip_height``: above the plate; 0 for a flat
    seat, whose contact is the innermost ring of width ``lip_width`` (it needs ``lip_edge_radius`` = 0).
    ``lip_edge_radius``: of both upper edges, 0 for sharp ones. ``lip_fillet``: radius of the fillet at the lip's foot,
    between its outer side and the plate, 0 for a sharp corner. ``outer_radius``, ``thickness``: of the plate.
    The group "contact" is the flat top of the lip, "fixed" the underside.
    """

    family: ClassVar[str] = "annular"

    bore_radius: float = 4e-3
    lip_width: float = 1e-3
    lip_height: float = 0.5e-3
    lip_edge_radius: float = 0.1e-3
    lip_fillet: float = 0.0
    outer_radius: float = 12e-3
    thickness: float = 8e-3

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
