"""[contact] of a scene: where and how the two bodies touch."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Self

from pydantic import Field, model_validator

from seatfem.fields import Angle, KeyProblem, Length, Opening, Position, Table, default, one_of
from seatfem.structures.rings import MOST_CHOSEN, MOST_PORTS, MOST_RINGS
from seatfem.study.scene.film import Film
from seatfem.study.scene.laws import ContactLaw, law_as_text, laws
from seatfem.study.scene.stopper import STEEPEST

if TYPE_CHECKING:
    AnyLaw = ContactLaw
else:
    AnyLaw = one_of(laws())  # of those that the program has of its own


class Contact(Table):
    """Where and how the two bodies touch.

    The keys from `ports` on are those of a lip: flat faces in one plane, each a ring between two closed lines, however
    it winds, or a strip with two ends. The ring of a body of revolution is one, the lands of a `plate`, and many a face
    of `cad` and `mesh`. Their centroid lies at the reed's contact, the part's x axis along the reed. Cuts square across
    divide them into arcs of equal areas, which are numbered through: face after face by x, a ring from its own x axis
    anticlockwise about the normal, a strip from its end at the lesser x. Of one ring that each ray from its centroid
    crosses once places are angles, from the x axis on; of others lengths along the lip.
    """

    law: AnyLaw = default({"kind": "signorini"}, "force by penetration; a kind without keys may be written as text")
    film: Film | None = Field(None, description="fluid in the gap; none where absent")
    at: Length | None = Field(None, description="position on the reed, from its root; the tip where absent")
    gap: Opening = default("0 mm", "smallest opening between the undeformed bodies")
    preload: bool = Field(
        False, strict=True, description="whether the bodies start in equilibrium with the reed's loads and each other"
    )
    rings: int = Field(
        1,
        strict=True,
        ge=1,
        le=MOST_RINGS,
        description="parts across the contact face, from edge to edge, each with its own contact; 1: one contact "
        "with the mean displacement",
    )

    ports: int | None = Field(
        None,
        strict=True,
        ge=1,
        le=MOST_PORTS,
        description="segments of the lip, each with its own contact; chosen where absent: then faces other than "
        "rings of bodies of revolution are struck as a whole, unless another key of a lip is given",
    )
    tilt: Angle = default("0 deg", "between the plane of the seat's lip and the undeformed reed")
    tilt_axis: Angle = default(
        "0 deg", "direction about which it is tilted, from the reed's long axis: 0 deg is roll, 90 deg is pitch"
    )
    offset: tuple[Position, Position] = default(
        ("0 mm", "0 mm"), "of the lip's centre from the reed's contact, along and across the reed"
    )
    line_arc: Angle = default("45 deg", "part of the lip over which forces per length are averaged")
    waviness: tuple[tuple[Angle, Position], ...] = Field(
        (),
        max_length=1000,
        description="heights of the gap over the lip's angle, added to the tilt: a list of [angle, height], in between "
        "linear; from the direction of the reed's tip, anticlockwise",
    )

    @model_validator(mode="before")
    @classmethod
    def _law_as_text(cls, given: object) -> object:
        return law_as_text(given)

    @property
    def uneven(self) -> str:
        """Return the key by which the lip is not open everywhere alike; "" where none is given."""
        return "tilt" if self.tilt else "waviness" if self.waviness else ""

    @property
    def along_a_lip(self) -> str:
        """Return the first key that only a lip has a use for; "" where none is given."""
        return "ports" if (self.ports or 1) > 1 else self.uneven or ("offset" if any(self.offset) else "")

    @model_validator(mode="after")
    def _of_a_lip(self) -> Self:
        if abs(self.tilt) > STEEPEST:
            raise KeyProblem("tilt", f"{math.degrees(self.tilt):g} deg must be at most {math.degrees(STEEPEST):g} deg")
        arcs = self.ports or 1
        if arcs * self.rings > MOST_PORTS:
            raise KeyProblem(
                "ports",
                f"{arcs} segments in {self.rings} rings are more than {MOST_PORTS}; their mutual compliances take "
                f"{8e-9 * (arcs * self.rings) ** 2:.2g} GB for each body: take fewer of either",
            )
        if arcs > 1 and arcs % 2 and 2 * arcs * self.rings > MOST_CHOSEN:  # half as many tell what they leave
            raise KeyProblem(
                "ports", f"{arcs} segments in {self.rings} rings: so many must be an even number of segments"
            )
        if self.ports == 1 and self.uneven:
            raise KeyProblem(
                "ports", f"a single contact point has only a mean gap, {self.uneven} needs several: remove one key"
            )
        if not 0 < self.line_arc <= 2 * math.pi * (1 + 1e-9):
            raise KeyProblem("line_arc", f"{math.degrees(self.line_arc):g} deg must be above 0 and at most 360 deg")
        angles = [angle for angle, _ in self.waviness]
        for a, b in itertools.pairwise(angles):
            if not a < b < angles[0] + 2 * math.pi:
                raise KeyProblem(
                    "waviness",
                    f"{math.degrees(b):g} deg after {math.degrees(a):g} deg: its angles must rise from one entry to "
                    "the next, within 360 deg",
                )
        return self
