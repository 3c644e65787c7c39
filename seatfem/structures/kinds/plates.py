"""Kinds of flat plates: the flapper, the free disc of a plate valve, the held disc, the ring of a ring valve."""

from __future__ import annotations

from typing import ClassVar, Final, Literal, Self

import numpy as np
from pydantic import model_validator

from impact.beams.stepped import SteppedCantilever
from impact.bodies.body import Body
from impact.bodies.reeds import ModeShape, reed
from impact.greens.base import Array, GreensFunction
from seatfem.fields import KeyProblem, build_from_fields
from seatfem.structures.kinds import plate_loads, structure
from seatfem.structures.kinds.structure import SampleScene
from seatfem.structures.kinds.thin_plate import FRONTS, ThinPlate
from seatfem.structures.shapes import Disc as DiscOutline
from seatfem.structures.shapes import Flapper as FlapperOutline
from seatfem.structures.shapes import Flat
from seatfem.structures.shapes import HeldDisc as HeldOutline
from seatfem.structures.shapes import RingPlate as RingOutline
from seatfem.units import write_quantity

EVENLY: Final = 16
"""Number of point springs that replace a spring distributed around a circle."""
CHORDS: Final = 64  # chords per quarter circle in the outline of the beam model of a flapper: its mass is right to 1e-4
OF_THE_BEAM: Final = 40  # number of modes of the beam model
NEAR: Final = 0.1  # largest relative difference between the frequencies of a mode in the plate and the beam model


class FreePlate(ThinPlate):
    """Base of all unsupported flat plates."""

    group: ClassVar[str] = "strikers"

    @property
    def loose(self) -> str:
        return f"seat.kind = {self.kind!r} is free to move"

    def check_place(self, place: structure.Place, key: str) -> None:
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

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        return super().pushed_at(body, self.spring_points if by == "springs" and place is None else place, by)

    @property
    def spring_points(self) -> Array:
        """Return points on the mean circle, so that the springs resist tumbling."""
        turns = 2 * np.pi * np.arange(EVENLY) / EVENLY
        return np.asarray(sum(self.geometry().room) / 2 * np.column_stack([np.cos(turns), np.sin(turns)]))

    @model_validator(mode="after")
    def _not_deflected(self) -> Self:
        if self.deflection is not None:
            raise KeyProblem("deflection", "a plate that nothing holds cannot be deflected at rest; give it a velocity")
        return self


class Disc(FreePlate):
    """A free round flat plate of Mindlin plate elements: a plate valve. It moves as a rigid body and in its own modes,
    and touches with a disc or a ring about its centre."""

    shape: ClassVar[type[Flat]] = DiscOutline
    sample: ClassVar[str] = """
diameter = "16 mm"
thickness = "1 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-2 m/s"', "stopper", FRONTS)

    kind: Literal["disc"]


class RingPlate(FreePlate):
    """A free flat annulus of Mindlin plate elements: the ring of a ring valve. It moves as a rigid body and in its own
    modes, and touches with a ring about its axis."""

    shape: ClassVar[type[Flat]] = RingOutline
    sample: ClassVar[str] = """
outer_diameter = "16 mm"
inner_diameter = "6 mm"
thickness = "1 mm"
contact_radius = "5.5 mm"
contact_width = "1 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('velocity = "-2 m/s"', "annular", FRONTS)

    kind: Literal["ring_plate"]

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        """Return (M, n); a pressure acts on the whole face."""
        return self.plate(body.greens).mean[:, None] if by == "pressure" else super().pushed_at(body, place, by)


class HeldDisc(plate_loads.ClampedPlate):
    """A round flat plate of Mindlin plate elements that is clamped at the edge of a hole in its middle, as where a disc
    is screwed on, or the rim of an umbrella valve: it tilts and bends about its middle. It touches with a ring about
    its axis."""

    shape: ClassVar[type[Flat]] = HeldOutline
    sample: ClassVar[str] = """
outer_diameter = "16 mm"
inner_diameter = "4 mm"
thickness = "0.5 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { deflection = "0.1 mm" }', "annular", FRONTS)

    kind: Literal["held_disc"]


class Flapper(plate_loads.ClampedPlate):
    """A flat reed of constant thickness with a clamped root, a taper, a neck and a round paddle, of Mindlin plate
    elements: it twists, and its paddle bends across. It touches with a disc or a ring about the paddle's centre."""

    about: ClassVar[str] = "the paddle's centre"

    shape: ClassVar[type[Flat]] = FlapperOutline
    sample: ClassVar[str] = """
root_width = "8 mm"
taper_length = "2 mm"
neck_width = "6 mm"
neck_length = "15 mm"
paddle_diameter = "16 mm"
thickness = "0.3 mm"
"""
    sample_scene: ClassVar[SampleScene] = SampleScene('release = { mode = 1, velocity = "-2 m/s" }', "annular", FRONTS)

    kind: Literal["flapper"]

    def as_beams(self, greens: GreensFunction) -> tuple[Body, ...]:
        """Return a beam of the same widths, released in its mode nearest in frequency, with the same velocity of the
        contact at the paddle's centre; none for other initial conditions, with loads, or if no bending mode is
        near."""
        release = self.release
        if release is None or release.velocity is None or structure.is_loaded(self):
            return ()
        outline, solid = self.geometry(), self.material.solid
        beam = SteppedCantilever(solid.young, solid.density, self.thickness, outline.widths(CHORDS))
        assert greens.modal is not None
        wanted, frequencies = greens.modal.omega[release.mode - 1], beam.frequencies(OF_THE_BEAM)
        number = int(np.argmin(np.abs(frequencies - wanted)))
        if abs(frequencies[number] / wanted - 1) > NEAR:
            return ()
        centre = outline.centre[0]
        start = ModeShape(number + 1, at=centre, velocity=release.velocity)
        return (reed(beam, damping_ratio=self.damping_ratio, n_modes=OF_THE_BEAM, contact_at=centre, release=start),)

    def geometry(self) -> FlapperOutline:
        return build_from_fields(FlapperOutline, self)
