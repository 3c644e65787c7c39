"""Stresses at a contact in closed form: Hertz, uniform disk, plane waves of a first contact, a beam's tip arrested.

Stress is > 0 in tension. Depths are z >= 0 below the surface on the axis of the contact. "Johnson" is K. L. Johnson,
Contact Mechanics, Cambridge 1985.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike

from impact.greens.base import Array
from impact.notices import SeatfemError

RECTANGULAR = math.sqrt(3.0)  # distance of the surface from the neutral axis over the radius of gyration
TIP_STEP_MAXIMUM = math.sqrt(math.pi)  # eta of the travelling largest moment: d/d eta vanishes at eta^2/4 = pi/4


class ContactStressError(SeatfemError, ValueError):
    """A quantity outside its range; the message names it, its value and the limit."""


@dataclass(frozen=True)
class HertzContact:
    """Size, pressure and approach of a Hertzian contact under load.

    Attributes:
        half_width: radius a of the circle or half-width b of the strip [m].
        pressure: largest pressure p0 [Pa], in the middle.
        approach: of distant points [m]; nan for a line contact, where it has no limit.
    """

    half_width: float
    pressure: float
    approach: float


@dataclass(frozen=True)
class HertzImpact:
    """Result of Hertz's quasi-static elastic impact: largest force [N], largest approach [m], contact duration [s]."""

    force: float
    approach: float
    duration: float


@dataclass(frozen=True)
class ShearMaximum:
    """Largest shear stress on the axis and its depth, relative to the pressure and the half-width."""

    stress: float
    depth: float


def reduced_modulus(*, young: float, poisson: float, young_2: float = math.inf, poisson_2: float = 0.0) -> float:
    """Return 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 [Pa]; the second body is rigid unless given."""
    _positive(young=young, young_2=young_2)
    return 1 / ((1 - poisson**2) / young + (1 - poisson_2**2) / young_2)


def hertz_stiffness(*, reduced_modulus: float, radius: float) -> float:
    """Return k = (4/3) E* sqrt(R) of N = k d^(3/2) [N/m^1.5], 1/R = 1/R_1 + 1/R_2. Source: Johnson 4.23."""
    _positive(reduced_modulus=reduced_modulus, radius=radius)
    return 4 / 3 * reduced_modulus * math.sqrt(radius)


def hertz_circular(*, force: float, reduced_modulus: float, radius: float) -> HertzContact:
    """Return the contact of spheres under N [N]: a = (3 N R/(4 E*))^(1/3), p0 = 3 N/(2 pi a^2), approach a^2/R.

    Source: Johnson 4.22 - 4.24.
    """
    _positive(force=force, reduced_modulus=reduced_modulus, radius=radius)
    a = (3 * force * radius / (4 * reduced_modulus)) ** (1 / 3)
    return HertzContact(a, 3 * force / (2 * math.pi * a**2), a**2 / radius)


def hertz_line(*, force_per_length: float, reduced_modulus: float, radius: float) -> HertzContact:
    """Return the contact of cylinders: b = sqrt(4 N' R/(pi E*)), p0 = 2 N'/(pi b), N' [N/m]. Johnson 4.43, 4.45."""
    _positive(force_per_length=force_per_length, reduced_modulus=reduced_modulus, radius=radius)
    b = math.sqrt(4 * force_per_length * radius / (math.pi * reduced_modulus))
    return HertzContact(b, 2 * force_per_length / (math.pi * b), math.nan)


def hertz_impact(*, stiffness: float, mass: float, speed: float) -> HertzImpact:
    """Return the impact of a mass m [kg] at V [m/s] against N = k d^(3/2), no waves (for two free bodies 1/m = 1/m_1 +
    1/m_2):

    d = (5 m V^2/(4 k))^(2/5), N = k d^(3/2), T = (4/5) sqrt(pi) Gamma(2/5)/Gamma(9/10) d/V.

    Source: Hertz 1882; Johnson 11.4.
    """
    _positive(stiffness=stiffness, mass=mass, speed=speed)
    approach = (5 * mass * speed**2 / (4 * stiffness)) ** 0.4
    factor = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
    return HertzImpact(stiffness * approach**1.5, approach, factor * approach / speed)


def circular_axis_stress(depth: ArrayLike, *, poisson: float) -> tuple[Array, Array]:
    """Return the ratios (n,) sigma_r/p0 and sigma_z/p0 on the axis of a circular Hertz contact, z = ``depth``/a (n,).

    sigma_theta = sigma_r = -(1 + nu)(1 - z atan(1/z)) + 1/(2 (1 + z^2)), sigma_z = -1/(1 + z^2). Source: Johnson 3.45.
    """
    z = _depth(depth, poisson)
    inside = 1 / (1 + z**2)
    return -(1 + poisson) * (1 - z * np.arctan2(1.0, z)) + inside / 2, -inside


def line_axis_stress(depth: ArrayLike) -> tuple[Array, Array]:
    """Return the ratios (n,) sigma_x/p0 and sigma_z/p0 below the middle of a Hertz line contact, z = ``depth``/b (n,).

    x is across the line; sigma_x = -((1 + 2 z^2)/sqrt(1 + z^2) - 2 z), sigma_z = -1/sqrt(1 + z^2).
    Source: Johnson 4.46.
    """
    z = _depth(depth, 0.0)
    root = np.sqrt(1 + z**2)
    return -((1 + 2 * z**2) / root - 2 * z), -1 / root


def disk_axis_stress(depth: ArrayLike, *, poisson: float) -> tuple[Array, Array]:
    """Return the ratios (n,) sigma_r/p and sigma_z/p on the axis of a uniformly loaded disk, z = ``depth``/a (n,).

    sigma_z = -(1 - c^3), sigma_theta = sigma_r = -((1 + 2 nu)/2 - (1 + nu) c + c^3/2), c = z/sqrt(1 + z^2).

    Source: Timoshenko & Goodier, Theory of Elasticity, load over part of the boundary of a semi-infinite solid.
    """
    z = _depth(depth, poisson)
    c = z / np.sqrt(1 + z**2)
    return -((1 + 2 * poisson) / 2 - (1 + poisson) * c + c**3 / 2), -(1 - c**3)


def circular_shear_maximum(*, poisson: float) -> ShearMaximum:
    """Return the largest |sigma_z - sigma_r|/2 under a circular Hertz contact, over p0, at z/a: 0.310, 0.481 for
    nu = 0.3."""
    return _shear_maximum(lambda z: circular_axis_stress(z, poisson=poisson))


def line_shear_maximum() -> ShearMaximum:
    """Return the largest |sigma_z - sigma_x|/2 below a Hertz line contact, over p0, at z/b: 0.300, 0.786."""
    return _shear_maximum(line_axis_stress)


def disk_shear_maximum(*, poisson: float) -> ShearMaximum:
    """Return the largest |sigma_z - sigma_r|/2 on the axis of a uniform disk, over p, at z/a: 0.333, 0.637 for
    nu = 0.3."""
    return _shear_maximum(lambda z: disk_axis_stress(z, poisson=poisson))


def edge_tension(*, poisson: float) -> float:
    """Return (1 - 2 nu)/3: the radial tension at the edge of a circular Hertz contact over p0. Source: Johnson 4.2."""
    _poisson(poisson)
    return (1 - 2 * poisson) / 3


def rod_wave_speed(*, young: float, density: float) -> float:
    """Return c_0 = sqrt(E/rho) [m/s]."""
    _positive(young=young, density=density)
    return math.sqrt(young / density)


def pressure_wave_speed(*, young: float, poisson: float, density: float) -> float:
    """Return c_p = sqrt(E (1 - nu)/(rho (1 + nu)(1 - 2 nu))) [m/s], plane strain of a wide front; inf for nu = 0.5."""
    _positive(young=young, density=density)
    _poisson(poisson)
    if poisson == 0.5:
        return math.inf
    return math.sqrt(young * (1 - poisson) / (density * (1 + poisson) * (1 - 2 * poisson)))


def first_contact_pressure(*, speed: float, impedance: float, impedance_2: float = math.inf) -> float:
    """Return the pressure v z_1 z_2/(z_1 + z_2) [Pa] of flat bodies that meet at v, until the first release wave.

    z = rho c [Pa s/m], with c_p for bodies and c_0 for rods; equal bodies rho c v/2, a rigid second one rho c v.
    """
    _positive(impedance=impedance, impedance_2=impedance_2)
    return speed / (1 / impedance + 1 / impedance_2)


def tip_step_moment(eta: ArrayLike) -> Array:
    """Return the ratio (n,) of the bending moment to v sqrt(EI rho A) in a long beam whose free tip gets v at once.

    m(eta) = -Im erfc(eta exp(i pi/4)/2), ``eta`` = x/sqrt(a t) (n,), x from the tip, a = sqrt(EI/(rho A)); its
    travelling maximum 0.48759 stands at eta = sqrt(pi). Equally a tip that is arrested from v.

    From EI u'''' + rho A u_tt = 0, u_t(0, t) = v, u''(0, t) = 0, in the Laplace domain.
    """
    return np.asarray(-np.imag(scipy.special.erfc(np.asarray(eta, dtype=float) * np.exp(0.25j * np.pi) / 2)))


def tip_step_stress(
    *, young: float, density: float, speed: float, eta: ArrayLike = TIP_STEP_MAXIMUM, section: float = RECTANGULAR
) -> Array:
    """Return the surface stress (n,) [Pa] rho c_0 v ``section`` m(eta) of a tip given the velocity v: largest 0.8445
    rho c_0 v.

    ``section`` is the distance of the surface from the neutral axis over the radius of gyration. Euler-Bernoulli:
    valid for waves longer than about 6 heights.
    """
    return np.asarray(density * rod_wave_speed(young=young, density=density) * speed * section * tip_step_moment(eta))


def midspan_step_stress(*, young: float, density: float, speed: float, section: float = RECTANGULAR) -> float:
    """Return the surface stress [Pa] of a beam section that keeps its slope and is given the velocity v: sqrt(3) rho
    c_0 v.

    M = v sqrt(EI rho A), constant in time: struck in mid-span, or a tip arrested by a clamp.
    """
    return density * rod_wave_speed(young=young, density=density) * speed * section


def tip_step_force(time: ArrayLike, *, speed: float, bending_stiffness: float, mass_per_length: float) -> Array:
    """Return F = v sqrt(EI rho A)/sqrt(2 pi a t) [N], a = sqrt(EI/(rho A)): what gives a free tip the velocity v at
    once.

    At times (n,) t > 0 [s], inf at 0; v [m/s], EI ``bending_stiffness`` [N m^2], rho A ``mass_per_length`` [kg/m].
    """
    _positive(bending_stiffness=bending_stiffness, mass_per_length=mass_per_length)
    a = math.sqrt(bending_stiffness / mass_per_length)
    with np.errstate(divide="ignore"):
        root = np.sqrt(2 * np.pi * a * np.asarray(time, dtype=float))
        return np.asarray(speed * math.sqrt(bending_stiffness * mass_per_length) / root)


def _shear_maximum(stress: Callable[[Array], tuple[Array, Array]]) -> ShearMaximum:
    """Return the largest shear stress by the roots of the derivative of a Chebyshev interpolant on 0 <= z <= 3."""

    def shear(z: Array) -> Array:
        across, along = stress(z)
        return np.abs(along - across) / 2

    roots = np.asarray(Chebyshev.interpolate(lambda z: np.subtract(*stress(z)), 60, domain=[0.0, 3.0]).deriv().roots())
    inner = roots[np.abs(roots.imag) < 1e-9].real
    depths = np.concatenate([[0.0], inner[(inner > 0) & (inner < 3)]])
    values = shear(depths)
    return ShearMaximum(float(values.max()), float(depths[values.argmax()]))


def _depth(depth: ArrayLike, poisson: float) -> Array:
    _poisson(poisson)
    z = np.asarray(depth, dtype=float)
    if z.size and z.min() < 0:
        raise ContactStressError(f"depth = {z.min():g} is above the surface; depths are >= 0")
    return z


def _poisson(poisson: float) -> None:
    if not 0.0 <= poisson <= 0.5:
        raise ContactStressError(f"poisson = {poisson:g} is outside [0, 0.5]")


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not value > 0:
            raise ContactStressError(f"{name} = {value:g} must be positive")
