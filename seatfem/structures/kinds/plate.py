"""The valve plate with several ports."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from seatfem.fields import KeyProblem, Length, of_same_names
from seatfem.structures.estimates.patch import Patch, on_plate
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import QUARTERS
from seatfem.structures.outlines import BodyViews, arc, box, of_ported_plate
from seatfem.structures.shapes import ValvePlate


class Plate(Drawn):
    """A flat valve plate with several round ports, a sealing land around each, and webs between them. With `outline` or
    `file` in place of its ports, kind = "plate" is a flat reed of any outline: all that kind = "sheet" takes."""

    has_faces: ClassVar[bool] = True

    sample: ClassVar[str] = """
ports = 4
port_radius = "3 mm"
pitch = "10 mm"
margin = "5 mm"
thickness = "3 mm"
land_width = "1 mm"
clamp_width = "2 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["plate"]
    ports: int = Field(strict=True, ge=1, le=200, description="number of ports")
    port_radius: Length = Field(description="radius of each port")
    pitch: Length = Field(description="distance of neighbouring ports, centre to centre")
    margin: Length = Field(description="from the outer ports to the plate's edge")
    thickness: Length = Field(description="thickness of the plate")
    land_width: Length = Field(description="width of the land around each port")
    clamp_width: Length = Field(description="width of the clamped rim of the underside")
    layout: Literal["circle", "row"] = Field("circle", description="of the ports")
    struck: int | None = Field(None, strict=True, ge=1, description="port whose land is struck; all lands if absent")
    fixed: Literal["rim"] = Field("rim", description="the clamped face: the rim of the underside")

    @model_validator(mode="after")
    def _struck_is_a_port(self) -> Self:
        if self.struck is not None and self.struck > self.ports:
            raise KeyProblem("struck", f"there is no port {self.struck}, the plate has {self.ports}")
        return self

    @property
    def struck_face(self) -> str:
        """Return the lands of all ports, or of one."""
        return "contact" if self.struck is None else f"land_{self.struck}"

    @property
    def sectors(self) -> int:
        if self.struck is not None:
            return 1
        return QUARTERS if self.layout == "row" else 2 * self.ports

    def geometry(self) -> ValvePlate:
        return of_same_names(ValvePlate, self)

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        plate = self.geometry()
        if self.layout == "circle":
            outline, rim = arc(plate.outer_radius), arc(plate.outer_radius - self.clamp_width)
        else:
            (x, y), inset = plate.half_sides, self.clamp_width
            outline, rim = box((-x, -y), (x, y)), box((inset - x, inset - y), (x - inset, y - inset))
        struck = range(self.ports) if self.struck is None else (self.struck - 1,)
        radii = (self.port_radius, self.port_radius + self.land_width)
        return of_ported_plate("valve plate", outline, rim, np.array(plate.centres), radii, struck, self.thickness)

    def struck_part(self) -> tuple[float, float, float]:
        reach = self.port_radius + self.land_width
        lands = self.ports if self.struck is None else 1
        return lands * math.pi * (reach**2 - self.port_radius**2), self.land_width, self.thickness

    def patch(self) -> Patch | None:
        """Return a bulky body on a clamped round plate of the same reach, thinned by its ports."""
        local, geometry = super().patch(), self.geometry()
        assert local is not None
        round_plate = self.layout == "circle"
        radius = (geometry.outer_radius if round_plate else min(geometry.half_sides)) - self.clamp_width
        solidity = max(1 - self.ports * self.port_radius**2 / geometry.outer_radius**2, 0.2) if round_plate else 0.5
        return on_plate(local, self.material.mean, radius, solidity)
