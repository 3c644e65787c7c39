"""Green's functions in closed form: rods, springs, rigid bodies, infinite beams and plates.

Arguments are SI. Every function here raises `GreensFunctionError`, naming the argument and its value, for one that is
not a positive, finite number (a damping ratio of 0 is none at all).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impact.exact.rods import DampedFixedRod, DampedFreeRod, DelayRod, damped_start
from impact.greens import modal
from impact.greens.base import (
    Array,
    ErrorEstimate,
    ExactPort,
    GreensFunctionError,
    check_factor,
    check_positive,
)


def spring(*, stiffness: float) -> modal.ModalGreens:
    """Return a massless spring: u = N/k, ``stiffness`` k [N/m]. The usual seat model, and baseline of every result."""
    check_positive(stiffness=stiffness)
    return _closed(modal.Residual.spring(1.0 / stiffness), kind="spring", stiffness=stiffness)


def semi_infinite_rod(
    *, young: float, density: float, area: float, length: float | None = None, damping_ratio: float = 0.0
) -> modal.ModalGreens:
    """Return a rod without reflections: a dashpot, g = 1/Z, Z = A sqrt(E rho) [N s/m].

    It takes the arguments of the other rods, to stand in for them: ``length`` has no effect, and ``damping_ratio``
    that of the limit length -> inf of a rod with uniform modal damping, g = (2/pi) acos(zeta)/sqrt(1 - zeta^2)/Z.
    """
    check_positive(young=young, density=density, area=area)
    if length is not None:
        check_positive(length=length)
    value = damped_start(damping_ratio) / (area * math.sqrt(young * density))
    origin = {"young": young, "density": density, "area": area, "damping_ratio": damping_ratio}
    return _dashpot(value, kind="semi_infinite_rod", **origin)


def infinite_plate(*, young: float, poisson: float, density: float, thickness: float) -> modal.ModalGreens:
    """Return an infinite Kirchhoff plate struck at a point: g = 1/(8 sqrt(D rho h)), D = E h^3/(12 (1 - nu^2)).

    E [Pa], rho [kg/m^3], h [m]. Source: Boussinesq; used for impact by Zener, Phys. Rev. 59 (1941) 669.
    """
    check_positive(young=young, density=density, thickness=thickness)
    if not -1.0 < poisson < 0.5:
        raise GreensFunctionError(f"poisson = {poisson:g} is outside (-1, 0.5)")
    rigidity = young * thickness**3 / (12 * (1 - poisson**2))
    value = 1.0 / (8 * math.sqrt(rigidity * density * thickness))
    return _dashpot(value, kind="infinite_plate", young=young, poisson=poisson, density=density, thickness=thickness)


def infinite_beam(*, young: float, density: float, area: float, second_moment: float) -> PowerGreens:
    """Return an infinite Euler-Bernoulli beam struck at a point: g = C t^(1/2)/Gamma(3/2), C = (4EI/rho A)^(3/4)/(8EI).

    E [Pa], rho [kg/m^3], A [m^2], I [m^4]; from u(0) = F/(8 EI b^3), 4 b^4 = rho A s^2/EI, in the Laplace domain.
    """
    check_positive(young=young, density=density, area=area, second_moment=second_moment)
    ei = young * second_moment
    coefficient = (4 * ei / (density * area)) ** 0.75 / (8 * ei)
    return PowerGreens(coefficient / math.gamma(1.5), 0.5)


def single_mode(*, frequency_hz: float, mass: float, damping_ratio: float = 0.0) -> modal.ModalGreens:
    """Return one damped oscillator of modal ``mass`` m [kg]: g(t) = exp(-zeta w t) sin(wd t)/(m wd), w = 2 pi
    frequency_hz.

    As g(0+) = 0, a rigid (Signorini) contact with it needs another body with g(0+) > 0; else take a compliant law.
    """
    check_positive(frequency_hz=frequency_hz, mass=mass)
    omega = np.array([2 * np.pi * frequency_hz])
    shapes = np.array([[1.0 / math.sqrt(mass)]])
    origin = {"kind": "single_mode", "frequency_hz": frequency_hz, "mass": mass, "damping_ratio": damping_ratio}
    return modal.ModalGreens(
        omega, np.array([damping_ratio]), shapes, modal.Residual.none(), error=ErrorEstimate(0.0, 0.0), origin=origin
    )


def fixed_rod(
    *, young: float, density: float, area: float, length: float, damping_ratio: float = 0.0
) -> DelayRod | DampedFixedRod:
    """Return an elastic rod struck at one end, fixed at the other; exact, with or without uniform modal damping.

    Undamped, g(t) = (1/Z) (H(t) + 2 sum_k (-1)^k H(t - 2 k l/c)) [m/(N s)], Z = A sqrt(E rho), c = sqrt(E/rho): the
    wave and its reflections (d'Alembert); damped, as `DampedFixedRod` says. S(inf) = l/(EA).
    """
    rod = _delay_rod(young, density, area, length, reflection=-1.0)
    if damping_ratio == 0.0:
        return rod
    check_positive(damping_ratio=damping_ratio)
    return DampedFixedRod(rod.impedance, length / math.sqrt(young / density), damping_ratio)


def free_rod(
    *, young: float, density: float, area: float, length: float, damping_ratio: float = 0.0
) -> DelayRod | DampedFreeRod:
    """Return an elastic rod struck at one end, free at the other; exact, with or without uniform modal damping.

    Undamped, g(t) = (1/Z) (H(t) + 2 sum_k H(t - 2 k l/c)) [m/(N s)], Z = A sqrt(E rho), c = sqrt(E/rho): the wave and
    its reflections (d'Alembert), on the mean t/(rho A l); damped, as `DampedFreeRod` says.
    """
    rod = _delay_rod(young, density, area, length, reflection=1.0)
    if damping_ratio == 0.0:
        return rod
    check_positive(damping_ratio=damping_ratio)
    return DampedFreeRod(rod.impedance, length / math.sqrt(young / density), damping_ratio)


def rod_with_end_impedance(
    *, young: float, density: float, area: float, length: float, end_impedance: float
) -> DelayRod:
    """Return an elastic rod whose far end moves against a dashpot ``end_impedance`` Z_e [N s/m] >= 0; 0 free, inf
    fixed.

    g(t) = (1/Z) (H(t) + 2 sum_k R^k H(t - 2 k l/c)) [m/(N s)], R = (Z - Z_e)/(Z + Z_e).
    """
    check_positive(young=young, density=density, area=area, length=length)
    if not end_impedance >= 0:
        raise GreensFunctionError(f"end_impedance = {end_impedance:g} must be >= 0: the end would feed energy")
    z = area * math.sqrt(young * density)
    reflection = -1.0 if math.isinf(end_impedance) else (z - end_impedance) / (z + end_impedance)
    return _delay_rod(young, density, area, length, reflection)


@dataclass(frozen=True)
class PowerGreens(ExactPort):
    """A Green's function g(t) = coefficient * t^exponent, exponent > -1."""

    kind: ClassVar[str] = "power_law"
    coefficient: float
    exponent: float

    def inverse_mass(self) -> Array:
        """Return lim g/t [1/kg]: the coefficient for exponent 1, 0 below (an infinite body), ``inf`` above."""
        return np.array([[self.coefficient if self.exponent == 1 else 0.0 if self.exponent < 1 else math.inf]])

    def scaled(self, factor: float) -> PowerGreens:
        return replace(self, coefficient=check_factor(factor) * self.coefficient)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.asarray(t, dtype=float)
        return np.where(time < 0, 0.0, self.coefficient * np.maximum(time, 0.0) ** self.exponent)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        return np.asarray(self.coefficient * time ** (self.exponent + 1) / (self.exponent + 1))

    def static_compliance(self) -> Array:
        return np.array([[np.inf]])

    def initial_value(self) -> Array:
        return np.array([[0.0 if self.exponent > 0 else self.coefficient if self.exponent == 0 else np.inf]])


def _delay_rod(young: float, density: float, area: float, length: float, reflection: float) -> DelayRod:
    check_positive(young=young, density=density, area=area, length=length)
    return DelayRod(area * math.sqrt(young * density), 2 * length / math.sqrt(young / density), reflection)


def _dashpot(value: float, **origin: object) -> modal.ModalGreens:
    return _closed(modal.Residual(np.array([[math.sqrt(value)]]), np.zeros(1), np.zeros((1, 1))), **origin)


def _closed(residual: modal.Residual, **origin: object) -> modal.ModalGreens:
    return modal.ModalGreens(
        np.zeros(0), np.zeros(0), np.zeros((0, 1)), residual, error=ErrorEstimate(0.0, 0.0), origin=origin
    )
