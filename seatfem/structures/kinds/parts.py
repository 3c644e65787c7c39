"""Tables that several kinds of structures have: damping, mesh, reduction."""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from seatfem.fields import Delay, Frequency, KeyProblem, Length, Rate, Table, Tolerance, default


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
