"""Spheres on rigid and on plate-like seats: the Hertz law, with and without radiation; several contacts at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import impact
from impact.exact.contact_stress import HertzContact, hertz_circular, hertz_stiffness, reduced_modulus
from impact.greens.modal import ModalGreens, Residual
from seatfem.verify import Case

from .limits import stepped

_YOUNG, _POISSON, _DENSITY = 200e9, 0.3, 7850.0
_RADIUS, VELOCITY = 5e-3, 1.0
MASS = _DENSITY * 4 / 3 * math.pi * _RADIUS**3
_STIFFNESS = 4 / 3 * _YOUNG / (2 * (1 - _POISSON**2)) * math.sqrt(_RADIUS)  # steel on steel
_TIME = float((MASS**2 / (_STIFFNESS**2 * VELOCITY)) ** 0.2)
_STEPS = 400  # per _TIME, coarsest of three
_HERTZ = "Hertz 1882; Johnson, Contact Mechanics, 11.4"
_ZENER = "Zener, Phys. Rev. 59 (1941) 669"

# of s'' + (1 + lambda d/dtau) s^1.5 = 0, lambda: restitution, duration/_TIME, largest approach/(_TIME V)
_PLATE = {
    0.0: (1.0, 3.2180655, 1.0933621),
    0.1: (0.84333941, 3.278495, 1.0235591),
    0.3: (0.60594666, 3.429108, 0.9117338),
    0.5: (0.4368953, 3.6244415, 0.8256516),
}
_CLEARANCE = "Den Hartog, Mechanical Vibrations: oscillator with clearance"
_CLAPEYRON = "Clapeyron's three moments: two equal spans, one end built in"


def compliant_cases() -> tuple[Case, ...]:
    """Spheres on rigid and on plate-like seats: the Hertz law, with and without radiation."""
    return (*_hertz(), *(case for inelasticity in _PLATE for case in _zener(inelasticity)))


def _hertz() -> tuple[Case, ...]:
    name = "steel sphere, 5 mm radius, 1 m/s, on a rigid seat"

    def case(quantity: str, exact: float, measure: Callable[[impact.ImpactResult], float]) -> Case:
        def solve(stiffness_factor: float, steps: int) -> float:
            return measure(strike(rigid_seat(), stiffness_factor, 1.0, steps))

        return Case(name, quantity, exact, 1e-6, _HERTZ, stepped(solve, _STEPS, 1))

    def contact(result: impact.ImpactResult) -> HertzContact:
        """Return the contact of Hertz under the largest force."""
        return _contact(impact.measures.peak_force(result))

    return (
        case("contact duration [s]", 3.52362147e-05, _duration),
        case("largest force [N]", 429.160669, impact.measures.peak_force),
        case("largest penetration [m]", 1.19717704e-05, _penetration),
        case("largest contact radius [m]", 0.000244660687, lambda result: contact(result).half_width),
        case("largest pressure [Pa]", 3423205080.0, lambda result: contact(result).pressure),
        Case(name, "mass [kg]", 0.00411025039, 1e-8, _HERTZ, lambda k: _sphere(k * _DENSITY).mass),
        Case(name, "k of N = k d^(3/2) [N/m^(3/2)]", 10360538900.0, 1e-8, _HERTZ, lambda k: _law(k).stiffness),
        *_hertz_constants(),
    )


def _hertz_constants() -> tuple[Case, ...]:
    """Return the cases of duration and largest force; the factor is on the velocity, k or the mass's scale."""
    name = "sphere on a rigid seat, constants of Hertz"

    def case(quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-6, _HERTZ, stepped(solve, _STEPS, 1))

    def by_approach(velocity_factor: float, steps: int) -> float:
        result = strike(rigid_seat(), 1.0, velocity_factor, steps)
        return _duration(result) * VELOCITY / _penetration(result)

    def force(velocity_factor: float, steps: int) -> float:
        peak = impact.measures.peak_force(strike(rigid_seat(), 1.0, velocity_factor, steps))
        return float(peak / (_STIFFNESS**0.4 * MASS**0.6 * VELOCITY**1.2))

    by_stiffness = "duration (k^2 V/m^2)^(1/5)"
    return (
        case("duration V/largest penetration", 2.9432751843, by_approach),
        case(by_stiffness, 3.2180654597, lambda k, n: _duration(strike(rigid_seat(), k, 1.0, n)) / _TIME),
        case("largest force/(k^(2/5) m^(3/5) V^(6/5))", 1.1432626298, force),
    )


def _zener(inelasticity: float) -> tuple[Case, Case, Case]:
    restitution, duration, approach = _PLATE[inelasticity]
    name = f"sphere on an infinite plate, lambda = {inelasticity:g}"

    def case(quantity: str, exact: float, solve: Callable[[float, int], float]) -> Case:
        return Case(name, quantity, exact, 1e-6, _ZENER, stepped(solve, _STEPS, 1))

    def rebound(factor: float, steps: int) -> float:
        """Return the rebound; the factor is on lambda, for a rigid seat on the velocity."""
        share, speed = (factor, 1.0) if inelasticity else (1.0, factor)
        result = strike(plate_seat(inelasticity * share), 1.0, speed, steps)
        return impact.measures.impulse(result) / (MASS * VELOCITY) - speed

    def struck(stiffness_factor: float, steps: int) -> impact.ImpactResult:
        return strike(plate_seat(inelasticity), stiffness_factor, 1.0, steps)

    return (
        case("rebound velocity/V", restitution, rebound),
        case("contact duration (k^2 V/m^2)^(1/5)", duration, lambda k, n: _duration(struck(k, n)) / _TIME),
        case(
            "largest approach (k^2/(m^2 V^4))^(1/5)",
            approach,
            lambda k, n: _penetration(struck(k, n)) / (_TIME * VELOCITY),
        ),
    )


def rigid_seat() -> ModalGreens:
    """Return a Green's function that is zero."""
    return ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.none())


def plate_seat(inelasticity: float) -> ModalGreens:
    """Return the infinite plate of impedance m/(lambda time), from its thickness: Z = 8 h^2 sqrt(E rho/(12 (1 -
    nu^2)))."""
    if inelasticity == 0:
        return rigid_seat()
    impedance = MASS / (inelasticity * _TIME)
    thickness = math.sqrt(impedance / 8) * (12 * (1 - _POISSON**2) / (_YOUNG * _DENSITY)) ** 0.25
    return impact.infinite_plate(young=_YOUNG, poisson=_POISSON, density=_DENSITY, thickness=thickness)


def _sphere(density: float) -> impact.Body:
    return impact.rigid_mass(mass=density * 4 / 3 * math.pi * _RADIUS**3, velocity=-VELOCITY)


def _law(young_factor: float) -> impact.Hertz:
    modulus = reduced_modulus(
        young=_YOUNG * young_factor, poisson=_POISSON, young_2=_YOUNG * young_factor, poisson_2=_POISSON
    )
    return impact.Hertz(stiffness=hertz_stiffness(reduced_modulus=modulus, radius=_RADIUS))


def _contact(force: float) -> HertzContact:
    return hertz_circular(force=force, reduced_modulus=_YOUNG / (2 * (1 - _POISSON**2)), radius=_RADIUS)


def strike(
    seat: ModalGreens, stiffness_factor: float, velocity_factor: float, steps: int, rule: str = "passive"
) -> impact.ImpactResult:
    """Run the impact of the sphere on a seat, ``steps`` to the unit of time."""
    striker = impact.rigid_mass(mass=MASS, velocity=-VELOCITY * velocity_factor)
    law = impact.Hertz(stiffness=_STIFFNESS * stiffness_factor)
    problem = impact.ContactProblem(striker, impact.Body(seat), law=law)
    return impact.solve(problem, dt=_TIME / steps, duration=4.5 * _TIME, rule=rule)


def _duration(result: impact.ImpactResult) -> float:
    """Return the time until the gap opens, linear between two records: second order, as it opens with a velocity."""
    gap = result.gap
    m = int(np.flatnonzero((gap[1:] > 0) & (gap[:-1] <= 0))[-1])
    return float(result.time[m]) - result.dt * float(gap[m]) / float(gap[m + 1] - gap[m])


def _penetration(result: impact.ImpactResult) -> float:
    return float(-np.min(result.gap))


def several_cases() -> tuple[Case, ...]:
    """Several contacts at once: a stop on either side, a reed on two supports."""
    return (_between_stops(), *_two_supports())


def _between_stops() -> Case:
    """Return the case of a mass between a seat and a stopper, clearance 2 d: period 2 pi/w + 4 d/V, m = k = V = d =
    1."""

    def period(stiffness: float, steps: int) -> float:
        """Return the time from the centre, towards the seat, to the same place; by the conserving rule."""
        contacts = [
            impact.Contact(impact.Body(rigid_seat()), gap=1.0, side=side, law=impact.LinearSpring(stiffness=k))
            for side, k in ((1, 1.0), (-1, stiffness))
        ]
        problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), contacts=contacts)
        result = impact.solve(problem, dt=1 / steps, duration=11.5, rule="conserving")
        place = result.striker_displacement[:, 0]
        m = int(np.flatnonzero((place[1:] <= 0) & (place[:-1] > 0))[-1])
        return float(result.time[m]) + result.dt * float(place[m] / (place[m] - place[m + 1]))

    name, exact = "mass between two springs with clearance", 2 * math.pi + 4
    return Case(name, "period w", exact, 1e-9, _CLEARANCE, stepped(period, _STEPS, 2))


def _two_supports() -> tuple[Case, Case]:
    """Return the cases of pressure q on a cantilever on rigid supports at middle and tip, spans L: 8/7 and 11/28 q
    L."""

    def reactions(load: float) -> tuple[float, float]:
        beam = impact.Cantilever(young=12.0, density=1.0, length=2.0, width=1.0, thickness=1.0)
        reed = impact.reed(beam, contact_at=(1.0, 2.0), loads=(impact.Pressure(lambda t: -load),))
        contacts = [impact.Contact(impact.Body(rigid_seat()), striker_port=port) for port in (0, 1)]
        problem = impact.ContactProblem(reed, contacts=contacts, preload=True)
        middle, tip = impact.solve(problem, dt=1e-3, duration=0.05).force[-1]
        return float(middle), float(tip)

    name = "reed pressed on two supports by a pressure q"
    return (
        Case(name, "N/(q L), middle", 8 / 7, 1e-6, _CLAPEYRON, lambda k: reactions(k)[0]),
        Case(name, "N/(q L), tip", 11 / 28, 1e-6, _CLAPEYRON, lambda k: reactions(k)[1]),
    )
