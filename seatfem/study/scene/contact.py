"""[contact] of a scene with its film, and [stopper]."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final

from annotated_types import Ge
from pydantic import Field, SerializerFunctionWrapHandler, create_model, model_serializer, model_validator

from impact.march.laws import SqueezeFilm
from seatfem import fields
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.structure import motion_key
from seatfem.structures.rings import MOST_CHOSEN, MOST_PORTS, MOST_RINGS, Division
from seatfem.study.scene.laws import USUAL, ContactLaw, law_as_text, laws
from seatfem.study.scene.retainers import Profile


class Film(fields.Table):
    """A fluid in the open gap between reed and seat, in addition to the contact law, modelled as under a long strip.

    On a length l of the strip the force is viscosity * l * width^3/(gap + floor)^3 times the closing speed. It opposes
    closing and opening alike; in opening it is limited to tension_limit times the area. It is zero while the gap is
    closed. Forces and impulses of a run are those of film and bodies together; contacts, their number, duration and
    restitution are those of the bodies alone. summary.json has film_force_peak_N, stiction_force_peak_N (the largest
    tension), film_loss_J, and the results without_film. The fluid is incompressible: for a gas the force is an upper
    bound where the film's pressure exceeds the ambient pressure.
    """

    sample: ClassVar[str] = """
viscosity = "18 uPa s"
floor = "2 um"
"""

    viscosity: fields.Viscosity = Field(description="mu, dynamic")
    floor: Annotated[fields.Length, fields.Usual(1e-8, 1e-3)] = Field(
        description="fluid gap that roughness leaves where the bodies touch; half the height difference within a lip "
        "segment, by tilt or waviness, is added"
    )
    width: fields.Length | None = fields.absent("of the strip, across the flow; that of the seat's lip where absent")
    length: fields.Length | None = fields.absent("of the strip; the circumference of the seat's lip where absent")
    tension_limit: fields.Pressure = fields.default(
        "1 bar", "pressure by which the film pulls before it breaks: the ambient one less that of cavitation"
    )

    def check(self, ring: tuple[float, float] | None, seat: str, rings: int) -> fields.Contradictions:
        """Yield contradictions of the film with the seat's lip, a ``ring`` of mean radius and width [m]."""
        if rings > 1:
            yield "film", f"the film is known across the whole lip, not in {rings} rings: remove either"
        for key in ("width", "length"):
            if ring is None and getattr(self, key) is None:
                words = f"required key is missing: of a seat of kind {seat!r}, as it is given here, no lip is known"
                yield f"film.{key}", f"{words}; give width and length of the strip that closes"

    def build_film(self, ring: tuple[float, float] | None) -> SqueezeFilm:
        """Return the film on the whole lip."""
        radius, across = ring or (0.0, 0.0)
        return SqueezeFilm.strip(
            viscosity=self.viscosity,
            length=self.length or 2 * math.pi * radius,
            width=self.width or across,
            floor=self.floor,
            underpressure=self.tension_limit,
        )


OWN_LAWS: Final = laws()
"""Laws defined before `Scene`; for later ones, `load.scene_of` makes another type of scenes."""
if TYPE_CHECKING:
    _Law = ContactLaw
else:
    _Law = fields.one_of(OWN_LAWS)


USUAL_ARCS: Final = 32  # default number of segments of a tilted or divided stopper
STEEPEST: Final = math.radians(30) * (1 + 1e-12)  # largest tilt; 30 deg itself fits, however it is rounded


class Stopper(fields.Table):
    """A second body that limits the lift, of any kind, with the keys of that kind. It is at rest, or free with a
    velocity towards the seat; it then strikes the reed from behind, as in a chain of a striker and two bars. If the
    reed is a free rod and `at` is its length, the stopper meets its back end. The stopper's Green's function follows
    its own keys; its error is in the error bars of a run, not in those of a plan."""

    inlined: ClassVar[str] = "body"

    sample: ClassVar[str] = """
kind = "spring"
stiffness = "20 N/um"
gap = "1.5 mm"
"""

    gap: Annotated[fields.Travel, Ge(0)] | None = fields.absent(
        "distance from the undeformed reed to the stopper, on the side away from the seat; with a profile where its "
        "height is 0"
    )
    lift: fields.Travel | None = fields.absent(
        "instead of gap: travel of the reed from the seat to the stopper; the reed on its seat lies "
        "contact.gap below its undeformed place, so that gap = lift - contact.gap, with a profile less its height at "
        "the contact"
    )
    at: fields.Length | None = fields.absent("position on the reed, from its root; that of the contact where absent")
    arcs: int | None = fields.absent(
        "number of segments of its face, each with its own contact, for a reed that is a plate, and with a profile "
        "also for a beam. The face is the flat ring or disc that is struck, the faces of cad and mesh, or, of a "
        "stopper without a face such as a spring, the reed's contact face. Where absent: 32 with rings, a tilt or a "
        "profile; else the face is one contact, until a round divides it",
        strict=True,
        ge=1,
        le=MOST_PORTS,
    )
    rings: int = fields.default(1, "number of parts across each segment", strict=True, ge=1, le=MOST_RINGS)
    tilt: fields.Tilt = fields.default(
        "0 deg", "between the stopper's plane and the undeformed reed; gap is then the smallest"
    )
    tilt_axis: fields.Angle = fields.default("0 deg", "direction about which it is tilted, as contact.tilt_axis")
    profile: Profile | None = fields.absent("shape of its face along a clamped reed; flat where absent")
    law: _Law = fields.default(USUAL, "force by penetration; a kind without keys may be written as text")
    body: Structure = Field(description="the stopping body")

    @model_validator(mode="before")
    @classmethod
    def _split_body(cls, given: object) -> object:
        """Move the keys of the body to the field ``body``."""
        if not isinstance(given, Mapping) or isinstance(given.get("body"), Structure):
            return given
        own = {key: value for key, value in given.items() if key in set(cls.model_fields) - {"body"}}
        return law_as_text({**own, "body": {key: value for key, value in given.items() if key not in own}})

    @model_serializer(mode="wrap")
    def _join_body(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the keys of stopper and body in one table, as in a file."""
        own: dict[str, Any] = dict(handler(self))
        return {**own.pop("body", {}), **own}

    def contradictions(self) -> fields.Contradictions:
        if self.gap is None and self.lift is None:
            words = type(self).model_fields["gap"].description
            yield "gap", f"required key is missing: {words}; or give lift, from the seat"
        if self.gap is not None and self.lift is not None:
            yield "lift", "gap is given too; keep one of the two"
        if self.lift is not None and self.lift <= 0:
            yield "lift", f"{1e3 * self.lift:g} mm: the reed could not leave its seat; it must be more than 0 mm"
        if (self.arcs or 1) * self.rings > MOST_PORTS:
            yield "arcs", f"{self.arcs} segments in {self.rings} rings are more than {MOST_PORTS}: take fewer"
        if abs(self.tilt) > STEEPEST:
            yield "tilt", f"{math.degrees(self.tilt):g} deg must be at most {math.degrees(STEEPEST):g} deg"
        for key in ("tilt", "profile"):
            if getattr(self, key) and self.arcs == 1:
                yield "arcs", f"a single contact point has only a mean gap, {key} needs several: remove one key"
        if self.profile is not None and not self.profile.own_face and not self.body.lip_face.no_lip:
            words = f"a stopper of kind {self.body.kind!r} has a face of its own"
            yield "profile", f"{words}; state own_face = true of a cad or mesh, or take a spring"
        if self.profile is not None and self.tilt:
            yield "tilt", "it has a profile too; write the tilt into the heights of profile.file, and remove the key"
        if self.profile is not None and self.speed:
            yield "velocity", "a retainer is at rest; remove the key, or the profile"
        if self.profile is not None and self.profile.own_face and (self.body.lip_face.no_lip or not self.body.files()):
            words = f"a stopper of kind {self.body.kind!r} has no curved face; state radius or file, of a spring"
            yield "profile.own_face", words
        if self.profile is not None and self.at is not None:
            yield "at", "the reed meets a profile all along; remove one of the two"
        if (key := motion_key(self.body)) and key != "velocity":
            yield key, "a stopper is at rest, or strikes with a velocity; remove the key, or strike with the body"
        yield from fields.flies_away(self.speed, "velocity")

    @property
    def speed(self) -> float:
        """Return the initial velocity of the stopper, < 0 towards the seat [m/s]."""
        return getattr(self.body, "velocity", None) or 0.0

    @property
    def parts(self) -> Division:
        """Return the division of its face into segments and rings."""
        many = self.arcs or (USUAL_ARCS if self.tilt or self.rings > 1 or self.profile is not None else 1)
        return Division(min(many, MOST_PORTS // self.rings), self.rings)

    def divided(self, division: Division) -> Stopper:
        """Return the stopper with another division of its face."""
        if division == self.parts:
            return self
        return self.model_copy(update={"arcs": division.arcs, "rings": division.rings})


def stopper_of(kinds: tuple[type[Structure], ...], laws: tuple[type[ContactLaw], ...]) -> type[Stopper]:
    """Return a type of stopper that takes bodies of these kinds and these contact laws."""
    changed: Any = {"body": (fields.one_of(kinds), fields.field_of(Stopper, "body"))}
    if laws != OWN_LAWS:
        changed["law"] = (fields.one_of(laws), fields.field_of(Stopper, "law"))
    return create_model("Stopper", __base__=Stopper, __doc__=Stopper.__doc__, **changed)


class Contact(fields.Table):
    """Where and how the two bodies touch.

    The keys from `ports` on apply to a lip: flat faces in one plane, each a ring between two closed lines of any shape,
    or a strip with two ends. The ring of a body of revolution, the lands of a `plate`, and many faces of `cad` and
    `mesh` are lips. The centroid of the faces lies at the reed's contact, and the part's x axis along the reed. A plate
    touches the part of the flat faces that lies under it in plan. This must be at least a tenth of each face, and all
    round a port at least a tenth of its land's width.

    Cuts across the faces divide them into segments (arcs) of equal areas. The segments are numbered face after face, in
    the order of x; on a ring from its own x axis, anticlockwise about the normal; on a strip from its end at the
    smaller x. Places are angles from the x axis on a single ring that each ray from its centroid crosses once, and
    lengths along the lip otherwise.
    """

    law: _Law = fields.default(USUAL, "force by penetration; a kind without keys may be written as text")
    film: Film | None = fields.absent("fluid in the gap; none where absent")
    at: fields.Length | None = fields.absent("position on the reed, from its root; the tip where absent")
    gap: fields.Opening = fields.default("0 mm", "smallest opening between the undeformed bodies")
    preload: bool = fields.default(
        False, "whether the bodies start in equilibrium with the reed's loads and each other", strict=True
    )
    rings: int = fields.default(
        1,
        "number of parts across the contact face, from edge to edge, each with its own contact; 1: one "
        "contact with the mean displacement",
        strict=True,
        ge=1,
        le=MOST_RINGS,
    )

    ports: int | None = fields.absent(
        "number of segments of the lip, each with its own contact. Where absent it is chosen by the run; it is one if "
        "the reed states its own contact or is no plate, unless another key of a lip is given",
        strict=True,
        ge=1,
        le=MOST_PORTS,
    )
    tilt: fields.Tilt = fields.default("0 deg", "between the plane of the seat's lip and the undeformed reed")
    tilt_axis: fields.Angle = fields.default(
        "0 deg", "direction about which it is tilted, from the reed's long axis: 0 deg is roll, 90 deg is pitch"
    )
    offset: tuple[fields.Position, fields.Position] = fields.default(
        ("0 mm", "0 mm"), "of the lip's centre from the reed's contact, along and across the reed"
    )
    line_arc: fields.Angle = fields.default("45 deg", "part of the lip over which forces per length are averaged")
    waviness: tuple[tuple[fields.Angle, fields.Position], ...] = fields.default(
        (),
        "heights that are added to the gap along the lip: a list of [angle, height], linear in between; angles from "
        "the direction of the reed's tip, anticlockwise",
        max_length=1000,
    )

    @model_validator(mode="before")
    @classmethod
    def _law_as_text(cls, given: object) -> object:
        return law_as_text(given)

    @property
    def uneven_key(self) -> str:
        """Return the key that lets the gap vary along the lip; "" if there is none."""
        return "tilt" if self.tilt else "waviness" if self.waviness else ""

    @property
    def lip_key(self) -> str:
        """Return the first stated key that needs a lip; "" if there is none."""
        return "ports" if (self.ports or 1) > 1 else self.uneven_key or ("offset" if any(self.offset) else "")

    def contradictions(self) -> fields.Contradictions:
        if abs(self.tilt) > STEEPEST:
            yield "tilt", f"{math.degrees(self.tilt):g} deg must be at most {math.degrees(STEEPEST):g} deg"
        arcs = self.ports or 1
        parts = f"{arcs} segments in {self.rings} rings"
        if arcs * self.rings > MOST_PORTS:
            size = f"their mutual compliances take {8e-9 * (arcs * self.rings) ** 2:.2g} GB for each body"
            yield "ports", f"{parts} are more than {MOST_PORTS}; {size}: take fewer of either"
        if arcs > 1 and arcs % 2 and 2 * arcs * self.rings > MOST_CHOSEN:  # the error is estimated with half as many
            yield "ports", f"{parts}: so many must be an even number of segments"
        if self.ports == 1 and self.uneven_key:
            yield (
                "ports",
                f"a single contact point has only a mean gap, {self.uneven_key} needs several: remove one key",
            )
        if self.film is not None and self.law.remembers:
            yield ("film", "how the fluid in a joint that stays closed moves is not known: remove one of film and law")
        if not 0 < self.line_arc <= 2 * math.pi * (1 + 1e-9):
            yield "line_arc", f"{math.degrees(self.line_arc):g} deg must be above 0 and at most 360 deg"
        angles = [angle for angle, _ in self.waviness]
        for a, b in itertools.pairwise(angles):
            if not a < b < angles[0] + 2 * math.pi:
                words = f"{math.degrees(b):g} deg after {math.degrees(a):g} deg: its angles must rise from one entry to"
                yield "waviness", f"{words} the next, within 360 deg"
