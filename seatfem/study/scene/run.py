"""[run] and [accuracy] of a scene: what is simulated, and what the answer must reach."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, Literal

from pydantic import Field, model_validator

from seatfem.fields import Contradictions, Fraction, KeyProblem, Table, Time, absent, default
from seatfem.study.scene.measures import LandingChoice, all_measures, judged_names
from seatfem.units import write_quantity

if TYPE_CHECKING:
    Measure = str
else:
    Measure = Literal[tuple(all_measures())]  # of those that the program has of its own


class Run(Table):
    """What is simulated."""

    duration: Time = Field(description="simulated time")
    time_step: Time | None = absent("time step; chosen from both bodies where absent", examples=["50 ns"])
    filter_width: Time = default("1 us", "width of the moving average behind filtered_peak_force_N")

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
        """Return the names of the measures asked for, of their landing, among the values of a run."""
        return judged_names(self.measures, self.landing)

    @model_validator(mode="before")
    @classmethod
    def _target_of_the_level(cls, written: object) -> object:
        if not isinstance(written, Mapping) or (level := written.get("level")) is None:
            return written
        if "target" in written:
            raise KeyProblem("target", f"level = {level!r} is given too; keep one of the two")
        return {**written, "target": TARGETS[level]} if level in TARGETS else written
