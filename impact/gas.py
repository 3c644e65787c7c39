"""Flow of a perfect gas through a reed valve, and the gas in the cylinder behind it (Costagliola 1950; Soedel).

A state holds pressure, mass, and the time integrals of flows, work and enthalpy. Functions advance it in place by a
step that conserves mass and energy to round-off.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, TypeVar

import numpy as np

from impact.greens.base import Array
from impact.march.grid import FOLLOW, extrapolate_openings
from impact.notices import SeatfemError
from impact.quantities import brief

__all__ = [
    "AreaTable",
    "Compressor",
    "GasError",
    "GasHistory",
    "PerfectGas",
    "Plenum",
    "Prescribed",
    "ReedValve",
    "SliderCrank",
    "gas_history",
    "isentropic",
    "of_molar_mass",
    "port_flow",
    "port_force",
]

MOLAR: Final = 8.31446261815324
"""Molar gas constant [J/(mol K)], exact in the SI of 2019."""


class GasError(SeatfemError, ValueError):
    """Error of an invalid gas, geometry or table; the message names value, limit and remedy."""


@dataclass(frozen=True)
class PerfectGas:
    """A gas with p V = m R T and constant specific heats.

    Attributes:
        k: ratio of the specific heats, > 1.
        constant: R of this gas [J/(kg K)], molar constant over molar mass.
        source: citation of the numbers.

    Raises:
        GasError: k <= 1, R <= 0, or a number that is not finite.
    """

    k: float
    constant: float
    source: str = ""

    def __post_init__(self) -> None:
        if not (self.k > 1 and self.constant > 0 and math.isfinite(self.k * self.constant)):
            raise GasError(f"a gas needs k > 1 and R > 0, finite; got k = {self.k:g}, R = {self.constant:g} J/(kg K)")

    @property
    def heat(self) -> float:
        """Return the specific heat at constant pressure, c_p = k R/(k - 1) [J/(kg K)]."""
        return self.k * self.constant / (self.k - 1)

    @cached_property
    def critical(self) -> float:
        """Return the ratio of the pressures at and below which the flow is choked, (2/(k + 1))^(k/(k - 1))."""
        return float((2 / (self.k + 1)) ** (self.k / (self.k - 1)))

    def flux(self, upstream: float, temperature: float, drop: float) -> float:
        """Return the mass flow per effective area [kg/(s m^2)] from gas at rest at the pressure ``upstream`` [Pa] and
        ``temperature`` [K].

            m'/A = p_u sqrt(2 k/((k - 1) R T_u) (r^(2/k) - r^((k + 1)/k))),   r = max(p_d/p_u, r*),

        where r* is `critical`. The argument ``drop`` = p_u - p_d >= 0 [Pa] avoids cancellation for small drops.
        """
        k = self.k
        ratio = max(1 - drop / upstream, self.critical)
        log = math.log1p(-drop / upstream) if ratio > self.critical else math.log(ratio)
        falls = -math.expm1((k - 1) / k * log)  # 1 - r^((k - 1)/k)
        speed = math.sqrt(2 * k / ((k - 1) * self.constant * temperature) * falls)
        return float(upstream * ratio ** (1 / k) * speed)


def of_molar_mass(k: float, molar_mass: float, source: str = "") -> PerfectGas:
    """Return the gas by its molar mass [kg/mol]; raises `GasError`."""
    if not molar_mass > 0:
        raise GasError(f"molar mass = {molar_mass:g} kg/mol must be positive")
    return PerfectGas(k, MOLAR / molar_mass, source)


GASES: Final = {
    "air": of_molar_mass(1.400, 28.9647e-3, "dry air near 300 K: Moran and Shapiro, Engineering Thermodynamics"),
    "nitrogen": of_molar_mass(1.400, 28.0134e-3, "near 300 K: NIST Chemistry WebBook"),
    "R134a": of_molar_mass(
        1.108, 102.032e-3, "ideal-gas limit at 300 K: Tillner-Roth and Baehr, J. Phys. Chem. Ref. Data 23 (1994) 657"
    ),
}
"""Ideal gases by name; near saturation real gases are denser and need other values of k and molar mass."""


PRESSURE, MASS, FORWARD, BACK, OTHER, WORK, ENTHALPY = range(7)
"""Entries of a state: p [Pa] and m [kg] of the gas; mass through the reed valve forward and back, and through the other
valve [kg]; work done on the gas, and enthalpy received by it [J]."""
STATE: Final = 7  # length of a state


@dataclass(frozen=True)
class SliderCrank:
    """A slider-crank drive without offset, at constant speed.

    Attributes:
        bore, stroke, rod: cylinder diameter, stroke, length of the connecting rod [m].
        clearance: volume at the top dead centre [m^3].
        rpm: speed [1/min].
        start: crank angle at t = 0, from the top dead centre [rad].

    Raises:
        GasError: a length, clearance or speed that is not positive; a rod of no more than half the stroke.
    """

    bore: float
    stroke: float
    rod: float
    clearance: float
    rpm: float
    start: float = 0.0

    def __post_init__(self) -> None:
        for name in ("bore", "stroke", "rod", "clearance", "rpm"):
            if not (getattr(self, name) > 0 and math.isfinite(getattr(self, name))):
                raise GasError(f"{name} = {getattr(self, name):g} must be positive and finite")
        if self.rod <= self.stroke / 2:
            raise GasError(
                f"rod = {1e3 * self.rod:g} mm is no longer than half the stroke of {1e3 * self.stroke:g} mm: the crank "
                f"cannot turn; make it longer than {500 * self.stroke:g} mm"
            )

    def angle(self, time: float) -> float:
        """Return the crank angle [rad] at a time [s]."""
        return self.start + math.pi / 30 * self.rpm * time

    def volume(self, time: float) -> float:
        """Return V_c + (pi/4) B^2 (a (1 - cos) + l - sqrt(l^2 - a^2 sin^2)) [m^3], a = stroke/2, l = rod."""
        arm, angle = self.stroke / 2, self.angle(time)
        travel = arm * (1 - math.cos(angle)) + self.rod - math.sqrt(self.rod**2 - (arm * math.sin(angle)) ** 2)
        return self.clearance + math.pi / 4 * self.bore**2 * travel


@dataclass(frozen=True)
class Plenum:
    """Gas at constant pressure [Pa] and temperature [K]; raises `GasError` unless both are positive."""

    pressure: float
    temperature: float

    def __post_init__(self) -> None:
        if not (self.pressure > 0 and self.temperature > 0 and math.isfinite(self.pressure * self.temperature)):
            raise GasError(
                f"a plenum at {self.pressure:g} Pa and {self.temperature:g} K: both must be positive, finite"
            )


def squeeze(gas: PerfectGas, state: list[float], before: float, after: float) -> None:
    """Compress the gas from one volume to another [m^3] with all valves shut: p V^k = const."""
    ratio = before / after
    state[WORK] += state[PRESSURE] * before / (gas.k - 1) * math.expm1((gas.k - 1) * math.log(ratio))
    state[PRESSURE] *= ratio**gas.k


def let_in(gas: PerfectGas, state: list[float], volume: float, plenum: Plenum, area: float, span: float) -> float:
    """Let gas flow from or to a plenum through an effective ``area`` [m^2] over ``span`` [s] at a constant volume.

    p' = k R T_u m'/V, with T_u of the plenum for inflow; for outflow, the gas in the volume keeps p/m^k. The root s
    of the pressure difference is a smooth function of time until the flow ends at s = 0: it is advanced by the
    midpoint rule, of second order. Mass and enthalpy follow from p exactly. Returns the mass that entered [kg],
    negative for outflow.
    """
    p, m, k = state[PRESSURE], state[MASS], gas.k
    root = math.sqrt(abs(plenum.pressure - p))
    if area == 0 or root == 0:
        return 0.0
    inward = plenum.pressure > p

    def rate(s: float) -> float:
        """Return -s' = |p'|/(2 s)."""
        if inward:
            heat = plenum.temperature
            flux = gas.flux(plenum.pressure, heat, s * s)
        else:
            now = plenum.pressure + s * s
            heat = p * volume / (m * gas.constant) * (now / p) ** ((k - 1) / k)
            flux = gas.flux(now, heat, s * s)
        return k * gas.constant * heat * area * flux / (2 * s * volume)

    middle = max(root - span / 2 * rate(root), 1e-6 * root)
    difference = max(root - span * rate(middle), 0.0) ** 2
    if inward:
        after = plenum.pressure - difference
        gained = volume * (after - p) / (k * gas.constant * plenum.temperature)
        brought = gas.heat * plenum.temperature * gained
    else:
        after = plenum.pressure + difference
        gained = m * math.expm1(math.log(after / p) / k)
        warm = p * volume / (m * gas.constant)
        brought = gas.heat * warm * m / k * ((1 + gained / m) ** k - 1)  # integral of c_p T dm, T ~ m^(k - 1)
    state[PRESSURE], state[MASS] = after, m + gained
    state[ENTHALPY] += brought
    return gained


NOT_MEASURED: Final = "not measured: "


@dataclass(frozen=True)
class AreaTable:
    """An effective area as piecewise linear function of the lift, constant beyond the last point.

    Attributes:
        lift: (n,) mean lift [m], increasing from 0.
        area: (n,) areas at these lifts [m^2], >= 0.
        source: citation of the numbers.

    Raises:
        GasError: a table that does not begin at lift 0, lifts that do not increase, negative areas.
    """

    lift: Array
    area: Array
    source: str

    __repr__ = brief

    def __post_init__(self) -> None:
        lift, area = self.lift, self.area
        if lift.ndim != 1 or lift.shape != area.shape or not len(lift):
            raise GasError(f"{np.size(area)} areas at {np.size(lift)} lifts: give one for each")
        if lift[0] != 0:
            raise GasError(f"the table begins at a lift of {1e3 * lift[0]:g} mm: state the area of the shut valve, too")
        if (back := np.flatnonzero(~(np.diff(lift) > 0))).size:
            raise GasError(
                f"the lifts must increase: {1e3 * lift[back[0] + 1]:g} mm follows {1e3 * lift[back[0]]:g} mm"
            )
        if not (np.all(area >= 0) and np.all(np.isfinite(area))):
            raise GasError(f"an area of {1e6 * np.min(area):g} mm^2: areas are >= 0 and finite")

    def __call__(self, lift: float) -> float:
        """Return the area [m^2] at a mean lift [m]; for a lift below 0, that at 0."""
        lifts, areas, slopes = self._lines  # of one number faster than `np.interp`, which checks its arrays
        at = bisect_right(lifts, lift) - 1
        return areas[0] if at < 0 else slopes[at] * (lift - lifts[at]) + areas[at]

    @cached_property
    def _lines(self) -> tuple[list[float], list[float], list[float]]:
        """Return lifts [m], areas [m^2] and, after each point, the slopes of the area [m]."""
        slopes = (np.diff(self.area) / np.diff(self.lift)).tolist()
        return self.lift.tolist(), self.area.tolist(), [*slopes, 0.0]


@dataclass(frozen=True)
class ReedValve:
    """Effective areas of a reed valve for both directions of flow.

    Flow is forward if it comes out of the port and lifts the reed. The pressure drop dp is that from the port to
    the other side of the reed.

    Attributes:
        flow, flow_back: A_e, which times `PerfectGas.flux` is the mass flow.
        force, force_back: A_f, which times dp is the force on the reed; at lift 0 the area of the port.

    Raises:
        GasError: a force area of 0 at lift 0: nothing would open the valve.
    """

    flow: AreaTable
    flow_back: AreaTable
    force: AreaTable
    force_back: AreaTable

    __repr__ = brief

    def __post_init__(self) -> None:
        for table in (self.force, self.force_back):
            if not table.area[0] > 0:
                raise GasError(
                    "the force area at lift 0 is 0: nothing opens the valve; state the area of the port there"
                )

    def flow_area(self, lift: float, drop: float) -> float:
        """Return A_e [m^2] at a lift [m] for the sign of dp = ``drop`` [Pa]."""
        return (self.flow if drop >= 0 else self.flow_back)(lift)

    def push(self, lift: float, drop: float) -> float:
        """Return the force dp A_f on the reed, away from the seat [N]."""
        return drop * (self.force if drop >= 0 else self.force_back)(lift)


def port_flow(radius: float, coefficient: float) -> AreaTable:
    """Return the estimate C_d min(2 pi R x, pi R^2): the gap around a port of radius R [m], at most the port's area.

    C_d is the ``coefficient``; the source is marked as not measured.
    """
    area = coefficient * math.pi * radius**2
    words = f"{NOT_MEASURED}{coefficient:g} min(2 pi R x, pi R^2), R = {1e3 * radius:g} mm"
    return AreaTable(np.array([0.0, radius / 2]), np.array([0.0, area]), words)


def port_force(radius: float) -> AreaTable:
    """Return the estimate pi R^2 [m^2], the value of a closed valve, at every lift, marked as not measured."""
    words = f"{NOT_MEASURED}pi R^2 at every lift, R = {1e3 * radius:g} mm"
    return AreaTable(np.zeros(1), np.array([math.pi * radius**2]), words)


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
        """Return the initial (7,) state in the order of `impact.gas`."""
        state = np.zeros(STATE)
        state[PRESSURE] = self.start_pressure
        warm = isentropic(self.gas, self.suction, self.start_pressure)
        state[MASS] = self.start_pressure * self.crank.volume(0.0) / (self.gas.constant * warm)
        return state

    def advance(self, state: Array, time: float, span: float, opening: float) -> float:
        """Advance as in `Feedback`; return dp A_f, with the mean of dp before and after the flow of the step [N]."""
        before, now, after = (self.crank.volume(time + part * span) for part in (0.0, 0.5, 1.0))
        values = state.tolist()  # of single numbers faster than an array
        squeeze(self.gas, values, before, now)
        first = values[PRESSURE]
        self._flow_through_reed(values, now, opening, span / 2)
        other, inward = (self.discharge, -1) if self.side == "suction" else (self.suction, 1)
        if inward * (other.pressure - values[PRESSURE]) > 0:
            values[OTHER] += abs(let_in(self.gas, values, now, other, self.other_area, span))
        self._flow_through_reed(values, now, opening, span / 2)
        pressure = (first + values[PRESSURE]) / 2
        squeeze(self.gas, values, now, after)
        state[:] = values
        return self.valve.push(opening, drop(self, pressure))

    def _flow_through_reed(self, state: list[float], volume: float, lift: float, span: float) -> None:
        area = self.valve.flow_area(lift, drop(self, state[PRESSURE]))
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
        """Return the initial (7,) state in the order of `impact.gas`, in which only pressure and masses through
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
        states: (n + 1, 7) states in the order of `impact.gas`.
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
    first, ahead = extrapolate_openings(opening)
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
