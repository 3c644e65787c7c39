"""Stresses at a contact: Hertz, line and disk loads, a beam's tip given a velocity at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from scipy.optimize import minimize_scalar

from impact.exact.contact_stress import (
    HertzContact,
    ShearMaximum,
    circular_shear_maximum,
    disk_shear_maximum,
    edge_tension,
    hertz_circular,
    hertz_line,
    line_shear_maximum,
    tip_step_force,
    tip_step_moment,
    tip_step_stress,
)
from seatfem.verify import Case

_JOHNSON = "Johnson, Contact Mechanics, ch. 3 and 4"
_GOODIER = "Timoshenko & Goodier, Theory of Elasticity: load on a half-space"
_LAPLACE = "Euler-Bernoulli beam, Laplace transform"
_POISSON = 0.3


def stress_cases() -> tuple[Case, ...]:
    """Stresses at a contact: Hertz, line and disk loads, a beam's tip given a velocity at once."""
    edge = Case(
        "circular Hertz contact, nu = 0.3",
        "radial tension at the edge/p0",
        0.133333333,
        4e-9,  # nine decimals printed
        _JOHNSON,
        lambda k: edge_tension(poisson=_POISSON * k),
    )
    return (*_circle(), edge, *_line(), *_disk(), *_tip())


def _circle() -> tuple[Case, Case]:
    shear = circular_shear_maximum(poisson=_POISSON)
    load = partial(hertz_circular, reduced_modulus=1.0, radius=1.0)
    return _hertz("circular Hertz contact, nu = 0.3", ("a", 0.3100205, 0.480864), shear, lambda k: load(force=k))


def _line() -> tuple[Case, Case]:
    load = partial(hertz_line, reduced_modulus=1.0, radius=1.0)
    exact = ("b", 0.3002831, 0.786151)
    return _hertz("Hertz line contact", exact, line_shear_maximum(), lambda k: load(force_per_length=k))


def _hertz(
    name: str, exact: tuple[str, float, float], shear: ShearMaximum, load: Callable[[float], HertzContact]
) -> tuple[Case, Case]:
    """Return the cases of Hertz; the factor is on the force; p0 and the half-width are those of force 1."""
    width, stress, depth = exact
    one = load(1.0)
    return (
        Case(
            name, "largest shear/p0", stress, 1e-6, _JOHNSON, lambda k: shear.stress * load(k).pressure / one.pressure
        ),
        Case(
            name,
            f"its depth/{width}",
            depth,
            1.1e-6,
            _JOHNSON,
            lambda k: shear.depth * load(k).half_width / one.half_width,
        ),
    )


def _disk() -> tuple[Case, Case]:
    """Return the cases of a disk load; the factor is on nu."""

    def shear(k: float) -> ShearMaximum:
        return disk_shear_maximum(poisson=_POISSON * k)

    name = "uniform pressure on a disk, nu = 0.3"
    return (
        Case(name, "largest shear on the axis/p", 0.3329097, 1e-6, _GOODIER, lambda k: shear(k).stress),
        Case(name, "its depth/a", 0.637377, 1.1e-6, _GOODIER, lambda k: shear(k).depth),
    )


def _tip() -> tuple[Case, ...]:
    """Return the cases of a beam's tip: EI = rho A = v = 1 at t = 1 unless multiplied."""

    def place(rigidity: float) -> float:
        """Return where the moment of the time 1 is largest; eta = x/sqrt(a t)."""
        result = minimize_scalar(
            lambda x: -float(tip_step_moment(x / rigidity**0.25)), bounds=(1.0, 2.5), method="bounded",
            options={"xatol": 1e-9},
        )  # fmt: skip
        return float(result.x)

    def moment(rigidity: float) -> float:
        """Return M = EI u'' over sqrt(EI rho A) of the rigidity 1."""
        largest = float(tip_step_moment(place(rigidity) / rigidity**0.25))
        return math.sqrt(rigidity) * largest

    stress = partial(tip_step_stress, density=1.0, speed=1.0)

    def impedance(rigidity: float) -> float:
        force = tip_step_force(1.0, speed=1.0, bending_stiffness=rigidity, mass_per_length=1.0)
        return float(force) * math.sqrt(2 * math.pi)

    name = "beam's free tip given the velocity v"
    return (
        Case(name, "largest moment/(v (EI rho A)^(1/2))", 0.48759496, 1e-8, _LAPLACE, moment),
        Case(name, "its place x/(a t)^(1/2)", 1.772454, 3e-7, _LAPLACE, place),
        Case(name, "largest surface stress/(rho c_0 v)", 0.84453925, 1e-8, _LAPLACE, lambda k: float(stress(young=k))),
        Case(name, "F (2 pi a t)^(1/2)/(v (EI rho A)^(1/2))", 1.0, 1e-12, _LAPLACE, impedance),
    )
