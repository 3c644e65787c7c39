"""[gas] of a scene: flow through the valve that the reed is, the cylinder behind it, loads on the reed, results."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from impact.bodies import body as bodies
from impact.bodies.time_series import TimeSeries, TimeSeriesError, read_time_series
from impact.files.csv_table import read_csv, write_csv
from impact.gas import (
    BACK,
    FORWARD,
    GASES,
    NOT_MEASURED,
    OTHER,
    PRESSURE,
    AreaTable,
    Compressor,
    GasError,
    GasHistory,
    PerfectGas,
    Plenum,
    Prescribed,
    ReedValve,
    SliderCrank,
    angles,
    drop,
    gas_history,
    of_molar_mass,
    port_flow,
    port_force,
)
from impact.greens.base import Array
from impact.march import grid
from impact.pictures import gas_plot
from impact.quantities import brief
from seatfem import fields
from seatfem.results import Result
from seatfem.structures import outlines
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.motion import CourseColumns, CourseUnits, Record
from seatfem.study.scene.models import Scene
from seatfem.study.scene.wings import NO_STOPS, Drive, DriveRun, PortLift, cycle_name
from seatfem.units import UnitError, write_quantity

FILE, PICTURE = "gas.csv", "gas.png"
OPEN: Final = 0.01  # lift, over its largest, above which the valve counts as open
PER_DEGREE: Final = 2  # updates of the gas per degree of the crank
WIDEST: Final = 30.0  # largest crank angle between two samples of a record [degrees]
OF_THE_CRANK: Final = ("bore", "stroke", "rod", "clearance")
BESIDE: Final = ("start_pressure", "other_valve_area")
"""Further keys that are used only if the cylinder's pressure is computed."""


class Fluid(fields.Table):
    """A perfect gas of constant specific heats: one of those known by name, or its numbers."""

    name: Literal[tuple(GASES)] | None = fields.absent("one that is known, in the ideal-gas limit")  # type: ignore[valid-type]
    k: float | None = fields.absent("ratio of the specific heats", gt=1, le=2)
    molar_mass: fields.MolarMass | None = fields.absent("of the gas")
    source: str = fields.default("", "citation of the numbers")

    def contradictions(self) -> fields.Contradictions:
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


class GasPlenum(fields.Table):
    """Gas at rest, at a constant pressure and temperature."""

    pressure: fields.Pressure = Field(description="absolute")
    temperature: fields.Temperature = Field(description="as in `20 degC` or `293 K`")


class MeasuredArea(fields.Table):
    """An effective area as a function of the lift, linear between its points and constant beyond, with its source."""

    area: tuple[tuple[fields.Gap, fields.SignedArea], ...] = Field(
        min_length=1, description="[lift, area], the lifts increasing from 0 mm"
    )
    source: fields.Source = Field(description="citation of the numbers: report, data sheet, computation")

    @property
    def table(self) -> AreaTable:
        """Return the table of areas in SI."""
        lift, area = np.array(self.area).T
        return AreaTable(lift, area, self.source)

    def contradictions(self) -> fields.Contradictions:
        try:
            _ = self.table
        except GasError as problem:
            yield "area", str(problem)


class Directions(fields.Table):
    """Effective areas, which differ with the direction of the flow."""

    forward: MeasuredArea | None = fields.absent("through the port, which lifts the reed")
    back: MeasuredArea | None = fields.absent("as the valve leaks back; where absent, those of forward")

    def tables(self, estimate: AreaTable) -> tuple[AreaTable, AreaTable]:
        """Return the tables of areas forward and back, by default the ``estimate``."""
        forward = estimate if self.forward is None else self.forward.table
        if self.back is not None:
            return forward, self.back.table
        source = forward.source if forward is estimate else f"{NOT_MEASURED}taken from forward, {forward.source}"
        return forward, AreaTable(forward.lift, forward.area, source)


class CompressorGas(Drive):
    """The reed as a valve of a compressor: the flow depends on its opening, and the gas loads the reed. The cylinder is
    adiabatic; its pressure is computed, or prescribed by a record. The other valve is ideal: a nozzle that opens at its
    plenum's pressure (docs/gas.md). Off if the table is absent."""

    table, description = "gas", "the gas that the reed, as a valve, lets through"
    rows = (
        Result("gas_largest_lift_m", "largest lift", "cycle"),
        Result("gas_opening_deg", "opens", "cycle"),
        Result("gas_closing_deg", "closes", "cycle"),
        Result("gas_seating_velocity_m_per_s", "seating velocity", "cycle"),
        Result("gas_seat_impacts", "seat impacts", "cycle"),
        Result("gas_stopper_impacts", "stopper impacts", "cycle"),
        Result("gas_mass_forward_kg", "mass forward", "cycle"),
        Result("gas_mass_back_kg", "mass back", "cycle"),
    )
    land_rows: ClassVar[Mapping[str, str]] = {
        "largest_lift_m": "largest\nlift",
        "closing_deg": "closes\nlast at",
        "mass_forward_kg": "mass\nforward",
        "mass_back_kg": "mass\nback",
    }
    captions: ClassVar[Mapping[str, str]] = {PICTURE: "Pressures, lift and flow over the cycle."}

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

    fluid: Annotated[Fluid, BeforeValidator(_named)] = fields.default(
        "air", "working gas; a name may be written as text"
    )
    valve: Literal["suction", "discharge"] = Field(description="which valve the reed is")
    suction: GasPlenum = Field(description="plenum that the cylinder draws from")
    discharge: GasPlenum = Field(description="plenum that it delivers to")
    rpm: fields.Rpm = Field(le=1e6, description="speed of the crank: a number (1/min), or with its unit")
    angle: fields.Angle = fields.default("0 deg", "crank angle at the start of the run, from the top dead centre")
    cycles: float | None = fields.absent("turns of the crank; instead of run.duration", gt=0, le=1e4)
    bore: fields.Length | None = fields.absent("diameter of the cylinder")
    stroke: fields.Length | None = fields.absent("of the piston")
    rod: fields.Length | None = fields.absent("length of the connecting rod")
    clearance: fields.Volume | None = fields.absent("volume at the top dead centre")
    start_pressure: fields.Pressure | None = fields.absent(
        "in the cylinder at the start, as if brought there isentropically from the suction plenum, whose "
        "pressure it is where absent"
    )
    other_valve_area: fields.Area | None = fields.absent(
        "effective flow area of the ideal valve that is not the reed; no such valve where absent"
    )
    cylinder_pressure: fields.ExistingFile | None = fields.absent(
        "instead of bore, stroke, rod, clearance: CSV file with `angle [deg],pressure [bar]` over a turn, "
        "or `time [ms],pressure [bar]` over the run"
    )
    columns: CourseColumns = fields.default(
        {}, "heads of the columns of cylinder_pressure, where they say neither time nor quantity"
    )
    units: CourseUnits = fields.default(
        {}, "units of the columns of cylinder_pressure, where the header does not say them"
    )
    port_diameter: fields.Length = Field(description="of the hole that the reed covers, or of each of several")
    ports: int | None = fields.absent(
        "number of equal ports, whose areas add up; absent: as many as the lands that a plate meets seal", ge=1, le=200
    )
    discharge_coefficient: float = fields.default(
        0.6, "of the estimated flow area, min(2 pi R x, pi R^2): not measured", gt=0, le=1
    )
    flow: Directions = fields.default({}, "effective flow areas; estimated where absent")
    force: Directions = fields.default({}, "effective force areas; that of the port where absent")

    def contradictions(self) -> fields.Contradictions:
        keys = self.given_keys(*OF_THE_CRANK)
        if self.cylinder_pressure is not None:
            if unused := [*keys, *self.given_keys(*BESIDE)]:
                yield unused[0], "cylinder_pressure prescribes the pressure; keep one of the two"
            _ = self.course
        elif stated := self.model_fields_set & {"columns", "units"}:
            yield min(stated), "there is no cylinder_pressure; remove the key"
        elif len(keys) < len(OF_THE_CRANK):
            missing = next(key for key in OF_THE_CRANK if key not in keys)
            words = type(self).model_fields[missing].description
            yield missing, f"required key is missing: {words}; or give cylinder_pressure"
        else:
            with fields.problem_of("rod", GasError):
                _ = self.crank
        if self.suction.pressure >= self.discharge.pressure:
            high, low = (write_quantity(each.pressure, "pressure") for each in (self.discharge, self.suction))
            words = f"{high} is not above suction.pressure = {low}: nothing is compressed"
            yield "discharge.pressure", f"{words}; exchange them, or raise it"
        with fields.problem_of("force", GasError):
            self.areas_of(1)

    @property
    def crank(self) -> SliderCrank | None:
        """Return the crank; ``None`` if the pressure is prescribed."""
        if self.bore is None or self.stroke is None or self.rod is None or self.clearance is None:
            return None
        return SliderCrank(self.bore, self.stroke, self.rod, self.clearance, self.rpm, self.angle)

    def areas_of(self, count: int) -> ReedValve:
        """Return the effective areas of all ports in SI, of ``count`` ports where the table does not state how many."""
        radius, ports = self.port_diameter / 2, self.ports or count

        def multiply_by_ports(estimate: AreaTable) -> AreaTable:
            if ports == 1:
                return estimate
            return AreaTable(estimate.lift, ports * estimate.area, f"{estimate.source}, of each of {ports} ports")

        flow = self.flow.tables(multiply_by_ports(port_flow(radius, self.discharge_coefficient)))
        return ReedValve(*flow, *self.force.tables(multiply_by_ports(port_force(radius))))

    def check_ports(self, count: int) -> fields.Contradictions:
        if self.ports not in (None, 1, count):
            has = "one port" if count == 1 else f"{count} ports"
            yield "ports", f"{self.ports}: the reed meets lands of {has}; use {count}, or remove the key"

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
        columns, units = self.columns.stated(), self.units.stated()
        with fields.problem_of("cylinder_pressure", TimeSeriesError):
            named = read_csv(path, TimeSeriesError).column_of("time", ("time",), {}) is not None
            by_time = "time" in columns or (named and "angle" not in columns)
            rpm, start = None if by_time else self.rpm, math.degrees(self.angle)
            series = read_time_series(
                path, "pressure", outside="hold", columns=columns, units=units, rpm=rpm, start=start, most_gap=WIDEST
            )
        if (least := float(series.value.min())) <= 0:
            words = f"{write_quantity(least, 'pressure')}: pressures are absolute, they must be above 0 Pa"
            raise fields.KeyProblem("cylinder_pressure", f"{path}: {words}")
        return series

    @property
    def turn(self) -> float:
        """Return the duration of one turn of the crank [s]."""
        return 60 / self.rpm

    @classmethod
    def complete(cls, scene: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the scene with run.duration by gas.cycles; invalid values are reported by their tables."""
        gas = scene.get("gas")
        if not isinstance(gas, Mapping) or "cycles" not in gas:
            return scene
        turns, rpm, run = gas["cycles"], gas.get("rpm"), scene.get("run", {})
        with suppress(UnitError):
            rpm = fields.read_rpm(rpm)
        plain = all(isinstance(number, int | float) and number > 0 for number in (turns, rpm))
        if not plain or not isinstance(run, Mapping) or "duration" in run:
            return scene
        return {**scene, "run": {**run, "duration": f"{60 * turns / rpm!r} s"}}

    def check(self, scene: Scene) -> fields.Contradictions:
        duration = scene.run.duration
        takes = write_quantity(duration, "time")
        if self.cycles is not None and not math.isclose(self.cycles * self.turn, duration, rel_tol=1e-6):
            words = f"{self.cycles:g} turns take {write_quantity(self.cycles * self.turn, 'time')}, run.duration is"
            yield "cycles", f"{words} {takes}: keep one of the two"
        if self.cylinder_pressure is not None:
            time, slack = self.course.time, 1e-9 * duration
            if not self.course.period and (time[0] > slack or time[-1] < duration - slack):
                first, last = (write_quantity(end, "time") for end in (time[0], time[-1]))
                words = f"the record covers {first} to {last}, the run takes {takes}"
                yield "cylinder_pressure", f"{words}: give a longer record, or shorten run.duration"

    @property
    def longest_step(self) -> float:
        return self.turn / 360 / PER_DEGREE / grid.FOLLOW

    def describe_step(self, step: float) -> str:
        return (
            f"lets the gas follow the reed every {write_quantity(grid.FOLLOW * step, 'time')}, less than {PER_DEGREE} "
            f"times a degree of the crank at gas.rpm = {60 / self.turn:g}"
        )

    @property
    def label(self) -> tuple[str, float, float]:
        port = self.port_diameter
        return f"pressure of the gas, {self.valve} valve, port Ø {outlines.length_text(port)}", -port / 2, port / 2

    def model_of(self, ports: int) -> Compressor | Prescribed:
        """Return the gas model of the table for a seat with so many ports."""
        common = (self.areas_of(ports), *self.plenums, self.valve)
        if (crank := self.crank) is None:
            return Prescribed(self.course, self.fluid.gas, *common)
        other, start = self.other_valve_area or 0.0, self.start_pressure or self.suction.pressure
        return Compressor(self.fluid.gas, crank, *common, other, start)

    def loads(self, reed: Structure, body: bodies.Body, ports: Sequence[Array] = ()) -> Iterator[bodies.Load]:
        """Yield the gas loads on the ``body`` of a ``reed``, over each of several ``ports``; a prescribed pressure is
        one load for each sign of dp."""
        drive, shape = self.model_of(len(ports) or 1), reed.pushed_at(body, None, by="pressure")[:, 0]
        if self.ports in (None, len(ports)) and len(ports) > 1:
            shape = np.mean([reed.pushed_at(body, points).mean(axis=1) for points in ports], axis=0)
        if isinstance(drive, Compressor):
            at_start = drive.valve.push(0.0, drop(drive, float(drive.start()[PRESSURE])))
            yield bodies.Load(shape, partial(np.full_like, fill_value=at_start, dtype=float), feedback=drive)
            return
        for table, sign in ((drive.valve.force, 1.0), (drive.valve.force_back, -1.0)):
            by_opening = partial(_area_ratio, table) if len(set(table.area)) > 1 else None
            yield bodies.Load(shape, partial(_pressure_force, drive, float(table.area[0]), sign), by_opening)

    def follow(
        self, lift: Array, dt: float, duration: float, ports: Sequence[PortLift] = (), stops: Array = NO_STOPS
    ) -> GasRun:
        drive = self.model_of(number_of_ports(ports))
        return GasRun(self, drive, gas_history(drive, lift, dt), lift, dt, duration, tuple(ports), stops)

    def notes(self) -> tuple[str, ...]:
        """Return a note on effective areas that were not measured."""
        valve = self.areas_of(1)
        tables = {"flow": (valve.flow, valve.flow_back), "force": (valve.force, valve.force_back)}
        guessed = [
            f"gas.{key}.{way} ({table.source.removeprefix(NOT_MEASURED)})"
            for key, both in tables.items()
            for way, table in zip(("forward", "back"), both, strict=True)
            if table.source.startswith(NOT_MEASURED)
        ]
        return (f"effective areas not measured: {', '.join(guessed)}",) if guessed else ()


def _area_ratio(table: AreaTable, opening: float) -> float:
    return table(opening) / float(table.area[0])


def _pressure_force(drive: Prescribed, area: float, sign: float, time: Array) -> Array:
    """Return the (n,) force dp A at the times at which dp has this sign, else 0 [N]."""
    dp = drop(drive, np.asarray(drive.pressure(time)))
    return np.where(sign * dp > 0, dp, 0.0) * area


@dataclass(frozen=True)
class GasRun(DriveRun):
    """The gas over a run of a scene.

    Attributes:
        asked: the table [gas].
        drive: model of the cylinder, or the prescribed pressure.
        history: pressure, flow and masses over time.
        lift, dt, duration, ports, stops: the run, as in `Drive.follow`.
    """

    asked: CompressorGas
    drive: Compressor | Prescribed
    history: GasHistory
    lift: Array
    dt: float
    duration: float
    ports: tuple[PortLift, ...]
    stops: Array

    __repr__ = brief

    @property
    def angle(self) -> Array:
        """Return the (n + 1,) crank angle at the times of the history [deg]."""
        return angles(self.history.time, self.asked.rpm, self.asked.angle)

    @cached_property
    def volume(self) -> Array:
        """Return the (n + 1,) volume of the cylinder [m^3]; empty if its pressure is prescribed."""
        crank = self.asked.crank
        return np.array([] if crank is None else [crank.volume(float(t)) for t in self.history.time])

    def values(self) -> dict[str, float]:
        """Return the mass that flows in each cycle of a run [kg], and that over each of several lands in all of it."""
        masses = cycle_masses(self.asked, self.duration, self.history)
        by_cycle = {cycle_name(key, cycle): mass for key, each in masses.items() for cycle, mass in enumerate(each)}
        return by_cycle | masses_over_lands(self.ports, self.history, self.dt)

    def keys(self) -> dict[str, object]:
        """Return the gas keys for summary.json; lists have a value, or ``None``, for each cycle.

        The valve is open above `OPEN` of its largest lift; the seating velocity is its speed where it falls below that.
        """
        gas, dt, lift, turn = self.asked, self.dt, self.lift, self.asked.turn
        largest = float(np.max(lift))
        is_open = lift > OPEN * largest if largest > 0 else np.zeros(len(lift), dtype=bool)
        rises, falls = (
            np.flatnonzero(is_open[1:] & ~is_open[:-1]) + 1,
            np.flatnonzero(~is_open[1:] & is_open[:-1]) + 1,
        )
        cycles = cycles_of(gas, self.duration)

        def group_by_cycle(steps: NDArray[Any]) -> list[NDArray[Any]]:
            number = np.minimum(np.asarray(steps * dt / turn, dtype=int), cycles - 1)
            return [steps[number == c] for c in range(cycles)]

        def degrees(step: int) -> float:
            return float(angles(np.array([step * dt]), gas.rpm, gas.angle)[0])

        speed = (lift[:-1] - lift[1:]) / dt
        valve, side = self.drive.valve, self.drive.side
        keys: dict[str, object] = {
            "gas_valve": side,
            "gas_cycles": self.duration / turn,
            "gas_opening_deg": [degrees(s[0]) if len(s) else None for s in group_by_cycle(rises)],
            "gas_closing_deg": [degrees(s[-1]) if len(s) else None for s in group_by_cycle(falls)],
            "gas_largest_lift_m": largest,
            "gas_seating_velocity_m_per_s": [
                float(speed[s - 1].max()) if len(s) else None for s in group_by_cycle(falls)
            ],
            "gas_seat_impacts": [len(s) for s in group_by_cycle(falls)],
            "gas_stopper_impacts": [len(s) for s in group_by_cycle(self.stops / dt)],
            **cycle_masses(gas, self.duration, self.history),
            "gas_flow_area_source": [valve.flow.source, valve.flow_back.source],
            "gas_force_area_source": [valve.force.source, valve.force_back.source],
            "gas_largest_pressure_Pa": float(self.history.pressure.max()),
            "gas_least_pressure_Pa": float(self.history.pressure.min()),
            **self._summarize_lands(),
        }
        if len(self.volume):
            residual = self.history.energy_residual(self.drive.gas.k, self.volume)
            keys |= {"gas_mass_residual": self.history.mass_residual(side)}
            keys |= {"gas_energy_residual": residual}
        return keys

    def _summarize_lands(self) -> dict[str, object]:
        """Return the keys of the flow over each of several lands: largest lift, last closing, masses, port area."""
        keys: dict[str, object] = {}
        if self.ports:
            keys["gas_lands"] = [each.name for each in self.ports]
        for number, each in enumerate(self.ports, start=1):
            largest = float(each.lift.max())
            falls = np.flatnonzero((each.lift[1:] <= OPEN * largest) & (each.lift[:-1] > OPEN * largest)) + 1
            closing = angles(np.asarray(falls[-1:] * self.dt, dtype=np.float64), self.asked.rpm, self.asked.angle)
            keys[f"gas_land_{number}_largest_lift_m"] = largest
            keys[f"gas_land_{number}_closing_deg"] = float(closing[0]) if len(closing) else None
            keys[f"gas_land_{number}_pressure_area_m2"] = float(self.drive.valve.force.area[0]) / len(self.ports)
        return keys | masses_over_lands(self.ports, self.history, self.dt)

    def write(self, folder: Path) -> Path:
        """Write the history as CSV, one line for each span of steps over which the gas takes the lift as constant."""
        h = self.history
        heads = ["time [s]", "angle [deg]", "pressure [Pa]", "lift [m]", "reed flow [kg/s]"]
        columns = [h.time, self.angle, h.pressure, h.lift, h.flow(FORWARD, BACK)]
        if len(self.volume):
            heads += ["other valve flow [kg/s]", "volume [m^3]", "mass [kg]"]
            columns += [h.flow(OTHER), self.volume, h.states[:, 1]]
        return write_csv(folder / FILE, heads, zip(*(column.tolist() for column in columns), strict=True), digits=9)

    def picture(self, title: str, stop: float) -> tuple[str, Callable[[Path], None]]:
        courses = self.drive, self.history, self.angle, self.volume
        return PICTURE, lambda path: gas_plot.plot_gas(*courses, path, stop=stop, title=title or "Reed valve")


def number_of_ports(lands: Sequence[PortLift]) -> int:
    """Return the number of ports that lands seal; 1 without any."""
    return round(sum(each.share for each in lands)) or 1


def masses_over_lands(ports: Sequence[PortLift], history: GasHistory, dt: float) -> dict[str, float]:
    """Return, by key of summary.json, the mass that passes each of several lands forward and back in a run [kg].

    The flow divides as the openings at their rims, min(rim x, A) with the port's area A; ``dt``: step of the lifts [s].
    """
    if not ports:
        return {}
    middles = (history.time[1:] + history.time[:-1]) / 2
    times = dt * np.arange(len(ports[0].lift))
    open_areas = np.array([np.clip(each.rim * np.interp(middles, times, each.lift), 0.0, each.area) for each in ports])
    total = open_areas.sum(axis=0)
    shares = np.divide(open_areas, total, out=np.full(open_areas.shape, 1 / len(ports)), where=total > 0)
    masses: dict[str, float] = {}
    for name, column in (("forward", FORWARD), ("back", BACK)):
        passed = shares @ np.diff(history.states[:, column])
        masses |= {f"gas_land_{number}_mass_{name}_kg": float(mass) for number, mass in enumerate(passed, start=1)}
    return masses


def cycles_of(gas: CompressorGas, duration: float) -> int:
    """Return the number of turns of the crank that a run of this ``duration`` [s] begins."""
    return max(1, math.ceil(duration / gas.turn - 1e-6))


def cycle_masses(gas: CompressorGas, duration: float, history: GasHistory) -> dict[str, list[float]]:
    """Return, by key of summary.json, the mass that flows in each cycle [kg], also through the other valve where the
    cylinder's pressure is computed."""
    edges = np.minimum(np.arange(cycles_of(gas, duration) + 1) * gas.turn, history.time[-1])
    columns = {"forward": FORWARD, "back": BACK, **({"other_valve": OTHER} if gas.crank else {})}
    return {
        f"gas_mass_{name}_kg": np.diff(np.interp(edges, history.time, history.states[:, column])).tolist()
        for name, column in columns.items()
    }
