"""The disc that limits a valve's lift."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from seatfem.fields import Length, of_same_names
from seatfem.structures.kinds.drawn import Turned
from seatfem.structures.shapes import Stopper


class StopperSeat(Turned):
    """A disc, flat or domed, struck around its axis: the stop that limits a valve's lift."""

    sample: ClassVar[str] = """
radius = "8 mm"
thickness = "5 mm"
contact_radius = "1 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["stopper"]
    radius: Length = Field(description="radius of the disc")
    thickness: Length = Field(description="thickness of the disc, at its axis")
    contact_radius: Length = Field(description="radius of the contact face")
    dome_radius: Length | None = Field(None, description="radius of the spherical top; a flat one if absent")

    def geometry(self) -> Stopper:
        return of_same_names(Stopper, self)

    def struck_part(self) -> tuple[float, float, float]:
        return self.struck_area, self.contact_radius, self.thickness
