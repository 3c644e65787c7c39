"""Rods with uniform modal damping, in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens import Array, ExactPort, GreensFunctionError, StepKernel, step_weights
from impact.modal import ModalGreens, Residual

Term = Callable[[complex], NDArray[np.complex128]]
_MEMORYLESS = 36.7  # exp(-36.7) = 1.1e-16: a mode that decays by this within a step remembers nothing


@dataclass(frozen=True)
class DampedFixedRod(ExactPort):
    """Fixed rod, every mode damped by the same ratio zeta:

    g(t) = 4/(pi Z sqrt(1 - zeta^2)) Im artanh(exp(lambda t)), lambda = (-zeta + i sqrt(1 - zeta^2)) w_1,
    w_1 = pi c/(2 l); from the sum over w_n = (2n - 1) w_1. S(t) uses the Legendre chi function chi_2.

    Attributes:
        impedance: Z = rho c A [N s/m].
        transit: l/c [s].
        damping_ratio: zeta > 0; above 1 the pair of real exponents takes over.
    """

    kind: ClassVar[str] = "damped_fixed_rod"
    impedance: float
    transit: float
    damping_ratio: float

    @property
    def omega_1(self) -> float:
        """First angular frequency pi c/(2 l) [rad/s]."""
        return math.pi / (2 * self.transit)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g(t) [m/(N s)]; at t = 0 its limit from the right."""
        time: Array = np.asarray(t, dtype=float)
        positive = np.where(time > 0, time, 1.0)
        values = self.over_exponents(lambda rate: np.arctanh(np.exp(rate * positive)))
        return np.where(time > 0, values, np.where(time == 0, self.initial_value()[0, 0], 0.0))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S(t) [m/N]."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        return self.over_exponents(lambda rate: (legendre_chi2(np.exp(rate * time)) - math.pi**2 / 8) / rate)

    def over_exponents(self, term: Term) -> Array:
        """4/(pi Z) times the divided difference of ``term`` over the pair of exponents."""
        return 4 / (math.pi * self.impedance) * divided_difference(term, self.damping_ratio, self.omega_1)

    def static_compliance(self) -> Array:
        """l/(EA) [m/N], whatever the damping."""
        return np.array([[self.transit / self.impedance]])

    def initial_value(self) -> Array:
        """g(0+) = (2/pi) acos(zeta)/sqrt(1 - zeta^2)/Z [m/(N s)]."""
        return np.array([[damped_start(self.damping_ratio) / self.impedance]])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """The modes that outlive a step and the compliance of those that do not: exact to round-off at this step.

        A mode with decay * dt > 36.7 follows a stepwise force like a spring. With too many such modes, exact weights.
        """
        z, w = self.damping_ratio, self.omega_1
        slow = z if z < 1 else 1 / (z + math.sqrt(z * z - 1))
        count = int(min(_MEMORYLESS / (slow * w * dt) / 2 + 1, 1e9))
        if count > 20_000 or count * float(n_steps) > 5e9:
            return StepKernel(None, step_weights(self, dt, n_steps), "closed form, exact step weights")
        omega = (2.0 * np.arange(1, count + 1, dtype=np.float64) - 1.0) * np.float64(w)
        factor = 2 / (self.impedance * self.transit)
        tail = max(self.transit / self.impedance - math.fsum(factor / omega**2), 0.0)
        modal = ModalGreens(omega, np.full(count, z), np.full((count, 1), math.sqrt(factor)), Residual.spring(tail))
        return StepKernel(modal, None, f"pole recursion, {count} poles (all that outlive a step)")


@dataclass(frozen=True)
class DampedFreeRod(ExactPort):
    """Free rod, every elastic mode damped by the same ratio zeta, its translation not at all:

    g(t) = t/m - 2/(pi Z sqrt(1 - zeta^2)) Im ln(1 - exp(lambda t)), lambda = (-zeta + i sqrt(1 - zeta^2)) w_1,
    w_1 = pi c/l, m = Z l/c; from the sum over w_n = n w_1. S(t) uses the dilogarithm.

    Attributes:
        impedance: Z = rho c A [N s/m].
        transit: l/c [s].
        damping_ratio: zeta > 0; above 1 the pair of real exponents takes over.
    """

    kind: ClassVar[str] = "damped_free_rod"
    impedance: float
    transit: float
    damping_ratio: float

    @property
    def mass(self) -> float:
        """rho A l = Z l/c [kg]."""
        return self.impedance * self.transit

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g(t) [m/(N s)]; at t = 0 its limit from the right."""
        time: Array = np.asarray(t, dtype=float)
        positive = np.where(time > 0, time, 1.0)
        values = positive / self.mass + self._elastic(lambda rate: -np.log(-np.expm1(rate * positive)))
        return np.where(time > 0, values, np.where(time == 0, self.initial_value()[0, 0], 0.0))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S(t) [m/N]."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        elastic = self._elastic(lambda rate: (dilogarithm(np.exp(rate * time)) - math.pi**2 / 6) / rate)
        return np.asarray(time**2 / (2 * self.mass) + elastic)

    def _elastic(self, term: Term) -> Array:
        omega_1 = math.pi / self.transit
        return 2 / (math.pi * self.impedance) * divided_difference(term, self.damping_ratio, omega_1)

    def static_compliance(self) -> Array:
        """Unbounded."""
        return np.array([[np.inf]])

    def initial_value(self) -> Array:
        """g(0+) = (2/pi) acos(zeta)/sqrt(1 - zeta^2)/Z [m/(N s)]."""
        return np.array([[damped_start(self.damping_ratio) / self.impedance]])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Exact step weights."""
        return StepKernel(None, step_weights(self, dt, n_steps), "closed form, exact step weights")


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


def legendre_chi2(q: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """chi_2(q) = sum q^(2k+1)/(2k+1)^2 = (Li_2(q) - Li_2(-q))/2, complex |q| <= 1."""
    return np.asarray((dilogarithm(q) - dilogarithm(-q)) / 2)


def dilogarithm(q: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Li_2(q) = sum q^k/k^2, complex |q| <= 1."""
    from scipy.special import spence  # here, as it would be a third of the time to import this package

    return np.asarray(spence(1 - q))
