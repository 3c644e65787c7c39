"""Tables of scenes with initial conditions and loads of a striker: velocities, deflections, forces over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, ClassVar, Literal, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from impact.bodies import time_series
from impact.bodies.body import Body, Load, ModalState
from impact.bodies.time_series import read_time_series
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from seatfem import fields
from seatfem.structures.kinds import structure
from seatfem.units import write_quantity


class Record(NamedTuple):
    """A time series read from a file [SI], and its quantity."""

    quantity: time_series.Quantity
    course: time_series.TimeSeries


@runtime_checkable
class Recorded(Protocol):
    """A table of a scene that may name a file with a time series."""

    def record(self) -> Record | None:
        """Return the time series; ``None`` if no file is named. Raises `TimeSeriesError` or `KeyProblem`."""


class Roles(fields.Table):
    """Base of tables with a text, such as a header, for each role of a column."""

    def stated(self) -> dict[str, str]:
        """Return the text of each key that is not empty."""
        return {role: text for role in type(self).model_fields if (text := getattr(self, role))}


class ResponseColumns(Roles):
    """Heads of the columns of a frequency response, where the header does not say which is which."""

    sample = 'frequency = "Frequency (Hz)"\nreal = "Real"\nimag = "Imag"'

    frequency: str = Field("", description="head of the column of frequencies")
    real: str = Field("", description="of real parts")
    imag: str = Field("", description="of imaginary parts")
    magnitude: str = Field("", description="of magnitudes, also in decibels")
    phase: str = Field("", description="of phases")
    response: str = Field("", description="of complex numbers, as 1.2e-3+4.5e-4i or (1.2e-3, 4.5e-4)")
    coherence: str = Field("", description="of coherence, with averages")
    variance: str = Field("", description="of the noise: squared error of the complex value, in the square of its unit")


class ResponseUnits(Roles):
    """Units of the columns of a frequency response, where the header does not say them."""

    sample = 'frequency = "Hz"\nresponse = "g/N"'

    frequency: str = Field("", description="Hz, kHz or MHz")
    response: str = Field("", description='as "m/s^2/N", "g/N", "um/N" or "dB re 1 m/N"')
    phase: str = Field("", description="deg or rad")


class CourseColumns(Roles):
    """Heads of the columns of a course, where the header does not say which is which."""

    sample = 'time = "Zeit"\npressure = "p_zyl"'

    time: str = Field("", description="head of the column of times")
    angle: str = Field("", description="of crank angles, with rpm")
    pressure: str = Field("", description="of a pressure")
    force: str = Field("", description="of a force")
    acceleration: str = Field("", description="of an acceleration")
    velocity: str = Field("", description="of a velocity")
    displacement: str = Field("", description="of a displacement")


class CourseUnits(CourseColumns):
    """Units of the columns of a course, where the header does not say them."""

    sample = 'time = "ms"\npressure = "bar"'

    time: str = Field("", description="s, ms or us")
    angle: str = Field("", description="deg")
    pressure: str = Field("", description="Pa, kPa, MPa, mbar, bar or psi")
    force: str = Field("", description="N, mN or kN")
    acceleration: str = Field("", description="m/s^2 or mm/s^2")
    velocity: str = Field("", description="m/s or mm/s")
    displacement: str = Field("", description="m, mm or um")


def as_value(given: object) -> object:
    """Read pressure = "0.2 bar" as pressure = { value = "0.2 bar" }."""
    return given if isinstance(given, Mapping | fields.Table) else {"value": given}


class _Course(fields.Table):
    """Constant, or in time from a CSV file."""

    quantity: ClassVar[Literal["pressure", "force", "acceleration"]]

    file: fields.ExistingFile | None = Field(
        None,
        description="CSV file, its header as in `time [ms],pressure [bar]`, beyond its ends their values; with rpm as "
        "in `angle [deg],pressure [bar]`, repeated every 360 deg, of which no more than 90 deg may be left out",
    )
    columns: CourseColumns = fields.default({}, "heads of its columns, where they say neither time nor quantity")
    units: CourseUnits = fields.default({}, "units of its columns, where the header does not say them")
    rpm: fields.Rpm | None = Field(None, description="speed of the crank (1/min) for a file in crank angle")
    angle: fields.Angle | None = Field(
        None, description="crank angle at the start of the run, with rpm; 0 where absent"
    )

    value: float | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.value is None) == (self.file is None):
            raise fields.KeyProblem("value", "give exactly one of value and file")
        if self.rpm is not None and self.file is None:
            raise fields.KeyProblem("rpm", "there is no file in crank angle; remove the key")
        if self.file is None and (stated := self.model_fields_set & {"columns", "units"}):
            raise fields.KeyProblem(min(stated), "there is no file; remove the key")
        if self.angle is not None and self.rpm is None:
            raise fields.KeyProblem("angle", "there is no rpm; remove the key, or give rpm")
        if self.file is not None:
            try:
                self.course  # noqa: B018
            except (ValueError, OSError) as error:
                raise fields.KeyProblem("file", str(error)) from None
        return self

    @property
    def course(self) -> Callable[[Array], Array]:
        """Return the quantity [SI] as a function of times (n,) [s]."""
        if (record := self.record()) is not None:
            return record.course
        return constant(self.value or 0.0)

    def record(self) -> Record | None:
        """Return the time series in the file; ``None`` for a constant. Raises `TimeSeriesError`."""
        if self.file is None:
            return None

        start = math.degrees(self.angle or 0.0)
        columns, units = self.columns.stated(), self.units.stated()
        series = read_time_series(
            self.file, self.quantity, outside="hold", columns=columns, units=units, rpm=self.rpm, start=start
        )
        return Record(self.quantity, series)


class PressureCourse(_Course):
    """A pressure, constant or in time; positive away from the seat."""

    sample: ClassVar[str] = 'value = "-0.2 bar"'

    quantity: ClassVar[Literal["pressure", "force", "acceleration"]] = "pressure"

    value: fields.SignedPressure | None = Field(None, description="where it is constant; negative towards the seat")


class ForceCourse(_Course):
    """A force, constant or in time; positive away from the seat."""

    sample: ClassVar[str] = 'value = "-1 N"'

    quantity: ClassVar[Literal["pressure", "force", "acceleration"]] = "force"

    value: fields.Force | None = Field(None, description="where it is constant; negative towards the seat")


class AccelerationCourse(_Course):
    """An acceleration, constant or in time; positive away from the seat."""

    sample: ClassVar[str] = 'value = "-9.81 m/s^2"'

    quantity: ClassVar[Literal["pressure", "force", "acceleration"]] = "acceleration"

    value: fields.Acceleration | None = Field(None, description="where it is constant; negative towards the seat")


class PointForce(ForceCourse):
    """A force at one place of a reed, constant or in time; positive away from the seat."""

    at: fields.Length | None = Field(
        None,
        description="distance from the root, of a plate along its axis; absent: the tip or, of a leaf that is held at "
        "both ends, the middle; of a plate the paddle's centre",
    )


AnyPressure = Annotated[PressureCourse, BeforeValidator(as_value)]
AnyForce = Annotated[ForceCourse, BeforeValidator(as_value)]
AnyAcceleration = Annotated[AccelerationCourse, BeforeValidator(as_value)]
AnyPointForce = Annotated[PointForce, BeforeValidator(as_value)]


class Moving(structure.Structure):
    """Base of all bodies that may strike and whose motion is known at their contact only."""

    traits: ClassVar[structure.Traits] = structure.Traits(is_solved=True, moved_by=("velocity", "deflection", "force"))

    velocity: fields.Approach | None = Field(
        None, description='of a free reed or mass at the start; negative towards the seat, as in "-2 m/s"'
    )
    deflection: fields.Position | None = Field(
        None, description="of a held reed: released from a static deflection of its contact"
    )
    force: AnyForce | None = Field(None, description="of a reed: force at its contact; a constant one may be text")

    def start_at(self, at: float) -> float:
        return self.deflection or 0.0

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        known = self.closed_form() if greens is None else greens
        if self.velocity is not None and math.isinf(known.mass()):
            raise GreensFunctionError(
                f"reed.velocity = {write_quantity(self.velocity, 'velocity')}: a body of kind {self.kind!r} that is "
                f"held cannot translate; "
                "release it from a deflection, or drive it by a force"
            )
        state: ModalState | None = None
        loads: tuple[Load, ...] = ()
        if self.deflection is not None:
            state = _deflected(known, self.deflection, self.kind)
        if self.force is not None:
            loads = (Load(_shape(known, self.kind, "force"), self.force.course),)
        return Body(known, self.velocity or 0.0, state, loads)


def _shape(greens: GreensFunction, kind: str, key: str) -> Array:
    """Return the (M,) mode shapes at the first port. Raises `GreensFunctionError` for a body without modes."""
    if (modal := greens.modal) is None or len(modal.omega) == 0:
        remedy = (
            "give it modal damping alone, and a reduction that keeps modes (greens.method = 'auto')"
            if math.isinf(greens.mass())
            else "use velocity"
        )
        raise GreensFunctionError(f"reed.{key}: a body of kind {kind!r} has no modes to be set in motion; {remedy}")
    return np.asarray(modal.shapes[:, 0])


def _deflected(greens: GreensFunction, deflection: float, kind: str) -> ModalState:
    """Return the state at rest in the static shape under a force at the contact, q_k = F phi_k/omega_k^2."""
    shape, modal = _shape(greens, kind, "deflection"), greens.modal
    assert modal is not None
    if not modal.omega.all():
        raise GreensFunctionError(f"reed.deflection: a body of kind {kind!r} is free to move; give it a velocity")
    each = shape / modal.omega**2
    return ModalState(deflection / float(shape @ each) * each, np.zeros(len(shape)))


def constant(value: float) -> Callable[[Array], Array]:
    """Return a constant function of time."""
    return lambda t: np.full(np.shape(t), value)


def scaled(course: Callable[[Array], Array], factor: float) -> Callable[[Array], Array]:
    """Return a function of time times a factor, as an area turns a pressure into a force."""
    return lambda t: factor * np.asarray(course(t))
