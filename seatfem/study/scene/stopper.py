"""[stopper]: a second body, which the striker may meet on the side away from the seat."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Final

from pydantic import Field, SerializerFunctionWrapHandler, create_model, model_serializer, model_validator

from seatfem.fields import Angle, Contradictions, Gap, Length, Position, Table, absent, default, one_of
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.structures.rings import MOST_PORTS, MOST_RINGS, Division
from seatfem.study.scene.laws import ContactLaw, law_as_text, laws

if TYPE_CHECKING:
    _Body = Structure
    _Law = ContactLaw
else:
    _Body = one_of(kinds_of())
    _Law = one_of(laws())


USUAL_ARCS: Final = 32
STEEPEST: Final = math.radians(30)  # tilt, of a face that still lands flat


class Stopper(Table):
    """A second body, at rest, that limits the lift: of any kind, with the keys of that kind beside these. Its Green's
    function is computed as its own keys state; what it is off by stands in the error bars of a run, not of its plan.
    """

    inlined: ClassVar[str] = "body"

    sample: ClassVar[str] = """
kind = "spring"
stiffness = "20 N/um"
gap = "1.5 mm"
"""

    gap: Gap | None = absent("distance from the undeformed reed to the stopper, on the side away from the seat")
    lift: Position | None = absent(
        "instead of gap: travel of the reed from the seat to the stopper; the reed on its seat lies "
        "contact.gap below its undeformed place, so that gap = lift - contact.gap"
    )
    at: Length | None = absent("position on the reed, from its root; that of the contact where absent")
    arcs: int | None = absent(
        "segments of its face, each with its own contact, for a reed that is a plate: of the flat ring or "
        "disc that is struck, of the faces of cad and mesh, or, of a stopper without a face such as a spring, of the "
        "reed's contact face; 32 where rings or a tilt are given, else the stopper is struck as a whole",
        strict=True,
        ge=1,
        le=MOST_PORTS,
    )
    rings: int = default(1, "parts across each of its segments", strict=True, ge=1, le=MOST_RINGS)
    tilt: Angle = default("0 deg", "between the stopper's plane and the undeformed reed; gap is then the smallest")
    tilt_axis: Angle = default("0 deg", "direction about which it is tilted, as contact.tilt_axis")
    law: _Law = default({"kind": "signorini"}, "force by penetration; a kind without keys may be written as text")
    body: _Body = Field(description="the stopping body")

    @model_validator(mode="before")
    @classmethod
    def _apart(cls, given: object) -> object:
        """Return the keys of the role, and those of the body."""
        if not isinstance(given, Mapping) or isinstance(given.get("body"), Structure):
            return given
        own = {key: value for key, value in given.items() if key in set(cls.model_fields) - {"body"}}
        return law_as_text({**own, "body": {key: value for key, value in given.items() if key not in own}})

    @model_serializer(mode="wrap")
    def _together(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the stopper as it is written in a file: one table."""
        own: dict[str, Any] = dict(handler(self))
        return {**own.pop("body", {}), **own}

    def contradictions(self) -> Contradictions:
        if self.gap is None and self.lift is None:
            words = type(self).model_fields["gap"].description
            yield "gap", f"required key is missing: {words}; or give lift, from the seat"
        if self.gap is not None and self.lift is not None:
            yield "lift", "gap is given too; keep one of the two"
        if self.lift is not None and self.lift <= 0:
            yield "lift", f"{1e3 * self.lift:g} mm: the stopper would lie below the seat; it must be more than 0 mm"
        if (self.arcs or 1) * self.rings > MOST_PORTS:
            yield "arcs", f"{self.arcs} segments in {self.rings} rings are more than {MOST_PORTS}: take fewer"
        if abs(self.tilt) > STEEPEST:
            yield "tilt", f"{math.degrees(self.tilt):g} deg must be at most {math.degrees(STEEPEST):g} deg"
        if self.tilt and self.arcs == 1:
            yield "arcs", "a single contact point has only a mean gap, tilt needs several: remove one key"
        if self.body.motion:
            yield self.body.motion, "a stopper is at rest; remove the key, or strike with the body"

    @property
    def parts(self) -> Division:
        """Return the parts into which its face is divided."""
        many = self.arcs or (USUAL_ARCS if self.tilt or self.rings > 1 else 1)
        return Division(min(many, MOST_PORTS // self.rings), self.rings)


def stopper_of(kinds: tuple[type[Structure], ...], laws: tuple[type[ContactLaw], ...]) -> type[Stopper]:
    """Return a stopper whose body may be of these kinds, met by these laws."""
    fields: Any = {
        "body": (one_of(kinds), Stopper.model_fields["body"]),
        "law": (one_of(laws), Stopper.model_fields["law"]),
    }
    return create_model("Stopper", __base__=Stopper, **fields)
