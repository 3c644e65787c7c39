"""Tables that several kinds of structures have: damping, supports, mesh, reduction."""

from __future__ import annotations

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from seatfem.fields import (
    AreaDamping,
    Bedding,
    Delay,
    Frequency,
    KeyProblem,
    Length,
    Position,
    Rate,
    Table,
    Tolerance,
    default,
)
from seatfem.structures.method import AUTO, Engine
from seatfem.units import write_quantity

METRES: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "inch": 0.0254}
"""Metres per length unit of a CAD or mesh file."""
LengthUnit = Literal["m", "mm", "um", "inch"]


class Rayleigh(Table):
    """Damping C = mass * M + stiffness * K; the ratio of a mode at w is mass / (2 w) + stiffness * w / 2."""

    sample: ClassVar[str] = 'stiffness = "10 ns"'

    mass: Rate = default("0 1/s", "factor of the mass matrix")
    stiffness: Delay = default("0 s", "factor of the stiffness matrix")


class Mesh(Table):
    """How fine the finite elements are."""

    sample: ClassVar[str] = """
size = "2 mm"
contact_size = "0.5 mm"
"""

    size: Length | None = Field(None, description="element size in the bulk; from the bandwidth where absent")
    contact_size: Length | None = Field(
        None, description="element size at the contact face; finer than the bulk where absent"
    )
    order: Literal[1, 2] = Field(2, description="polynomial order of the elements")
    shape: Literal["tet", "hex"] = Field("tet", description="of the elements; hexes where the seat can be swept")

    @model_validator(mode="after")
    def _finer_at_the_contact(self) -> Self:
        if self.size and self.contact_size and self.contact_size > self.size:
            raise KeyProblem(
                "contact_size",
                f"{write_quantity(self.contact_size, 'length')} must be at most the bulk's size, "
                f"{write_quantity(self.size, 'length')}",
            )
        return self


class Registered:
    """Checks the name of a reduction, or "auto"; the error is that of any key that takes one of several words."""

    @property
    def options(self) -> tuple[str, ...]:
        """Return all names there are."""
        from seatfem.structures.reduction.greens import reducers  # for load time: most scenes name none

        return (AUTO, *reducers())

    def __call__(self, method: str) -> str:
        if method != AUTO and method not in self.options:
            *first, last = map(repr, self.options)
            raise PydanticCustomError("literal_error", "unknown", {"expected": f"{', '.join(first)} or {last}"})
        return method


class GreensSettings(Table):
    """How a body's Green's function is computed from matrices."""

    sample: ClassVar[str] = 'bandwidth = "200 kHz"'

    method: Annotated[str, AfterValidator(Registered())] = Field(
        AUTO, description="the reduction; auto: the cheapest that is suitable, plugins included"
    )
    bandwidth: Frequency = default("1 MHz", "highest frequency that must be right")
    tolerance: Tolerance = Field(0.01, description="relative error of the reduction inside the bandwidth")
    max_vectors: int | None = Field(
        None, ge=1, description="most Krylov vectors, or Lanczos steps; absent: the reduction's own limit"
    )
    backend: Engine = Field(
        "built-in", description="solver library; slepc: krylov and modes on the ranks of PETSc (docs/large_seats.md)"
    )


class Support(Table):
    """What all supports have; one without springs and dashpots holds."""

    kind: str
    on: str = Field(description="name of the face")

    damps: ClassVar[bool] = False
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Return whether it resists a displacement, not only a velocity."""
        return True

    @property
    def stiffness(self) -> float:
        """Return the stiffness per area, normal to the face [N/m^3]; 0 of what is no spring."""
        return 0.0


class FoundationSupport(Support):
    """Springs per area between a face and the ground."""

    kind: Literal["foundation"]
    normal: Bedding = Field(description="stiffness per area, normal to the face")
    tangential: Bedding = default("0 N/m^3", "stiffness per area, along the face")

    @property
    def holds(self) -> bool:
        return self.normal > 0 or self.tangential > 0

    @property
    def stiffness(self) -> float:
        return self.normal


class BoltedSupport(Support):
    """A bolted face: the contact stiffness of the joint, per area."""

    kind: Literal["bolted"]
    normal: Bedding = Field(description="stiffness per area, normal to the face")
    tangential: Bedding | None = Field(None, description="stiffness per area along the face; 0.82 of normal if absent")

    @property
    def stiffness(self) -> float:
        return self.normal


class AbsorbingSupport(Support):
    """The seat goes on beyond a face: waves leave through it and do not come back."""

    kind: Literal["absorbing"]
    centre: tuple[Position, Position, Position] | None = Field(
        None,
        examples=[["0 mm", "0 mm", "8 mm"]],
        description="where the waves come from; with it the face holds the seat against slow motion too",
    )

    damps: ClassVar[bool] = True

    @property
    def holds(self) -> bool:
        return self.centre is not None


class DashpotSupport(Support):
    """Dashpots per area between a face and the ground."""

    kind: Literal["dashpot"]
    normal: AreaDamping = Field(description="damping per area, normal to the face")
    tangential: AreaDamping = default("0 N*s/m^3", "damping per area, along the face")

    damps: ClassVar[bool] = True

    @property
    def holds(self) -> bool:
        return False


class SlidingSupport(Support):
    """A plane face that cannot leave its plane: a guide, or a plane of symmetry."""

    kind: Literal["sliding"]


AnySupport = Annotated[
    FoundationSupport | BoltedSupport | AbsorbingSupport | DashpotSupport | SlidingSupport, Field(discriminator="kind")
]
