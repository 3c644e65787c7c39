"""Two bars in line: what the joint of their faces throws back, and what it passes on."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq

import impact
from impact.greens.base import Array
from seatfem.verify import Estimate

STEP: Final = 0.1  # us
LASTS: Final = 240.0  # us
EARLY, LATE = 70.0, 100.0
"""Times before which the joint closes, and after which it opens [us]."""
EXPONENT: Final = 2.0  # of machined faces
STIFFNESSES: Final = (1e-2, 1.0)
"""Between which that of a joint is looked for, force in volts, closure in volts times us."""
Law = Callable[[float], impact.Law]


@dataclass(frozen=True)
class Seen:
    """What the gauges see of a joint: times [us] from the half height of the front on, strains [V].

    Attributes:
        blips: height of the strain that comes back while the joint closes, and while it opens.
        values: by the names of the set.
    """

    blips: tuple[float, float]
    values: Mapping[str, float]


def predict(record: Any) -> Mapping[str, Estimate]:
    """Return what is predicted, in volts and us, bars of the calculation and of both fits.

    Bars: what half the step changes, and each fitted height at the end of its interval, summed as squares.
    """
    coming = incident(record.data)
    heights = [(record.fitted[name]["value"], record.fitted[name]["uncertainty"]) for name in ("closure", "recovery")]
    own = _fitted(coming, heights[0][0], heights[1][0])
    others = [
        _fitted(coming, heights[0][0], heights[1][0], STEP / 2),
        _fitted(coming, heights[0][0] + heights[0][1], heights[1][0]),
        _fitted(coming, heights[0][0], heights[1][0] + heights[1][1]),
    ]
    return {
        name: Estimate(value, math.sqrt(sum((other[name] - value) ** 2 for other in others)))
        for name, value in own.items()
    }


def incident(data: Mapping[str, Any]) -> impact.IncomingWave:
    """Return the pulse in a bar of unit modulus, density and area, whose speed and impedance are 1."""
    pulse = data["incident"]
    time, strain = np.array(pulse["time_us"], dtype=float), np.array(pulse["strain_V"], dtype=float)
    return impact.IncomingWave(impact.TimeSeries(time, -strain, "zero", "incident"), 1.0)


def look(coming: impact.IncomingWave, law: impact.Law, step: float = STEP) -> Seen:
    """Return what is seen of the pulse behind a joint of this law: force passed on, and what comes back."""
    bar = impact.semi_infinite_rod(young=1.0, density=1.0, area=1.0)
    first = impact.Body(bar, base=coming.outwards)
    result = impact.solve(impact.ContactProblem(impact.Body(bar), first, law=law), dt=step, duration=LASTS)
    time, passed = result.time - step / 2, result.force
    back = passed + coming.arriving(time)
    early, late = time < EARLY, time > LATE
    plateau = float(np.median(passed[(time > 45) & (time < 110)]))
    rise = {share: _crossing(time, passed, share * plateau) for share in (0.1, 0.5, 0.9)}
    fall = {share: _crossing(-time[::-1], passed[::-1], share * plateau) for share in (0.1, 0.5, 0.9)}
    values = {
        "area of the first blip": float(np.minimum(back[early], 0).sum()) * step,
        "area of the second blip": float(np.maximum(back[late], 0).sum()) * step,
        "area of all that comes back": float(back.sum()) * step,
        "width of what is passed on, at half height": -fall[0.5] - rise[0.5],
        "from a tenth to nine tenths of its front": rise[0.9] - rise[0.1],
        "first blip, from half of the front on": float(time[early][back[early].argmin()]) - rise[0.5],
        "second blip, from half of the front on": float(time[late][back[late].argmax()]) - rise[0.5],
        "from nine tenths to a tenth of its end": fall[0.9] - fall[0.1],
    }
    return Seen((float(back[early].min()), float(back[late].max())), values)


def stiffness_for(coming: impact.IncomingWave, law: Law, height: float, step: float = STEP) -> float:
    """Return the stiffness at which a law throws back a blip of this height while it closes."""

    def off(exponent: float) -> float:
        return look(coming, law(math.exp(exponent)), step).blips[0] - height

    return math.exp(brentq(off, *map(math.log, STIFFNESSES), xtol=1e-6))


def _fitted(coming: impact.IncomingWave, closing: float, opening: float, step: float = STEP) -> dict[str, float]:
    """Return all values of the joint that has both blips; the first one does not know of the recovery."""
    stiffness = stiffness_for(coming, lambda k: impact.RoughJoint(k, EXPONENT), closing, step)

    def off(recovery: float) -> float:
        return look(coming, impact.RoughJoint(stiffness, EXPONENT, recovery), step).blips[1] - opening

    recovery = brentq(off, 0.05, 1.0, xtol=1e-6)
    seen = look(coming, impact.RoughJoint(stiffness, EXPONENT, recovery), step)
    plateau = 0.64  # V
    return {**seen.values, "closure": (plateau / stiffness) ** (1 / EXPONENT), "recovery": recovery}


def _crossing(time: Array, values: Array, level: float) -> float:
    """Return when a course first rises through a level."""
    k = int(np.argmax(values >= level))
    return float(time[k - 1] + (level - values[k - 1]) / (values[k] - values[k - 1]) * (time[k] - time[k - 1]))
