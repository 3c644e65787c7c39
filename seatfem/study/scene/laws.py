"""Tables of the contact laws in scenes. A new law is a subclass of `ContactLaw`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Final, Literal, Self

from annotated_types import Ge, Gt, Le
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from impact.march.laws import (
    Hertz,
    HertzOnPatch,
    HuntCrossley,
    Law,
    LawError,
    LinearSpring,
    RoughJoint,
    Signorini,
    TableJoint,
)
from seatfem import fields
from seatfem.structures import columns

ClosingForce = Annotated[float, BeforeValidator(fields.ReadQuantity("force")), Gt(0)]
Exponent = Annotated[float, BeforeValidator(fields.read_number), Ge(1), Le(10)]
Recovery = Annotated[float, BeforeValidator(fields.read_number), Gt(0), Le(1)]
COLUMNS: Final = {"closure": "length", "loading": "force", "unloading": "force"}
USUAL: Final = {"kind": "signorini"}
"""Default contact law."""


class ContactLaw(fields.Table):
    """Base of the tables of contact laws, each with ``kind: Literal["name"]``."""

    remembers: ClassVar[bool] = False
    """This says whether the force depends on the largest closure since the contact last opened."""
    holds_indentation: ClassVar[bool] = False
    """This says whether its penetration includes the local indentation of both bodies, as seen from far away; then
    patches that bring one of their own are taken out of it (`take_out_patches`)."""

    kind: str

    def law(self, share: float = 1.0) -> Law:
        """Return the law for a fraction ``share`` of the contact area."""
        raise NotImplementedError

    def take_out_patches(self, local: float) -> Law:
        """Return the law of the whole contact less the local compliance of the patches [m/N], of one that
        `holds_indentation`."""
        raise NotImplementedError

    @property
    def sphere_stiffness(self) -> float:
        """Return Hertz's stiffness (4/3) E* sqrt(R) [N/m^1.5]; 0 for other contacts than that of a sphere."""
        return 0.0


def laws() -> tuple[type[ContactLaw], ...]:
    """Return all contact laws defined so far, those of this module first."""
    return fields.kinds_below(ContactLaw)


class SignoriniLaw(ContactLaw):
    """Rigid unilateral contact: no penetration, no adhesion."""

    kind: Literal["signorini"]

    def law(self, share: float = 1.0) -> Law:
        return Signorini()


class SpringLaw(ContactLaw):
    """A linear spring between the bodies while they touch."""

    kind: Literal["spring"]
    stiffness: fields.Stiffness = Field(description="force per penetration")

    def law(self, share: float = 1.0) -> Law:
        return LinearSpring(share * self.stiffness)


class HertzLaw(ContactLaw):
    """Hertz's contact of a sphere: force = stiffness * penetration^1.5. The stiffness is that of both bodies; the local
    compliance of a patch of finite elements is subtracted from the law, so the force does not depend on the size of the
    patch. State a patch at least as large as the contact, and at least its own width away from edges. Rings, lips,
    faces of files and faces in parts are refused."""

    holds_indentation: ClassVar[bool] = True

    sample: ClassVar[str] = """
kind = "hertz"
stiffness = "5 GN/m^1.5"
"""

    kind: Literal["hertz"]
    stiffness: fields.HertzStiffness = Field(description="(4/3) E* sqrt(R)")

    def law(self, share: float = 1.0) -> Law:
        return Hertz(share * self.stiffness)

    def take_out_patches(self, local: float) -> Law:
        return HertzOnPatch(self.stiffness, local)

    @property
    def sphere_stiffness(self) -> float:
        return self.stiffness


class HuntCrossleyLaw(HertzLaw):
    """Hertz's contact with damping: force = stiffness * penetration^1.5 * (1 + damping * rate of penetration).
    Stiffness and patches are as in hertz."""

    kind: Literal["hunt_crossley"]  # type: ignore[assignment]
    damping: fields.Slowness = fields.default(
        "0 s/m", "3 (1 - e)/(2 v) for the coefficient of restitution e, near 1, at the speed v"
    )

    def law(self, share: float = 1.0) -> Law:
        return HuntCrossley(share * self.stiffness, self.damping)

    def take_out_patches(self, local: float) -> Law:
        return HertzOnPatch(self.stiffness, local, self.damping)


class RoughLaw(ContactLaw):
    """A joint of rough, conforming faces after bedding in. It is soft at low load: force = `force` *
    (closure/`closure`)^exponent. On unloading a fraction `recovery` of its closure is recovered, along a branch that is
    1/recovery times as stiff at each force; the rest is recovered when it opens, so that the next load starts from the
    first branch. Each cycle loses a fraction 1 - recovery of its work."""

    remembers: ClassVar[bool] = True
    sample: ClassVar[str] = """
kind = "rough_joint"
force = "10 kN"
closure = "2 um"
"""

    kind: Literal["rough_joint"]
    force: ClosingForce = Field(description="that closes it by closure, on the whole contact")
    closure: Annotated[fields.Length, fields.Usual(1e-8, 1e-3)] = Field(description="penetration at this force")
    exponent: Exponent = fields.default(2.0, "of force over closure; 2 of machined faces, up to 3.3 of fine ones")
    recovery: Recovery = fields.default(1.0, "share of the closure that comes back when unloaded; 1: elastic")

    def law(self, share: float = 1.0) -> Law:
        return RoughJoint.through(
            force=share * self.force, closure=self.closure, exponent=self.exponent, recovery=self.recovery
        )


class TableLaw(ContactLaw):
    """A joint by table: rows of a CSV file with a header such as `closure [um],loading [kN],unloading [kN]`. Both
    forces are those of the whole contact. Loading increases from row to row. Unloading is measured on the way back from
    the last row; it is 0 up to the closure that remains until the joint opens, and must nowhere be softer than loading
    at the same force, which would supply energy. Values are linear between rows, and beyond the last row with the
    slopes that lead to it. Unloading from other forces follows the same branch, shifted."""

    remembers: ClassVar[bool] = True
    sample: ClassVar[str] = """
kind = "table_joint"
file = "joint.csv"
"""

    kind: Literal["table_joint"]
    file: fields.ExistingFile = Field(description="CSV file with the columns closure, loading, unloading")

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        if not (info.context or {}).get("unread"):
            with fields.problem_of("file", columns.ColumnsError, LawError):
                self.law()
        return self

    def law(self, share: float = 1.0) -> Law:
        table = columns.read_columns(self.file, COLUMNS, tuple(COLUMNS))
        return TableJoint(*(tuple(table[name].tolist()) for name in COLUMNS)).scaled(share)


def law_as_text(given: object) -> object:
    """Return the table ``given`` with law = "signorini" written as law = { kind = "signorini" }."""
    if isinstance(given, Mapping) and isinstance(given.get("law"), str):
        return {**given, "law": {"kind": given["law"]}}
    return given
