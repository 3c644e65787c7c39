"""Impact on rods: waves in one dimension, exact."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import impact
from impact.after.rods import rod_stress
from impact.exact.closed_form import ExactRod
from impact.greens.base import Array
from seatfem.verify import Case, Estimate

from .limits import stepped

_GOODIER = "Timoshenko & Goodier, Theory of Elasticity: longitudinal impact of bars"
_WAVES = "d'Alembert's waves"
_INTERVALS = "Saint-Venant & Flamant 1883: by intervals of 2 l/c"
STEPS = 200  # per l/c, coarsest of three

# (rod mass/mass, reflection): end of contact c t/l, largest contact stress/(rho c V), velocity at separation/V, and of
# the rods of Timoshenko and Goodier the largest stress at the fixed end/(rho c V)
STRUCK: dict[tuple[float, float], tuple[float, ...]] = {
    (1.0, -1.0): (3.067667642, 2.135335283, 0.68761894, 2.270670566),
    (0.25, -1.0): (5.89959044, 2.974410101, 0.816911552, 3.213061319),
    (1 / 6, -1.0): (7.407591891269, 3.468792199798, 0.929680854063),
    (1 / 2, -1.0): (4.708567243668, 2.367879441171, 0.925246996733),
    (2.0, -1.0): (2.504578909722, 2.018315638889, 0.729051693830),
    (1 / 2, -0.5): (4.756965139716, 1.367879441171, 0.335187872557),
}


def rod_cases() -> tuple[Case, ...]:
    """Impact on rods: waves in one dimension, exact."""
    fixed = (case for key, values in STRUCK.items() if len(values) == 4 for case in struck_rod(*key))
    return (*fixed, *_without_return(), *_between_rods())


def unit_rod(**changes: float) -> dict[str, float]:
    """Return a rod with Z = l/c = 1 (E = rho = A = l = 1) but for the changes."""
    return {"young": 1.0, "density": 1.0, "area": 1.0, "length": 1.0, **changes}


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


def struck_rod(alpha: float, reflection: float) -> tuple[Case, ...]:
    """Return the cases of a rigid mass on a rod, fixed or on a dashpot.

    A wave a leaves the contact: its end moves with a(t) + R a(t - T), pressed by Z (a(t) - R a(t - T)).
    """
    end, stress, rebound, *fixed_end = STRUCK[alpha, reflection]
    held = "fixed rod" if reflection == -1.0 else "rod on a dashpot of 3 Z"
    name, source = f"rigid mass on a {held}, rod mass/mass = {alpha:.3g}", _GOODIER if fixed_end else _INTERVALS

    def strike(area: float, length: float, steps: int) -> tuple[impact.ImpactResult, ExactRod]:
        impedance = math.inf if reflection == -1.0 else (1 - reflection) / (1 + reflection)
        rod = impact.rod_with_end_impedance(**unit_rod(area=area, length=length), end_impedance=impedance)
        problem = impact.ContactProblem(impact.rigid_mass(mass=1 / alpha, velocity=-1.0), impact.Body(rod))
        return impact.solve(problem, dt=1 / steps, duration=6.5 if fixed_end else 8.0), rod

    def peak(area: float, steps: int) -> float:
        result, _ = strike(area, 1.0, steps)
        return float(np.max(result.force[first_impact(result)]))

    def at_the_fixed_end(area: float, steps: int) -> float:
        result, rod = strike(area, 1.0, steps)
        return float(np.max(rod_stress(result, rod, area=1.0)[: first_impact(result).stop]))

    def velocity(area: float, steps: int) -> float:
        result, _ = strike(area, 1.0, steps)
        return float(np.sum(result.force[first_impact(result)])) * result.dt * alpha - 1.0

    def case(quantity: str, exact: float, solve: Callable[[float, int], float], order: int | None = None) -> Case:
        return Case(name, quantity, exact, 1e-6, source, stepped(solve, STEPS, order))

    return (
        case("end of contact, c t/l", end, lambda k, n: end_of_contact(strike(1.0, k, n)[0])),
        case("largest contact stress/(rho c V)", stress, peak, 1),
        *(case("largest stress at the fixed end/(rho c V)", value, at_the_fixed_end, 1) for value in fixed_end),
        case("rebound velocity at separation/V", rebound, velocity),
    )


def _without_return() -> tuple[Case, Case]:
    half = 0.5
    exact = (1 - math.exp(-2 * half)) / half - math.exp(-2 * half)

    def restitution(mass: float, steps: int) -> float:
        striker = impact.rigid_mass(mass=mass / half, velocity=-1.0)
        problem = impact.ContactProblem(striker, impact.Body(impact.free_rod(**unit_rod())))
        return impact.measures.restitution(impact.solve(problem, dt=1 / steps, duration=2.5))

    def decay(mass: float, steps: int) -> float:
        """Return the decay of the force, which at a step's end is the mean of its neighbours: second order."""
        rod = impact.semi_infinite_rod(young=1.0, density=1.0, area=1.0)
        problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=-1.0), impact.Body(rod))
        result = impact.solve(problem, dt=1 / steps, duration=1.5)
        return float(result.force[steps] + result.force[steps + 1]) / 2

    def case(name: str, quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-9, _WAVES, stepped(solve, STEPS, 2))

    name = "rigid mass on a free rod, rod mass/mass = 0.5"
    return (
        case(name, "restitution of the mass centres", exact, restitution),
        case("rigid mass M on a semi-infinite rod", "N/(Z V) at Z t/M = 1", math.exp(-1.0), decay),
    )


def collide(striker: impact.GreensFunction, target: impact.GreensFunction) -> impact.ImpactResult:
    """Run an impact of two rods; reflections fall on steps, so that the march is exact."""
    problem = impact.ContactProblem(impact.Body(striker, velocity=-1.0), impact.Body(target))
    return impact.solve(problem, dt=1 / STEPS, duration=6.0)


def _between_rods() -> tuple[Case, Case, Case]:
    def duration(length: float) -> float:
        rod = impact.free_rod(**unit_rod(length=length))
        start, end = impact.measures.contact_intervals(collide(rod, rod))[0]
        return float(end - start)

    def restitution(length: float) -> float:
        """Return the restitution of two rods; the factor is on the length of one of them."""
        one, other = (impact.free_rod(**unit_rod(length=each)) for each in (1.0, length))
        return impact.measures.restitution(collide(one, other))

    def early(young: float) -> Estimate:
        three = impact.semi_infinite_rod(young=3.0 * young, density=3.0, area=1.0)
        force: Array = collide(impact.free_rod(**unit_rod()), three).force[1:STEPS]
        return Estimate(float(force[-1]), float(np.ptp(force)))

    return (
        Case("identical rods", "contact time, c t/l", 2.0, 1e-9, "Saint-Venant 1867", duration),
        Case("identical rods", "restitution", 1.0, 1e-9, "Saint-Venant 1867", restitution),
        Case("rods of impedance 1 and 3 before any reflection", "N/V", 0.75, 1e-9, _WAVES, early),
    )
