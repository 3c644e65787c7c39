"""Tables inside those of structures: material, damping, supports, mesh, Green's function."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from seatfem.fields import (
    AreaDamping,
    Bedding,
    Delay,
    Density,
    Frequency,
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
from seatfem.structures import materials
from seatfem.structures.named_materials import NAMED_MATERIALS, named_material

Direction = tuple[float, float, float]


class Material(Table):
    """A linear elastic, isotropic material; a name alone may be written as text, `material = "steel"`."""

    kind: Literal["isotropic"] = Field("isotropic", description="the same in all directions")
    name: str | None = Field(
        None, exclude=True, description="of the list below; fills in what is not given of the other values"
    )
    young: Pressure = Field(description="Young's modulus")
    poisson: PoissonRatio = Field(0.3, description="Poisson's ratio; a beam does not use it")
    density: Density = Field(description="mass per volume")
    loss_factor: LossFactor = Field(0.0, description="structural damping of a seat's region, twice the damping ratio")

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, given: object) -> object:
        """material = "steel" is material = { name = "steel" }; a value beside the name overrules the list's."""
        if isinstance(given, str):
            return {"name": given, **_constants(given)}
        if not isinstance(given, Mapping) or not isinstance(name := given.get("name"), str):
            return given
        try:
            return {**_constants(name), **given}
        except ValueError as problem:
            raise KeyProblem("name", str(problem)) from None

    @property
    def isotropic(self) -> bool:
        """Whether it is the same in all directions."""
        return True

    @property
    def solid(self) -> materials.Material:
        """The material as finite elements take it."""
        return materials.Material(self.young, self.poisson, self.density, loss_factor=self.loss_factor)

    @property
    def mean(self) -> materials.Material:
        """An isotropic material of about the same stiffness."""
        return self.solid

    @property
    def young_across(self) -> float:
        """Young's modulus along the third axis [Pa]."""
        return self.young


def _constants(name: str) -> dict[str, object]:
    """A listed material's values, as a file would state them. Raises `ValueError` for a name that is not listed."""
    if (found := named_material(name)) is None:
        close = get_close_matches(name.casefold(), NAMED_MATERIALS, n=1)
        meant = f"; did you mean {close[0]!r}?" if close else ""
        raise ValueError(
            f"no material named {name!r}{meant} There are: {', '.join(map(repr, NAMED_MATERIALS))}; of any other give "
            'young, poisson and density, as in { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
        )
    return {"young": f"{found.young!r} Pa", "poisson": found.poisson, "density": f"{found.density!r} kg/m^3"}


class OrthotropicMaterial(Table):
    """A linear elastic material with three planes of symmetry, normal to its axes 1, 2, 3."""

    kind: Literal["orthotropic"]
    young: tuple[Pressure, Pressure, Pressure] = Field(description="Young's moduli E1, E2, E3")
    poisson: tuple[PoissonRatio, PoissonRatio, PoissonRatio] = Field(
        description="Poisson's ratios nu12, nu13, nu23", examples=[[0.3, 0.3, 0.3]]
    )
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

    @property
    def isotropic(self) -> bool:
        """Whether it is the same in all directions."""
        return False

    @property
    def solid(self) -> materials.Orthotropic:
        """The material as finite elements take it."""
        rows = np.asarray(self.axes, dtype=float)
        unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        return materials.Orthotropic(
            young=self.young,
            poisson=self.poisson,
            shear=self.shear,
            density=self.density,
            axes=tuple(tuple(float(x) for x in row) for row in unit),
            name="seat.material",
            loss_factor=self.loss_factor,
        )

    @property
    def mean(self) -> materials.Material:
        """An isotropic material of about the same stiffness: the means of moduli and ratios."""
        return materials.Material(sum(self.young) / 3, sum(self.poisson) / 3, self.density)

    @property
    def young_across(self) -> float:
        """Young's modulus along the third axis [Pa]."""
        return self.young[2]


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

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return self.normal

    damps: ClassVar[bool] = False
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return self.normal > 0 or self.tangential > 0


class BoltedSupport(Table):
    """A bolted face: the contact stiffness of the joint, per area."""

    kind: Literal["bolted"]
    on: str = Field(description="name of the face")
    normal: Bedding = Field(description="stiffness per area, normal to the face")
    tangential: Bedding | None = Field(None, description="stiffness per area along the face; 0.82 of normal if absent")

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return self.normal

    damps: ClassVar[bool] = False
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return True


class AbsorbingSupport(Table):
    """The seat goes on beyond a face: waves leave through it and do not come back."""

    kind: Literal["absorbing"]
    on: str = Field(description="name of the face")
    centre: tuple[Position, Position, Position] | None = Field(
        None,
        examples=[["0 mm", "0 mm", "8 mm"]],
        description="where the waves come from; with it the face holds the seat against slow motion too",
    )

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return 0.0

    damps: ClassVar[bool] = True
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return self.centre is not None


class DashpotSupport(Table):
    """Dashpots per area between a face and the ground."""

    kind: Literal["dashpot"]
    on: str = Field(description="name of the face")
    normal: AreaDamping = Field(description="damping per area, normal to the face")
    tangential: AreaDamping = default("0 N*s/m^3", "damping per area, along the face")

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return 0.0

    damps: ClassVar[bool] = True
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return False


class SlidingSupport(Table):
    """A plane face that cannot leave its plane: a guide, or a plane of symmetry."""

    kind: Literal["sliding"]
    on: str = Field(description="name of the face")

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return 0.0

    damps: ClassVar[bool] = False
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return True


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


def _registered(method: str) -> str:
    """The name of a reduction, or "auto"; else the error of any key that takes one of several words."""
    if method == "auto":
        return method
    from seatfem.structures.reduction.registry import reducers  # for load time: most scenes name none

    if method not in (known := reducers()):
        *first, last = map(repr, ("auto", *known))
        raise PydanticCustomError("literal_error", "unknown", {"expected": f"{', '.join(first)} or {last}"})
    return method


class GreensSettings(Table):
    """How the seat's Green's function is computed."""

    method: Annotated[str, AfterValidator(_registered)] = Field(
        "auto",
        description="the reduction: auto chooses among krylov, modes, transient, lanczos, second_order and others "
        "that are registered",
    )
    bandwidth: Frequency = default("1 MHz", "highest frequency that must be right")
    tolerance: Tolerance = Field(0.01, description="relative error of the reduction inside the bandwidth")
    max_vectors: int | None = Field(
        None, ge=1, description="most Krylov vectors, or Lanczos steps; absent: 800, second_order 500, lanczos 20000"
    )


METRES: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}
"""Metres per length unit of a CAD or mesh file."""
LengthUnit = Literal["m", "mm", "um", "inch"]
