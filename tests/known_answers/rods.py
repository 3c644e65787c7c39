"""Impact on rods: waves in one dimension, exact."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

import impact
from impact.after.rods import rod_stress
from impact.exact.closed_form import ExactRod
from impact.greens.base import Array
from seatfem.verify import Case, Estimate

from .limits import stepped

_GOODIER = "Timoshenko & Goodier, Theory of Elasticity: longitudinal impact of bars"
_WAVES = "d'Alembert's waves"
_YOUNG, _DENSITY, _AREA, _LENGTH = 200e9, 7850.0, 1e-4, 0.1  # a steel rod
_SPEED = math.sqrt(_YOUNG / _DENSITY)
_IMPEDANCE = _AREA * math.sqrt(_YOUNG * _DENSITY)
_MASS = _DENSITY * _AREA * _LENGTH
_TRANSIT = _LENGTH / _SPEED
_STEPS = 200  # per l/c, coarsest of three

# end of contact ct/l, largest contact stress and largest stress at the fixed end over rho c V, velocity at separation/V
_FIXED = {
    1.0: (3.067667642, 2.135335283, 2.270670566, 0.68761894),
    0.25: (5.89959044, 2.974410101, 3.213061319, 0.816911552),
}


def rod_cases() -> tuple[Case, ...]:
    """Impact on rods: waves in one dimension, exact."""
    return (*(case for alpha in _FIXED for case in _on_fixed_rod(alpha)), *_without_return(), *_between_rods())


def first_impact(result: impact.ImpactResult) -> slice:
    """Return the records of the first contact interval."""
    start, end = np.rint(impact.measures.contact_intervals(result)[0] / result.dt).astype(int)
    return slice(int(start) + 1, int(end) + 1)


def end_of_contact(result: impact.ImpactResult) -> float:
    """Return when the falling force reaches zero [s]: a parabola through its last whole steps, second order.

    The force of a step belongs to the step's middle; the last step is left out, as contact ends within it.
    """
    last = first_impact(result).stop - 1
    kept = slice(last - 3, last)
    middle = result.time[kept] - result.dt / 2
    origin = float(middle[-1])
    return origin + float(np.polynomial.Polynomial.fit(result.force[kept], middle - origin, 2)(0.0))


def _on_fixed_rod(alpha: float) -> tuple[Case, ...]:
    end, contact, fixed_end, rebound = _FIXED[alpha]
    name = f"rigid mass on a fixed rod, rod mass/mass = {alpha:g}"

    def case(quantity: str, exact: float, measure: Callable[[float, float, int], float], order: int | None) -> Case:
        return Case(name, quantity, exact, 1e-6, _GOODIER, stepped(partial(measure, alpha), _STEPS, order))

    return (
        case("end of contact, c t/l", end, _end_on_fixed_rod, None),
        case("largest contact stress/(rho c V)", contact, _contact_stress, 1),
        case("largest stress at the fixed end/(rho c V)", fixed_end, _fixed_end_stress, 1),
        case("rebound velocity at separation/V", rebound, _rebound_velocity, None),
    )


def _strike_fixed_rod(alpha: float, area: float, length: float, steps: int) -> tuple[impact.ImpactResult, ExactRod]:
    rod = impact.fixed_rod(young=_YOUNG, density=_DENSITY, area=area, length=length)
    problem = impact.ContactProblem(impact.rigid_mass(mass=_MASS / alpha, velocity=-1.0), impact.Body(rod))
    return impact.solve(problem, dt=_TRANSIT / steps, duration=6.5 * _TRANSIT), rod


def _end_on_fixed_rod(alpha: float, length_factor: float, steps: int) -> float:
    result, _ = _strike_fixed_rod(alpha, _AREA, _LENGTH * length_factor, steps)
    return end_of_contact(result) / _TRANSIT


def _contact_stress(alpha: float, area_factor: float, steps: int) -> float:
    result, _ = _strike_fixed_rod(alpha, _AREA * area_factor, _LENGTH, steps)
    return float(np.max(result.force[first_impact(result)])) / _IMPEDANCE


def _fixed_end_stress(alpha: float, area_factor: float, steps: int) -> float:
    result, rod = _strike_fixed_rod(alpha, _AREA * area_factor, _LENGTH, steps)
    stress = rod_stress(result, rod, area=_AREA)
    return float(np.max(stress[: first_impact(result).stop])) * _AREA / _IMPEDANCE


def _rebound_velocity(alpha: float, area_factor: float, steps: int) -> float:
    result, _ = _strike_fixed_rod(alpha, _AREA * area_factor, _LENGTH, steps)
    return float(np.sum(result.force[first_impact(result)])) * result.dt * alpha / _MASS - 1.0


def _without_return() -> tuple[Case, Case]:
    half = 0.5
    restitution = (1 - math.exp(-2 * half)) / half - math.exp(-2 * half)

    def case(name: str, quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-9, _WAVES, stepped(solve, _STEPS, 2))

    name, solve = "rigid mass on a free rod, rod mass/mass = 0.5", partial(_free_rod_restitution, half)
    return (
        case(name, "restitution of the mass centres", restitution, solve),
        case("rigid mass M on a semi-infinite rod", "N/(Z V) at Z t/M = 1", math.exp(-1.0), _semi_infinite_decay),
    )


def _free_rod_restitution(alpha: float, mass_factor: float, steps: int) -> float:
    rod = impact.free_rod(young=_YOUNG, density=_DENSITY, area=_AREA, length=_LENGTH)
    striker = impact.rigid_mass(mass=_MASS / alpha * mass_factor, velocity=-1.0)
    result = impact.solve(
        impact.ContactProblem(striker, impact.Body(rod)), dt=_TRANSIT / steps, duration=2.5 * _TRANSIT
    )
    return impact.measures.restitution(result)


def _semi_infinite_decay(mass_factor: float, steps: int) -> float:
    """Return the decay of the force, which at a step's end is the mean of its neighbours: second order."""
    rod = impact.semi_infinite_rod(young=_YOUNG, density=_DENSITY, area=_AREA)
    striker = impact.rigid_mass(mass=_MASS * mass_factor, velocity=-1.0)
    time = _MASS / _IMPEDANCE
    result = impact.solve(impact.ContactProblem(striker, impact.Body(rod)), dt=time / steps, duration=1.5 * time)
    return float(result.force[steps] + result.force[steps + 1]) / 2 / _IMPEDANCE


def _between_rods() -> tuple[Case, Case, Case]:
    return (
        Case("identical rods", "contact time, c t/l", 2.0, 1e-9, "Saint-Venant 1867", _identical_rods_duration),
        Case("identical rods", "restitution", 1.0, 1e-9, "Saint-Venant 1867", _identical_rods_restitution),
        Case("rods of impedance 1 and 3 before any reflection", "N/V", 0.75, 1e-9, _WAVES, _two_impedances),
    )


def _collide(striker: impact.GreensFunction, target: impact.GreensFunction, steps: int) -> impact.ImpactResult:
    problem = impact.ContactProblem(impact.Body(striker, velocity=-1.0), impact.Body(target))
    return impact.solve(problem, dt=_TRANSIT / steps, duration=3 * _TRANSIT)


def _identical_rods_duration(length_factor: float) -> float:
    rod = impact.free_rod(young=_YOUNG, density=_DENSITY, area=_AREA, length=_LENGTH * length_factor)
    start, end = impact.measures.contact_intervals(_collide(rod, rod, _STEPS))[0]
    return float(end - start) / _TRANSIT


def _identical_rods_restitution(length_factor: float) -> float:
    """Return the restitution of two rods; the factor is on the length of one of them."""
    first = impact.free_rod(young=_YOUNG, density=_DENSITY, area=_AREA, length=_LENGTH)
    second = impact.free_rod(young=_YOUNG, density=_DENSITY, area=_AREA, length=_LENGTH * length_factor)
    return impact.measures.restitution(_collide(first, second, _STEPS))


def _two_impedances(young_factor: float) -> Estimate:
    one = impact.free_rod(young=1.0, density=1.0, area=1.0, length=1.0)
    three = impact.semi_infinite_rod(young=3.0 * young_factor, density=3.0, area=1.0)
    problem = impact.ContactProblem(impact.Body(one, velocity=-1.0), impact.Body(three))
    force: Array = impact.solve(problem, dt=0.01, duration=1.0).force[1:]
    return Estimate(float(force[-1]), float(np.ptp(force)))
