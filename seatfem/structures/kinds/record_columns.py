"""What the header of a CSV file does not say: heads and units of its columns, by their role."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

from pydantic import Field

from seatfem.fields import Table

if TYPE_CHECKING:
    from impact.bodies.time_series import Quantity, TimeSeries


class Record(NamedTuple):
    """A course as it was read from a file [SI], and of which quantity."""

    quantity: Quantity
    course: TimeSeries


@runtime_checkable
class Recorded(Protocol):
    """A table of a scene that may name a file with a course."""

    def record(self) -> Record | None:
        """Return the course; ``None`` where no file is named. Raises `TimeSeriesError` or `KeyProblem`."""


class Roles(Table):
    """Text by role."""

    def stated(self) -> dict[str, str]:
        """Return what is stated."""
        return {role: text for role in type(self).model_fields if (text := getattr(self, role)) is not None}


def stated_in(roles: Roles | None) -> dict[str, str]:
    """Return what a key of a scene states; nothing where it is absent."""
    return {} if roles is None else roles.stated()


class ResponseColumns(Roles):
    """Heads of the columns of a frequency response, where the header does not say which is which."""

    sample = 'frequency = "Frequency (Hz)"\nreal = "Real"\nimag = "Imag"'

    frequency: str | None = Field(None, description="head of the column of frequencies")
    real: str | None = Field(None, description="of real parts")
    imag: str | None = Field(None, description="of imaginary parts")
    magnitude: str | None = Field(None, description="of magnitudes, also in decibels")
    phase: str | None = Field(None, description="of phases")
    coherence: str | None = Field(None, description="of coherence, with averages")
    variance: str | None = Field(
        None, description="of the noise: squared error of the complex value, in the square of its unit"
    )


class ResponseUnits(Roles):
    """Units of the columns of a frequency response, where the header does not say them."""

    sample = 'frequency = "Hz"\nresponse = "g/N"'

    frequency: str | None = Field(None, description="Hz, kHz or MHz")
    response: str | None = Field(None, description='as "m/s^2/N", "g/N", "um/N" or "dB re 1 m/N"')
    phase: str | None = Field(None, description="deg or rad")


class CourseColumns(Roles):
    """Heads of the columns of a course, where the header does not say which is which."""

    sample = 'time = "Zeit"\npressure = "p_zyl"'

    time: str | None = Field(None, description="head of the column of times")
    angle: str | None = Field(None, description="of crank angles, with rpm")
    pressure: str | None = Field(None, description="of a pressure")
    force: str | None = Field(None, description="of a force")
    acceleration: str | None = Field(None, description="of an acceleration")
    velocity: str | None = Field(None, description="of a velocity")
    displacement: str | None = Field(None, description="of a displacement")


class CourseUnits(CourseColumns):
    """Units of the columns of a course, where the header does not say them."""

    sample = 'time = "ms"\npressure = "bar"'

    time: str | None = Field(None, description="s, ms or us")
    angle: str | None = Field(None, description="deg")
    pressure: str | None = Field(None, description="Pa, kPa, MPa, mbar, bar or psi")
    force: str | None = Field(None, description="N, mN or kN")
    acceleration: str | None = Field(None, description="m/s^2 or mm/s^2")
    velocity: str | None = Field(None, description="m/s or mm/s")
    displacement: str | None = Field(None, description="m, mm or um")
