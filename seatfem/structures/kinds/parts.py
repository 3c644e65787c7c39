"""Tables that several kinds of structures have: damping, mesh, reduction."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from seatfem.fields import Delay, Frequency, KeyProblem, Length, Rate, Table, Tolerance, default
from seatfem.structures.method import AUTO


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


class Registered:
    """Checks the name of a reduction, or "auto"; the error is that of any key that takes one of several words."""

    @property
    def options(self) -> tuple[str, ...]:
        """All names there are."""
        from seatfem.structures.reduction.registry import reducers  # for load time: most scenes name none

        return (AUTO, *reducers())

    def __call__(self, method: str) -> str:
        if method != AUTO and method not in self.options:
            *first, last = map(repr, self.options)
            raise PydanticCustomError("literal_error", "unknown", {"expected": f"{', '.join(first)} or {last}"})
        return method


class GreensSettings(Table):
    """How a body's Green's function is computed from matrices."""

    method: Annotated[str, AfterValidator(Registered())] = Field(
        AUTO, description="the reduction; auto: the cheapest that serves, of those from elsewhere too"
    )
    bandwidth: Frequency = default("1 MHz", "highest frequency that must be right")
    tolerance: Tolerance = Field(0.01, description="relative error of the reduction inside the bandwidth")
    max_vectors: int | None = Field(
        None, ge=1, description="most Krylov vectors, or Lanczos steps; absent: the reduction's own limit"
    )


METRES: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}
"""Metres per length unit of a CAD or mesh file."""
LengthUnit = Literal["m", "mm", "um", "inch"]
