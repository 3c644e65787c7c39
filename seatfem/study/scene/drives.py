"""Excitations and gauges of a scene: [[base]], [[load]], [[spring]], [[wave]] in endless rods, and [[gauge]]."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, Literal, Self, get_args

import numpy as np
from annotated_types import Ge, Le
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from impact.bodies import loads, time_series
from impact.bodies.body import IncomingWave
from impact.bodies.time_series import TimeSeries, TimeSeriesError, read_time_series
from impact.greens.base import Array
from seatfem import fields
from seatfem.structures.kinds.motion import AnyAcceleration, AnyForce, AnyPressure, CourseColumns, CourseUnits, Record
from seatfem.structures.kinds.structure import Structure


@dataclass(frozen=True)
class Mount:
    """A body of a scene with the excitation of its base.

    Attributes:
        role: name of its table.
        structure: the body.
        base: motion of its base; ``None`` if that is at rest.
        wave: incoming wave; ``None`` if there is none.
    """

    role: str
    structure: Structure
    base: Base | None = None
    wave: Wave | None = None


class Base(fields.Table):
    """A motion of the reed's clamp, or of the base of the seat or the stopper, along the normal (positive away from the
    seat), from a CSV file that covers the run. Gaps follow it, and the body has inertia loads: the full load for a
    reed, and for a seat or stopper that is a beam or a plate. For others only the rigid motion is modelled; motions
    that would bend them by more than 1 % of the displacement are refused. Displacements and velocities in results are
    absolute; energies are relative to the base."""

    sample: ClassVar[str] = """
of = "seat"
displacement = "base.csv"
"""

    of: Literal["reed", "seat", "stopper"] = Field(description="whose base")
    displacement: fields.ExistingFile | None = fields.absent(
        "CSV file, its header as in `time [ms],displacement [um]`; in between a cubic spline"
    )
    velocity: fields.ExistingFile | None = fields.absent(
        "or `time [ms],velocity [m/s]`, in between linear; the body moves along at the start"
    )
    acceleration: fields.ExistingFile | None = fields.absent(
        "or `time [ms],acceleration [m/s^2]`, in between linear, from rest at the start"
    )

    columns: CourseColumns = fields.default({}, "heads of its columns, where they say neither time nor quantity")
    units: CourseUnits = fields.default({}, "units of its columns, where the header does not say them")

    @model_validator(mode="after")
    def _one_of_three(self, info: ValidationInfo) -> Self:
        self.check_one_of(KINDS, "nothing says how it moves")
        if not (info.context or {}).get("unread"):
            with fields.problem_of(self._kind, time_series.TimeSeriesError):
                self.record()
        return self

    @property
    def _kind(self) -> loads.Kind:
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    def record(self) -> Record:
        """Return the time series in the file. Raises `TimeSeriesError`."""
        kind, columns, units = self._kind, self.columns.stated(), self.units.stated()
        return Record(kind, time_series.read_time_series(getattr(self, kind), kind, columns=columns, units=units))

    def motion(self) -> loads.BaseMotion:
        """Return the motion of the base by its file. Raises `TimeSeriesError`."""
        return loads.BaseMotion.from_series(self.record().course, self._kind)


KINDS: tuple[loads.Kind, ...] = get_args(loads.Kind)


ACTING = ("pressure", "force", "gravity", "base_motion")


def _tabulate_area(given: object) -> object:
    """Return area = "80 mm^2" and area = [["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]] as the two columns of a table."""
    if isinstance(given, Mapping | fields.Table):
        return given
    if not isinstance(given, list):
        return {"lift": ["0 mm"], "area": [given]}
    if not all(isinstance(row, list) and len(row) == 2 for row in given):
        raise ValueError('rows of lift and area are needed, as in [["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]]')
    return {"lift": [row[0] for row in given], "area": [row[1] for row in given]}


class AreaByLift(fields.Table):
    """The effective area of a pressure as a function of the reed's lift: linear between the values, constant beyond.
    Written as one area, or as a list of pairs of lift and area."""

    lift: tuple[fields.Position, ...] = Field(min_length=1, description="opening at the contact, increasing")
    area: tuple[fields.SignedArea, ...] = Field(min_length=1, description="area at each of them")

    def contradictions(self) -> fields.Contradictions:
        if len(self.lift) != len(self.area):
            yield "area", f"{len(self.area)} areas at {len(self.lift)} lifts: give one for each"
        if self.lift[0] < 0:
            yield "lift", f"a lift of {1e3 * self.lift[0]:g} mm: lifts are >= 0, counted from the seat"
        for before, after in itertools.pairwise(self.lift):
            if after <= before:
                yield "lift", f"the lifts must increase: {1e3 * after:g} mm follows {1e3 * before:g} mm"
        if (least := min(self.area)) <= 0:
            yield "area", f"an area of {1e6 * least:g} mm^2: areas must be positive; for none remove the load"

    def __call__(self, lift: float) -> float:
        """Return the area [m^2] at an opening [m]."""
        return float(np.interp(lift, self.lift, self.area))


class ExternalLoad(fields.Table):
    """One load on the reed: a pressure on an effective area at the contact (of a plate, spread over the disc that the
    contact covers or encloses, over several ports in proportion to their areas, of a ring plate over its whole face), a
    force, gravity, or the acceleration of the frame that holds the reed (only the reed has the inertia load, minus its
    mass times the acceleration)."""

    sample: ClassVar[str] = """
pressure = "-0.2 bar"
area = "80 mm^2"
"""

    pressure: AnyPressure | None = fields.absent(
        "over the reed, on area, at its contact, positive off the seat; a constant one may be text"
    )
    area: Annotated[AreaByLift, BeforeValidator(_tabulate_area)] | None = fields.absent(
        'effective area of the pressure: one, or by the lift as in `[["0 mm", "80 mm^2"], ["1 mm", "60 mm^2"]]`'
    )
    force: AnyForce | None = fields.absent("at one place, positive off the seat; a constant one may be written as text")
    at: fields.Length | None = fields.absent("of the force, from the root; where absent: at the contact")
    point: tuple[fields.Position, fields.Position] | None = fields.absent(
        "of the force on a plate, along and across it, from the centre of its contact"
    )
    gravity: fields.Acceleration | None = fields.absent(
        "component of the acceleration along the normal; negative presses the reed on the seat"
    )
    base_motion: AnyAcceleration | None = fields.absent(
        "acceleration of the frame along the normal; a constant one may be written as text"
    )

    def contradictions(self) -> fields.Contradictions:
        self.check_one_of(ACTING, "nothing acts")
        if self.area is None and self.pressure is not None:
            yield "area", "required key is missing: effective area"
        if self.area is not None and self.pressure is None:
            yield "area", "there is no pressure; remove the key"
        if self.force is None and (places := self.given_keys("at", "point")):
            yield places[0], "only a force has a place; remove the key"
        if self.at is not None and self.point is not None:
            yield "point", "at is given too; keep one"

    @property
    def by_lift(self) -> bool:
        """Return whether the load depends on the opening of the reed."""
        return self.area is not None and len(set(self.area.area)) > 1


MOST: Final = 64
"""Largest number of springs in one table."""
Preload = Annotated[float, BeforeValidator(fields.ReadQuantity("force")), Field(ge=0)]


class ValveSpring(fields.Table):
    """Springs between the reed and a fixed guard, which press the reed on its seat. Each is linear, without mass and
    damping, and acts at all times. They are part of the reed: of its modes, its energy and all its error bars. Their
    effect on the omitted modes is neglected, like that of loads."""

    sample: ClassVar[str] = """
stiffness = "2 N/mm"
preload = "5 N"
"""

    stiffness: fields.Stiffness = Field(description="of all springs of the table together")
    preload: Preload = fields.default(
        "0 N",
        "force of all of them together on the closed reed, which lies contact.gap below its undeformed "
        "place; towards the seat",
    )
    at: fields.Length | None = fields.absent(
        "where they press, from the root; where no place is given: at the contact, of a ring plate or a "
        "disc spread around its mean circle, of a ball through its centre"
    )
    points: tuple[tuple[fields.Position, fields.Position], ...] | None = fields.absent(
        "of a plate, a spring each: places along and across it, from the centre of its contact",
        min_length=1,
        max_length=MOST,
    )
    number: int | None = fields.absent(
        "of a plate: springs on a circle, the first on the x axis", strict=True, ge=1, le=MOST
    )
    radius: fields.Length | None = fields.absent("of that circle, about the centre of the plate's contact")

    def contradictions(self) -> fields.Contradictions:
        if (self.number is None) != (self.radius is None):
            missing = "number" if self.number is None else "radius"
            yield missing, "required key is missing: springs on a circle have number and radius"
        if len(keys := self.given_keys("at", "points", "number")) > 1:
            yield keys[1], f"{keys[0]} is given too; keep one"

    @property
    def places(self) -> Array | None:
        """Return the (S, 2) places of springs on a plate, relative to its contact's centre [m]; ``None`` by default."""
        if self.number is not None and self.radius is not None:
            turns = 2 * np.pi * np.arange(self.number) / self.number
            return self.radius * np.column_stack([np.cos(turns), np.sin(turns)])
        return None if self.points is None else np.array(self.points)

    def force_on_undeformed(self, gap: float) -> float:
        """Return the force on the undeformed reed towards the seat [N]; the closed reed lies ``gap`` [m] below."""
        return self.preload + self.stiffness * gap

    @property
    def words(self) -> str:
        """Return a short description with stiffness and preload."""
        many = self.number or (0 if self.points is None else len(self.points))
        size = f"{self.stiffness / 1e3:.4g} N/mm"
        preload = f", preload {self.preload:.4g} N" if self.preload else ""
        return (f"{many} valve springs, {size} together" if many > 1 else f"valve spring {size}") + preload

    def check(self, reed: Structure) -> None:
        """Raise a `KeyProblem` of this table for places that the reed does not have."""
        if self.at is not None:
            reed.check_place(self.at, "at")
        if (places := self.places) is not None:
            reed.check_place(places, "radius" if self.points is None else "points")


Strain = Annotated[float, BeforeValidator(fields.read_number), Ge(-0.1), Le(0.1)]


class Wave(fields.Table):
    """A strain wave that arrives at the struck end of an endless rod: from a file, or a trapezoid that rises and falls
    within `rise` and has the width `duration` at half its height. Strain is positive in tension. The record is taken at
    the distance `recorded_at` from the end; the wave arrives later by this distance over the speed of waves in the rod.
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
    """A strain gauge at a point along a rod, or on the face of a cantilever reed towards the seat; positive in tension.
    summary.json has its largest and smallest strain, gauges.csv its history at the middle of each step."""

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
    contact_at: float | tuple[float, ...] | None
