"""The tables of a scene beside [seat], and the scene itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from seatfem.fields import (
    Approach,
    DampingRatio,
    Fraction,
    Gap,
    KeyProblem,
    Length,
    Mass,
    Table,
    Time,
    default,
)
from seatfem.machine.code import numerics_version
from seatfem.structures.kinds.parts import Material
from seatfem.structures.kinds.seats import ElasticSeat, GreensFile, Seat
from seatfem.structures.rings import MOST_RINGS
from seatfem.study.scene.laws import AnyLaw


class Release(Table):
    """How the reed starts: at rest, in the static shape under a force at its tip."""

    tip_deflection: Length = Field(description="deflection of the tip, away from the seat")


class Cantilever(Table):
    """A flat reed, clamped at its root: an Euler-Bernoulli beam; by default as wide and thick as the paper's."""

    kind: Literal["cantilever"]
    length: Length = Field(description="free length")
    width: Length = default("10 mm", "width")
    thickness: Length = default("0.305 mm", "thickness, in the direction of the motion")
    material: Material = default({"young": "200 GPa", "density": "7850 kg/m^3"}, "the reed's material; steel if absent")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    n_modes: int = Field(40, strict=True, ge=1, le=1000, description="number of beam modes")
    release: Release = Field(description="how the reed starts")


class RigidMass(Table):
    """A rigid striker in free flight, as in a drop test."""

    kind: Literal["rigid_mass"]
    mass: Mass = Field(description="mass")
    velocity: Approach = Field(description='velocity at the start; towards the seat it is negative, as in "-2 m/s"')


Reed = Annotated[Cantilever | RigidMass, Field(discriminator="kind")]


class Contact(Table):
    """Where and how the two bodies touch."""

    law: AnyLaw = default({"kind": "signorini"}, "force by penetration; a kind without keys may be written as text")
    at: Length | None = Field(None, description="position on the reed, from its root; the tip where absent")
    gap: Gap = default("0 mm", "opening between the undeformed bodies")
    rings: int = Field(
        1,
        strict=True,
        ge=1,
        le=MOST_RINGS,
        description="parts of the struck patch, from one edge to the other, each with a contact of its own; 1: the "
        "patch moves as its mean",
    )

    @model_validator(mode="before")
    @classmethod
    def _law_as_text(cls, given: object) -> object:
        """law = "signorini" is law = { kind = "signorini" }."""
        if isinstance(given, Mapping) and isinstance(given.get("law"), str):
            return {**given, "law": {"kind": given["law"]}}
        return given


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


Measure = Literal["impulse", "filtered_peak", "contact_duration", "seat_displacement", "stress"]
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
    seat: Seat = Field(description="what is struck")
    reed: Reed = Field(description="what strikes")
    contact: Contact = default({}, "where and how the two touch")
    run: Run = Field(description="what is simulated")
    accuracy: Accuracy = default({}, "what the answer must reach")

    @model_validator(mode="after")
    def _contact_on_the_reed(self) -> Self:
        at = self.contact.at
        if at is None:
            return self
        if isinstance(self.reed, RigidMass):
            raise KeyProblem("contact.at", "a rigid mass has no positions; remove the key")
        if at > self.reed.length:
            raise KeyProblem("contact.at", f"{at:g} m lies beyond the reed, which ends at {self.reed.length:g} m")
        return self

    @model_validator(mode="after")
    def _rings_of_a_patch(self) -> Self:
        if self.contact.rings > 1 and not isinstance(self.seat, ElasticSeat | GreensFile):
            raise KeyProblem(
                "contact.rings",
                f"of a seat of kind {self.seat.kind!r} no patch is known that could be divided; remove the key",
            )
        return self

    @model_validator(mode="after")
    def _stress_of_what_bends(self) -> Self:
        if isinstance(self.reed, RigidMass) and "stress" in self.accuracy.measures:
            raise KeyProblem(
                "accuracy.measures",
                "a rigid mass does not bend, it has no stress: remove it, or use a cantilever",
            )
        return self

    def seat_key(self) -> str:
        """A hash of everything the seat's Green's function depends on, the code included; files count by content, not
        by name, with all that they include."""
        seat = self.seat.model_dump(mode="json")
        if self.contact.rings > 1:
            seat["rings"] = self.contact.rings
        for key in type(self.seat).model_fields:
            if isinstance(file := getattr(self.seat, key), Path):
                from seatfem.structures.formats.includes import (
                    with_included,  # with readers that take half a second to load
                )

                parts = [_hash(part) for part in with_included(file)]
                seat[key] = parts[0] if len(parts) == 1 else sorted(parts)
        text = json.dumps([numerics_version(), seat], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
