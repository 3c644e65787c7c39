"""A struck pipe as a free rod: the times at which its struck end moves on."""

from collections.abc import Mapping

import numpy as np

import impact
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

TRIPS = 7
SAMPLES = 200_000
END = 20e-3
"""Samples of the response of the struck end, and its length [s]."""


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return the time of seven round trips [ms]: the mean over the range of moduli, with half of the range."""
    slow, fast = (1e3 * _trips(record, parse_quantity(young, "pressure")) for young in record.geometry["young"])
    return {"seven round trips": Estimate((slow + fast) / 2, abs(slow - fast) / 2)}


def _trips(record: MeasuredSet, young: float) -> float:
    """Return when the struck end of a rod that got a unit impulse jumps for the seventh time [s]."""
    geometry = record.geometry
    rod = impact.free_rod(
        young=young,
        density=parse_quantity(geometry["density"], "density"),
        area=parse_quantity(geometry["area"], "area"),
        length=parse_quantity(geometry["length"], "length"),
    )
    time = np.linspace(0.0, END, SAMPLES)
    jumps = np.flatnonzero(np.diff(rod.impulse_response(time)) > 0)
    return float(time[jumps[TRIPS - 1]])
