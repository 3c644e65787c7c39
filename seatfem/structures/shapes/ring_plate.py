"""The ring plate: a flat annulus that nothing holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from impact.greens.base import Array
from seatfem.structures.shapes import loops
from seatfem.structures.shapes.flat import THINNER, Flat
from seatfem.structures.shapes.shape import key, require_below, require_positive


@dataclass(frozen=True)
class RingPlate(Flat):
    """Annular sheet about the origin, underside at z = 0 (metres). The group "contact" is the upper side."""

    family: ClassVar[str] = "ring_plate"

    outer_diameter: float = key("outer diameter")
    inner_diameter: float = key("diameter of the hole")
    thickness: float = key("thickness, in the direction of the motion")

    def __post_init__(self) -> None:
        require_positive(self, *vars(self))
        require_below(self, "inner_diameter", self.outer_diameter, "outer_diameter")
        require_below(self, "thickness", self.narrowest, f"the ring's radial width: {THINNER}")

    @property
    def centre(self) -> tuple[float, float]:
        return 0.0, 0.0

    @property
    def room(self) -> tuple[float, float]:
        return self.inner_diameter / 2, self.outer_diameter / 2

    @property
    def is_mirrored(self) -> bool:
        return True

    @property
    def area(self) -> float:
        return math.pi / 4 * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def narrowest(self) -> float:
        return (self.outer_diameter - self.inner_diameter) / 2

    @property
    def is_clamped(self) -> bool:
        return False

    @property
    def around(self) -> tuple[Array, ...]:
        hole, edge = self.room
        return loops.whole(self.centre, edge), loops.whole(self.centre, hole)
