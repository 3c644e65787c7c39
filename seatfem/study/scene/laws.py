"""[contact] law: how the force follows from the penetration; a new law is a new class and one name in `AnyLaw`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from seatfem.fields import HertzStiffness, Slowness, Stiffness, Table, default


class SignoriniLaw(Table):
    """Rigid unilateral contact: no penetration, no adhesion."""

    kind: Literal["signorini"]


class SpringLaw(Table):
    """A linear spring between the bodies while they touch."""

    kind: Literal["spring"]
    stiffness: Stiffness = Field(description="force per penetration")


class HertzLaw(Table):
    """Hertz's contact of a sphere: force = stiffness * penetration^1.5."""

    kind: Literal["hertz"]
    stiffness: HertzStiffness = Field(description="(4/3) E* sqrt(R)")


class HuntCrossleyLaw(Table):
    """Hertz's contact with a loss: force = stiffness * penetration^1.5 * (1 + damping * rate of penetration)."""

    kind: Literal["hunt_crossley"]
    stiffness: HertzStiffness = Field(description="(4/3) E* sqrt(R)")
    damping: Slowness = default("0 s/m", "3 (1 - e)/(2 v) for the coefficient of restitution e, near 1, at the speed v")


def law_as_text(given: object) -> object:
    """law = "signorini" is law = { kind = "signorini" }, in the table ``given``."""
    if isinstance(given, Mapping) and isinstance(given.get("law"), str):
        return {**given, "law": {"kind": given["law"]}}
    return given


AnyLaw = Annotated[SignoriniLaw | SpringLaw | HertzLaw | HuntCrossleyLaw, Field(discriminator="kind")]
