"""A ball that bounces under gravity: the restitution of one contact by the march, and the flights between contacts."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from scipy.optimize import brentq

import impact
from impact import measures
from seatfem.structures.model import Array
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

SPEEDS = (0.1, 0.4, 1.3)
"""Speeds [m/s] at which the restitution is marched; in between its loss is interpolated."""
SLOWEST = 1e-3
"""Speed [m/s] below which no bounce is counted."""


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return speed, loss and durations. Bars: what the uncertainties of both fitted durations change."""
    fits = [record.fitted[name]["duration_s"] for name in ("speed", "loss")]
    uncertainty = record.predicted[0].uncertainty
    value = _fitted(record, *fits)
    changed = [_fitted(record, fits[0] + uncertainty, fits[1]), _fitted(record, fits[0], fits[1] + uncertainty)]
    bars = np.sqrt(np.sum([(each - value) ** 2 for each in changed], axis=0))
    starts = record.geometry["start_s"]
    names = ["speed", "loss", *(f"ten bounces from {start:g} s" for start in starts)]
    return {name: Estimate(float(value[i]), float(bars[i])) for i, name in enumerate(names)}


def restitution_loss(record: MeasuredSet, impedance_ratio: float, speed: float) -> float:
    """Return 1 - e of one contact by a linear spring on a dashpot, which an infinite plate is to a point.

    ``impedance_ratio`` is that of the dashpot to sqrt(m k) of ball and spring.
    """
    geometry = record.geometry
    radius = parse_quantity(geometry["diameter"], "length") / 2
    young, density = parse_quantity(geometry["young"], "pressure"), parse_quantity(geometry["density"], "density")
    mass, stiffness = density * 4 / 3 * math.pi * radius**3, young * radius * 1e-2
    own = math.sqrt(mass * stiffness)
    thickness = math.sqrt(
        impedance_ratio * own / 8 * math.sqrt(12 * (1 - geometry["poisson"] ** 2) / (young * density))
    )
    plate = impact.infinite_plate(young=young, poisson=geometry["poisson"], density=density, thickness=thickness)
    ball = impact.rigid_mass(mass=mass, velocity=-speed)
    problem = impact.ContactProblem(ball, impact.Body(plate), law=impact.LinearSpring(stiffness=stiffness))
    time = math.sqrt(mass / stiffness)
    result = impact.solve(problem, dt=time / 4000, duration=4 * time)
    return 2.0 - measures.impulse(result) / (mass * speed)


def _fitted(record: MeasuredSet, first: float, later: float) -> Array:
    """Return speed [m/s], loss [%] and all durations [s], fitted to the durations of the two groups."""
    gravity = parse_quantity(record.geometry["gravity"], "acceleration")
    starts = np.array(record.geometry["start_s"]) - record.geometry["start_s"][0]
    group = record.fitted["loss"]["group"]
    bounces = record.geometry["bounces"]

    def times(ratio: float) -> tuple[float, Array]:
        losses = [restitution_loss(record, ratio, speed) for speed in SPEEDS]

        def loss(speed: float) -> float:
            return float(np.interp(speed, SPEEDS, losses))

        def misfit(speed: float) -> float:
            return _durations(_contacts(speed, loss, gravity), starts[:1], bounces)[0] - first

        speed = brentq(misfit, 0.5, 3.0, xtol=1e-9)
        return speed, _durations(_contacts(speed, loss, gravity), starts, bounces)

    ratio = math.exp(
        brentq(lambda x: times(math.exp(x))[1][group] - later, math.log(50.0), math.log(2000.0), xtol=1e-6)
    )
    speed, durations = times(ratio)
    return np.array([speed, 100 * restitution_loss(record, ratio, speed), *durations])


def _contacts(speed: float, loss: Callable[[float], float], gravity: float) -> Array:
    """Return the times [s] of the contacts, the first at 0, after which the ball leaves with ``speed``."""
    times = [0.0]
    while speed > SLOWEST:
        times.append(times[-1] + 2 * speed / gravity)
        speed *= 1 - loss(speed)
    return np.array(times)


def _durations(times: Array, starts: Array, bounces: int) -> Array:
    """Return how long so many bounces last from each start [s]; between contacts their number is interpolated."""
    numbers = np.arange(len(times))
    begun = np.interp(starts, times, numbers)
    return np.asarray(np.interp(begun + bounces, numbers, times) - starts)
