"""[[base]]: what holds a body moves by a known course."""

from __future__ import annotations

from typing import ClassVar, Literal, Self, get_args

from pydantic import Field, ValidationInfo, model_validator

from impact.bodies.base_motion import BaseMotion, Kind
from impact.bodies.time_series import TimeSeriesError, read_time_series
from seatfem.fields import ExistingFile, Table, absent, problem_of
from seatfem.structures.kinds.motion import CourseColumns, CourseUnits, Record, stated_in


class Base(Table):
    """The clamp of the reed, or what the seat or the stopper stands on, moves along the normal, away from the seat
    positive, by the course of a CSV file that covers the run. Gaps follow it, and the body feels its own inertia: in
    full a reed, and a seat or stopper that is a beam or a plate; of others only the rigid motion is known, and courses
    are refused that would bend them by more than 1 % of their way. Displacements and velocities in results are those in
    space; energies are seen from the base.
    """

    sample: ClassVar[str] = """
of = "seat"
displacement = "base.csv"
"""

    of: Literal["reed", "seat", "stopper"] = Field(description="whose base")
    displacement: ExistingFile | None = absent(
        "CSV file, its header as in `time [ms],displacement [um]`; in between a cubic spline"
    )
    velocity: ExistingFile | None = absent(
        "or `time [ms],velocity [m/s]`, in between linear; the body moves along at the start"
    )
    acceleration: ExistingFile | None = absent(
        "or `time [ms],acceleration [m/s^2]`, in between linear, from rest at the start"
    )

    columns: CourseColumns | None = absent("heads of its columns, where they say neither time nor quantity")
    units: CourseUnits | None = absent("units of its columns, where the header does not say them")

    @model_validator(mode="after")
    def _one_of_three(self, info: ValidationInfo) -> Self:
        self.check_one_of(KINDS, "nothing says how it moves")
        if not (info.context or {}).get("unread"):
            with problem_of(self._kind, TimeSeriesError):
                self.record()
        return self

    @property
    def _kind(self) -> Kind:
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    def record(self) -> Record:
        """Return the course of its file. Raises `TimeSeriesError`."""
        kind, columns, units = self._kind, stated_in(self.columns), stated_in(self.units)
        return Record(kind, read_time_series(getattr(self, kind), kind, columns=columns, units=units))

    def motion(self) -> BaseMotion:
        """Return the base's motion as its file has it. Raises `TimeSeriesError`."""
        return BaseMotion.from_series(self.record().course, self._kind)


KINDS: tuple[Kind, ...] = get_args(Kind)
