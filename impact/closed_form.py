"""Green's functions in closed form: rods, springs, rigid bodies, infinite beams and plates."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens import Array, ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
from impact.modal import ModalGreens, Residual

_MEMORYLESS = 36.7  # exp(-36.7) = 1.1e-16: a mode that decays by this within a step remembers nothing


def spring(*, stiffness: float) -> ModalGreens:
    """Massless spring: u = N / stiffness [N/m]. The usual seat model, and the baseline beside every result."""
    _positive(stiffness=stiffness)
    return _closed(Residual.spring(1.0 / stiffness), kind="spring", stiffness=stiffness)


def semi_infinite_rod(*, young: float, density: float, area: float) -> ModalGreens:
    """Rod without reflections: g = 1/Z, Z = A sqrt(E rho) [N s/m]; a dashpot at its end."""
    _positive(young=young, density=density, area=area)
    z = area * math.sqrt(young * density)
    return _dashpot(1.0 / z, kind="semi_infinite_rod", young=young, density=density, area=area)


def infinite_plate(*, young: float, poisson: float, density: float, thickness: float) -> ModalGreens:
    """Infinite Kirchhoff plate struck at a point: g = 1/(8 sqrt(D rho h)), D = E h^3/(12 (1 - nu^2)).

    Source: Boussinesq; used for impact by Zener, Phys. Rev. 59 (1941) 669.
    """
    _positive(young=young, density=density, thickness=thickness)
    if not -1.0 < poisson < 0.5:
        raise GreensFunctionError(f"poisson = {poisson:g} is outside (-1, 0.5)")
    rigidity = young * thickness**3 / (12 * (1 - poisson**2))
    value = 1.0 / (8 * math.sqrt(rigidity * density * thickness))
    return _dashpot(value, kind="infinite_plate", young=young, poisson=poisson, density=density, thickness=thickness)


def infinite_beam(*, young: float, density: float, area: float, second_moment: float) -> PowerLaw:
    """Infinite Euler-Bernoulli beam struck at a point: g = C t^(1/2)/Gamma(3/2), C = (4EI/rho A)^(3/4)/(8EI).

    From EI u'''' + rho A s^2 u = F delta(x) in the Laplace domain, u(0) = F/(8 EI b^3), 4 b^4 = rho A s^2/EI.
    """
    _positive(young=young, density=density, area=area, second_moment=second_moment)
    ei = young * second_moment
    coefficient = (4 * ei / (density * area)) ** 0.75 / (8 * ei)
    return PowerLaw(coefficient / math.gamma(1.5), 0.5)


def single_mode(*, frequency_hz: float, mass: float, damping_ratio: float = 0.0) -> ModalGreens:
    """One damped oscillator of modal ``mass`` [kg] at the port; a bare one needs a compliant law or a residual."""
    _positive(frequency_hz=frequency_hz, mass=mass)
    omega = np.array([2 * np.pi * frequency_hz])
    shapes = np.array([[1.0 / math.sqrt(mass)]])
    origin = {"kind": "single_mode", "frequency_hz": frequency_hz, "mass": mass, "damping_ratio": damping_ratio}
    return ModalGreens(
        omega, np.array([damping_ratio]), shapes, Residual.none(), error=ErrorEstimate(0.0, 0.0), origin=origin
    )


def fixed_rod(
    *, young: float, density: float, area: float, length: float, damping_ratio: float = 0.0
) -> DelayRod | DampedFixedRod:
    """Elastic rod struck at one end, fixed at the other; exact, with or without uniform modal damping."""
    if damping_ratio == 0.0:
        return _delay_rod(young, density, area, length, reflection=-1.0)
    _positive(young=young, density=density, area=area, length=length, damping_ratio=damping_ratio)
    return DampedFixedRod(area * math.sqrt(young * density), length / math.sqrt(young / density), damping_ratio)


def free_rod(*, young: float, density: float, area: float, length: float) -> DelayRod:
    """Elastic rod struck at one end, free at the other; exact."""
    return _delay_rod(young, density, area, length, reflection=1.0)


def rod_with_end_impedance(
    *, young: float, density: float, area: float, length: float, end_impedance: float
) -> DelayRod:
    """Elastic rod whose far end moves against a dashpot ``end_impedance`` [N s/m]; 0 free, inf fixed."""
    _positive(young=young, density=density, area=area, length=length)
    if not end_impedance >= 0:
        raise GreensFunctionError(f"end_impedance = {end_impedance:g} must be >= 0: the end would feed energy")
    z = area * math.sqrt(young * density)
    reflection = -1.0 if math.isinf(end_impedance) else (z - end_impedance) / (z + end_impedance)
    return _delay_rod(young, density, area, length, reflection)


@dataclass(frozen=True)
class DelayRod(GreensFunction):
    """Undamped rod known by its reflections: g(t) = (1/Z) (H(t) + 2 sum_k R^k H(t - k T)).

    Attributes:
        impedance: Z = rho c A [N s/m].
        round_trip: T = 2 l/c [s].
        reflection: R of the particle velocity at the far end, -1 fixed ... +1 free.
    """

    impedance: float
    round_trip: float
    reflection: float

    @property
    def ports(self) -> tuple[str, ...]:
        """The struck end."""
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> dict[str, object]:
        """The three parameters."""
        return {
            "kind": "delay_rod",
            "impedance": self.impedance,
            "round_trip": self.round_trip,
            "reflection": self.reflection,
        }

    @property
    def mass(self) -> float:
        """rho A l = Z T/2 [kg]."""
        return self.impedance * self.round_trip / 2

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g(t) [m/(N s)], right-continuous at its jumps."""
        time: Array = np.asarray(t, dtype=float)
        n = np.floor(np.maximum(time, 0.0) / self.round_trip)
        return np.where(time < 0, 0.0, (1.0 + 2.0 * self._geometric(n)) / self.impedance)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S(t) [m/N]; the triangle wave for a fixed end."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        n, r = np.floor(time / self.round_trip), self.reflection
        if r == -1.0:
            phase = np.mod(time, 2 * self.round_trip)
            return np.asarray((self.round_trip - np.abs(phase - self.round_trip)) / self.impedance)
        if r == 1.0:
            return np.asarray((time + 2 * n * time - self.round_trip * n * (n + 1)) / self.impedance)
        delays = r * (1 - (n + 1) * r**n + n * r ** (n + 1)) / (1 - r) ** 2  # sum of k r^k
        return np.asarray((time + 2 * (time * self._geometric(n) - self.round_trip * delays)) / self.impedance)

    def _geometric(self, n: Array) -> Array:
        r = self.reflection
        return np.asarray(n if r == 1.0 else r * (1 - r**n) / (1 - r))

    def static_compliance(self) -> Array:
        """l/(EA) for a fixed end; ``inf`` otherwise."""
        value = self.round_trip / (2 * self.impedance) if self.reflection == -1.0 else np.inf
        return np.array([[value]])

    def initial_value(self) -> Array:
        """1/Z."""
        return np.array([[1.0 / self.impedance]])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Exact step weights."""
        return StepKernel(None, _weights(self, dt, n_steps), "delay kernel, exact step weights")


@dataclass(frozen=True)
class DampedFixedRod(GreensFunction):
    """Fixed rod, every mode damped by the same ratio zeta:

    g(t) = 4/(pi Z sqrt(1 - zeta^2)) Im artanh(exp(lambda t)), lambda = (-zeta + i sqrt(1 - zeta^2)) w_1,
    w_1 = pi c/(2 l); from the sum over w_n = (2n - 1) w_1. S(t) uses the Legendre chi function chi_2.

    Attributes:
        impedance: Z = rho c A [N s/m].
        transit: l/c [s].
        damping_ratio: zeta > 0; above 1 the pair of real exponents takes over.
    """

    impedance: float
    transit: float
    damping_ratio: float

    @property
    def ports(self) -> tuple[str, ...]:
        """The struck end."""
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> dict[str, object]:
        """The three parameters."""
        return {
            "kind": "damped_fixed_rod",
            "impedance": self.impedance,
            "transit": self.transit,
            "damping_ratio": self.damping_ratio,
        }

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

    def over_exponents(self, term: Callable[[complex], NDArray[np.complex128]]) -> Array:
        """4/(pi Z) times the divided difference of ``term`` over the pair of exponents."""
        z, w = self.damping_ratio, self.omega_1
        if abs(z - 1.0) < 1e-4:  # symmetric mean about the double exponent: error O(1e-8)
            near = [DampedFixedRod(self.impedance, self.transit, 1.0 + d).over_exponents(term) for d in (-2e-4, 2e-4)]
            return np.asarray((near[0] + near[1]) / 2)
        factor = 4 / (math.pi * self.impedance)
        if z < 1:
            root = math.sqrt(1 - z * z)
            return np.asarray(factor / root * np.imag(term(complex(-z, root) * w)))
        root = math.sqrt(z * z - 1)
        slow, fast = term(complex(-1 / (z + root)) * w), term(complex(-(z + root)) * w)
        return np.asarray(factor / (2 * root) * np.real(slow - fast))

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
            return StepKernel(None, _weights(self, dt, n_steps), "closed form, exact step weights")
        omega = (2.0 * np.arange(1, count + 1, dtype=np.float64) - 1.0) * np.float64(w)
        factor = 2 / (self.impedance * self.transit)
        tail = max(self.transit / self.impedance - math.fsum(factor / omega**2), 0.0)
        modal = ModalGreens(omega, np.full(count, z), np.full((count, 1), math.sqrt(factor)), Residual.spring(tail))
        return StepKernel(modal, None, f"pole recursion, {count} poles (all that outlive a step)")


@dataclass(frozen=True)
class PowerLaw(GreensFunction):
    """g(t) = coefficient * t^exponent, exponent > -1."""

    coefficient: float
    exponent: float

    @property
    def ports(self) -> tuple[str, ...]:
        """The struck point."""
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> dict[str, object]:
        """The two parameters."""
        return {"kind": "power_law", "coefficient": self.coefficient, "exponent": self.exponent}

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """coefficient * t^exponent [m/(N s)]."""
        time: Array = np.asarray(t, dtype=float)
        return np.where(time < 0, 0.0, self.coefficient * np.maximum(time, 0.0) ** self.exponent)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """coefficient * t^(exponent + 1)/(exponent + 1) [m/N]."""
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        return np.asarray(self.coefficient * time ** (self.exponent + 1) / (self.exponent + 1))

    def static_compliance(self) -> Array:
        """Unbounded."""
        return np.array([[np.inf]])

    def initial_value(self) -> Array:
        """0 for a positive exponent."""
        return np.array([[0.0 if self.exponent > 0 else self.coefficient if self.exponent == 0 else np.inf]])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Exact step weights."""
        return StepKernel(None, _weights(self, dt, n_steps), "closed form, exact step weights")


def damped_start(zeta: float) -> float:
    """Factor by which uniform modal damping lowers g(0+): (2/pi) acos(zeta)/sqrt(1 - zeta^2), acosh above 1."""
    if zeta < 0:
        raise GreensFunctionError(f"damping ratio {zeta:g} must be >= 0")
    if abs(zeta - 1) < 1e-6:
        return 2 / math.pi
    if zeta < 1:
        return 2 / math.pi * math.acos(zeta) / math.sqrt(1 - zeta * zeta)
    return 2 / math.pi * math.acosh(zeta) / math.sqrt(zeta * zeta - 1)


def _weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    return np.diff(greens.step_response(dt * np.arange(n_steps + 1)))[None, None, :]


def legendre_chi2(q: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """chi_2(q) = sum q^(2k+1)/(2k+1)^2 = (Li_2(q) - Li_2(-q))/2, complex |q| <= 1."""
    from scipy.special import spence  # here, as it would be a third of the time to import this package

    return np.asarray((spence(1 - q) - spence(1 + q)) / 2)


def _delay_rod(young: float, density: float, area: float, length: float, reflection: float) -> DelayRod:
    _positive(young=young, density=density, area=area, length=length)
    return DelayRod(area * math.sqrt(young * density), 2 * length / math.sqrt(young / density), reflection)


def _dashpot(value: float, **origin: object) -> ModalGreens:
    return _closed(Residual(np.array([[math.sqrt(value)]]), np.zeros(1), np.zeros((1, 1))), **origin)


def _closed(residual: Residual, **origin: object) -> ModalGreens:
    return ModalGreens(
        np.zeros(0), np.zeros(0), np.zeros((0, 1)), residual, error=ErrorEstimate(0.0, 0.0), origin=origin
    )


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise GreensFunctionError(f"{name} = {value:g} must be a positive, finite number")
