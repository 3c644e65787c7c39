"""[gas] of a scene: gas flow through the valve that the reed is, and the cylinder behind it, with their checks."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from impact.bodies.time_series import TimeSeries, TimeSeriesError, read_time_series
from impact.files.csv_table import read_csv
from impact.gas import (
    GASES,
    NOT_MEASURED,
    AreaTable,
    GasError,
    PerfectGas,
    Plenum,
    ReedValve,
    SliderCrank,
    of_molar_mass,
    port_flow,
    port_force,
)
from seatfem.fields import (
    Angle,
    Area,
    Contradictions,
    ExistingFile,
    Gap,
    KeyProblem,
    Length,
    MolarMass,
    Pressure,
    Rpm,
    SignedArea,
    Source,
    Table,
    Temperature,
    Volume,
    absent,
    default,
    problem_of,
)
from seatfem.structures.kinds.motion import CourseColumns, CourseUnits, Record, stated_in
from seatfem.units import write_quantity

WIDEST: Final = 30.0  # largest crank angle between two samples of a record [degrees]
OF_THE_CRANK: Final = ("bore", "stroke", "rod", "clearance")
BESIDE: Final = ("start_pressure", "other_valve_area")
"""Further keys that are used only if the cylinder's pressure is computed."""


class Fluid(Table):
    """A perfect gas of constant specific heats: one of those known by name, or its numbers."""

    name: Literal[tuple(GASES)] | None = absent("one that is known, in the ideal-gas limit")  # type: ignore[valid-type]
    k: float | None = absent("ratio of the specific heats", gt=1, le=2)
    molar_mass: MolarMass | None = absent("of the gas")
    source: str = default("", "citation of the numbers")

    def contradictions(self) -> Contradictions:
        if self.name is None and (self.k is None or self.molar_mass is None):
            yield "k", "a gas needs a name, or k and molar_mass"
        if self.name is not None and (self.k is not None or self.molar_mass is not None):
            yield "name", "k or molar_mass is given too: keep the name, or both numbers"

    @property
    def gas(self) -> PerfectGas:
        """Return the gas in SI."""
        if self.name is not None:
            return GASES[self.name]
        assert self.k is not None
        assert self.molar_mass is not None
        return of_molar_mass(self.k, self.molar_mass, self.source)


def _named(given: object) -> object:
    """Return fluid = "air" as fluid = { name = "air" }."""
    if isinstance(given, str) and given not in GASES:
        raise ValueError(f"{given!r} is no gas known here; take {', '.join(GASES)}, or give k and molar_mass")
    return {"name": given} if isinstance(given, str) else given


class GasPlenum(Table):
    """Gas at rest, at a constant pressure and temperature."""

    pressure: Pressure = Field(description="absolute")
    temperature: Temperature = Field(description="as in `20 degC` or `293 K`")


class MeasuredArea(Table):
    """An effective area as a function of the lift, linear between its points and constant beyond, with its source."""

    area: tuple[tuple[Gap, SignedArea], ...] = Field(
        min_length=1, description="[lift, area], the lifts increasing from 0 mm"
    )
    source: Source = Field(description="citation of the numbers: report, data sheet, computation")

    @property
    def table(self) -> AreaTable:
        """Return the table of areas in SI."""
        lift, area = np.array(self.area).T
        return AreaTable(lift, area, self.source)

    def contradictions(self) -> Contradictions:
        try:
            _ = self.table
        except GasError as problem:
            yield "area", str(problem)


class Directions(Table):
    """Effective areas, which differ with the direction of the flow."""

    forward: MeasuredArea | None = absent("through the port, which lifts the reed")
    back: MeasuredArea | None = absent("as the valve leaks back; where absent, those of forward")

    def tables(self, estimate: AreaTable) -> tuple[AreaTable, AreaTable]:
        """Return the tables of areas forward and back, by default the ``estimate``."""
        forward = estimate if self.forward is None else self.forward.table
        if self.back is not None:
            return forward, self.back.table
        source = forward.source if forward is estimate else f"{NOT_MEASURED}taken from forward, {forward.source}"
        return forward, AreaTable(forward.lift, forward.area, source)


class CompressorGas(Table):
    """The reed as a valve of a compressor: the flow depends on its opening, and the gas loads the reed. The cylinder is
    adiabatic; its pressure is computed, or prescribed by a record. The other valve is ideal: a nozzle that opens at its
    plenum's pressure (docs/gas.md). Off if the table is absent."""

    sample: ClassVar[str] = """
valve = "suction"
suction = { pressure = "1 bar", temperature = "20 degC" }
discharge = { pressure = "5 bar", temperature = "180 degC" }
rpm = 3000
bore = "50 mm"
stroke = "40 mm"
rod = "80 mm"
clearance = "4 cm^3"
port_diameter = "12 mm"
"""

    fluid: Annotated[Fluid, BeforeValidator(_named)] = default("air", "working gas; a name may be written as text")
    valve: Literal["suction", "discharge"] = Field(description="which valve the reed is")
    suction: GasPlenum = Field(description="plenum that the cylinder draws from")
    discharge: GasPlenum = Field(description="plenum that it delivers to")
    rpm: Rpm = Field(le=1e6, description="speed of the crank: a number (1/min), or with its unit")
    angle: Angle = default("0 deg", "crank angle at the start of the run, from the top dead centre")
    cycles: float | None = absent("turns of the crank; instead of run.duration", gt=0, le=1e4)
    bore: Length | None = absent("diameter of the cylinder")
    stroke: Length | None = absent("of the piston")
    rod: Length | None = absent("length of the connecting rod")
    clearance: Volume | None = absent("volume at the top dead centre")
    start_pressure: Pressure | None = absent(
        "in the cylinder at the start, as if brought there isentropically from the suction plenum, whose "
        "pressure it is where absent"
    )
    other_valve_area: Area | None = absent(
        "effective flow area of the ideal valve that is not the reed; no such valve where absent"
    )
    cylinder_pressure: ExistingFile | None = absent(
        "instead of bore, stroke, rod, clearance: CSV file with `angle [deg],pressure [bar]` over a turn, "
        "or `time [ms],pressure [bar]` over the run"
    )
    columns: CourseColumns | None = absent(
        "heads of the columns of cylinder_pressure, where they say neither time nor quantity"
    )
    units: CourseUnits | None = absent("units of the columns of cylinder_pressure, where the header does not say them")
    port_diameter: Length = Field(description="of the hole that the reed covers")
    discharge_coefficient: float = default(
        0.6, "of the estimated flow area, min(2 pi R x, pi R^2): not measured", gt=0, le=1
    )
    flow: Directions = default({}, "effective flow areas; estimated where absent")
    force: Directions = default({}, "effective force areas; that of the port where absent")

    def contradictions(self) -> Contradictions:
        keys = self.given_keys(*OF_THE_CRANK)
        if self.cylinder_pressure is not None:
            if unused := [*keys, *self.given_keys(*BESIDE)]:
                yield unused[0], "cylinder_pressure prescribes the pressure; keep one of the two"
            _ = self.course
        elif self.columns is not None or self.units is not None:
            yield self.given_keys("columns", "units")[0], "there is no cylinder_pressure; remove the key"
        elif len(keys) < len(OF_THE_CRANK):
            missing = next(key for key in OF_THE_CRANK if key not in keys)
            words = type(self).model_fields[missing].description
            yield missing, f"required key is missing: {words}; or give cylinder_pressure"
        else:
            with problem_of("rod", GasError):
                _ = self.crank
        if self.suction.pressure >= self.discharge.pressure:
            high, low = (write_quantity(each.pressure, "pressure") for each in (self.discharge, self.suction))
            words = f"{high} is not above suction.pressure = {low}: nothing is compressed"
            yield "discharge.pressure", f"{words}; exchange them, or raise it"
        with problem_of("force", GasError):
            _ = self.areas

    @property
    def crank(self) -> SliderCrank | None:
        """Return the crank; ``None`` if the pressure is prescribed."""
        if self.bore is None or self.stroke is None or self.rod is None or self.clearance is None:
            return None
        return SliderCrank(self.bore, self.stroke, self.rod, self.clearance, self.rpm, self.angle)

    @property
    def areas(self) -> ReedValve:
        """Return the effective areas in SI."""
        radius = self.port_diameter / 2
        flow = self.flow.tables(port_flow(radius, self.discharge_coefficient))
        return ReedValve(*flow, *self.force.tables(port_force(radius)))

    @property
    def plenums(self) -> tuple[Plenum, Plenum]:
        """Return the plenums of suction and discharge."""
        s, d = self.suction, self.discharge
        return Plenum(s.pressure, s.temperature), Plenum(d.pressure, d.temperature)

    def record(self) -> Record | None:
        """Return the prescribed pressure, ``None`` if it is computed. Raises like `course`."""
        return None if self.cylinder_pressure is None else Record("pressure", self.course)

    @property
    def course(self) -> TimeSeries:
        """Return the prescribed pressure. Raises `KeyProblem` for a record that cannot be read, or has gaps."""
        path = self.cylinder_pressure
        assert path is not None
        columns, units = stated_in(self.columns), stated_in(self.units)
        with problem_of("cylinder_pressure", TimeSeriesError):
            named = read_csv(path, TimeSeriesError).column_of("time", ("time",), {}) is not None
            by_time = "time" in columns or (named and "angle" not in columns)
            rpm, start = None if by_time else self.rpm, math.degrees(self.angle)
            series = read_time_series(
                path, "pressure", outside="hold", columns=columns, units=units, rpm=rpm, start=start, most_gap=WIDEST
            )
        if (least := float(series.value.min())) <= 0:
            words = f"{write_quantity(least, 'pressure')}: pressures are absolute, they must be above 0 Pa"
            raise KeyProblem("cylinder_pressure", f"{path}: {words}")
        return series

    @property
    def turn(self) -> float:
        """Return the duration of one turn of the crank [s]."""
        return 60 / self.rpm
