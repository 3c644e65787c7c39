"""The tables inside [seat]: material, damping, mesh, Green's function, and ways of naming faces."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Annotated, Literal, Self, TypeVar

from annotated_types import Ge, Le
from pydantic import Field, model_validator

from seatfem.geometry import CONTACT_COLOUR, FIXED_COLOUR, ColourFace, GeometryError, PlaneFace
from seatfem.scene.fields import (
    Delay,
    Density,
    Fraction,
    Frequency,
    Gap,
    KeyProblem,
    Length,
    PoissonRatio,
    Position,
    Pressure,
    Rate,
    Table,
    default,
)

_Spec = TypeVar("_Spec")
_Channel = Annotated[int, Ge(0), Le(255)]


class Material(Table):
    """A linear elastic, isotropic material."""

    young: Pressure = Field(description="Young's modulus")
    poisson: PoissonRatio = Field(0.3, description="Poisson's ratio; a beam does not use it")
    density: Density = Field(description="mass per volume")


class Rayleigh(Table):
    """Damping C = mass * M + stiffness * K; the ratio of a mode at w is mass / (2 w) + stiffness * w / 2."""

    mass: Rate = default("0 1/s", "factor of the mass matrix")
    stiffness: Delay = default("0 s", "factor of the stiffness matrix")


class Mesh(Table):
    """How fine the finite elements are."""

    size: Length | None = Field(None, description="element size in the bulk; from the bandwidth where absent")
    contact_size: Length | None = Field(
        None, description="element size at the contact patch; finer than the bulk where absent"
    )
    order: Literal[1, 2] = Field(2, description="polynomial order of the elements")

    @model_validator(mode="after")
    def _finer_at_the_contact(self) -> Self:
        if self.size and self.contact_size and self.contact_size > self.size:
            raise KeyProblem("contact_size", f"{self.contact_size:g} m is coarser than the bulk's {self.size:g} m")
        return self


class GreensSettings(Table):
    """How the seat's Green's function is computed."""

    method: Literal["auto", "krylov", "modes", "transient"] = Field("auto", description="the road; auto chooses")
    bandwidth: Frequency = default("1 MHz", "highest frequency that must be right")
    tolerance: Fraction = Field(0.01, description="relative error of the reduction inside the bandwidth")


class ByColour(Table):
    """The faces painted in one colour in the CAD program."""

    kind: Literal["colour"]
    colour: tuple[_Channel, _Channel, _Channel] = Field(description="red, green, blue, each 0 to 255")

    def selector(self) -> ColourFace:
        return ColourFace((*self.colour, 255))


class ByPlane(Table):
    """The flat face with a given outward normal n in the plane n.x = offset."""

    kind: Literal["plane"]
    normal: tuple[float, float, float] = Field(description="outward normal of the face")
    offset: Position = Field(description="distance of the plane from the origin, along the normal")
    radius_min: Gap = default("0 mm", "keep faces at least this far from the axis through the origin")
    radius_max: Length | None = Field(None, description="keep faces at most this far from that axis")

    def selector(self) -> PlaneFace:
        outer = math.inf if self.radius_max is None else self.radius_max
        return PlaneFace(self.normal, self.offset, radius_min=self.radius_min, radius_max=outer)

    @model_validator(mode="after")
    def _can_select(self) -> Self:
        in_scene_words(self.selector)
        return self


FaceSelector = Annotated[ByColour | ByPlane, Field(discriminator="kind")]
RED_FACES = ByColour(kind="colour", colour=CONTACT_COLOUR[:3])
BLUE_FACES = ByColour(kind="colour", colour=FIXED_COLOUR[:3])


def in_scene_words(build: Callable[[], _Spec]) -> _Spec:
    """A geometry's complaint about one of its fields becomes one about the key of that name."""
    try:
        return build()
    except GeometryError as error:
        if field := re.match(r"\w+\.(\w+) = (.*)", str(error), re.DOTALL):
            raise KeyProblem(field[1], field[2]) from error
        raise
