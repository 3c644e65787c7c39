"""The tables of a scene beside its structures, and the scene itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, Literal, Self

from pydantic import Field, model_validator

from seatfem.fields import Angle, Fraction, Gap, KeyProblem, Length, Position, Table, Time, default, one_of
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.structures.rings import MOST_PORTS, MOST_RINGS, Division
from seatfem.study.scene.base import Base
from seatfem.study.scene.external import ExternalLoad
from seatfem.study.scene.film import Film
from seatfem.study.scene.gas import CompressorGas
from seatfem.study.scene.laws import ContactLaw, law_as_text, laws
from seatfem.study.scene.life import LifeTable
from seatfem.study.scene.measures import all_measures, any_needs_stress
from seatfem.study.scene.stopper import STEEPEST, Stopper
from seatfem.study.scene.stress import Stress

if TYPE_CHECKING:
    Body = Structure
    AnyLaw = ContactLaw
    Measure = str
else:
    Body = one_of(kinds_of())  # of those that the program has of its own, as are the laws and measures
    AnyLaw = one_of(laws())
    Measure = Literal[tuple(all_measures())]
BODIES: Final = ("seat", "reed")
"""The roles of every scene: tables that take any kind of structure."""


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
    gap: Gap = default("0 mm", "opening between the undeformed bodies")
    preload: bool = Field(
        False, strict=True, description="whether the bodies start in equilibrium with the reed's loads and each other"
    )
    rings: int = Field(
        1,
        strict=True,
        ge=1,
        le=MOST_RINGS,
        description="parts of the struck patch, from one edge to the other, each with a contact of its own; 1: the "
        "patch moves as its mean",
    )

    ports: int | None = Field(
        None,
        strict=True,
        ge=1,
        le=MOST_PORTS,
        description="arcs of the lip, each with a contact of its own; chosen where absent, other faces than rings of "
        "bodies of revolution are then struck as a whole unless another key of a lip is given",
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
        """The key by which the lip is not open everywhere alike; "" where none is given."""
        return "tilt" if self.tilt else "waviness" if self.waviness else ""

    @property
    def along_a_lip(self) -> str:
        """The first key that only a lip has a use for; "" where none is given."""
        return "ports" if (self.ports or 1) > 1 else self.uneven or ("offset" if any(self.offset) else "")

    @model_validator(mode="after")
    def _of_a_lip(self) -> Self:
        if abs(self.tilt) > STEEPEST:
            raise KeyProblem("tilt", f"{math.degrees(self.tilt):g} deg is more than {math.degrees(STEEPEST):g} deg")
        arcs = self.ports or 1
        if arcs * self.rings > MOST_PORTS:
            raise KeyProblem(
                "ports", f"{arcs} arcs in {self.rings} rings are more than {MOST_PORTS}: take fewer of either"
            )
        if arcs > 1 and arcs % 2 and 2 * arcs * self.rings > MOST_PORTS:  # half as many tell what they leave
            raise KeyProblem("ports", f"{arcs} arcs in {self.rings} rings: so many must be an even number of arcs")
        if self.ports == 1 and self.uneven:
            raise KeyProblem("ports", f"one port is open by its mean alone, {self.uneven} needs several: remove either")
        if not 0 < self.line_arc <= 2 * math.pi * (1 + 1e-9):
            raise KeyProblem("line_arc", f"{math.degrees(self.line_arc):g} deg is not above 0 and up to 360 deg")
        angles = [angle for angle, _ in self.waviness]
        if any(b <= a for a, b in itertools.pairwise(angles)) or (angles and angles[-1] - angles[0] >= 2 * math.pi):
            raise KeyProblem("waviness", "its angles must rise from one entry to the next, within 360 deg")
        return self


class Run(Table):
    """What is simulated."""

    duration: Time = Field(description="simulated time")
    time_step: Time | None = Field(None, description="time step; chosen from both bodies where absent")
    filter_width: Time = default("1 us", "width of the moving average behind filtered_peak_force_N")

    @model_validator(mode="after")
    def _several_steps(self) -> Self:
        if self.time_step is not None and 2 * self.time_step > self.duration:
            raise KeyProblem("time_step", f"{self.time_step:g} s leaves fewer than two steps in {self.duration:g} s")
        return self


AccuracyLevel = Literal["quick", "standard", "reference"]
TARGETS: Final[Mapping[AccuracyLevel, str]] = {"quick": "5 %", "standard": "1 %", "reference": "0.3 %"}


class Accuracy(Table):
    """What the answer must reach: a target, or the name of one."""

    level: AccuracyLevel | None = Field(None, description="a target by name: quick 5 %, standard 1 %, reference 0.3 %")
    target: Fraction = default("1 %", "relative error asked for; or give level")
    measures: tuple[Measure, ...] = Field(("impulse", "filtered_peak"), min_length=1, description="what it is asked of")

    @model_validator(mode="before")
    @classmethod
    def _target_of_the_level(cls, written: object) -> object:
        if not isinstance(written, Mapping) or (level := written.get("level")) is None:
            return written
        if "target" in written:
            raise KeyProblem("target", f"level = {level!r} is given too; keep one of the two")
        return {**written, "target": TARGETS[level]} if level in TARGETS else written


class Scene(Table):
    """One impact: a reed, a seat, and how long to watch. All values are SI floats."""

    title: str = Field("", description="for reports and pictures")
    seat: Body = Field(description="what is struck")
    reed: Body = Field(description="what strikes")
    contact: Contact = default({}, "where and how the two touch")
    stopper: Stopper | None = Field(None, description="a second body, which limits the lift")
    load: tuple[ExternalLoad, ...] = Field((), description="known loads on the reed, a table each: [[load]]")
    base: tuple[Base, ...] = Field((), description="what moves the bases of bodies, a table each: [[base]]")
    gas: CompressorGas | None = Field(None, description="the gas that the reed, as a valve, lets through")
    run: Run = Field(description="what is simulated")
    accuracy: Accuracy = default({}, "what the answer must reach")
    life: LifeTable | None = Field(None, description="how long the reed has to live; not asked where absent")
    stress: Stress | None = Field(None, description="where stress in the seat is looked for; nowhere where absent")

    @property
    def needs_stress(self) -> bool:
        """Whether the reed's stress is asked for while it strikes, by a measure or for its life."""
        for_life = self.life is not None and self.life.demand() is not None and self.reed.has_stress
        return any_needs_stress(self.accuracy.measures) or for_life

    @model_validator(mode="before")
    @classmethod
    def _duration_of_the_cycles(cls, given: object) -> object:
        """gas.cycles in place of run.duration; what is wrong with either is told where it is read."""
        gas = given.get("gas") if isinstance(given, Mapping) else None
        if not isinstance(given, Mapping) or not isinstance(gas, Mapping) or "cycles" not in gas:
            return given
        turns, rpm, run = gas["cycles"], gas.get("rpm"), given.get("run", {})
        plain = all(isinstance(number, int | float) and number > 0 for number in (turns, rpm))
        if not plain or not isinstance(run, Mapping) or "duration" in run:
            return given
        return {**given, "run": {**run, "duration": f"{60 * turns / rpm!r} s"}}

    @model_validator(mode="after")
    def _gas_of_the_run(self) -> Self:
        if (gas := self.gas) is None:
            return self
        if gas.cycles is not None and not math.isclose(gas.cycles * gas.turn, self.run.duration, rel_tol=1e-6):
            raise KeyProblem(
                "gas.cycles",
                f"{gas.cycles:g} turns take {gas.cycles * gas.turn:g} s, run.duration is {self.run.duration:g} s: keep "
                "one of the two",
            )
        if gas.cylinder_pressure is not None:
            time, slack = gas.course.time, 1e-9 * self.run.duration
            if not gas.course.period and (time[0] > slack or time[-1] < self.run.duration - slack):
                raise KeyProblem(
                    "gas.cylinder_pressure",
                    f"the record covers {time[0]:g}..{time[-1]:g} s, the run takes 0..{self.run.duration:g} s: give a "
                    "longer record, or shorten run.duration",
                )
        return self

    @property
    def bodies(self) -> Mapping[str, Structure]:
        """The bodies that take part, by the names of their tables."""
        found = {"seat": self.seat, "reed": self.reed}
        return found if self.stopper is None else {**found, "stopper": self.stopper.body}

    @property
    def contact_at(self) -> float | tuple[float, float] | None:
        """Where on the reed the contacts lie [m]: the seat's, and the stopper's where that is another place."""
        at = self.contact.at
        if self.stopper is None or self.stopper.at is None:
            return at
        here = self.reed.free_point if at is None else at
        assert here is not None
        return at if self.stopper.at == here else (here, self.stopper.at)

    @property
    def has_two_places(self) -> bool:
        """Whether seat and stopper meet the reed at different places: the second is a port of its own."""
        return isinstance(self.contact_at, tuple)

    @property
    def stopper_gap(self) -> float:
        """From the undeformed reed to the stopper, lift - contact.gap where its lift is stated [m]."""
        assert self.stopper is not None
        if self.stopper.lift is not None:
            return self.stopper.lift - self.contact.gap
        assert self.stopper.gap is not None
        return self.stopper.gap

    @model_validator(mode="after")
    def _in_their_roles(self) -> Self:
        """What is struck is at rest, and what strikes moves."""
        if self.seat.motion:
            raise KeyProblem(f"seat.{self.seat.motion}", "what is struck is at rest; remove the key, or strike with it")
        reed, moved_by = self.reed, self.reed.moved_by
        if not moved_by:
            raise KeyProblem("reed.kind", f"a body of kind {reed.kind!r} has no motion of its own: it cannot strike")
        if not reed.motion and not self.load and not self.base and self.gas is None:
            others = f" ({', '.join(moved_by[1:-1])} or {moved_by[-1]} would do, too)"
            words = type(reed).model_fields[moved_by[0]].description or ""
            raise KeyProblem(f"reed.{moved_by[0]}", f"required key is missing: {words.partition(';')[0]}{others}")
        try:
            reed.check_motion()
        except KeyProblem as problem:
            raise KeyProblem(f"reed.{problem.key}", str(problem)) from None
        return self

    @model_validator(mode="after")
    def _loads_on_the_reed(self) -> Self:
        for number, load in enumerate(self.load):
            self.reed.check_place(load.at, f"load.{number}.at")
            if load.needs_weight and not self.reed.has_weight:
                raise KeyProblem(
                    f"load.{number}.{'gravity' if load.gravity is not None else 'base_motion'}",
                    f"of a reed of kind {self.reed.kind!r} it is not known how its mass is spread; give a force",
                )
        return self

    @model_validator(mode="after")
    def _bases_of_what_is_held(self) -> Self:
        for number, base in enumerate(self.base):
            if base.of not in self.bodies:
                raise KeyProblem(f"base.{number}.of", "there is no [stopper]; add one, or remove the table")
            if base is not self.base_of(base.of):
                raise KeyProblem(f"base.{number}.of", f"the base of the {base.of} has a table before; keep one")
            if loose := self.bodies[base.of].loose:
                words = loose.replace("seat.kind", f"{base.of}.kind")
                raise KeyProblem(f"base.{number}.of", f"{words}: it stands on nothing that could move it")
        if self.base_of("reed") is not None and not self.reed.has_weight:
            raise KeyProblem(
                f"base.{[base.of for base in self.base].index('reed')}.of",
                f"of a reed of kind {self.reed.kind!r} it is not known how its mass is spread; give a beam or a plate",
            )
        return self

    def base_of(self, role: str) -> Base | None:
        """What moves the base of the body in this role; ``None``: it rests."""
        return next((base for base in self.base if base.of == role), None)

    @property
    def is_loaded(self) -> bool:
        """Whether known forces drive the reed, or gas does, or bases move."""
        return bool(self.load or self.base) or self.gas is not None or self.reed.is_loaded

    @property
    def is_blown_by_lift(self) -> bool:
        """Whether any load depends on how far the reed is off its seat."""
        return self.gas is not None or any(load.by_lift for load in self.load)

    @model_validator(mode="after")
    def _contact_on_the_reed(self) -> Self:
        self.reed.check_contact(self.contact.at)
        return self

    @model_validator(mode="after")
    def _stopper_beyond_the_reed(self) -> Self:
        self.check_start()
        return self

    def check_start(self) -> None:
        """The stopper meets the reed where it has a place, and not before the start; raises `KeyProblem`."""
        if (stopper := self.stopper) is None:
            return
        self.reed.check_contact(stopper.at, "stopper.at")
        if stopper.parts != Division() and not self.reed.meets_lips:
            key = "arcs" if (stopper.arcs or 1) > 1 else "tilt" if stopper.tilt else "rings"
            words = f"a reed of kind {self.reed.kind!r} touches with one rigid face; remove the key, or take a plate"
            raise KeyProblem(f"stopper.{key}", words)
        by_lift = stopper.lift is not None
        if by_lift and self.has_two_places and self.contact.gap > 0:
            raise KeyProblem(
                "stopper.lift",
                f"with contact.gap = {1e3 * self.contact.gap:g} mm the closed reed is bent, and where it stands at "
                "stopper.at depends on what holds it there; give stopper.gap, from the undeformed reed",
            )
        gap, start = self.stopper_gap, self.reed.start_at(self.contact.at if stopper.at is None else stopper.at)
        key = "stopper.lift" if by_lift else "stopper.gap"
        more = self.contact.gap if by_lift else 0.0
        if gap < 0:
            raise KeyProblem(
                key,
                f"{1e3 * (gap + more):.6g} mm is less than contact.gap = {1e3 * more:.6g} mm: the undeformed reed "
                f"would stand inside the stopper; make the lift at least {1e3 * more:.6g} mm",
            )
        if start > gap + 1e-9 * abs(start):
            raise KeyProblem(
                key,
                f"{1e3 * (gap + more):.6g} mm: at the start the reed stands {1e3 * start:.6g} mm off its undeformed "
                f"place there, inside the stopper (limit: {key}); make the {key.removeprefix('stopper.')} at least "
                f"{1e3 * (start + more):.6g} mm, or release the reed from a smaller deflection",
            )

    @model_validator(mode="after")
    def _lip_of_a_seat(self) -> Self:
        if (key := self.contact.along_a_lip) and (why := self.seat.no_lip):
            raise KeyProblem(f"contact.{key}", f"a seat of kind {self.seat.kind!r}, {why}")
        if self.seat.is_curved:
            raise KeyProblem("seat.curvature", "only the reed may be curved; remove the key")
        if self.reed.is_curved and (why := self.seat.no_lip):
            raise KeyProblem("reed.curvature", f"a seat of kind {self.seat.kind!r}, {why}")
        if self.reed.is_curved and self.contact.ports == 1:
            raise KeyProblem(
                "contact.ports", "one port is open by its mean alone, reed.curvature needs several: remove it"
            )
        if any(self.contact.offset) and not self.reed.meets_lips:
            raise KeyProblem(
                "contact.offset", f"a body of kind {self.reed.kind!r} touches with one rigid face; remove the key"
            )
        return self

    @model_validator(mode="after")
    def _film_of_a_strip(self) -> Self:
        if (film := self.contact.film) is not None:
            try:
                film.check(self.seat.struck_ring, self.seat.kind, self.contact.rings)
            except KeyProblem as problem:
                raise KeyProblem(f"contact.{problem.key}", str(problem)) from None
        return self

    @model_validator(mode="after")
    def _stress_of_finite_elements(self) -> Self:
        if self.stress is not None and not self.seat.is_meshed:
            raise KeyProblem("stress", f"a seat of kind {self.seat.kind!r} has no finite elements; remove the table")
        if self.stress is not None:
            try:
                self.stress.check(self.run.duration)
            except KeyProblem as problem:
                raise KeyProblem(f"stress.{problem.key}", str(problem)) from None
        return self

    @model_validator(mode="after")
    def _rings_of_a_patch(self) -> Self:
        if self.contact.rings > 1 and not self.seat.has_rings:
            raise KeyProblem(
                "contact.rings",
                f"of a seat of kind {self.seat.kind!r} no patch is known that could be divided; remove the key",
            )
        return self

    @model_validator(mode="after")
    def _stress_of_what_bends(self) -> Self:
        if any_needs_stress(self.accuracy.measures) and not self.reed.has_stress:
            bends = "has no bending stress that is known" if self.reed.reach else "does not bend, it has no stress"
            words = f"a body of kind {self.reed.kind!r} {bends}: remove it, or use a cantilever"
            raise KeyProblem("accuracy.measures", words)
        return self

    @model_validator(mode="after")
    def _life_of_what_bends(self) -> Self:
        if self.life is not None:
            try:
                self.life.check(self)
            except KeyProblem as problem:
                raise KeyProblem(f"life.{problem.key}", str(problem)) from None
        return self
