"""The disc: a round flat plate that nothing holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from impact.greens.base import Array
from seatfem.structures.shapes import loops
from seatfem.structures.shapes.flat import THINNER, Flat
from seatfem.structures.shapes.shape import key, require_below, require_positive


@dataclass(frozen=True)
class Disc(Flat):
    """Round sheet about the origin, underside at z = 0 (metres). The group "contact" is the upper side."""

    family: ClassVar[str] = "disc"

    diameter: float = key("diameter")
    thickness: float = key("thickness, in the direction of the motion")

    def __post_init__(self) -> None:
        require_positive(self, *vars(self))
        require_below(self, "thickness", self.diameter / 2, f"half the diameter: {THINNER}")

    @property
    def centre(self) -> tuple[float, float]:
        return 0.0, 0.0

    @property
    def room(self) -> tuple[float, float]:
        return 0.0, self.diameter / 2

    @property
    def is_mirrored(self) -> bool:
        return True

    @property
    def area(self) -> float:
        return math.pi / 4 * self.diameter**2

    @property
    def narrowest(self) -> float:
        return self.diameter

    @property
    def is_clamped(self) -> bool:
        return False

    @property
    def around(self) -> tuple[Array, ...]:
        return (loops.whole(self.centre, self.diameter / 2),)
