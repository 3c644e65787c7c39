"""Spheres on rigid and on plate-like seats: the Hertz law, with and without radiation."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

import impact
from impact.modal import ModalGreens, Residual
from seatfem.verification.case import Case, Estimate, richardson

_YOUNG, _POISSON, _DENSITY = 200e9, 0.3, 7850.0
_RADIUS, _VELOCITY = 5e-3, 1.0
_MASS = _DENSITY * 4 / 3 * math.pi * _RADIUS**3
_STIFFNESS = 4 / 3 * _YOUNG / (2 * (1 - _POISSON**2)) * math.sqrt(_RADIUS)  # steel on steel
_TIME = float((_MASS**2 / (_STIFFNESS**2 * _VELOCITY)) ** 0.2)
_STEPS = 400  # per _TIME, coarsest of three
_HERTZ = "Hertz 1882; Johnson, Contact Mechanics, 11.4"
_ZENER = "Zener, Phys. Rev. 59 (1941) 669"

# lambda: restitution, duration in units of _TIME, of s'' + (1 + lambda d/dtau) s^1.5 = 0
_PLATE = {
    0.0: (1.0, 3.2180655),
    0.1: (0.84333941, 3.278495),
    0.3: (0.60594666, 3.429108),
    0.5: (0.4368953, 3.6244415),
}


def compliant_cases() -> tuple[Case, ...]:
    """Sphere on a rigid seat, and on infinite plates from rigid (lambda = 0) to yielding."""
    return (*_hertz(), *(case for inelasticity in _PLATE for case in _zener(inelasticity)))


def _hertz() -> tuple[Case, ...]:
    name = "steel sphere, 5 mm radius, 1 m/s, on a rigid seat"

    def case(quantity: str, exact: float, measure: Callable[[impact.ImpactResult], float]) -> Case:
        def compute(coefficient: float) -> Estimate:
            return richardson(lambda steps: measure(_strike(rigid_seat(), coefficient, 1.0, steps)), _STEPS, 1)

        return Case(name, quantity, exact, 1e-6, _HERTZ, compute)

    return (
        case("contact duration [s]", 3.52362147e-05, _duration),
        case("largest force [N]", 429.160669, impact.measures.peak_force),
        case("largest penetration [m]", 1.19717704e-05, _penetration),
    )


def _zener(inelasticity: float) -> tuple[Case, Case]:
    restitution, duration = _PLATE[inelasticity]
    rebound = _plate_rebound if inelasticity else _rigid_rebound
    name = f"sphere on an infinite plate, lambda = {inelasticity:g}"
    return (
        Case(
            name,
            "rebound velocity/V",
            restitution,
            1e-6,
            _ZENER,
            lambda k: richardson(partial(rebound, inelasticity, k), _STEPS, 1),
        ),
        Case(
            name,
            "contact duration (k^2 V/m^2)^(1/5)",
            duration,
            1e-6,
            _ZENER,
            lambda k: richardson(partial(_plate_duration, inelasticity, k), _STEPS, 1),
        ),
    )


def rigid_seat() -> ModalGreens:
    """A Green's function that is zero."""
    return ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.none())


def plate_seat(inelasticity: float) -> ModalGreens:
    """Infinite plate of impedance m/(lambda time), by its thickness: Z = 8 h^2 sqrt(E rho/(12 (1 - nu^2)))."""
    if inelasticity == 0:
        return rigid_seat()
    impedance = _MASS / (inelasticity * _TIME)
    thickness = math.sqrt(impedance / 8) * (12 * (1 - _POISSON**2) / (_YOUNG * _DENSITY)) ** 0.25
    return impact.infinite_plate(young=_YOUNG, poisson=_POISSON, density=_DENSITY, thickness=thickness)


def _strike(seat: ModalGreens, stiffness_factor: float, velocity_factor: float, steps: int) -> impact.ImpactResult:
    striker = impact.rigid_mass(mass=_MASS, velocity=-_VELOCITY * velocity_factor)
    law = impact.Hertz(stiffness=_STIFFNESS * stiffness_factor)
    problem = impact.ContactProblem(striker, impact.Body(seat), law=law)
    return impact.solve(problem, dt=_TIME / steps, duration=4.5 * _TIME)


def _plate_rebound(inelasticity: float, factor: float, steps: int) -> float:
    """The factor is on lambda."""
    result = _strike(plate_seat(inelasticity * factor), 1.0, 1.0, steps)
    return impact.measures.impulse(result) / (_MASS * _VELOCITY) - 1.0


def _rigid_rebound(inelasticity: float, velocity_factor: float, steps: int) -> float:
    result = _strike(plate_seat(inelasticity), 1.0, velocity_factor, steps)
    return impact.measures.impulse(result) / (_MASS * _VELOCITY) - velocity_factor


def _plate_duration(inelasticity: float, stiffness_factor: float, steps: int) -> float:
    return _duration(_strike(plate_seat(inelasticity), stiffness_factor, 1.0, steps)) / _TIME


def _duration(result: impact.ImpactResult) -> float:
    """Until the gap opens, between two records by straight line: second order, as it opens with a velocity."""
    gap = result.gap
    m = int(np.flatnonzero((gap[1:] > 0) & (gap[:-1] <= 0))[-1])
    return float(result.time[m]) - result.dt * float(gap[m]) / float(gap[m + 1] - gap[m])


def _penetration(result: impact.ImpactResult) -> float:
    return float(-np.min(result.gap))
