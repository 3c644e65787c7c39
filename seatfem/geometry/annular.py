"""The annular valve seat: a circular plate with a port bore and a raised, rounded lip around it."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

from seatfem.geometry.checks import GeometryError, require_below, require_positive
from seatfem.geometry.faces import Patches, PlaneFace


@dataclass(frozen=True)
class AnnularSeat:
    """Solid of revolution about z, underside at z = 0 (metres).

    ``bore_radius``: of the port. ``lip_width``: radial, edges included. ``lip_height``: above the plate.
    ``lip_edge_radius``: of both upper edges, 0 for sharp ones. ``outer_radius``, ``thickness``: of the plate.
    The group "contact" is the flat top of the lip, "fixed" the underside.
    """

    bore_radius: float = 4e-3
    lip_width: float = 1e-3
    lip_height: float = 0.5e-3
    lip_edge_radius: float = 0.1e-3
    outer_radius: float = 12e-3
    thickness: float = 8e-3

    def __post_init__(self) -> None:
        require_positive(self, "bore_radius", "lip_width", "lip_height", "outer_radius", "thickness")
        if self.lip_edge_radius != 0.0:
            require_positive(self, "lip_edge_radius")
        require_below(self, "lip_edge_radius", self.lip_width / 2, "half the lip_width: the lip needs a flat top")
        require_below(self, "lip_edge_radius", self.lip_height, "the lip_height")
        lip_radius = self.bore_radius + self.lip_width
        if self.outer_radius <= lip_radius:
            raise GeometryError(
                f"AnnularSeat.outer_radius = {self.outer_radius:g} m: "
                f"must be > {lip_radius:g} m (bore_radius + lip_width)"
            )

    @property
    def patches(self) -> Patches:
        top = PlaneFace((0.0, 0.0, 1.0), self.thickness + self.lip_height)
        return {"contact": (top,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}


def build(seat: AnnularSeat, occ: Any) -> None:
    """Revolve the half section (millimetres) in the given gmsh OpenCASCADE model."""
    bore, width, height = 1e3 * seat.bore_radius, 1e3 * seat.lip_width, 1e3 * seat.lip_height
    edge, outer, plate = 1e3 * seat.lip_edge_radius, 1e3 * seat.outer_radius, 1e3 * seat.thickness
    lip, top = bore + width, plate + height

    def point(r: float, z: float) -> int:
        return int(occ.addPoint(r, 0.0, z))

    corners = [point(bore, 0.0), point(outer, 0.0), point(outer, plate), point(lip, plate)]
    if edge == 0.0:
        corners += [point(lip, top), point(bore, top)]
        outline = [occ.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    else:
        outside = [point(lip, top - edge), point(lip - edge, top - edge), point(lip - edge, top)]
        inside = [point(bore + edge, top), point(bore + edge, top - edge), point(bore, top - edge)]
        path = [*corners, outside[0]]
        outline = [occ.addLine(a, b) for a, b in itertools.pairwise(path)]
        outline += [occ.addCircleArc(*outside), occ.addLine(outside[-1], inside[0])]
        outline += [occ.addCircleArc(*inside), occ.addLine(inside[-1], corners[0])]
        occ.remove([(0, outside[1]), (0, inside[1])])
    section = occ.addPlaneSurface([occ.addCurveLoop(outline)])
    occ.revolve([(2, section)], 0, 0, 0, 0, 0, 1, 2 * math.pi)
    occ.remove([(2, section)], recursive=True)
