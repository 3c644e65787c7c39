"""[contact] film: a gas or a liquid that has to be squeezed out of the gap."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import Field

from impact.march.film import SqueezeFilm
from seatfem.fields import Contradictions, Length, Pressure, Table, Viscosity, absent, default


class Film(Table):
    """A fluid in the open gap between reed and seat, beside the law of the contact, as under a long strip: its force on
    a length l of it is viscosity * l * width^3/(gap + floor)^3 times the closing speed, against it, and as much against
    the opening one, up to tension_limit on its area. It rests while the gap is closed. Forces and impulses of a run
    are those of film and bodies together; contacts, their number, duration and restitution those of the bodies alone.
    summary.json has film_force_peak_N, stiction_force_peak_N (the largest pull), film_loss_J, and what there would be
    without_film. The fluid does not give way: of a gas the force is an upper bound where the film's pressure exceeds
    the ambient one.
    """

    sample: ClassVar[str] = """
viscosity = "18 uPa s"
floor = "2 um"
"""

    viscosity: Viscosity = Field(description="mu, dynamic")
    floor: Length = Field(
        description="fluid gap that roughness leaves where the bodies touch; half the height difference within a lip "
        "segment, by tilt or waviness, is added"
    )
    width: Length | None = absent("of the strip, across the flow; that of the seat's lip where absent")
    length: Length | None = absent("of the strip; the circumference of the seat's lip where absent")
    tension_limit: Pressure = default(
        "1 bar", "pressure by which the film pulls before it breaks: the ambient one less that of cavitation"
    )

    def check(self, ring: tuple[float, float] | None, seat: str, rings: int) -> Contradictions:
        """Yield what is wrong with the film on the seat's lip, a ``ring`` of mean radius and width [m]."""
        if rings > 1:
            yield "film", f"the film is known across the whole lip, not in {rings} rings: remove either"
        for key in ("width", "length"):
            if ring is None and getattr(self, key) is None:
                words = f"required key is missing: of a seat of kind {seat!r}, as it is given here, no lip is known"
                yield f"film.{key}", f"{words}; give width and length of the strip that closes"

    def of(self, ring: tuple[float, float] | None) -> SqueezeFilm:
        """Return the film on the whole lip."""
        radius, across = ring or (0.0, 0.0)
        return SqueezeFilm.strip(
            viscosity=self.viscosity,
            length=self.length or 2 * math.pi * radius,
            width=self.width or across,
            floor=self.floor,
            underpressure=self.tension_limit,
        )
