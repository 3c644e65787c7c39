"""Flat plates in free flight, by plate elements: the disc of a plate valve, the ring of a ring valve."""

from __future__ import annotations

from typing import ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from impact.bodies.body import Body
from impact.greens.base import Array
from seatfem.fields import KeyProblem, Length
from seatfem.structures.kinds.structure import SampleScene
from seatfem.structures.kinds.thin_plate import FRONTS, ThinPlate
from seatfem.structures.shapes import Disc as DiscOutline
from seatfem.structures.shapes import Flat
from seatfem.structures.shapes import RingPlate as RingOutline
from seatfem.units import write_quantity

EVENLY: Final = 16
"""Springs that stand for one that is spread around a circle."""


class FreePlate(ThinPlate):
    """Base of all flat plates that nothing holds."""

    group: ClassVar[str] = "strikers"

    @property
    def loose(self) -> str:
        return f"seat.kind = {self.kind!r} is free to move"

    def check_place(self, place: float | Array | None, key: str) -> None:
        if not isinstance(place, np.ndarray):
            return super().check_place(place, key)
        least, most = self.geometry().room
        away = np.hypot(*place.T)
        if away.min() < least or away.max() > most:
            far = float(away.min() if away.min() < least else away.max())
            raise KeyProblem(
                key,
                f"{write_quantity(far, 'length')} from {self.about} is off the plate, which lies between "
                f"{write_quantity(least, 'length')} and {write_quantity(most, 'length')} from there",
            )
        return None

    @property
    def spring_points(self) -> Array | None:
        """Return points around its mean circle, so that nothing is free to tumble."""
        turns = 2 * np.pi * np.arange(EVENLY) / EVENLY
        return np.asarray(sum(self.geometry().room) / 2 * np.column_stack([np.cos(turns), np.sin(turns)]))

    def check_motion(self) -> None:
        if self.deflection is not None:
            raise KeyProblem("deflection", "a plate that nothing holds cannot be deflected at rest; give it a velocity")


class Disc(FreePlate):
    """A round flat plate that nothing holds, in free flight: a plate valve. It touches with a disc or a ring about its
    centre. By Mindlin plate elements: it translates and tumbles as a rigid body, and rings in its own modes."""

    shape: ClassVar[type[Flat]] = DiscOutline
    sample: ClassVar[str] = """
diameter = "16 mm"
thickness = "1 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-2 m/s"', "stopper", FRONTS)

    kind: Literal["disc"]
    contact_radius: Length | None = Field(
        None, description="radius of the disc that touches, or mean radius of the ring; absent: diameter/16"
    )


class RingPlate(FreePlate):
    """A flat annulus that nothing holds, in free flight: the ring of a ring valve. It touches with a ring about its
    axis. By Mindlin plate elements: it translates and tumbles as a rigid body, and rings in its own modes."""

    shape: ClassVar[type[Flat]] = RingOutline
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
    contact_radius: Length | None = Field(
        None, description="mean radius of the ring that touches; absent: in the middle of the annulus"
    )
    contact_width: Length | None = Field(
        None, description="radial width of the ring that touches; absent: a quarter of the annulus's"
    )

    def blown(self, body: Body) -> Array:
        """Return how a pressure over its whole face moves the modes."""
        return self.plate(body.greens).mean
