"""[contact] law: how the force follows from the penetration; a new law is a subclass of `ContactLaw`, in any file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from impact.march.laws import Hertz, HuntCrossley, Law, LinearSpring, Signorini
from seatfem.fields import HertzStiffness, Slowness, Stiffness, Table, default, kinds_below


class ContactLaw(Table):
    """A law of contact: the keys that a scene states it by, ``kind: Literal["name"]`` among them."""

    kind: str

    def law(self, share: float = 1.0) -> Law:
        """Return the law itself, of a ``share`` of the patch's area."""
        raise NotImplementedError

    @property
    def of_a_sphere(self) -> float | None:
        """Return Hertz's stiffness (4/3) E* sqrt(R) [N/m^1.5]; ``None`` where the contact is none of a sphere."""
        return None


def laws() -> tuple[type[ContactLaw], ...]:
    """Return every law that is defined by now, ours first."""
    return kinds_below(ContactLaw)


class SignoriniLaw(ContactLaw):
    """Rigid unilateral contact: no penetration, no adhesion."""

    kind: Literal["signorini"]

    def law(self, share: float = 1.0) -> Law:
        return Signorini()


class SpringLaw(ContactLaw):
    """A linear spring between the bodies while they touch."""

    kind: Literal["spring"]
    stiffness: Stiffness = Field(description="force per penetration")

    def law(self, share: float = 1.0) -> Law:
        return LinearSpring(share * self.stiffness)


class HertzLaw(ContactLaw):
    """Hertz's contact of a sphere: force = stiffness * penetration^1.5."""

    sample: ClassVar[str] = """
kind = "hertz"
stiffness = "5 GN/m^1.5"
"""

    kind: Literal["hertz"]
    stiffness: HertzStiffness = Field(description="(4/3) E* sqrt(R)")

    def law(self, share: float = 1.0) -> Law:
        return Hertz(share * self.stiffness)

    @property
    def of_a_sphere(self) -> float | None:
        return self.stiffness


class HuntCrossleyLaw(HertzLaw):
    """Hertz's contact with a loss: force = stiffness * penetration^1.5 * (1 + damping * rate of penetration)."""

    kind: Literal["hunt_crossley"]  # type: ignore[assignment]
    damping: Slowness = default("0 s/m", "3 (1 - e)/(2 v) for the coefficient of restitution e, near 1, at the speed v")

    def law(self, share: float = 1.0) -> Law:
        return HuntCrossley(share * self.stiffness, self.damping)


def law_as_text(given: object) -> object:
    """Return law = "signorini" as law = { kind = "signorini" }, in the table ``given``."""
    if isinstance(given, Mapping) and isinstance(given.get("law"), str):
        return {**given, "law": {"kind": given["law"]}}
    return given
