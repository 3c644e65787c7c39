"""The elastic rod in closed form."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field, model_validator

import impact
from impact.greens.base import GreensFunction
from seatfem.fields import Area, DampingRatio, Density, KeyProblem, Length, Pressure
from seatfem.structures.estimates.column import Column
from seatfem.structures.kinds.motion import Moving

if TYPE_CHECKING:
    from impact.exact.damped_rods import DampedFixedRod


class Rod(Moving):
    """The straight elastic rod in one dimension, clamped at its far end, in closed form."""

    kind: Literal["rod"]
    young: Pressure = Field(description="Young's modulus")
    density: Density = Field(description="mass per volume")
    length: Length = Field(description="length along the impact")
    area: Area | None = Field(None, description="cross-section; or give width and thickness")
    width: Length | None = Field(None, description="width of a rectangular cross-section")
    thickness: Length | None = Field(None, description="thickness of a rectangular cross-section")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")

    @model_validator(mode="after")
    def _one_cross_section(self) -> Self:
        if self.area is not None and (self.width or self.thickness):
            raise KeyProblem("area", "width or thickness is given too; keep the area or both of these")
        if self.area is None and not (self.width and self.thickness):
            raise KeyProblem("area", "the cross-section is missing: give area, or width and thickness")
        return self

    @property
    def cross_section(self) -> float:
        """Area in square metres."""
        return self.area if self.area is not None else (self.width or 0.0) * (self.thickness or 0.0)

    @property
    def plane(self) -> bool:
        return True

    @property
    def loss(self) -> float:
        return self.damping_ratio

    def column(self) -> Column | None:
        return Column(self.cross_section, self.length, math.sqrt(self.cross_section), self.young, self.density)

    def closed_form(self) -> GreensFunction | None:
        return fixed_rod(self.young, self.density, self.cross_section, self.length, self.damping_ratio)

    def rod(self) -> DampedFixedRod | None:
        return damped_rod(self.young, self.density, self.cross_section, self.length, self.damping_ratio)


def fixed_rod(young: float, density: float, area: float, length: float, damping_ratio: float) -> GreensFunction:
    """The rod that is clamped at its far end."""
    return impact.fixed_rod(young=young, density=density, area=area, length=length, damping_ratio=damping_ratio)


def damped_rod(young: float, density: float, area: float, length: float, damping_ratio: float) -> DampedFixedRod | None:
    """The same, where it is damped: its poles can be counted beforehand."""
    from impact.exact.damped_rods import DampedFixedRod  # of plans only

    if damping_ratio <= 0:
        return None
    speed = math.sqrt(young / density)
    return DampedFixedRod(density * speed * area, length / speed, damping_ratio)
