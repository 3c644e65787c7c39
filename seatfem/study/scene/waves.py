"""[[wave]] and [[gauge]] of a scene: incoming strain waves in endless rods, and strain gauges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from annotated_types import Ge, Le
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from impact.bodies.incoming import IncomingWave
from impact.bodies.time_series import TimeSeries, TimeSeriesError, read_time_series
from seatfem import fields

if TYPE_CHECKING:
    from seatfem.study.scene.drives import Mount

Strain = Annotated[float, BeforeValidator(fields.read_number), Ge(-0.1), Le(0.1)]


class Wave(fields.Table):
    """A wave of strain that comes along an endless rod to its struck end: from a file, or a trapezoid that rises and
    falls within `rise` and is `duration` wide at half its height. Strain is positive in tension. A gauge records it
    `recorded_at` from the end, earlier than it arrives by that way over the speed of waves in the rod.
    """

    sample: ClassVar[str] = """
of = "seat"
peak = -1e-3
rise = "10 us"
duration = "100 us"
"""

    of: Literal["seat", "reed"] = Field(description="along which body: a rod with far_end = 'endless'")
    strain: fields.ExistingFile | None = fields.absent(
        "CSV file, its header as in `time [us],strain [um/m]`; zero outside, in between linear"
    )
    peak: Strain | None = fields.absent("or of a trapezoid: the strain of its plateau; negative in compression")
    rise: fields.Time | None = fields.absent("of a trapezoid: from nothing to its plateau, and back")
    duration: fields.Time | None = fields.absent("of a trapezoid: width at half its height")
    start: fields.Delay = fields.default("0 s", "of a trapezoid: when it begins where it is recorded")
    recorded_at: fields.Gap = fields.default("0 mm", "distance of the place where it is recorded from the struck end")

    @model_validator(mode="after")
    def _known(self, info: ValidationInfo) -> Self:
        if not (info.context or {}).get("unread"):
            with fields.problem_of("strain", TimeSeriesError):
                self.course()
        return self

    def contradictions(self) -> fields.Contradictions:
        self.check_one_of(("strain", "peak"), "nothing says what comes")
        shape = self.given_keys("rise", "duration")
        if self.strain is not None and shape:
            yield shape[0], "strain is given from a file; remove the key"
        if self.peak is not None and len(shape) < 2:
            missing = "duration" if shape == ["rise"] else "rise"
            yield missing, f"required key is missing: {type(self).model_fields[missing].description}"
        elif self.rise is not None and self.duration is not None and self.rise >= self.duration:
            yield "rise", "a trapezoid rises in less than its width at half its height: shorten rise"

    def course(self) -> TimeSeries:
        """Return the strain at the place where it is recorded. Raises `TimeSeriesError`."""
        if self.strain is not None:
            return read_time_series(self.strain, "strain", outside="zero")
        peak, rise, lasts = self.peak or 0.0, self.rise or 0.0, self.duration or 0.0
        times = self.start + np.array([0.0, rise, lasts, lasts + rise])
        return TimeSeries(times, np.array([0.0, peak, peak, 0.0]), "zero", "wave")

    def incoming(self, speed: float) -> IncomingWave:
        """Return the wave in a rod with this ``speed`` of waves [m/s]. Raises `TimeSeriesError`."""
        return IncomingWave(self.course(), speed, self.recorded_at)


class Gauge(fields.Table):
    """A strain gauge along a rod, or on the face of a cantilever reed that looks to the seat; positive in tension, at a
    point. summary.json has its largest and smallest strain, gauges.csv its course at the middle of each step.
    """

    sample: ClassVar[str] = """
name = "bar"
of = "seat"
at = "600 mm"
"""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]{0,30}$", description="in results: small letters, digits and _")
    of: Literal["seat", "reed", "stopper"] = Field(description="on which body")
    at: fields.Gap = Field(
        description="distance from the struck end of a rod (of the reed: from the seat's contact), "
        "or from the root of a beam"
    )


@dataclass(frozen=True)
class Gauged:
    """A gauge, its body with the excitation of the base, and the positions of the contacts on the reed [m]."""

    gauge: Gauge
    mount: Mount
    contact_at: float | tuple[float, float] | None
