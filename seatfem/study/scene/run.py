"""[run], [accuracy] and [stress] of a scene: simulated time, required accuracy, and stress in the seat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal

from pydantic import Field, model_validator

from seatfem.fields import Contradictions, Fraction, Gap, KeyProblem, Position, Table, Time, Usual, absent, default
from seatfem.study.scene.measures import LandingChoice, defined_measures, judged_names
from seatfem.units import write_quantity

OWN_MEASURES: Final = tuple(defined_measures())
"""Measures defined before `Scene`, like the laws `contact.OWN_LAWS`."""
if TYPE_CHECKING:
    Measure = str
else:
    Measure = Literal[OWN_MEASURES]


MOST_MEMBERS: Final = 1000  # most runs of an ensemble


class Run(Table):
    """What is simulated."""

    duration: Time = Field(description="simulated time")
    time_step: Time | None = absent("time step; chosen from both bodies where absent", examples=["50 ns"])
    filter_width: Annotated[Time, Usual(1e-8, 1e-3)] = default(
        "1 us", "width of the moving average behind filtered_peak_force_N"
    )
    ensemble: int | None = absent(
        "runs that differ by round-off, for statistics of the landings that no single run knows; none if absent",
        strict=True,
        ge=2,
        le=MOST_MEMBERS,
        examples=[20],
    )

    def contradictions(self) -> Contradictions:
        if self.time_step is not None and 2 * self.time_step > self.duration:
            step, duration = (write_quantity(time, "time") for time in (self.time_step, self.duration))
            yield "time_step", f"{step} must leave at least two steps in {duration}"


AccuracyLevel = Literal["quick", "standard", "reference"]
TARGETS: Final[Mapping[AccuracyLevel, str]] = {"quick": "5 %", "standard": "1 %", "reference": "0.3 %"}


class Accuracy(Table):
    """The accuracy asked for: a target, or the name of one."""

    level: AccuracyLevel | None = absent("a target by name: quick 5 %, standard 1 %, reference 0.3 %")
    target: Fraction = default("1 %", "relative error asked for; or give level")
    measures: tuple[Measure, ...] = default(("impulse", "filtered_peak"), "results it is asked of", min_length=1)
    landing: LandingChoice = default(
        "hardest",
        "the landing on the seat that the measures refer to: the one whose force exceeds the static load "
        "most, the first one, or the whole run, static load included",
    )

    @property
    def judged(self) -> tuple[str, ...]:
        """Return the names, among the values of a run, of the required measures for the chosen landing."""
        return judged_names(self.measures, self.landing)

    @model_validator(mode="before")
    @classmethod
    def _target_of_the_level(cls, written: object) -> object:
        if not isinstance(written, Mapping) or (level := written.get("level")) is None:
            return written
        if "target" in written:
            raise KeyProblem("target", f"level = {level!r} is given too; keep one of the two")
        return {**written, "target": TARGETS[level]} if level in TARGETS else written


MOST = 100  # most named points
MOST_FRAMES = 500


class Stress(Table):
    """Stress in the seat's finite elements under the contact forces of the run, by mode acceleration; off if the table
    is absent. For a seat that is struck in arcs of its lip the force of each arc acts on its own arc."""

    sample: ClassVar[str] = """
distance = "0.2 mm"
frames = 40
"""

    points: tuple[tuple[Position, Position, Position], ...] = default(
        (),
        "named places x, y, z in the seat's own coordinates, whose histories are kept; of a body of "
        "revolution about z that is struck all around the angle does not matter",
        max_length=MOST,
    )
    surface: bool = default(
        True, "whether the whole surface is searched for the largest; else only the points", strict=True
    )
    distance: Gap = default(
        "0.2 mm", "from sharp inner corners and the rim of clamped faces, within which no stress is reported"
    )
    struck: bool = default(
        False,
        "whether the surface includes the struck face and its neighbourhood within distance, where a "
        "coarse mesh is unreliable and the stress at a rigid rim has no limit",
        strict=True,
    )
    apart: Gap = default("1 mm", "within which the largest of the stress is one hot spot")
    frames: int = default(
        0,
        "of the stress wave on the seat, and on the faces of a reed that is a plate: stress_wave.gif and "
        ".png, reed_stress_wave.gif and .png, for ParaView seat_stress.pvd and reed_stress.pvd; 0: none",
        ge=0,
        le=MOST_FRAMES,
    )
    frames_from: Time | None = absent("time of their first; absent: the first touch; of a reed a little before it")
    frames_until: Time | None = absent(
        "time of their last; absent: when shear waves have gone along the seat twice; of a reed a little "
        "after its first contact"
    )

    def contradictions(self) -> Contradictions:
        if not self.surface and not self.points:
            yield "points", "no point is named and surface = false: name one, or remove the table"
        if not self.frames and (idle := [key for key in ("frames_from", "frames_until") if getattr(self, key)]):
            yield idle[0], "there are no frames: state their number, or remove the key"
        if self.frames_from and self.frames_until and self.frames_from >= self.frames_until:
            last, first = (write_quantity(time, "time") for time in (self.frames_until, self.frames_from))
            yield "frames_until", f"{last} must be later than frames_from = {first}"

    def check(self, duration: float) -> Contradictions:
        """Yield contradictions for frames after the end of the run, ``duration`` [s]."""
        for key in self.given_keys("frames_from", "frames_until"):
            if (time := getattr(self, key)) > duration:
                stated, most = (write_quantity(each, "time") for each in (time, duration))
                yield key, f"{stated} must be at most run.duration = {most}"
