"""The annular valve seat: a circular plate with a port bore and a raised, rounded lip around it, or a flat one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seatfem.structures.shapes.profile import Edge, Point, Profile, polygon
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import require_above, require_below, require_positive


@dataclass(frozen=True)
class AnnularSeat(Turning):
    """Solid of revolution about z, underside at z = 0 (metres).

    ``bore_radius``: of the port. ``lip_width``: radial, edges included. ``lip_height``: above the plate; 0 for a flat
    seat, whose contact is the innermost ring of width ``lip_width`` (it needs ``lip_edge_radius`` = 0).
    ``lip_edge_radius``: of both upper edges, 0 for sharp ones. ``outer_radius``, ``thickness``: of the plate.
    The group "contact" is the flat top of the lip, "fixed" the underside.
    """

    family: ClassVar[str] = "annular"

    bore_radius: float = 4e-3
    lip_width: float = 1e-3
    lip_height: float = 0.5e-3
    lip_edge_radius: float = 0.1e-3
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

    @property
    def patches(self) -> Patches:
        top, edge = self.thickness + self.lip_height, self.lip_edge_radius
        inner, outer = self.bore_radius + edge, self.bore_radius + self.lip_width - edge
        contact = PlaneFace((0.0, 0.0, 1.0), top, radius_min=inner, radius_max=outer)
        return {"contact": (contact,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def profile(self) -> Profile:
        """The half section."""
        bore, lip, r = self.bore_radius, self.bore_radius + self.lip_width, self.lip_edge_radius
        plate, top = self.thickness, self.thickness + self.lip_height
        base: list[Point] = [(bore, 0.0), (self.outer_radius, 0.0), (self.outer_radius, plate), (lip, plate)]
        if self.lip_height == 0.0:
            return Profile(polygon([*base, (bore, plate)], ["fixed", "", "", "contact", ""]))
        if r == 0.0:
            return Profile(polygon([*base, (lip, top), (bore, top)], ["fixed", "", "", "", "contact", ""]))
        points = [*base, (lip, top - r), (lip - r, top), (bore + r, top), (bore, top - r)]
        edges = list(polygon(points, ["fixed", "", "", "", "", "contact", "", ""]))
        edges[4] = Edge(points[4], points[5], (lip - r, top - r))
        edges[6] = Edge(points[6], points[7], (bore + r, top - r))
        return Profile(tuple(edges))
