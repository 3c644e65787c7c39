"""[[spring]]: valve springs between the reed and its guard, which press it on its seat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Final

import numpy as np
from pydantic import BeforeValidator, Field

from impact.greens.base import Array
from seatfem.fields import Contradictions, Length, Position, ReadQuantity, Stiffness, Table, absent, default

if TYPE_CHECKING:
    from seatfem.structures.kinds.structure import Structure

MOST: Final = 64
"""Springs of one table."""
Preload = Annotated[float, BeforeValidator(ReadQuantity("force")), Field(ge=0)]


class ValveSpring(Table):
    """Springs between the reed and a guard at rest, which press the reed on its seat. Each is linear, without mass and
    damping, and acts all the time. They are part of the reed: of its modes, of its energy, and of every error bar. What
    they do to the motions that its modes leave out is neglected, as it is of loads."""

    sample: ClassVar[str] = """
stiffness = "2 N/mm"
preload = "5 N"
"""

    stiffness: Stiffness = Field(description="of all springs of the table together")
    preload: Preload = default(
        "0 N",
        "force of all of them together on the closed reed, which lies contact.gap below its undeformed "
        "place; towards the seat",
    )
    at: Length | None = absent(
        "where they press, from the root; where no place is given: at the contact, of a ring plate or a "
        "disc spread around its mean circle, of a ball through its centre"
    )
    points: tuple[tuple[Position, Position], ...] | None = absent(
        "of a plate, a spring each: places along and across it, from the centre of its contact",
        min_length=1,
        max_length=MOST,
    )
    number: int | None = absent("of a plate: springs on a circle, the first on the x axis", strict=True, ge=1, le=MOST)
    radius: Length | None = absent("of that circle, about the centre of the plate's contact")

    def contradictions(self) -> Contradictions:
        if (self.number is None) != (self.radius is None):
            missing = "number" if self.number is None else "radius"
            yield missing, "required key is missing: springs on a circle have number and radius"
        if len(keys := self.given_keys("at", "points", "number")) > 1:
            yield keys[1], f"{keys[0]} is given too; keep one"

    @property
    def places(self) -> Array | None:
        """Return the (S, 2) places of springs on a plate, from the centre of its contact [m]; ``None``: none given."""
        if self.number is not None and self.radius is not None:
            turns = 2 * np.pi * np.arange(self.number) / self.number
            return self.radius * np.column_stack([np.cos(turns), np.sin(turns)])
        return None if self.points is None else np.array(self.points)

    @property
    def words(self) -> str:
        """Return what they are, in a few words."""
        many = self.number or (0 if self.points is None else len(self.points))
        size = f"{self.stiffness / 1e3:.4g} N/mm"
        preload = f", preload {self.preload:.4g} N" if self.preload else ""
        return (f"{many} valve springs, {size} together" if many > 1 else f"valve spring {size}") + preload

    def check(self, reed: Structure) -> None:
        """Raise `KeyProblem`, of a key of this table, for places that the reed does not have."""
        if self.at is not None:
            reed.check_place(self.at, "at")
        if (places := self.places) is not None:
            reed.check_place(places, "radius" if self.points is None else "points")
