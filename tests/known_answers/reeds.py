"""Reeds of other kinds, and the paper's reed let go: frequencies, static values, free flight by the march itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

import impact
from seatfem.verify import Case

from .beams import REED, lowest
from .compliant import rigid_seat

_CLOSED = "closed form"
_MODE = "closed form: one oscillator"
_LIFT = 1e-3  # tip deflection at release [m]
_UNIT = {"density": 1.0, "length": 1.0, "width": 1.0, "thickness": 1.0}  # with E = 12: EI = rho A = L = 1
# damping ratio: first contact [s], its closing velocity [m/s], released in the first mode
_FLIGHT = {0.0: (6.4855554e-4, 2.421992), 0.03: (6.6124152e-4, 2.308377)}


def reed_cases() -> tuple[Case, ...]:
    """Reeds of other kinds, and the paper's reed let go: frequencies, static values, free flight by the march."""
    flights = tuple(case for damping_ratio in _FLIGHT for case in _flight(damping_ratio))
    return (*_other_kinds(), *_static(), *flights)


def _other_kinds() -> tuple[Case, ...]:
    """Return the cases of frequencies; the factor is on the rigidity, for the first mode with a tip mass on this."""
    clamped = (22.3733, 61.6728, 120.9034)
    tip_mass = (1.557298, 16.25009, 50.89584, 105.1983, 179.2320)
    shear_hz = (404.48307, 2424.20669, 6376.03372, 11565.92073, 17606.48175)
    short = impact.TimoshenkoCantilever(
        young=200e9, density=7850.0, length=0.2, width=0.02, thickness=0.02, poisson=0.3, shear_factor=5 / 6
    )

    def on_clamps(n: int, factor: float) -> float:
        return float(impact.ClampedClamped(young=12.0 * factor, **_UNIT).frequencies(n + 1)[n])

    def with_a_mass(n: int, factor: float) -> float:
        young, mass = (1.0, factor) if n == 0 else (factor, 1.0)
        return float(impact.TipMassCantilever(young=12.0 * young, tip_mass=mass, **_UNIT).frequencies(n + 1)[n])

    def with_shear(n: int, factor: float) -> float:
        return float(replace(short, young=short.young * factor).frequencies(n + 1)[n]) / (2 * math.pi)

    thomson, table = (
        "Thomson, Theory of Vibration with Applications, appendix D",
        "Math. Probl. Eng. 2017, 1568019, table 1",
    )
    exact = "exact determinant and Chebyshev collocation"
    return (
        *lowest("clamped-clamped beam", "(k_{} L)^2", clamped, 3e-6, thomson, on_clamps),
        *lowest("cantilever, tip mass = beam's mass", "(k_{} L)^2", tip_mass, 5e-7, table, with_a_mass),
        *lowest("Timoshenko cantilever, L/h = 10", "f_{} [Hz]", shear_hz, 2e-8, exact, with_shear),
    )


def _static() -> tuple[Case, ...]:
    """Return the cases of the force and the stress from the modes and the flexibility they leave out."""

    def force(young_factor: float) -> float:
        reed = replace(REED, young=REED.young * young_factor)
        return _LIFT / float(impact.reed(reed).greens.static_compliance()[0, 0])

    name, stress = "paper's reed, static", "root stress for 1 mm, 3 E h d/(2 L^2) [Pa]"
    of_force = 6 * REED.length / (REED.width * REED.thickness**2)
    return (
        Case(name, "mass [kg]", 0.0006081395, 1e-8, _CLOSED, lambda k: replace(REED, density=REED.density * k).mass),
        Case(name, "EI [N m^2]", 0.00472877083, 1e-8, _CLOSED, lambda k: replace(REED, young=REED.young * k).rigidity),
        Case(name, "tip force for 1 mm [N]", 0.865701904, 1e-8, _CLOSED, force),
        Case(name, stress, 141825280.0, 4e-8, _CLOSED, lambda k: of_force * force(k)),
    )


def _flight(damping_ratio: float) -> tuple[Case, Case]:
    name = f"paper's reed released in its first mode, damping ratio {damping_ratio:g}"
    time, velocity = _FLIGHT[damping_ratio]

    def case(quantity: str, exact: float, measure: Callable[[float, float], float]) -> Case:
        def compute(young_factor: float) -> float:
            return measure(*_first_crossing(damping_ratio, young_factor))

        return Case(name, quantity, exact, 4e-7, _MODE, compute)  # seven digits printed

    return (
        case("first contact [s]", time, lambda at, _: at),
        case("closing velocity [m/s]", velocity, lambda _, speed: speed),
    )


def _first_crossing(damping_ratio: float, young_factor: float) -> tuple[float, float]:
    """Return time and speed at which the tip passes the level of the seat, which is out of reach here.

    The march is exact at its 200 steps; a polynomial through ten of them (0.05 rad each) is exact to 1e-13.
    """
    beam = replace(REED, young=REED.young * young_factor)
    body = impact.reed(beam, damping_ratio=damping_ratio, release=impact.ModeShape(1, _LIFT))
    problem = impact.ContactProblem(body, impact.Body(rigid_seat()), gap=10 * _LIFT)
    result = impact.solve(problem, dt=5e-6, duration=1e-3)
    tip = result.striker_displacement
    m = int(np.flatnonzero((tip[1:] <= 0) & (tip[:-1] > 0))[0])
    near = slice(m - 4, m + 6)
    passing = Polynomial.fit(result.time[near], tip[near], 9)
    zero = float(brentq(passing, result.time[m], result.time[m + 1], xtol=1e-16))
    return zero, -float(passing.deriv()(zero))
