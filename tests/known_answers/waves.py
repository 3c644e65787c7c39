"""Impact on rods that the classical tables leave out: other masses, other ends, unequal rods, a soft tip."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import impact
from seatfem.verify import Case

from .compliant import rigid_seat
from .limits import stepped
from .rods import end_of_contact, first_impact

_INTERVALS = "Saint-Venant & Flamant 1883: by intervals of 2 l/c"
_RODS = "Saint-Venant 1867; Goldsmith, Impact: characteristics"
_GRAFF = "Graff, Wave Motion in Elastic Solids, ch. 2"
_MAXWELL = "Maxwell body, closed form"
_STEPS = 200  # per l/c, coarsest of three

# (rod mass/mass, reflection): end of contact c t/l, largest contact stress/(rho c V), velocity at separation/V
_STRUCK = {
    (1 / 6, -1.0): (7.407591891269, 3.468792199798, 0.929680854063),
    (1 / 2, -1.0): (4.708567243668, 2.367879441171, 0.925246996733),
    (2.0, -1.0): (2.504578909722, 2.018315638889, 0.729051693830),
    (1 / 2, -0.5): (4.756965139716, 1.367879441171, 0.335187872557),
}


def wave_cases() -> tuple[Case, ...]:
    """Impact on rods that the classical tables leave out: other masses, other ends, unequal rods, a soft tip.

    Rods with Z = l/c = 1 (E = rho = A = l = 1) unless multiplied.
    """
    struck = tuple(case for key in _STRUCK for case in _struck_rod(*key))
    return (*struck, *_unequal_lengths(), *_unequal_rods(), *_rod_on_wall(), *_soft_tip())


def _rod(**changes: float) -> dict[str, float]:
    return {"young": 1.0, "density": 1.0, "area": 1.0, "length": 1.0, **changes}


def _struck_rod(alpha: float, reflection: float) -> tuple[Case, ...]:
    end, stress, rebound = _STRUCK[alpha, reflection]
    """A wave a leaves the contact: its end moves with a(t) + R a(t - T), pressed by Z (a(t) - R a(t - T))."""
    held = "fixed rod" if reflection == -1.0 else "rod on a dashpot of 3 Z"
    name = f"rigid mass on a {held}, rod mass/mass = {alpha:.3g}"

    def strike(area: float, length: float, steps: int) -> impact.ImpactResult:
        impedance = math.inf if reflection == -1.0 else (1 - reflection) / (1 + reflection)
        rod = impact.rod_with_end_impedance(**_rod(area=area, length=length), end_impedance=impedance)
        problem = impact.ContactProblem(impact.rigid_mass(mass=1 / alpha, velocity=-1.0), impact.Body(rod))
        return impact.solve(problem, dt=1 / steps, duration=8.0)

    def duration(length: float, steps: int) -> float:
        return end_of_contact(strike(1.0, length, steps))

    def peak(area: float, steps: int) -> float:
        result = strike(area, 1.0, steps)
        return float(np.max(result.force[first_impact(result)]))

    def velocity(area: float, steps: int) -> float:
        result = strike(area, 1.0, steps)
        return float(np.sum(result.force[first_impact(result)])) * result.dt * alpha - 1.0

    def case(quantity: str, exact: float, solve: Callable[[float, int], float], order: int | None = None) -> Case:
        return Case(name, quantity, exact, 1e-6, _INTERVALS, stepped(solve, _STEPS, order))

    return (
        case("end of contact, c t/l", end, duration),
        case("largest contact stress/(rho c V)", stress, peak, 1),
        case("rebound velocity at separation/V", rebound, velocity),
    )


def _collide(striker: impact.GreensFunction, target: impact.GreensFunction) -> impact.ImpactResult:
    """Run an impact of two rods; reflections fall on steps, so that the march is exact."""
    problem = impact.ContactProblem(impact.Body(striker, velocity=-1.0), impact.Body(target))
    return impact.solve(problem, dt=1 / _STEPS, duration=6.0)


def _unequal_lengths() -> tuple[Case, Case]:
    """Return the cases of a short rod on one twice as long: at rest and free of stress after its own round trip."""
    name = "rods of length 1 and 2, equal section"

    def run(length: float) -> impact.ImpactResult:
        return _collide(impact.free_rod(**_rod(length=length)), impact.free_rod(**_rod(length=2.0)))

    def duration(length: float) -> float:
        """Return the time until the force falls to half of Z V/2: the impulse over this force."""
        return impact.measures.impulse(run(length)) / 0.5

    return (
        Case(name, "restitution", 0.5, 1e-9, _RODS, lambda k: impact.measures.restitution(run(k))),
        Case(name, "impulse/(Z V/2), c t/l_1", 2.0, 1e-9, _RODS, duration),
    )


def _unequal_rods() -> tuple[Case, Case]:
    """Return the cases of impedance 1 on 3, the target's round trip half as long: forces 3/4, then 3/8, then open."""
    name = "rods of impedance 1 and 3, length 1 and 1/2"

    def run(area: float) -> impact.ImpactResult:
        return _collide(impact.free_rod(**_rod()), impact.free_rod(**_rod(area=area, length=0.5)))

    def second(k: float) -> float:
        return float(run(3.0 * k).force[3 * _STEPS // 2])

    return (
        Case(name, "N/(Z_1 V) after the first reflection", 0.375, 1e-9, _RODS, second),
        Case(name, "restitution", 0.875, 1e-9, _RODS, lambda k: impact.measures.restitution(run(3.0 * k))),
    )


def _rod_on_wall() -> tuple[Case, Case]:
    """Return the cases of a rod on a wall: the whole rod turns round after one round trip."""
    name = "free rod on a rigid wall"

    def run(length: float) -> impact.ImpactResult:
        return _collide(impact.free_rod(**_rod(length=length)), rigid_seat())

    def duration(k: float) -> float:
        start, end = impact.measures.contact_intervals(run(k))[0]
        return float(end - start)

    def stress(k: float) -> float:
        return impact.measures.peak_force(_collide(impact.free_rod(**_rod(young=k)), rigid_seat()))

    return (
        Case(name, "contact time, c t/l", 2.0, 1e-9, _GRAFF, duration),
        Case(name, "contact stress/(rho c V)", 1.0, 1e-9, _GRAFF, stress),
    )


def _soft_tip() -> tuple[Case, Case]:
    """Return the cases of a mass, linear contact spring, semi-infinite rod: N'' + (k/Z) N' + (k/M) N = 0, a damped
    half-cycle."""
    zeta = 0.2  # (k M)^(1/2)/(2 Z)
    root = math.sqrt(1 - zeta**2)
    name = "mass with a spring tip on a semi-infinite rod, damping ratio 0.2"

    def run(area: float, steps: int, rule: str = "auto") -> impact.ImpactResult:
        rod = impact.semi_infinite_rod(young=1.0, density=1.0, area=area / (2 * zeta))
        mass = impact.rigid_mass(mass=1.0, velocity=-1.0)
        problem = impact.ContactProblem(mass, impact.Body(rod), law=impact.LinearSpring(stiffness=1.0))
        return impact.solve(problem, dt=1 / steps, duration=4.0, rule=rule)

    def rebound(area: float, steps: int) -> float:
        return impact.measures.impulse(run(area, steps)) - 1.0

    def peak(area: float, steps: int) -> float:
        return impact.measures.peak_force(run(area, steps, "passive"))

    restitution = math.exp(-math.pi * zeta / root)
    largest = math.exp(-zeta / root * math.acos(zeta))
    return (
        Case(name, "restitution", restitution, 1e-6, _MAXWELL, stepped(rebound, 800, 2)),
        Case(name, "N/(V (k M)^(1/2)), largest", largest, 1e-6, _MAXWELL, stepped(peak, 800, 1)),
    )
