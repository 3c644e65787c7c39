"""The ball: a sphere with a small flat facet at its pole."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from seatfem.structures.shapes.profile import Edge, Profile
from seatfem.structures.shapes.revolved import Turning
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from seatfem.structures.shapes.shape import require_below, require_positive


@dataclass(frozen=True)
class Ball(Turning):
    """Solid sphere about z that touches the plane z = 0 (metres), cut off flat at its upper pole.

    The group "contact" is the facet, a disc of ``contact_radius``; nothing is clamped.
    """

    family: ClassVar[str] = "ball"

    diameter: float
    contact_radius: float

    def __post_init__(self) -> None:
        require_positive(self, "diameter", "contact_radius")
        require_below(self, "contact_radius", self.diameter / 4, "half of the ball's radius: a facet is small")

    @property
    def top(self) -> float:
        """Return the height of the facet [m]."""
        radius = self.diameter / 2
        return radius + math.sqrt(radius**2 - self.contact_radius**2)

    @property
    def patches(self) -> Patches:
        return {"contact": (PlaneFace((0.0, 0.0, 1.0), self.top),)}

    @property
    def profile(self) -> Profile:
        """Return the half section, its side on the axis included."""
        radius = self.diameter / 2
        pole, side, rim, middle = (0.0, 0.0), (radius, radius), (self.contact_radius, self.top), (0.0, self.top)
        round_parts = Edge(pole, side, (0.0, radius)), Edge(side, rim, (0.0, radius))
        return Profile((*round_parts, Edge(rim, middle, name="contact"), Edge(middle, pole, name="axis")))
