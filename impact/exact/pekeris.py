"""Lamb's problem at the surface: Rayleigh speed, and the motion after a vertical point load that stays.

With tau = c_s t/r, kappa = c_s/c_p, gamma = c_s/c_R and the Rayleigh cubic, x = (slowness c_s)^2,

    P(x) = (1 - 2x)^4 + 16 x^2 (x - kappa^2)(1 - x) = 16 (kappa^2 - 1) x^3 + 8 (3 - 2 kappa^2) x^2 - 8 x + 1,

the Cagniard integral over slownesses splits into partial fractions over the roots of P, each in closed form.

Sources: Pekeris, PNAS 41 (1955) 469 (nu = 1/4); Mooney, Bull. Seism. Soc. Am. 64 (1974) 473 and Kausel, Proc. R. Soc.
A 469 (2013) 20120462 (any nu).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.base import Array, ComplexArray, GreensFunctionError

_NEARLY_DOUBLE = 1e-3  # roots closer than this lose digits in partial fractions


@dataclass(frozen=True)
class PointLoad:
    """Terms of h = f/f(inf), f the `point_step_response`:

    h = 1/2 + Re sum_j strength_j/sqrt(tau^2 - pole_j) - (rayleigh/2)/sqrt(gamma^2 - tau^2),  kappa < tau < 1
    h = 1 - rayleigh/sqrt(gamma^2 - tau^2),  1 < tau < gamma;   h = 1 beyond, 0 before kappa.
    """

    kappa: float
    gamma: float
    poles: ComplexArray
    strengths: ComplexArray
    rayleigh: float

    @staticmethod
    def of(poisson: float) -> PointLoad:
        """The terms for a Poisson ratio in [0, 0.5]; raises `GreensFunctionError` outside."""
        kappa2 = _kappa2(poisson)
        x1, x2, x3 = _roots(kappa2)
        static = (1 - poisson) / 2

        def residue(x: ComplexArray, slope: ComplexArray) -> ComplexArray:
            return np.asarray((1 - 2 * x) ** 2 * np.sqrt(kappa2 - x + 0j) / (2 * static * slope))

        lead = 16 * (kappa2 - 1)
        if abs(x1 - x2) > _NEARLY_DOUBLE:
            poles = np.array([x1, x2])
            strengths = residue(poles, lead * (poles - x3) * np.array([x1 - x2, x2 - x1]))
        else:  # Cauchy's integral around both, trapezoidal rule: its 16 points act as poles; exact to round-off
            arm = 10 * _NEARLY_DOUBLE * np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
            poles = (x1 + x2) / 2 + arm
            strengths = residue(poles, lead * (poles - x1) * (poles - x2) * (poles - x3)) * arm / 16
        top, slope = x3.real, lead * ((x3 - x1) * (x3 - x2)).real
        rayleigh = -((1 - 2 * top) ** 2) * math.sqrt(top - kappa2) / (static * slope)
        return PointLoad(math.sqrt(kappa2), math.sqrt(top), poles, strengths, rayleigh)


def rayleigh_speed(poisson: float) -> float:
    """c_R/c_s of an elastic half-space, 0.8740 (nu = 0) ... 0.9553 (nu = 0.5): the exact root of the Rayleigh cubic.

    Raises:
        GreensFunctionError: Poisson ratio outside [0, 0.5].
    """
    return 1 / math.sqrt(_roots(_kappa2(poisson))[2].real)


def point_step_response(tau: ArrayLike, *, poisson: float) -> Array:
    """f(tau), shape of ``tau``: w = F f(c_s t/r)/(pi mu r) is the surface's displacement along a point load F H(t) [m].

    Zero before the pressure wave, -inf at the Rayleigh wave tau = c_s/c_R, (1 - nu)/2 (Boussinesq) ever after.
    Accurate to 1e-11 of (1 - nu)/2 away from the Rayleigh pole.
    """
    load = PointLoad.of(poisson)
    t = np.asarray(tau, dtype=float)
    square = np.ravel(t) ** 2
    before, late = load.gamma**2 - square, np.ravel(t) > load.gamma
    with np.errstate(divide="ignore"):
        pole = load.rayleigh / np.sqrt(np.where(late, 1.0, np.maximum(before, 0.0)))
    early = (np.ravel(t) > load.kappa) & (np.ravel(t) < 1)
    terms = load.strengths / np.sqrt(np.where(early, square, 1.0)[:, None] - load.poles)
    h = np.where(early, 0.5 + terms.sum(axis=1).real - pole / 2, np.where(late, 1.0, 1.0 - pole))
    return np.asarray((1 - poisson) / 2 * np.where(np.ravel(t) > load.kappa, h, 0.0)).reshape(t.shape)


def _kappa2(poisson: float) -> float:
    if not 0.0 <= poisson <= 0.5:
        raise GreensFunctionError(f"poisson = {poisson:g} is outside [0, 0.5]")
    return (1 - 2 * poisson) / (2 * (1 - poisson))


def _roots(kappa2: float) -> tuple[complex, complex, complex]:
    """Roots of P, the Rayleigh root (the only one above 1) last; one Newton step removes the eigenvalue round-off."""
    cubic = np.polynomial.Polynomial([1.0, -8.0, 8 * (3 - 2 * kappa2), 16 * (kappa2 - 1)])
    roots = np.asarray(cubic.roots(), dtype=complex)
    last = np.argmax(roots.real)  # above 1; the two others have real parts below 3/4
    roots[last] -= cubic(roots[last]) / cubic.deriv()(roots[last])
    x1, x2 = np.delete(roots, last)
    return complex(x1), complex(x2), complex(roots[last])
