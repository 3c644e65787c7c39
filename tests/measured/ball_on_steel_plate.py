"""A steel ball on a steel plate: the march of a mass with the Hertz law on an infinite plate."""

import math
from collections.abc import Mapping

import impact
from impact import measures
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

STEPS = 500
"""Steps in the unit of time of the Hertz contact, of which it lasts three."""


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return the contact time [us]: the mean of the slowest and the fastest ball, with half of their difference."""
    slow, fast = (1e6 * contact_time(record, parse_quantity(speed, "velocity")) for speed in record.geometry["speeds"])
    return {"contact time": Estimate((slow + fast) / 2, abs(slow - fast) / 2)}


def contact_time(record: MeasuredSet, speed: float) -> float:
    """Return the duration [s] of the first contact at a speed [m/s]."""
    geometry = record.geometry
    radius = parse_quantity(geometry["diameter"], "length") / 2
    young, density = parse_quantity(geometry["young"], "pressure"), parse_quantity(geometry["density"], "density")
    poisson, thickness = geometry["poisson"], parse_quantity(geometry["thickness"], "length")
    mass = density * 4 / 3 * math.pi * radius**3
    stiffness = 4 / 3 * young / (2 * (1 - poisson**2)) * math.sqrt(radius)
    time = (mass**2 / (stiffness**2 * speed)) ** 0.2
    plate = impact.infinite_plate(young=young, poisson=poisson, density=density, thickness=thickness)
    ball = impact.rigid_mass(mass=mass, velocity=-speed)
    problem = impact.ContactProblem(ball, impact.Body(plate), law=impact.Hertz(stiffness=stiffness))
    start, end = measures.contact_intervals(impact.solve(problem, dt=time / STEPS, duration=6 * time))[0]
    return float(end - start)
