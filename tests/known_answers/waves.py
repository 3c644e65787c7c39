"""Impact on rods that the classical tables leave out: other masses, other ends, unequal rods, a soft tip."""

from __future__ import annotations

import math
from collections.abc import Callable

import impact
from seatfem.verify import Case

from .compliant import rigid_seat
from .limits import stepped
from .rods import STEPS, STRUCK, collide, struck_rod, unit_rod

_RODS = "Saint-Venant 1867; Goldsmith, Impact: characteristics"
_GRAFF = "Graff, Wave Motion in Elastic Solids, ch. 2"
_MAXWELL = "Maxwell body, closed form"


def wave_cases() -> tuple[Case, ...]:
    """Impact on rods that the classical tables leave out: other masses, other ends, unequal rods, a soft tip.

    Rods with Z = l/c = 1 (E = rho = A = l = 1) unless multiplied.
    """
    struck = (case for key, values in STRUCK.items() if len(values) == 3 for case in struck_rod(*key))
    return (*struck, *_unequal_lengths(), *_unequal_rods(), *_rod_on_wall(), *_soft_tip())


def _unequal_lengths() -> tuple[Case, Case]:
    """Return the cases of a short rod on one twice as long: at rest and free of stress after its own round trip."""
    name = "rods of length 1 and 2, equal section"

    def run(length: float) -> impact.ImpactResult:
        return collide(impact.free_rod(**unit_rod(length=length)), impact.free_rod(**unit_rod(length=2.0)))

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
        return collide(impact.free_rod(**unit_rod()), impact.free_rod(**unit_rod(area=area, length=0.5)))

    second = "N/(Z_1 V) after the first reflection"
    return (
        Case(name, second, 0.375, 1e-9, _RODS, lambda k: float(run(3.0 * k).force[3 * STEPS // 2])),
        Case(name, "restitution", 0.875, 1e-9, _RODS, lambda k: impact.measures.restitution(run(3.0 * k))),
    )


def _rod_on_wall() -> tuple[Case, Case]:
    """Return the cases of a rod on a wall: the whole rod turns round after one round trip."""
    name = "free rod on a rigid wall"

    def run(length: float) -> impact.ImpactResult:
        return collide(impact.free_rod(**unit_rod(length=length)), rigid_seat())

    def duration(k: float) -> float:
        start, end = impact.measures.contact_intervals(run(k))[0]
        return float(end - start)

    def stress(k: float) -> float:
        return impact.measures.peak_force(collide(impact.free_rod(**unit_rod(young=k)), rigid_seat()))

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

    def case(quantity: str, exact: float, order: int, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-6, _MAXWELL, stepped(solve, 800, order))

    rebound, largest = math.exp(-math.pi * zeta / root), math.exp(-zeta / root * math.acos(zeta))
    peak = impact.measures.peak_force
    return (
        case("restitution", rebound, 2, lambda k, n: impact.measures.impulse(run(k, n)) - 1.0),
        case("N/(V (k M)^(1/2)), largest", largest, 1, lambda k, n: peak(run(k, n, "passive"))),
    )
