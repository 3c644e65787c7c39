"""The tables inside [seat]: material, damping, mesh, Green's function, and ways of naming faces."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from annotated_types import Ge, Le
from pydantic import Discriminator, Field, Tag, model_validator

from seatfem.geometry import CONTACT_COLOUR, FIXED_COLOUR, ColourFace, GeometryError, PlaneFace
from seatfem.scene.fields import (
    AreaDamping,
    Bedding,
    Delay,
    Density,
    Frequency,
    Gap,
    KeyProblem,
    Length,
    LossFactor,
    PoissonRatio,
    Position,
    Pressure,
    Rate,
    Table,
    Tolerance,
    default,
)

_Spec = TypeVar("_Spec")
_Channel = Annotated[int, Ge(0), Le(255)]
Direction = tuple[float, float, float]


class Material(Table):
    """A linear elastic, isotropic material."""

    kind: Literal["isotropic"] = Field("isotropic", description="the same in all directions")
    young: Pressure = Field(description="Young's modulus")
    poisson: PoissonRatio = Field(0.3, description="Poisson's ratio; a beam does not use it")
    density: Density = Field(description="mass per volume")
    loss_factor: LossFactor = Field(0.0, description="structural damping of a seat's region, twice the damping ratio")


class OrthotropicMaterial(Table):
    """A linear elastic material with three planes of symmetry, normal to its axes 1, 2, 3."""

    kind: Literal["orthotropic"]
    young: tuple[Pressure, Pressure, Pressure] = Field(description="Young's moduli E1, E2, E3")
    poisson: tuple[PoissonRatio, PoissonRatio, PoissonRatio] = Field(description="Poisson's ratios nu12, nu13, nu23")
    shear: tuple[Pressure, Pressure, Pressure] = Field(description="shear moduli G12, G13, G23")
    density: Density = Field(description="mass per volume")
    axes: tuple[Direction, Direction, Direction] = Field(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), description="directions of the axes 1, 2, 3"
    )
    loss_factor: LossFactor = Field(0.0, description="structural damping of the region, twice the damping ratio")

    @model_validator(mode="after")
    def _right_angles(self) -> Self:
        axes = np.array(self.axes)
        lengths = np.linalg.norm(axes, axis=1)
        if not np.all((lengths > 1e-150) & (lengths < 1e150)):
            raise KeyProblem("axes", f"{self.axes} has a direction without a length")
        unit = axes / lengths[:, None]
        if not np.abs(unit @ unit.T - np.eye(3)).max() < 1e-6:
            raise KeyProblem("axes", f"{self.axes} are not at right angles to each other")
        return self


def _kind_of_material(value: object) -> str:
    if isinstance(value, Mapping):
        return str(value.get("kind", "isotropic"))
    return str(getattr(value, "kind", "isotropic"))


AnyMaterial = Annotated[
    Annotated[Material, Tag("isotropic")] | Annotated[OrthotropicMaterial, Tag("orthotropic")],
    Discriminator(_kind_of_material),
]


class FoundationSupport(Table):
    """Springs per area between a face and the ground."""

    kind: Literal["foundation"]
    on: str = Field(description="name of the face")
    normal: Bedding = Field(description="stiffness per area, normal to the face")
    tangential: Bedding = default("0 N/m^3", "stiffness per area, along the face")


class BoltedSupport(Table):
    """A bolted face: the contact stiffness of the joint, per area."""

    kind: Literal["bolted"]
    on: str = Field(description="name of the face")
    normal: Bedding = Field(description="stiffness per area, normal to the face")
    tangential: Bedding | None = Field(None, description="stiffness per area along the face; 0.82 of normal if absent")


class AbsorbingSupport(Table):
    """The seat goes on beyond a face: waves leave through it and do not come back."""

    kind: Literal["absorbing"]
    on: str = Field(description="name of the face")


class DashpotSupport(Table):
    """Dashpots per area between a face and the ground."""

    kind: Literal["dashpot"]
    on: str = Field(description="name of the face")
    normal: AreaDamping = Field(description="damping per area, normal to the face")
    tangential: AreaDamping = default("0 N*s/m^3", "damping per area, along the face")


class SlidingSupport(Table):
    """A plane face that cannot leave its plane: a guide, or a plane of symmetry."""

    kind: Literal["sliding"]
    on: str = Field(description="name of the face")


AnySupport = Annotated[
    FoundationSupport | BoltedSupport | AbsorbingSupport | DashpotSupport | SlidingSupport, Field(discriminator="kind")
]


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
    shape: Literal["tet", "hex"] = Field("tet", description="of the elements; hexes where the seat can be swept")

    @model_validator(mode="after")
    def _finer_at_the_contact(self) -> Self:
        if self.size and self.contact_size and self.contact_size > self.size:
            raise KeyProblem("contact_size", f"{self.contact_size:g} m is coarser than the bulk's {self.size:g} m")
        return self


class GreensSettings(Table):
    """How the seat's Green's function is computed."""

    method: Literal["auto", "krylov", "modes", "transient", "lanczos", "second_order"] = Field(
        "auto", description="the road; auto chooses"
    )
    bandwidth: Frequency = default("1 MHz", "highest frequency that must be right")
    tolerance: Tolerance = Field(0.01, description="relative error of the reduction inside the bandwidth")


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
