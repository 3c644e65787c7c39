"""Tables that several kinds of structures have: materials, damping, supports, mesh, reduction."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from seatfem import fields, units
from seatfem.structures import materials
from seatfem.structures.materials import NAMED_MATERIALS, named_material
from seatfem.structures.method import AUTO
from seatfem.structures.reduction import greens

Direction = tuple[float, float, float]


class Material(fields.Table):
    """A linear elastic, isotropic material; a name alone may be written as text, `material = "steel"`."""

    isotropic: ClassVar[bool] = True
    """Whether it is the same in all directions."""

    kind: Literal["isotropic"] = Field("isotropic", description="the same in all directions")
    name: str | None = Field(
        None, exclude=True, description="a material of the list below; its values hold where a key is absent"
    )
    young: fields.Modulus = Field(description="Young's modulus")
    poisson: fields.PoissonRatio = Field(0.3, description="Poisson's ratio, of rubber 0.499; a beam does not use it")
    density: fields.Density = Field(description="mass per volume")
    loss_factor: fields.LossFactor = Field(
        0.0, description="structural damping of a seat's region, twice the damping ratio"
    )

    @model_validator(mode="before")
    @classmethod
    def _look_up_constants(cls, given: object) -> object:
        """Read material = "steel" as material = { name = "steel" }; keys of the table override the listed values."""
        if isinstance(given, str):
            return {"name": given, **_constants(given)}
        if not isinstance(given, Mapping) or not isinstance(name := given.get("name"), str):
            return given
        try:
            return {**_constants(name), **given}
        except ValueError as problem:
            raise fields.KeyProblem("name", str(problem)) from None

    @property
    def solid(self) -> materials.Material:
        """Return the material for the finite elements."""
        return materials.Material(self.young, self.poisson, self.density, loss_factor=self.loss_factor)

    @property
    def mean(self) -> materials.Material:
        """Return an isotropic material of about the same stiffness."""
        return self.solid


def _constants(name: str) -> dict[str, object]:
    """Return the keys of a listed material as text with units. Raises `ValueError` for an unknown name."""
    if (material := named_material(name)) is None:
        close = get_close_matches(name.casefold(), NAMED_MATERIALS, n=1)
        meant = f"; did you mean {close[0]!r}?" if close else ""
        raise ValueError(
            f"no material named {name!r}{meant} There are: {', '.join(map(repr, NAMED_MATERIALS))}; of any other give "
            'young, poisson and density, as in { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
        )
    return {"young": f"{material.young!r} Pa", "poisson": material.poisson, "density": f"{material.density!r} kg/m^3"}


class OrthotropicMaterial(fields.Table):
    """A linear elastic material with three planes of symmetry, normal to its axes 1, 2, 3."""

    isotropic: ClassVar[bool] = False

    kind: Literal["orthotropic"]
    young: tuple[fields.Modulus, fields.Modulus, fields.Modulus] = Field(description="Young's moduli E1, E2, E3")
    poisson: tuple[fields.PoissonRatio, fields.PoissonRatio, fields.PoissonRatio] = Field(
        description="Poisson's ratios nu12, nu13, nu23", examples=[[0.3, 0.3, 0.3]]
    )
    shear: tuple[fields.Modulus, fields.Modulus, fields.Modulus] = Field(description="shear moduli G12, G13, G23")
    density: fields.Density = Field(description="mass per volume")
    axes: tuple[Direction, Direction, Direction] = Field(
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), description="directions of the axes 1, 2, 3"
    )
    loss_factor: fields.LossFactor = Field(0.0, description="structural damping of the region, twice the damping ratio")

    @model_validator(mode="after")
    def _right_angles(self) -> Self:
        axes = np.array(self.axes)
        lengths = np.linalg.norm(axes, axis=1)
        if not np.all((lengths > 1e-150) & (lengths < 1e150)):
            raise fields.KeyProblem("axes", f"{self.axes}: each direction must have a length")
        unit = axes / lengths[:, None]
        if not np.abs(unit @ unit.T - np.eye(3)).max() < 1e-6:
            raise fields.KeyProblem("axes", f"{self.axes} must be at right angles to each other")
        return self

    @property
    def solid(self) -> materials.Orthotropic:
        """Return the material for the finite elements."""
        rows = np.asarray(self.axes, dtype=float)
        unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        axes = tuple(tuple(float(x) for x in row) for row in unit)
        return fields.build_from_fields(materials.Orthotropic, self, axes=axes, name="seat.material")

    @property
    def mean(self) -> materials.Material:
        """Return an isotropic material of about the same stiffness: the means of moduli and ratios."""
        return materials.Material(sum(self.young) / 3, sum(self.poisson) / 3, self.density)


def _kind_of_material(value: object) -> str:
    if isinstance(value, Mapping):
        return str(value.get("kind", "isotropic"))
    return str(getattr(value, "kind", "isotropic"))


AnyMaterial = Annotated[
    Annotated[Material, Tag("isotropic")] | Annotated[OrthotropicMaterial, Tag("orthotropic")],
    Discriminator(_kind_of_material),
]


METRES: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}
"""Metres per length unit of a CAD or mesh file."""
LengthUnit = Literal["m", "mm", "um", "inch"]


class Rayleigh(fields.Table):
    """Damping C = mass * M + stiffness * K; the ratio of a mode at w is mass / (2 w) + stiffness * w / 2."""

    sample: ClassVar[str] = 'stiffness = "10 ns"'

    mass: fields.Rate = fields.default("0 1/s", "factor of the mass matrix")
    stiffness: fields.Delay = fields.default("0 s", "factor of the stiffness matrix")


class Mesh(fields.Table):
    """How fine the finite elements are."""

    sample: ClassVar[str] = """
size = "2 mm"
contact_size = "0.5 mm"
"""
    former: ClassVar[Mapping[str, str]] = {"shape": "swept hexahedra are no longer made; remove this key"}

    size: fields.Length | None = Field(None, description="element size in the bulk; from the bandwidth where absent")
    contact_size: fields.Length | None = Field(
        None, description="element size at the contact face; finer than the bulk where absent"
    )
    order: Literal[1, 2] = Field(2, description="polynomial order of the elements")

    @model_validator(mode="after")
    def _finer_at_the_contact(self) -> Self:
        if self.size and self.contact_size and self.contact_size > self.size:
            raise fields.KeyProblem(
                "contact_size",
                f"{units.write_quantity(self.contact_size, 'length')} must be at most the bulk's size, "
                f"{units.write_quantity(self.size, 'length')}",
            )
        return self


class ReductionName:
    """Validator of a reduction's name or "auto"; its message is that of any key with fixed choices."""

    @property
    def options(self) -> tuple[str, ...]:
        """Return "auto" and the names of all reductions."""
        return (AUTO, *greens.reducers())

    def __call__(self, method: str) -> str:
        if method != AUTO and method not in self.options:
            if method == "lanczos":
                raise ValueError("'lanczos' is no reduction any more; remove this key, or take 'auto'")
            *first, last = map(repr, self.options)
            raise PydanticCustomError("literal_error", "unknown", {"expected": f"{', '.join(first)} or {last}"})
        return method


class GreensSettings(fields.Table):
    """How a body's Green's function is computed from matrices."""

    sample: ClassVar[str] = 'bandwidth = "200 kHz"'
    former: ClassVar[Mapping[str, str]] = {"backend": "all reductions are done by this process now; remove this key"}

    method: Annotated[str, AfterValidator(ReductionName())] = Field(
        AUTO, description="the reduction; auto: the cheapest that is suitable, plugins included"
    )
    bandwidth: fields.Frequency = fields.default("1 MHz", "highest frequency that must be right")
    tolerance: fields.Tolerance = Field(0.01, description="relative error of the reduction inside the bandwidth")
    max_vectors: int | None = Field(None, ge=1, description="most Krylov vectors; absent: the reduction's own limit")


class Support(fields.Table):
    """Base of supports; by default it resists displacement and has no springs or dashpots."""

    kind: str
    on: str = Field(description="name of the face")

    @property
    def holds(self) -> bool:
        """Return whether it resists a displacement, not only a velocity."""
        return True

    @property
    def stiffness(self) -> float:
        """Return the stiffness per area, normal to the face [N/m^3]; 0 unless the support is a spring."""
        return 0.0


class FoundationSupport(Support):
    """Springs per area between a face and the ground."""

    kind: Literal["foundation"]
    normal: fields.Bedding = Field(description="stiffness per area, normal to the face")
    tangential: fields.Bedding = fields.default("0 N/m^3", "stiffness per area, along the face")

    @property
    def holds(self) -> bool:
        return self.normal > 0 or self.tangential > 0

    @property
    def stiffness(self) -> float:
        return self.normal


class BoltedSupport(Support):
    """A bolted face: the contact stiffness of the joint, per area."""

    kind: Literal["bolted"]
    normal: fields.Bedding = Field(description="stiffness per area, normal to the face")
    tangential: fields.Bedding | None = Field(
        None, description="stiffness per area along the face; 0.82 of normal if absent"
    )

    @property
    def stiffness(self) -> float:
        return self.normal


class AbsorbingSupport(Support):
    """The seat continues beyond a face: waves leave through it without reflection."""

    kind: Literal["absorbing"]
    centre: tuple[fields.Position, fields.Position, fields.Position] | None = Field(
        None,
        examples=[["0 mm", "0 mm", "8 mm"]],
        description="where the waves come from; with it the face holds the seat against slow motion too",
    )

    @property
    def holds(self) -> bool:
        return self.centre is not None


class DashpotSupport(Support):
    """Dashpots per area between a face and the ground."""

    kind: Literal["dashpot"]
    normal: fields.AreaDamping = Field(description="damping per area, normal to the face")
    tangential: fields.AreaDamping = fields.default("0 N*s/m^3", "damping per area, along the face")

    @property
    def holds(self) -> bool:
        return False


class SlidingSupport(Support):
    """A plane face that cannot leave its plane: a guide, or a plane of symmetry."""

    kind: Literal["sliding"]


AnySupport = Annotated[
    FoundationSupport | BoltedSupport | AbsorbingSupport | DashpotSupport | SlidingSupport, Field(discriminator="kind")
]
