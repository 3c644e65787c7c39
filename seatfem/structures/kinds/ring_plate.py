"""The ring plate: a flat annulus in free flight, by plate elements."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import Length, of_same_names
from seatfem.structures.kinds.structure import SampleScene
from seatfem.structures.kinds.thin_plate import FRONTS, FreePlate
from seatfem.structures.shapes.ring_plate import RingPlate as Outline


class RingPlate(FreePlate):
    """A flat annulus that nothing holds, in free flight: the ring of a ring valve. It touches with a ring about its
    axis. By Mindlin plate elements: it translates and tumbles as a rigid body, and rings in its own modes."""

    sample: ClassVar[str] = """
outer_diameter = "16 mm"
inner_diameter = "6 mm"
thickness = "1 mm"
contact_radius = "5.5 mm"
contact_width = "1 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-2 m/s"', "annular", FRONTS)

    kind: Literal["ring_plate"]
    outer_diameter: Length = Field(description="outer diameter")
    inner_diameter: Length = Field(description="diameter of the hole")
    contact_radius: Length | None = Field(
        None, description="mean radius of the ring that touches; absent: in the middle of the annulus"
    )
    contact_width: Length | None = Field(
        None, description="radial width of the ring that touches; absent: a quarter of the annulus's"
    )

    def geometry(self) -> Outline:
        return of_same_names(Outline, self)

    def blown(self, body: Body) -> Array:
        """Return how a pressure over its whole face moves the modes."""
        return self.plate(body.greens).mean

    @property
    def usual_radius(self) -> float:
        return (self.outer_diameter + self.inner_diameter) / 4

    @property
    def usual_width(self) -> float | None:
        return (self.outer_diameter - self.inner_diameter) / 8
