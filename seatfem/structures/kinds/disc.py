"""The disc: a round flat plate in free flight, by plate elements."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from seatfem.fields import Length, of_same_names
from seatfem.structures.kinds.structure import SampleScene
from seatfem.structures.kinds.thin_plate import FRONTS, FreePlate
from seatfem.structures.shapes.disc import Disc as Outline


class Disc(FreePlate):
    """A round flat plate that nothing holds, in free flight: a plate valve. It touches with a disc or a ring about its
    centre. By Mindlin plate elements: it translates and tumbles as a rigid body, and rings in its own modes."""

    sample: ClassVar[str] = """
diameter = "16 mm"
thickness = "1 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-2 m/s"', "stopper", FRONTS)

    kind: Literal["disc"]
    diameter: Length = Field(description="diameter")
    contact_radius: Length | None = Field(
        None, description="radius of the disc that touches, or mean radius of the ring; absent: diameter/16"
    )

    def geometry(self) -> Outline:
        return of_same_names(Outline, self)

    @property
    def usual_radius(self) -> float:
        return self.diameter / 16
