"""The stopper: the disc, flat or domed, that limits a valve's lift."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from impact.greens.base import Array
from seatfem.structures.shapes.faces import Vector
from seatfem.structures.shapes.profile import Edge, Point, Profile, polygon
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import Patches, PlaneFace, PointFace
from seatfem.structures.shapes.shape import (
    EVERYWHERE,
    Plan,
    PlanSamples,
    circle_points,
    key,
    require_above,
    require_below,
    require_positive,
    squares,
)

INSIDE = 1e-2  # radians from the plane y = 0


@dataclass(frozen=True)
class Stopper(Turning):
    """Solid disc about z, underside at z = 0 (metres).

    The group "contact" is the patch, "fixed" the underside; a meridian's edge on the axis is called "axis".
    """

    family: ClassVar[str] = "stopper"

    radius: float = key("radius of the disc", 6e-3)
    thickness: float = key("thickness of the disc, at its axis", 5e-3)
    contact_radius: float = key("radius of the contact face", 2e-3)
    dome_radius: float | None = key("radius of the spherical top; a flat one if absent", None)

    def __post_init__(self) -> None:
        require_positive(self, "radius", "thickness", "contact_radius")
        require_below(self, "contact_radius", self.radius, "the radius", inclusive=True)
        if self.dome_radius is None:
            return
        require_positive(self, "dome_radius")
        require_above(self, "dome_radius", self.radius, "the radius")
        require_above(self, "thickness", self.thickness - self.top(self.radius), "the dome's height")

    def top(self, r: float) -> float:
        """Return the height of the upper side at the radius r."""
        if self.dome_radius is None:
            return self.thickness
        return self.thickness - self.dome_radius + math.sqrt(self.dome_radius**2 - r * r)

    @property
    def patches(self) -> Patches:
        contact = (
            PlaneFace((0.0, 0.0, 1.0), self.thickness, radius_max=self.contact_radius)
            if self.dome_radius is None
            else PointFace(self._inside_patch)
        )
        return {"contact": (contact,), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}

    @property
    def _inside_patch(self) -> Vector:
        """Return a point of the patch beside the axis and within every sector."""
        r = self.contact_radius / 2
        return r * math.cos(INSIDE), r * math.sin(INSIDE), self.top(r)

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

    @property
    def plan(self) -> Plan:
        return Plan(self.thickness, {"contact": ("patch",)}, {"fixed": (EVERYWHERE,)})

    @property
    def dome(self) -> Callable[[Array], Array] | None:
        if self.dome_radius is None:
            return None
        radius, thickness = self.dome_radius, self.thickness
        return lambda points: np.asarray(thickness - radius + np.sqrt(radius**2 - np.sum(points**2, axis=1)))

    def areas(self, occ: Any) -> dict[str, list[int]]:
        """Add the disc (millimetres) and the patch in it, in the given gmsh OpenCASCADE model."""
        disc, patch = (occ.addDisk(0, 0, 0, 1e3 * r, 1e3 * r) for r in (self.radius, self.contact_radius))
        _, pieces = occ.fragment([(2, disc)], [(2, patch)])
        return {"patch": [tag for _, tag in pieces[1]]}

    def plan_samples(self) -> PlanSamples:
        radius, patch = self.radius, self.contact_radius

        def distance(points: Array) -> Array:
            return np.asarray(np.hypot(points[:, 0], points[:, 1]) - patch)

        points, areas = squares((-radius, -radius), (radius, radius), distance)
        kept = np.hypot(points[:, 0], points[:, 1]) < radius
        return points[kept], areas[kept], *circle_points(np.zeros((1, 2)), radius), distance
