"""What a reed valve is to the gas: its areas of flow and of force by the lift, forward and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.brief import brief
from impact.gas.nozzle import GasError
from impact.greens.base import Array

NOT_MEASURED: Final = "not measured: "


@dataclass(frozen=True)
class AreaTable:
    """An effective area by the lift, by lines between its points, held beyond the last.

    Attributes:
        lift: (n,) mean lift [m], increasing from 0.
        area: (n,) at each of them [m^2], none negative.
        source: of the numbers.

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
        """Return the area [m^2] at a mean lift [m]; below 0 that at 0."""
        return float(np.interp(lift, self.lift, self.area))


@dataclass(frozen=True)
class ReedValve:
    """Effective areas of a reed valve, each direction with its own.

    Forward is through the port, which lifts the reed. The pressure drop dp is counted forward: that in the port less$
    that on the reed's other side.

    Attributes:
        flow, flow_back: A_e, by which `PerfectGas.flux` gives the mass flow.
        force, force_back: A_f, by which dp gives the force on the reed; at lift 0 the area of the port.

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
        """Return A_e at a lift [m] under dp = ``drop`` [Pa], whose sign alone counts [m^2]."""
        return (self.flow if drop >= 0 else self.flow_back)(lift)

    def push(self, lift: float, drop: float) -> float:
        """Return dp A_f, away from the seat [N]."""
        return drop * (self.force if drop >= 0 else self.force_back)(lift)


def port_flow(radius: float, coefficient: float) -> AreaTable:
    """Return C_d min(2 pi R x, pi R^2), the gap round a port of radius R [m], up to the port itself.

    It is an estimate, and marked so; C_d is the ``coefficient``.
    """
    area = coefficient * math.pi * radius**2
    words = f"{NOT_MEASURED}{coefficient:g} min(2 pi R x, pi R^2), R = {1e3 * radius:g} mm"
    return AreaTable(np.array([0.0, radius / 2]), np.array([0.0, area]), words)


def port_force(radius: float) -> AreaTable:
    """Return pi R^2 at every lift: the area of the port alone, as if the valve stayed shut. An estimate, marked so."""
    words = f"{NOT_MEASURED}pi R^2 at every lift, R = {1e3 * radius:g} mm"
    return AreaTable(np.zeros(1), np.array([math.pi * radius**2]), words)
