"""The flapper: a flat reed with a round paddle, by plate elements."""

from __future__ import annotations

from typing import ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from impact.beams.stepped import SteppedCantilever
from impact.bodies.body import Body
from impact.bodies.reeds import ModeShape, reed
from impact.greens.base import GreensFunction
from seatfem.fields import Length, of_same_names
from seatfem.structures.kinds.plate_loads import ClampedPlate
from seatfem.structures.kinds.structure import SampleScene
from seatfem.structures.kinds.thin_plate import FRONTS
from seatfem.structures.shapes import Flat
from seatfem.structures.shapes.flapper import Flapper as Outline

CHORDS: Final = 64  # of a quarter circle, in the beam that stands for a flapper: its mass is right to 1e-4
OF_THE_BEAM: Final = 40  # modes
NEAR: Final = 0.1  # frequencies of one and the same mode, as a plate and as a beam


class Flapper(ClampedPlate):
    """A flat reed of even thickness: a clamped root that tapers to a neck, and a round paddle; it touches with a disc
    or a ring about the paddle's centre. By Mindlin plate elements: it twists, and its paddle bends across."""

    about: ClassVar[str] = "the paddle's centre"

    shape: ClassVar[type[Flat]] = Outline
    sample: ClassVar[str] = """
root_width = "8 mm"
taper_length = "2 mm"
neck_width = "6 mm"
neck_length = "15 mm"
paddle_diameter = "16 mm"
thickness = "0.3 mm"
material = "steel"
damping_ratio = 0.02
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { mode = 1, velocity = "-2 m/s" }', "annular", FRONTS)

    kind: Literal["flapper"]
    contact_radius: Length | None = Field(
        None,
        description="radius of the disc that touches, or mean radius of the ring; absent: paddle_diameter/16, or "
        "midway between a hole and the paddle's edge",
    )
    contact_width: Length | None = Field(
        None,
        description="radial width of the ring that touches; absent: a disc does, or about a hole a ring of a quarter "
        "of what is there",
    )

    def as_a_beam(self, greens: GreensFunction) -> Body | None:
        """Return a beam of the same widths, touched at the paddle's centre, where it moves as fast in the mode that it
        is released in: the one of the nearest frequency. ``None`` of other starts, of loads, and where no bending mode
        is near."""
        release = self.release
        if release is None or release.velocity is None or self.is_loaded:
            return None
        outline, solid = self.geometry(), self.material.solid
        beam = SteppedCantilever(solid.young, solid.density, self.thickness, outline.widths(CHORDS))
        assert greens.modal is not None
        wanted, frequencies = greens.modal.omega[release.mode - 1], beam.frequencies(OF_THE_BEAM)
        number = int(np.argmin(np.abs(frequencies - wanted)))
        if abs(frequencies[number] / wanted - 1) > NEAR:
            return None
        centre = outline.centre[0]
        start = ModeShape(number + 1, at=centre, velocity=release.velocity)
        return reed(beam, damping_ratio=self.damping_ratio, n_modes=OF_THE_BEAM, contact_at=centre, release=start)

    def geometry(self) -> Outline:
        return of_same_names(Outline, self)
