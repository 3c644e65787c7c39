"""A cylinder: its volume by the crank angle, and its gas, squeezed adiabatically and let in or out.

A state holds pressure, mass, and what has passed so far. Each function takes it on in place by a step that conserves
mass and energy to round-off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from impact.gas.nozzle import GasError, PerfectGas
from impact.greens.base import Array

PRESSURE, MASS, FORWARD, BACK, OTHER, WORK, ENTHALPY = range(7)
"""Of a state: p [Pa] and m [kg] of the gas; mass through the reed valve forward and back, through the other valve [kg];
work done on the gas, enthalpy it received [J]."""
STATE: Final = 7


@dataclass(frozen=True)
class SliderCrank:
    """A piston on a crank that turns steadily; its pin axis meets the crank's.

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


def squeeze(gas: PerfectGas, state: Array, before: float, after: float) -> None:
    """Compress the gas from one volume to another [m^3] with all valves shut: p V^k = const."""
    ratio = before / after
    state[WORK] += state[PRESSURE] * before / (gas.k - 1) * math.expm1((gas.k - 1) * math.log(ratio))
    state[PRESSURE] *= ratio**gas.k


def let_in(gas: PerfectGas, state: Array, volume: float, plenum: Plenum, area: float, span: float) -> float:
    """Let gas flow from or to a plenum through an effective ``area`` [m^2] over ``span`` [s] at a constant volume.

    p' = k R T_u m'/V, with T_u of the plenum where it flows in; where it flows out, what stays keeps p/m^k. The root s
    of the pressures' difference is smooth down to zero, where the flow ends: it is stepped by the midpoint rule, of
    second order, and stops there. Mass and enthalpy follow from p exactly. Returns the mass that came in [kg];
    negative: went out.
    """
    p, m, k = float(state[PRESSURE]), float(state[MASS]), gas.k
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
