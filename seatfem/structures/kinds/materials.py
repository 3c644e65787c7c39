"""Materials of structures: by name, by their constants, in all directions the same or not."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from seatfem.fields import Density, KeyProblem, LossFactor, PoissonRatio, Pressure, Table, of_same_names
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
        """Read material = "steel" as material = { name = "steel" }; a value beside the name overrules the list's."""
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
        """Return whether it is the same in all directions."""
        return True

    @property
    def solid(self) -> materials.Material:
        """Return the material as finite elements take it."""
        return materials.Material(self.young, self.poisson, self.density, loss_factor=self.loss_factor)

    @property
    def mean(self) -> materials.Material:
        """Return an isotropic material of about the same stiffness."""
        return self.solid

    @property
    def young_across(self) -> float:
        """Return Young's modulus along the third axis [Pa]."""
        return self.young


def _constants(name: str) -> dict[str, object]:
    """Return a listed material's values, as a file would state them. Raises `ValueError` for a name that is not
    listed."""
    if (material := named_material(name)) is None:
        close = get_close_matches(name.casefold(), NAMED_MATERIALS, n=1)
        meant = f"; did you mean {close[0]!r}?" if close else ""
        raise ValueError(
            f"no material named {name!r}{meant} There are: {', '.join(map(repr, NAMED_MATERIALS))}; of any other give "
            'young, poisson and density, as in { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
        )
    return {"young": f"{material.young!r} Pa", "poisson": material.poisson, "density": f"{material.density!r} kg/m^3"}


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
            raise KeyProblem("axes", f"{self.axes}: each direction must have a length")
        unit = axes / lengths[:, None]
        if not np.abs(unit @ unit.T - np.eye(3)).max() < 1e-6:
            raise KeyProblem("axes", f"{self.axes} must be at right angles to each other")
        return self

    @property
    def isotropic(self) -> bool:
        """Return whether it is the same in all directions."""
        return False

    @property
    def solid(self) -> materials.Orthotropic:
        """Return the material as finite elements take it."""
        rows = np.asarray(self.axes, dtype=float)
        unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        axes = tuple(tuple(float(x) for x in row) for row in unit)
        return of_same_names(materials.Orthotropic, self, axes=axes, name="seat.material")

    @property
    def mean(self) -> materials.Material:
        """Return an isotropic material of about the same stiffness: the means of moduli and ratios."""
        return materials.Material(sum(self.young) / 3, sum(self.poisson) / 3, self.density)

    @property
    def young_across(self) -> float:
        """Return Young's modulus along the third axis [Pa]."""
        return self.young[2]


def _kind_of_material(value: object) -> str:
    if isinstance(value, Mapping):
        return str(value.get("kind", "isotropic"))
    return str(getattr(value, "kind", "isotropic"))


AnyMaterial = Annotated[
    Annotated[Material, Tag("isotropic")] | Annotated[OrthotropicMaterial, Tag("orthotropic")],
    Discriminator(_kind_of_material),
]
