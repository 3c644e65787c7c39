"""[stopper]: a second body, which the striker may meet on the side away from the seat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

from pydantic import Field, SerializerFunctionWrapHandler, create_model, model_serializer, model_validator

from seatfem.fields import Gap, KeyProblem, Length, Position, Table, default, one_of
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.laws import ContactLaw, law_as_text, laws

if TYPE_CHECKING:
    _Body = Structure
    _Law = ContactLaw
else:
    _Body = one_of(kinds_of())
    _Law = one_of(laws())


class Stopper(Table):
    """A second body, at rest, that limits the lift: of any kind, with the keys of that kind beside these. Its Green's
    function is computed as its own keys state; what it is off by is in no error bar.
    """

    inlined: ClassVar[str] = "body"
    """The field whose keys stand in this table itself."""

    gap: Gap | None = Field(
        None, description="distance from the undeformed reed to the stopper, on the side away from the seat"
    )
    lift: Position | None = Field(
        None,
        description="in place of gap: travel of the reed from the seat to the stopper; the reed that lies on its seat "
        "stands contact.gap below its undeformed place, so that gap = lift - contact.gap",
    )
    at: Length | None = Field(None, description="position on the reed, from its root; that of the contact where absent")
    law: _Law = default({"kind": "signorini"}, "force by penetration; a kind without keys may be written as text")
    body: _Body = Field(description="what is met")

    @model_validator(mode="before")
    @classmethod
    def _apart(cls, given: object) -> object:
        """The keys of the role, and those of the body."""
        if not isinstance(given, Mapping) or isinstance(given.get("body"), Structure):
            return given
        own = {key: value for key, value in given.items() if key in ("gap", "lift", "at", "law")}
        return law_as_text({**own, "body": {key: value for key, value in given.items() if key not in own}})

    @model_serializer(mode="wrap")
    def _together(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """As it stands in a file: one table."""
        own: dict[str, Any] = dict(handler(self))
        return {**own.pop("body", {}), **own}

    @model_validator(mode="after")
    def _gap_or_lift(self) -> Self:
        if self.gap is None and self.lift is None:
            words = type(self).model_fields["gap"].description
            raise KeyProblem("gap", f"required key is missing: {words}; or give lift, from the seat")
        if self.gap is not None and self.lift is not None:
            raise KeyProblem("lift", "gap is given too; keep one of the two")
        if self.lift is not None and self.lift <= 0:
            raise KeyProblem(
                "lift", f"{1e3 * self.lift:g} mm: the stopper would lie below the seat; it must be more than 0 mm"
            )
        return self

    @model_validator(mode="after")
    def _at_rest(self) -> Self:
        if self.body.motion:
            raise KeyProblem(self.body.motion, "a stopper is at rest; remove the key, or strike with the body")
        return self


def stopper_of(kinds: tuple[type[Structure], ...], laws: tuple[type[ContactLaw], ...]) -> type[Stopper]:
    """A stopper whose body may be of these kinds, met by these laws."""
    fields: Any = {
        "body": (one_of(kinds), Stopper.model_fields["body"]),
        "law": (one_of(laws), Stopper.model_fields["law"]),
    }
    return create_model("Stopper", __base__=Stopper, **fields)
