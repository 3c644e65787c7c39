"""What holds a structure beside its clamped faces."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from seatfem.fields import AreaDamping, Bedding, Position, Table, default


class Support(Table):
    """What all supports have; one without springs and dashpots holds."""

    kind: str
    on: str = Field(description="name of the face")

    damps: ClassVar[bool] = False
    """Whether it has dashpots, which couple the modes."""

    @property
    def holds(self) -> bool:
        """Whether it resists a displacement, not only a velocity."""
        return True

    @property
    def stiffness(self) -> float:
        """Per area, normal to the face [N/m^3]; 0 of what is no spring."""
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
