"""[[load]]: known loads on the reed, beside those that its own table has."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from seatfem.fields import Acceleration, Contradictions, Length, Position, SignedArea, Table, absent
from seatfem.structures.kinds.motion import AnyAcceleration, AnyForce, AnyPressure

ACTING = ("pressure", "force", "gravity", "base_motion")


def _as_table(given: object) -> object:
    """Return area = "80 mm^2" and area = [["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]] as the two columns of a table."""
    if isinstance(given, Mapping | Table):
        return given
    if not isinstance(given, list):
        return {"lift": ["0 mm"], "area": [given]}
    if not all(isinstance(row, list) and len(row) == 2 for row in given):
        raise ValueError('rows of lift and area are needed, as in [["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]]')
    return {"lift": [row[0] for row in given], "area": [row[1] for row in given]}


class AreaByLift(Table):
    """The area by which a pressure acts, by how far the reed is off its seat; a line between the lifts, held beyond.

    Written as one area, or as a list of pairs of lift and area.
    """

    lift: tuple[Position, ...] = Field(min_length=1, description="opening at the contact, increasing")
    area: tuple[SignedArea, ...] = Field(min_length=1, description="area at each of them")

    def contradictions(self) -> Contradictions:
        if len(self.lift) != len(self.area):
            yield "area", f"{len(self.area)} areas at {len(self.lift)} lifts: give one for each"
        if self.lift[0] < 0:
            yield "lift", f"a lift of {1e3 * self.lift[0]:g} mm: lifts are >= 0, counted from the seat"
        for before, after in itertools.pairwise(self.lift):
            if after <= before:
                yield "lift", f"the lifts must increase: {1e3 * after:g} mm follows {1e3 * before:g} mm"
        if (least := min(self.area)) <= 0:
            yield "area", f"an area of {1e6 * least:g} mm^2: areas must be positive; for none remove the load"

    def __call__(self, lift: float) -> float:
        """Return the area [m^2] at an opening [m]."""
        return float(np.interp(lift, self.lift, self.area))


class ExternalLoad(Table):
    """One load on the reed: a pressure on an effective area at the contact (of a plate, spread over the disc that the
    contact covers or encloses, of a ring plate over its whole face), a force, gravity, or the acceleration of the frame
    that holds it (the reed alone feels it: its mass times the acceleration, the other way round)."""

    sample: ClassVar[str] = """
pressure = "-0.2 bar"
area = "80 mm^2"
"""

    pressure: AnyPressure | None = absent(
        "over the reed, on area, at its contact, positive off the seat; a constant one may be text"
    )
    area: Annotated[AreaByLift, BeforeValidator(_as_table)] | None = absent(
        'effective area of the pressure: one, or by the lift as in `[["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]]`'
    )
    force: AnyForce | None = absent("at one place, positive off the seat; a constant one may be written as text")
    at: Length | None = absent("of the force, from the root; where absent: at the contact")
    point: tuple[Position, Position] | None = absent(
        "of the force on a plate, along and across it, from the centre of its contact"
    )
    gravity: Acceleration | None = absent(
        "component of the acceleration along the normal; negative presses the reed on the seat"
    )
    base_motion: AnyAcceleration | None = absent(
        "acceleration of the frame along the normal; a constant one may be written as text"
    )

    def contradictions(self) -> Contradictions:
        self.check_one_of(ACTING, "nothing acts")
        if self.area is None and self.pressure is not None:
            yield "area", "required key is missing: effective area"
        if self.area is not None and self.pressure is None:
            yield "area", "there is no pressure; remove the key"
        if self.force is None and (places := self.given_keys("at", "point")):
            yield places[0], "only a force has a place; remove the key"
        if self.at is not None and self.point is not None:
            yield "point", "at is given too; keep one"

    @property
    def by_lift(self) -> bool:
        """Return whether the load depends on how far the reed is off its seat."""
        return self.area is not None and len(set(self.area.area)) > 1
