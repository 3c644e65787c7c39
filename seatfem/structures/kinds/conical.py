"""The conical seat, as under a poppet valve."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from seatfem.fields import Angle, Length, default, of_same_names
from seatfem.structures.estimates.patch import Column
from seatfem.structures.kinds.drawn import Turned
from seatfem.structures.shapes import ConicalSeat


class Conical(Turned):
    """A ring whose port widens in a cone, as under a poppet valve; a band in the middle of the cone is struck."""

    sample: ClassVar[str] = """
bore_radius = "4 mm"
face_width = "2 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["conical"]
    bore_radius: Length = Field(description="radius of the port")
    half_angle: Angle = default("45 deg", "between the cone's generators and the axis")
    face_width: Length = Field(description="width of the cone along its generators")
    contact_width: Length | None = Field(
        None, description="width of the band that is struck; all of the cone if absent"
    )
    outer_radius: Length = default("12 mm", "radius of the ring")
    thickness: Length = default("8 mm", "thickness of the ring")

    def geometry(self) -> ConicalSeat:
        return of_same_names(ConicalSeat, self)

    def struck_part(self) -> tuple[float, float, float]:
        start, end = self.geometry().band
        return self.struck_area, end - start, self.thickness

    def column(self) -> Column | None:
        """Return the column under the band as it is seen along the axis."""
        column = super().column()
        return None if column is None else replace(column, area=column.area * math.sin(self.half_angle))
