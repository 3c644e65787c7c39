"""Rods with uniform modal damping, in closed form."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from impact.exact.rods import ExactRod, Term, damped_start, dilogarithm, divided_difference, legendre_chi2
from impact.greens.answers import Array, ComplexArray, Rod, StepKernel, check_factor
from impact.greens.modal import ModalGreens, Residual
from impact.greens.stated import ExactPort

_MEMORYLESS = 36.7  # exp(-36.7) = 1.1e-16: a mode that decays by this within a step remembers nothing
_AT_REST = 40.0  # exp(-40) = 4e-18: the step response is the static compliance


@dataclass(frozen=True)
class DampedRod(ExactPort):
    """A rod, every elastic mode damped by the same ratio zeta; its far end decides which modes it has.

    ``impedance``: Z = rho c A [N s/m]; ``transit``: l/c [s]; ``damping_ratio``: zeta > 0, above 1 a pair of real
    exponents.
    """

    reflection: ClassVar[float]
    impedance: float
    transit: float
    damping_ratio: float

    @property
    def rod(self) -> Rod:
        return Rod(self.impedance, self.transit, self.reflection, self.damping_ratio)

    @property
    def highest_rate(self) -> float:
        return 10 / self.transit

    def scaled(self, factor: float) -> Self:
        return replace(self, impedance=self.impedance / check_factor(factor))

    def initial_value(self) -> Array:
        """Return g(0+) = (2/pi) acos(zeta)/sqrt(1 - zeta^2)/Z [m/(N s)]."""
        return np.array([[damped_start(self.damping_ratio) / self.impedance]])

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.asarray(t, dtype=float)
        values = self._after_start(np.where(time > 0, time, 1.0))
        return np.where(time > 0, values, np.where(time == 0, self.initial_value()[0, 0], 0.0))

    @abstractmethod
    def _after_start(self, time: Array) -> Array:
        """Return g at times > 0."""


@dataclass(frozen=True)
class DampedFixedRod(DampedRod, ExactRod):
    """Fixed rod with uniform modal damping:

    g(t) = 4/(pi Z sqrt(1 - zeta^2)) Im artanh(exp(lambda t)), lambda = (-zeta + i sqrt(1 - zeta^2)) w_1,
    w_1 = pi c/(2 l); from the sum over w_n = (2n - 1) w_1. S(t) uses the Legendre chi function chi_2.
    """

    kind: ClassVar[str] = "damped_fixed_rod"
    reflection: ClassVar[float] = -1.0
    most_poles: ClassVar[tuple[int, float]] = 20_000, 1e9
    """Poles, and poles times steps, up to which it is marched by poles: these tell the energy stored from that lost."""

    def forces_only(self) -> BareFixedRod:
        return BareFixedRod(self.impedance, self.transit, self.damping_ratio)

    @property
    def omega_1(self) -> float:
        """Return the first angular frequency pi c/(2 l) [rad/s]."""
        return math.pi / (2 * self.transit)

    @property
    def slowest_decay(self) -> float:
        """Return the smallest of all decay rates: zeta w_1, above critical damping w_1/(zeta + sqrt(zeta^2 - 1))
        [1/s]."""
        z = self.damping_ratio
        return self.omega_1 * (z if z < 1 else 1 / (z + math.sqrt(z * z - 1)))

    def _after_start(self, time: Array) -> Array:
        return self._over_exponents(lambda rate: np.arctanh(np.exp(rate * time)))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        moving = time < _AT_REST / self.slowest_decay
        now, out = time[moving], np.full(time.shape, self.transit / self.impedance)
        out[moving] = self._over_exponents(lambda rate: (legendre_chi2(np.exp(rate * now)) - math.pi**2 / 8) / rate)
        return out

    def displacement_at(self, time: Array, at: float) -> Array:
        """Return the sum of chi_2 that `impact.after.rods.displacement_response` states."""
        turn = 0.5j * math.pi * at

        def term(rate: complex) -> ComplexArray:
            return (legendre_chi2(np.exp(rate * time + turn)) + legendre_chi2(np.exp(rate * time - turn))) / 2 / rate

        return np.asarray((1 - at) * self.transit / self.impedance + self._over_exponents(term))

    def force_at(self, time: Array, at: float) -> Array:
        """Return minus the derivative of the displacement along x; its limit from the right at t = 0."""
        if at == 0.0:
            return np.ones_like(time)
        turn, slope = 0.5j * math.pi * at, self.impedance * self.omega_1  # EA d theta/dx

        def term(rate: complex) -> ComplexArray:
            pair = np.arctanh(np.exp(rate * time + turn)) - np.arctanh(np.exp(rate * time - turn))
            return np.asarray(pair * (0.5j * slope / rate))

        return np.asarray(np.where(time > 0, 1.0 - self._over_exponents(term), 0.0))

    def _over_exponents(self, term: Term) -> Array:
        """Return 4/(pi Z) times the divided difference of ``term`` over the pair of exponents."""
        return 4 / (math.pi * self.impedance) * divided_difference(term, self.damping_ratio, self.omega_1)

    def static_compliance(self) -> Array:
        """Return l/(EA) [m/N], whatever the damping."""
        return np.array([[self.transit / self.impedance]])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Return the modes that outlive a step and the compliance of those that do not: exact at this step.

        A mode with decay * dt > 36.7 follows a stepwise force like a spring. With too many that do not, exact weights.
        """
        count = self.lasting_modes(dt)
        if not self.marches(dt, n_steps):
            return super().step_kernel(dt, n_steps)
        return StepKernel(self.modes(count), None, f"pole recursion, {count} poles (all that outlive a step)")

    def modes(self, count: int) -> ModalGreens:
        """Return the first ``count`` modes, and the compliance of the rest."""
        omega = (2.0 * np.arange(1, count + 1, dtype=np.float64) - 1.0) * np.float64(self.omega_1)
        factor = 2 / (self.impedance * self.transit)
        tail = max(self.transit / self.impedance - math.fsum(factor / omega**2), 0.0)
        damping, shapes = np.full(count, self.damping_ratio), np.full((count, 1), math.sqrt(factor))
        return ModalGreens(omega, damping, shapes, Residual.spring(tail))

    def marches(self, dt: float, n_steps: float) -> bool:
        """Return whether its memory is that of poles, over ``n_steps`` of ``dt`` [s]; else of exact step weights."""
        (most, most_in_all), count = self.most_poles, self.lasting_modes(dt)
        return count <= most and count * float(n_steps) <= most_in_all

    def marched_poles(self, dt: float, n_steps: float) -> int | None:
        return self.lasting_modes(dt) if self.marches(dt, n_steps) else None

    def lasting_modes(self, dt: float) -> int:
        """Return how many modes are not at rest again within a step ``dt`` [s]."""
        return int(min(_MEMORYLESS / (self.slowest_decay * dt) / 2 + 1, 1e9))


class BareFixedRod(DampedFixedRod):
    """The same rod where nobody asks for its energies: by step weights as soon as these are faster."""

    most_poles: ClassVar[tuple[int, float]] = 500, math.inf  # the benchmark `rod_kernels`


@dataclass(frozen=True)
class DampedFreeRod(DampedRod):
    """Free rod, every elastic mode damped by the same ratio zeta, its translation not at all:

    g(t) = t/m - 2/(pi Z sqrt(1 - zeta^2)) Im ln(1 - exp(lambda t)), lambda = (-zeta + i sqrt(1 - zeta^2)) w_1,
    w_1 = pi c/l, m = Z l/c; from the sum over w_n = n w_1. S(t) uses the dilogarithm.
    """

    kind: ClassVar[str] = "damped_free_rod"
    reflection: ClassVar[float] = 1.0

    def inverse_mass(self) -> Array:
        """Return 1/(rho A l) = c/(Z l) [1/kg]."""
        return np.array([[1 / (self.impedance * self.transit)]])

    def _after_start(self, time: Array) -> Array:
        elastic = self._elastic(lambda rate: -np.log(-np.expm1(rate * time)))
        return np.asarray(time * self.inverse_mass()[0, 0] + elastic)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        elastic = self._elastic(lambda rate: (dilogarithm(np.exp(rate * time)) - math.pi**2 / 6) / rate)
        return np.asarray(time**2 / 2 * self.inverse_mass()[0, 0] + elastic)

    def _elastic(self, term: Term) -> Array:
        omega_1 = math.pi / self.transit
        return 2 / (math.pi * self.impedance) * divided_difference(term, self.damping_ratio, omega_1)

    def static_compliance(self) -> Array:
        return np.array([[np.inf]])
