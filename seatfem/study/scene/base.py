"""[[base]]: what holds a body moves by a known course."""

from __future__ import annotations

from typing import ClassVar, Literal, Self, get_args

from pydantic import Field, ValidationInfo, model_validator

from impact.bodies.base_motion import BaseMotion, Kind
from impact.bodies.time_series import TimeSeriesError, read_time_series
from seatfem.fields import ExistingFile, KeyProblem, Table
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
    displacement: ExistingFile | None = Field(
        None, description="CSV file, its header as in `time [ms],displacement [um]`; in between a cubic spline"
    )
    velocity: ExistingFile | None = Field(
        None, description="or `time [ms],velocity [m/s]`, in between linear; the body moves along at the start"
    )
    acceleration: ExistingFile | None = Field(
        None, description="or `time [ms],acceleration [m/s^2]`, in between linear, from rest at the start"
    )

    columns: CourseColumns | None = Field(
        None, description="heads of its columns, where they say neither time nor quantity"
    )
    units: CourseUnits | None = Field(None, description="units of its columns, where the header does not say them")

    @model_validator(mode="after")
    def _one_of_three(self, info: ValidationInfo) -> Self:
        if len(keys := self._given) != 1:
            words = f"{' and '.join(keys)} are given" if keys else "nothing says how it moves"
            raise KeyProblem(keys[1] if keys else "displacement", f"{words}: give exactly one of {', '.join(KINDS)}")
        if (info.context or {}).get("unread"):
            return self
        try:
            self.record()
        except TimeSeriesError as error:
            raise KeyProblem(keys[0], str(error)) from None
        return self

    @property
    def _given(self) -> list[Kind]:
        return [kind for kind in KINDS if getattr(self, kind) is not None]

    def record(self) -> Record:
        """Return the course of its file. Raises `TimeSeriesError`."""
        (kind,) = self._given
        columns, units = stated_in(self.columns), stated_in(self.units)
        return Record(kind, read_time_series(getattr(self, kind), kind, columns=columns, units=units))

    def motion(self) -> BaseMotion:
        """Return the base's motion as its file has it. Raises `TimeSeriesError`."""
        (kind,) = self._given
        return BaseMotion.of(self.record().course, kind)


KINDS: tuple[Kind, ...] = get_args(Kind)
