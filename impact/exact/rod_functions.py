"""Functions behind rods with uniform modal damping: divided differences over the exponents, dilogarithms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from impact.greens.answers import Array, ComplexArray, GreensFunctionError

Term = Callable[[complex], ComplexArray]
_TINY, _SMALL = 1e-4, 0.4  # |q| up to which the power series of the dilogarithm is summed


def divided_difference(term: Term, zeta: float, omega: float) -> Array:
    """(term(lambda) - term(conj lambda))/(2 i sqrt(1 - zeta^2)), lambda = (-zeta + i sqrt(1 - zeta^2)) omega.

    Above critical damping the same with the two real exponents.
    """
    if abs(zeta - 1.0) < 1e-4:  # symmetric mean about the double exponent: error O(1e-8)
        return np.asarray(sum(divided_difference(term, 1.0 + d, omega) for d in (-2e-4, 2e-4)) / 2)
    if zeta < 1:
        root = math.sqrt(1 - zeta * zeta)
        return np.asarray(np.imag(term(complex(-zeta, root) * omega)) / root)
    root = math.sqrt(zeta * zeta - 1)
    slow, fast = term(complex(-1 / (zeta + root)) * omega), term(complex(-(zeta + root)) * omega)
    return np.asarray(np.real(slow - fast) / (2 * root))


def damped_start(zeta: float) -> float:
    """Factor by which uniform modal damping lowers g(0+): (2/pi) acos(zeta)/sqrt(1 - zeta^2), acosh above 1."""
    if zeta < 0:
        raise GreensFunctionError(f"damping ratio {zeta:g} must be >= 0")
    if abs(zeta - 1) < 1e-6:
        return 2 / math.pi
    if zeta < 1:
        return 2 / math.pi * math.acos(zeta) / math.sqrt(1 - zeta * zeta)
    return 2 / math.pi * math.acosh(zeta) / math.sqrt(zeta * zeta - 1)


def legendre_chi2(q: ComplexArray) -> ComplexArray:
    """chi_2(q) = sum q^(2k+1)/(2k+1)^2 = (Li_2(q) - Li_2(-q))/2, complex |q| <= 1."""
    return np.asarray((dilogarithm(q) - dilogarithm(-q)) / 2)


def dilogarithm(q: ComplexArray) -> ComplexArray:
    """Li_2(q) = sum q^k/k^2, complex |q| <= 1; by this sum where it is short, as it is once a rod is nearly at rest."""
    from scipy.special import spence  # here, as it would be a third of the time to import this package

    q = np.asarray(q)
    size, out = np.abs(q), np.empty_like(q)
    parts = ((size <= _TINY, 4), ((size > _TINY) & (size <= _SMALL), 36))  # the term left out is below 1e-17 of the sum
    for here, terms in parts:
        out[here] = _power_sum(q[here], terms)
    large = ~(size <= _SMALL)
    out[large] = spence(1 - q[large])
    return out


def _power_sum(q: ComplexArray, terms: int) -> ComplexArray:
    total = np.zeros_like(q)
    for k in range(terms, 0, -1):
        total = q * (1 / k**2 + total)
    return total
