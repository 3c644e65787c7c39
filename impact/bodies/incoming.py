"""A wave in an endless rod that arrives at its struck end."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from impact.bodies.time_series import TimeSeries, TimeSeriesError
from impact.greens.base import Array

EARLY: Final = 0.01
"""Largest displacement of the end before t = 0 over its maximum, as allowance for the noise of a record."""


@dataclass(frozen=True)
class IncomingWave:
    """A strain wave e(t) that arrives at the free end of an endless rod, initially at rest, and is reflected.

    Without contact the end moves outwards at -2 c e(t), twice the particle velocity, and at a distance x from it the
    strain is e(t + x/c) - e(t - x/c), > 0 in tension. The response to contact forces is superposed on both
    (d'Alembert).

    Attributes:
        strain: e recorded by a gauge at times (n,), > 0 in tension, zero outside the record.
        speed: c [m/s].
        recorded_at: distance of that gauge from the end [m].

    Raises:
        TimeSeriesError: an invalid speed or distance, or a wave that reaches the end before t = 0.
    """

    strain: TimeSeries
    speed: float
    recorded_at: float = 0.0
    _ramp: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (self.speed > 0 and math.isfinite(self.speed) and 0 <= self.recorded_at < math.inf):
            raise TimeSeriesError(
                f"{self.strain.name}: speed = {self.speed:g} m/s must be positive, the gauge's distance from the end, "
                f"{self.recorded_at:g} m, not negative"
            )
        time, value = self.strain.time, self.strain.value
        ramp = np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(time))])
        object.__setattr__(self, "_ramp", ramp)
        if abs(early := self._moved(0.0)) > EARLY * np.abs(ramp).max() * 2 * self.speed:
            raise TimeSeriesError(
                f"{self.strain.name}: by t = 0 the wave has moved the rod's end by {early:.3g} m already: give "
                "times that count from an earlier instant on"
            )

    def arriving(self, time: Array) -> Array:
        """Return e at times (n,) at the end [s]; a jump at the ends of the record counts half."""
        return np.asarray(self.strain(np.asarray(time, dtype=float) - self.recorded_at / self.speed))

    def outwards(self, time: Array) -> Array:
        """Return the (n,) outward displacement of the free end since t = 0 [m], exact for strain that is linear between
        samples."""
        return self._moved(time) - self._moved(0.0)

    def _moved(self, time: ArrayLike) -> Array:
        at = np.asarray(time, dtype=float) - self.recorded_at / self.speed
        known, value = self.strain.time, self.strain.value
        inside = np.clip(at, known[0], known[-1])
        k = np.clip(np.searchsorted(known, inside, side="right") - 1, 0, len(known) - 2)
        since, slope = inside - known[k], (value[k + 1] - value[k]) / (known[k + 1] - known[k])
        return np.asarray(-2 * self.speed * (self._ramp[k] + since * (value[k] + slope * since / 2)))

    def strain_at(self, time: Array, distance: float) -> Array:
        """Return the (n,) strain at a ``distance`` from the end [m] without contact, > 0 in tension."""
        late = distance / self.speed
        return np.asarray(self.arriving(time + late) - self.arriving(time - late))
