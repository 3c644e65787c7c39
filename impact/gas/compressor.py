"""Coupling of a reed valve with the gas in a compressor's cylinder (Costagliola 1950; Soedel)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from impact.gas.flow import (
    BACK,
    ENTHALPY,
    FORWARD,
    MASS,
    OTHER,
    PRESSURE,
    STATE,
    WORK,
    PerfectGas,
    Plenum,
    ReedValve,
    SliderCrank,
    let_in,
    squeeze,
)
from impact.greens.base import Array
from impact.march.stepper import FOLLOW, foreseen
from impact.quantities import brief

Side = Literal["suction", "discharge"]
Pressure = TypeVar("Pressure", float, Array)


@dataclass(frozen=True)
class Compressor:
    """A cylinder between two plenums. One valve is the reed; the other one is ideal: a nozzle without inertia that
    opens forward at its plenum's pressure.

    A step by symmetric splitting: half the change of volume, half the flow through the reed valve, the flow through the
    other one, then the other halves in reverse order. It is of second order, and each part is exact in mass and energy.
    The class is the `Feedback` of a load.

    Attributes:
        gas, crank, valve: gas, crank drive, and effective areas of the reed valve.
        suction, discharge: the plenums.
        side: valve that is the reed.
        other_area: effective area of the other valve [m^2]; 0 if there is none.
        start_pressure: pressure in the cylinder at t = 0 [Pa]; its temperature is that by `isentropic`.
    """

    gas: PerfectGas
    crank: SliderCrank
    valve: ReedValve
    suction: Plenum
    discharge: Plenum
    side: Side
    other_area: float
    start_pressure: float

    __repr__ = brief

    def start(self) -> Array:
        """Return the initial (7,) state in the order of `impact.gas.flow`."""
        state = np.zeros(STATE)
        state[PRESSURE] = self.start_pressure
        warm = isentropic(self.gas, self.suction, self.start_pressure)
        state[MASS] = self.start_pressure * self.crank.volume(0.0) / (self.gas.constant * warm)
        return state

    def advance(self, state: Array, time: float, span: float, opening: float) -> float:
        """Advance as in `Feedback`; return dp A_f, with the mean of dp before and after the flow of the step [N]."""
        before, now, after = (self.crank.volume(time + part * span) for part in (0.0, 0.5, 1.0))
        squeeze(self.gas, state, before, now)
        first = float(state[PRESSURE])
        self._through_the_reed(state, now, opening, span / 2)
        other, inward = (self.discharge, -1) if self.side == "suction" else (self.suction, 1)
        if inward * (other.pressure - state[PRESSURE]) > 0:
            state[OTHER] += abs(let_in(self.gas, state, now, other, self.other_area, span))
        self._through_the_reed(state, now, opening, span / 2)
        pressure = (first + float(state[PRESSURE])) / 2
        squeeze(self.gas, state, now, after)
        return self.valve.push(opening, drop(self, pressure))

    def _through_the_reed(self, state: Array, volume: float, lift: float, span: float) -> None:
        area = self.valve.flow_area(lift, drop(self, float(state[PRESSURE])))
        plenum = self.suction if self.side == "suction" else self.discharge
        gained = let_in(self.gas, state, volume, plenum, area, span)
        forward = gained if self.side == "suction" else -gained
        state[FORWARD if forward > 0 else BACK] += abs(forward)


@dataclass(frozen=True)
class Prescribed:
    """A cylinder with prescribed pressure, which drives the reed but does not depend on the flow.

    Gas from the cylinder has the temperature by `isentropic`.

    Attributes:
        pressure: pressure in the cylinder, (n,) s -> (n,) Pa.
        gas, valve, suction, discharge, side: as in `Compressor`.
    """

    pressure: Callable[[Array], Array]
    gas: PerfectGas
    valve: ReedValve
    suction: Plenum
    discharge: Plenum
    side: Side

    __repr__ = brief

    def start(self) -> Array:
        """Return the initial (7,) state in the order of `impact.gas.flow`, in which only pressure and masses through
        the reed valve are used."""
        state = np.zeros(STATE)
        state[PRESSURE] = self.pressure(np.zeros(1))[0]
        return state

    def advance(self, state: Array, time: float, span: float, opening: float) -> float:
        """Advance as in `Feedback`, by the midpoint rule."""
        middle, end = (float(p) for p in self.pressure(np.array([time + span / 2, time + span])))
        over = drop(self, middle)
        known = self.suction if self.side == "suction" else self.discharge
        warm = isentropic(self.gas, self.suction, middle)
        from_known = (over > 0) == (self.side == "suction")
        source = (known.pressure, known.temperature) if from_known else (middle, warm)
        passed = span * self.valve.flow_area(opening, over) * self.gas.flux(*source, abs(over))
        state[PRESSURE] = end
        state[FORWARD if over > 0 else BACK] += passed
        return self.valve.push(opening, over)


def isentropic(gas: PerfectGas, plenum: Plenum, pressure: float) -> float:
    """Return the temperature of the plenum's gas after an isentropic change to a pressure [Pa], T (p/p_0)^((k - 1)/k)
    [K]."""
    return float(plenum.temperature * (pressure / plenum.pressure) ** ((gas.k - 1) / gas.k))


def drop(drive: Compressor | Prescribed, pressure: Pressure) -> Pressure:
    """Return the pressure in the port less that on the other side of the reed [Pa]; the port has the pressure of the
    suction plenum or, for a discharge valve, of the cylinder."""
    return drive.suction.pressure - pressure if drive.side == "suction" else pressure - drive.discharge.pressure


@dataclass(frozen=True)
class GasHistory:
    """History of the gas in a run, at the ends of the intervals in which it assumes a constant lift.

    Attributes:
        time: (n + 1,) times [s].
        lift: (n + 1,) mean lift [m].
        states: (n + 1, 7) states in the order of `impact.gas.flow`.
    """

    time: Array
    lift: Array
    states: Array

    __repr__ = brief

    @property
    def pressure(self) -> Array:
        """Return the (n + 1,) pressure in the cylinder [Pa]."""
        return np.asarray(self.states[:, PRESSURE])

    def flow(self, *columns: int) -> Array:
        """Return the (n + 1,) mass flow by ``columns`` of the states, mean over the interval before, BACK counted
        negative [kg/s]."""
        passed = np.sum([(-1 if c == BACK else 1) * self.states[:, c] for c in columns], axis=0)
        return np.concatenate([np.zeros(1), np.diff(passed) / np.diff(self.time)])

    def mass_residual(self, side: Side) -> float:
        """Return the largest error of the mass balance over the initial mass."""
        s = self.states - self.states[0]
        reed, other = s[:, FORWARD] - s[:, BACK], s[:, OTHER]
        came = reed - other if side == "suction" else other - reed
        return float(np.max(np.abs(s[:, MASS] - came)) / self.states[0, MASS])

    def energy_residual(self, k: float, volume: Array) -> float:
        """Return the largest |U - U_0 - work - enthalpy| over the largest U = p V/(k - 1); ``volume`` (n + 1,)
        [m^3]."""
        inner = self.pressure * volume / (k - 1)
        s = self.states - self.states[0]
        return float(np.max(np.abs(inner - inner[0] - s[:, WORK] - s[:, ENTHALPY])) / np.max(inner))


def gas_history(drive: Compressor | Prescribed, opening: Array, dt: float) -> GasHistory:
    """Return the history of the gas, recomputed after a run from the reed's motion as during the run.

    Args:
        drive: cylinder that drove the reed.
        opening: (n + 1,) mean opening of the contacts with seats [m].
        dt: time step [s].
    """
    first, ahead = foreseen(opening)
    state = drive.start()
    states = [state.copy()]
    for start, lift in zip(first, ahead, strict=True):
        drive.advance(state, start * dt, FOLLOW * dt, float(lift))
        states.append(state.copy())
    at = np.append(first, first[-1] + FOLLOW)
    lifts = opening[np.minimum(at, len(opening) - 1)]
    return GasHistory(at * dt, np.asarray(lifts), np.array(states))


def angles(time: Array, rpm: float, start: float) -> Array:
    """Return the crank angles [deg], not reduced to one turn, at times [s], from ``start`` [rad] at t = 0."""
    return np.asarray(math.degrees(start) + 6 * rpm * time)
