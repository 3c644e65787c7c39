"""The gas of a run: its loads on the reed, and its results in numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.after.measures import contact_groups
from impact.bodies.body import Body, Load
from impact.files.csv_table import write_csv
from impact.gas import (
    BACK,
    FORWARD,
    NOT_MEASURED,
    OTHER,
    PRESSURE,
    AreaTable,
    Compressor,
    GasHistory,
    Prescribed,
    angles,
    drop,
    gas_history,
)
from impact.greens.base import Array
from impact.quantities import brief
from impact.runs.variations import Values
from seatfem.structures.kinds import Structure
from seatfem.study.impacts.touches import OF_GAS, Touches
from seatfem.study.scene.gas import CompressorGas

OPEN = 0.01  # lift, over its largest, above which the valve counts as open


def gas_of(gas: CompressorGas) -> Compressor | Prescribed:
    """Return the gas model of the table [gas]."""
    common = (gas.areas, *gas.plenums, gas.valve)
    if (crank := gas.crank) is None:
        return Prescribed(gas.course, gas.fluid.gas, *common)
    other, start = gas.other_valve_area or 0.0, gas.start_pressure or gas.suction.pressure
    return Compressor(gas.fluid.gas, crank, *common, other, start)


def gas_loads(gas: CompressorGas, reed: Structure, body: Body) -> Iterator[Load]:
    """Yield the gas loads on the ``body`` of a ``reed``; a prescribed pressure is one load for each sign of dp."""
    drive, shape = gas_of(gas), reed.pushed_at(body, None, by="pressure")[:, 0]
    if isinstance(drive, Compressor):
        at_start = drive.valve.push(0.0, drop(drive, float(drive.start()[PRESSURE])))
        yield Load(shape, partial(np.full_like, fill_value=at_start, dtype=float), feedback=drive)
        return
    for table, sign in ((drive.valve.force, 1.0), (drive.valve.force_back, -1.0)):
        by_opening = partial(_area_ratio, table) if len(set(table.area)) > 1 else None
        yield Load(shape, partial(_pressure_force, drive, float(table.area[0]), sign), by_opening)


def _area_ratio(table: AreaTable, opening: float) -> float:
    return table(opening) / float(table.area[0])


def _pressure_force(drive: Prescribed, area: float, sign: float, time: Array) -> Array:
    """Return the (n,) force dp A at the times at which dp has this sign, else 0 [N]."""
    dp = drop(drive, np.asarray(drive.pressure(time)))
    return np.where(sign * dp > 0, dp, 0.0) * area


@dataclass(frozen=True)
class GasRun:
    """The gas over a run of a scene.

    Attributes:
        asked: the table [gas].
        drive: model of the cylinder, or the prescribed pressure.
        history: pressure, flow and masses over time.
        angle: (n + 1,) crank angle at these times [deg].
        volume: (n + 1,) volume of the cylinder [m^3]; ``None`` if its pressure is prescribed.
    """

    asked: CompressorGas
    drive: Compressor | Prescribed
    history: GasHistory
    angle: Array
    volume: Array | None

    __repr__ = brief

    @staticmethod
    def from_run(gas: CompressorGas, touches: Touches) -> GasRun:
        """Return the gas of a run, by its table [gas]."""
        drive = gas_of(gas)
        history = gas_history(drive, touches.opening, touches.seat.dt)
        crank = gas.crank
        volume = None if crank is None else np.array([crank.volume(float(t)) for t in history.time])
        return GasRun(gas, drive, history, angles(history.time, gas.rpm, gas.angle), volume)


def gas_keys(run: GasRun, touches: Touches, duration: float) -> dict[str, object]:
    """Return the gas keys for summary.json; lists have a value, or ``None``, for each cycle of a ``duration`` [s].

    The valve is open above `OPEN` of its largest lift; the seating velocity is its speed where it falls below that.
    """
    gas, dt, lift, turn = run.asked, touches.seat.dt, touches.opening, run.asked.turn
    largest = float(np.max(lift))
    is_open = lift > OPEN * largest if largest > 0 else np.zeros(len(lift), dtype=bool)
    rises, falls = (np.flatnonzero(is_open[1:] & ~is_open[:-1]) + 1, np.flatnonzero(~is_open[1:] & is_open[:-1]) + 1)
    cycles = cycles_of(gas, duration)

    def by_cycle(steps: NDArray[Any]) -> list[NDArray[Any]]:
        number = np.minimum(np.asarray(steps * dt / turn, dtype=int), cycles - 1)
        return [steps[number == c] for c in range(cycles)]

    def degrees(step: int) -> float:
        return float(angles(np.array([step * dt]), gas.rpm, gas.angle)[0])

    speed = (lift[:-1] - lift[1:]) / dt
    stops = np.zeros(0) if touches.stopper is None else contact_groups(touches.stopper)[:, 0] / dt
    valve, side = run.drive.valve, run.drive.side
    keys: dict[str, object] = {
        "gas_valve": side,
        "gas_cycles": duration / turn,
        "gas_opening_deg": [degrees(s[0]) if len(s) else None for s in by_cycle(rises)],
        "gas_closing_deg": [degrees(s[-1]) if len(s) else None for s in by_cycle(falls)],
        "gas_largest_lift_m": largest,
        "gas_seating_velocity_m_per_s": [float(speed[s - 1].max()) if len(s) else None for s in by_cycle(falls)],
        "gas_seat_impacts": [len(s) for s in by_cycle(falls)],
        "gas_stopper_impacts": [len(s) for s in by_cycle(stops)],
        **cycle_masses(gas, duration, run.history, of_other=run.volume is not None),
        "gas_flow_area_source": [valve.flow.source, valve.flow_back.source],
        "gas_force_area_source": [valve.force.source, valve.force_back.source],
        "gas_largest_pressure_Pa": float(run.history.pressure.max()),
        "gas_least_pressure_Pa": float(run.history.pressure.min()),
    }
    if run.volume is not None:
        residual = run.history.energy_residual(run.drive.gas.k, run.volume)
        keys |= {"gas_mass_residual": run.history.mass_residual(side)}
        keys |= {"gas_energy_residual": residual}
    return keys


def cycles_of(gas: CompressorGas, duration: float) -> int:
    """Return the number of turns of the crank that a run of this ``duration`` [s] begins."""
    return max(1, math.ceil(duration / gas.turn - 1e-6))


def mass_values(gas: CompressorGas | None, duration: float, opening: Array, dt: float) -> Values:
    """Return the mass that flows in each cycle of a run [kg], by key of summary.json and cycle, from its lift (n + 1,)
    [m] at steps ``dt`` [s]; none without gas."""
    if gas is None:
        return {}
    drive = gas_of(gas)
    masses = cycle_masses(gas, duration, gas_history(drive, opening, dt), of_other=isinstance(drive, Compressor))
    return {f"{key} {cycle}": mass for key, each in masses.items() for cycle, mass in enumerate(each)}


def cycle_masses(gas: CompressorGas, duration: float, history: GasHistory, *, of_other: bool) -> dict[str, list[float]]:
    """Return, by key of summary.json, the mass that flows in each cycle [kg]; with ``of_other`` also that through the
    other valve."""
    edges = np.minimum(np.arange(cycles_of(gas, duration) + 1) * gas.turn, history.time[-1])
    columns = {"forward": FORWARD, "back": BACK, **({"other_valve": OTHER} if of_other else {})}
    return {
        f"{OF_GAS}{name}_kg": np.diff(np.interp(edges, history.time, history.states[:, column])).tolist()
        for name, column in columns.items()
    }


def gas_notes(gas: CompressorGas | None) -> tuple[str, ...]:
    """Return a note on effective areas that were not measured."""
    if gas is None:
        return ()
    valve = gas.areas
    tables = {"flow": (valve.flow, valve.flow_back), "force": (valve.force, valve.force_back)}
    guessed = [
        f"gas.{key}.{way} ({table.source.removeprefix(NOT_MEASURED)})"
        for key, both in tables.items()
        for way, table in zip(("forward", "back"), both, strict=True)
        if table.source.startswith(NOT_MEASURED)
    ]
    return (f"effective areas not measured: {', '.join(guessed)}",) if guessed else ()


def write_gas(run: GasRun, path: Path) -> Path:
    """Write the history of the gas as CSV, one line for each span of steps over which it takes the lift as constant."""
    h = run.history
    heads = ["time [s]", "angle [deg]", "pressure [Pa]", "lift [m]", "reed flow [kg/s]"]
    columns = [h.time, run.angle, h.pressure, h.lift, h.flow(FORWARD, BACK)]
    if run.volume is not None:
        heads += ["other valve flow [kg/s]", "volume [m^3]", "mass [kg]"]
        columns += [h.flow(OTHER), run.volume, h.states[:, 1]]
    return write_csv(path, heads, zip(*(column.tolist() for column in columns), strict=True), digits=9)
