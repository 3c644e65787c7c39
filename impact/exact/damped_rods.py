"""Rods with uniform modal damping, in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens.base import Array, GreensFunctionError, Rod, StepKernel, check_factor
from impact.greens.exact_port import ExactPort, step_weights
from impact.greens.modal import ModalGreens, Residual

Term = Callable[[complex], NDArray[np.complex128]]
_MEMORYLESS = 36.7  # exp(-36.7) = 1.1e-16: a mode that decays by this within a step remembers nothing
_AT_REST = 40.0  # exp(-40) = 4e-18: the step response is the static compliance
_TINY, _SMALL = 1e-4, 0.4  # |q| up to which the power series of the dilogarithm is summed


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
    most_poles: ClassVar[tuple[int, float]] = 20_000, 1e9
    """Poles, and poles times steps, up to which it is marched by poles: these tell the energy stored from that lost."""
    impedance: float
    transit: float
    damping_ratio: float

    @property
    def rod(self) -> Rod:
        """Itself."""
        return Rod(self.impedance, self.transit, -1.0, self.damping_ratio)

    @property
    def highest_rate(self) -> float:
        """Ten radians per transit [rad/s]."""
        return 10 / self.transit

    def scaled(self, factor: float) -> Self:
        """A rod of 1/``factor`` the section."""
        return replace(self, impedance=self.impedance / check_factor(factor))

    def forces_only(self) -> BareFixedRod:
        """By step weights as soon as these are faster."""
        return BareFixedRod(self.impedance, self.transit, self.damping_ratio)

    @property
    def omega_1(self) -> float:
        """First angular frequency pi c/(2 l) [rad/s]."""
        return math.pi / (2 * self.transit)

    @property
    def slowest_decay(self) -> float:
        """Smallest of all decay rates: zeta w_1, above critical damping w_1/(zeta + sqrt(zeta^2 - 1)) [1/s]."""
        z = self.damping_ratio
        return self.omega_1 * (z if z < 1 else 1 / (z + math.sqrt(z * z - 1)))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g(t) [m/(N s)]; at t = 0 its limit from the right."""
        time: Array = np.asarray(t, dtype=float)
        positive = np.where(time > 0, time, 1.0)
        values = self.over_exponents(lambda rate: np.arctanh(np.exp(rate * positive)))
        return np.where(time > 0, values, np.where(time == 0, self.initial_value()[0, 0], 0.0))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S(t) [m/N]."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        moving = time < _AT_REST / self.slowest_decay
        now, out = time[moving], np.full(time.shape, self.transit / self.impedance)
        out[moving] = self.over_exponents(lambda rate: (legendre_chi2(np.exp(rate * now)) - math.pi**2 / 8) / rate)
        return out

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

        A mode with decay * dt > 36.7 follows a stepwise force like a spring. With too many that do not, exact weights.
        """
        count = self.lasting_modes(dt)
        if not self.marches(dt, n_steps):
            return StepKernel(None, step_weights(self, dt, n_steps), "closed form, exact step weights")
        return StepKernel(self.modes(count), None, f"pole recursion, {count} poles (all that outlive a step)")

    def modes(self, count: int) -> ModalGreens:
        """The first ``count`` modes, and the compliance of the rest."""
        omega = (2.0 * np.arange(1, count + 1, dtype=np.float64) - 1.0) * np.float64(self.omega_1)
        factor = 2 / (self.impedance * self.transit)
        tail = max(self.transit / self.impedance - math.fsum(factor / omega**2), 0.0)
        damping, shapes = np.full(count, self.damping_ratio), np.full((count, 1), math.sqrt(factor))
        return ModalGreens(omega, damping, shapes, Residual.spring(tail))

    def marches(self, dt: float, n_steps: float) -> bool:
        """Whether its memory is that of poles, over ``n_steps`` of ``dt`` [s]; else of exact step weights."""
        (most, most_in_all), count = self.most_poles, self.lasting_modes(dt)
        return count <= most and count * float(n_steps) <= most_in_all

    def marched_poles(self, dt: float, n_steps: float) -> int | None:
        """The modes that outlive a step, where they are marched."""
        return self.lasting_modes(dt) if self.marches(dt, n_steps) else None

    def lasting_modes(self, dt: float) -> int:
        """How many modes are not at rest again within a step ``dt`` [s]."""
        return int(min(_MEMORYLESS / (self.slowest_decay * dt) / 2 + 1, 1e9))


class BareFixedRod(DampedFixedRod):
    """The same rod where nobody asks for its energies: by step weights as soon as these are faster."""

    most_poles: ClassVar[tuple[int, float]] = 500, math.inf  # the benchmark `rod_kernels`


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
    def rod(self) -> Rod:
        """Itself."""
        return Rod(self.impedance, self.transit, 1.0, self.damping_ratio)

    @property
    def highest_rate(self) -> float:
        """Ten radians per transit [rad/s]."""
        return 10 / self.transit

    def inverse_mass(self) -> Array:
        """1/(rho A l) = c/(Z l) [1/kg]."""
        return np.array([[1 / (self.impedance * self.transit)]])

    def scaled(self, factor: float) -> Self:
        """A rod of 1/``factor`` the section."""
        return replace(self, impedance=self.impedance / check_factor(factor))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g(t) [m/(N s)]; at t = 0 its limit from the right."""
        time: Array = np.asarray(t, dtype=float)
        positive = np.where(time > 0, time, 1.0)
        values = positive * self.inverse_mass()[0, 0] + self._elastic(lambda rate: -np.log(-np.expm1(rate * positive)))
        return np.where(time > 0, values, np.where(time == 0, self.initial_value()[0, 0], 0.0))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S(t) [m/N]."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        elastic = self._elastic(lambda rate: (dilogarithm(np.exp(rate * time)) - math.pi**2 / 6) / rate)
        return np.asarray(time**2 / 2 * self.inverse_mass()[0, 0] + elastic)

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


def _power_sum(q: NDArray[np.complex128], terms: int) -> NDArray[np.complex128]:
    total = np.zeros_like(q)
    for k in range(terms, 0, -1):
        total = q * (1 / k**2 + total)
    return total
