"""Green's functions in closed form: rods, springs, rigid bodies, infinite beams and plates.

Rods are uniform: undamped ones by their reflections, struck at one or both ends, and uniformly damped ones. Arguments
are SI. Every function that makes one raises `GreensFunctionError`, naming the argument and its value, for one that is
not a positive, finite number (a damping ratio of 0 is none at all).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import scipy
from numpy.typing import ArrayLike

from impact.greens import base, modal
from impact.greens.base import Array, ComplexArray


@dataclass(frozen=True)
class TwoEndedRod(base.ExactPort):
    """Undamped free rod with a port at either end, both displaced along the same normal:

    g_11 = g_22 = (1/Z) (H(t) + 2 sum_k H(t - k T)),  g_12 = (2/Z) sum_k H(t - (k - 1/2) T),  k = 1, 2, ...

    ``impedance``: Z = rho c A [N s/m]; ``round_trip``: T = 2 l/c [s].
    """

    kind: ClassVar[str] = "two_ended_rod"
    memory: ClassVar[str] = "delay kernel"
    impedance: float
    round_trip: float

    @property
    def one(self) -> DelayRod:
        """Return the Green's function of one end alone, a free rod."""
        return DelayRod(self.impedance, self.round_trip, 1.0)

    @property
    def ports(self) -> tuple[str, ...]:
        return ("front", "back")

    @property
    def highest_rate(self) -> float:
        return self.one.highest_rate

    def inverse_mass(self) -> Array:
        """Return 1/(rho A l) between any two ends [1/kg]."""
        return np.full((2, 2), float(self.one.inverse_mass()[0, 0]))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        if i == j:
            return self.one.impulse_response(t)
        arrived = np.floor(np.asarray(t, dtype=float) / self.round_trip + 0.5)
        return np.asarray(2 * np.maximum(arrived, 0.0) / self.impedance)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        if i == j:
            return self.one.step_response(t)
        return self.one.displacement_at(np.maximum(np.asarray(t, dtype=float), 0.0), 1.0)

    def static_compliance(self) -> Array:
        return np.full((2, 2), math.inf)

    def initial_value(self) -> Array:
        return np.eye(2) / self.impedance


def rod_of_two_ends(*, young: float, density: float, area: float, length: float) -> TwoEndedRod:
    """Return an undamped free rod, E [Pa], rho [kg/m^3], A [m^2], l [m], struck at its ends "front" and "back".

    Displacements of both ends are along one normal: of two forces that press the rod together one is < 0. Raises
    `GreensFunctionError` for an argument that is not positive and finite.
    """
    base.check_positive(young=young, density=density, area=area, length=length)
    return TwoEndedRod(area * math.sqrt(young * density), 2 * length / math.sqrt(young / density))


class ExactRod(base.ExactPort):
    """A rod that is known in closed form at every place along it, not at its struck end alone."""

    @property
    @abstractmethod
    def rod(self) -> base.Rod:
        """Return its impedance, transit, reflection and damping."""

    @abstractmethod
    def displacement_at(self, time: Array, at: float) -> Array:
        """Return S(x, t) [m/N] at times >= 0 and ``at`` = x/l: see `impact.after.rods.displacement_response`."""

    @abstractmethod
    def force_at(self, time: Array, at: float) -> Array:
        """Return E(x, t) [1] at times >= 0 and ``at`` = x/l: see `impact.after.rods.force_response`."""


def reflect(sent: Array, reflection: float, steps: int) -> Array:
    """Return the outgoing wave a = f + R a(t - T) (n,) of a rod, f = ``sent`` (n,), whose waves return after T, so many
    ``steps``, times R = ``reflection``.

    Round trips are doubled: with S the delay by T, 1/(1 - R S) = (1 + R S) (1 + R^2 S^2) (1 + R^4 S^4) ...
    """
    outgoing, delay, gain = np.array(sent, dtype=float), steps, reflection
    while delay < len(outgoing):
        outgoing[delay:] += gain * outgoing[:-delay]
        delay, gain = 2 * delay, gain**2
    return outgoing


def check_on_rod(at: float) -> float:
    """Return a position x/l on a rod; raises `GreensFunctionError` for one off it."""
    if not 0.0 <= at <= 1.0:
        raise base.GreensFunctionError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    return at


@dataclass(frozen=True)
class DelayRod(ExactRod):
    """Undamped rod known by its reflections: g(t) = (1/Z) (H(t) + 2 sum_k R^k H(t - k T)).

    ``impedance``: Z = rho c A [N s/m]; ``round_trip``: T = 2 l/c [s]; ``reflection``: R of the particle velocity at the
    far end, -1 fixed ... +1 free.
    """

    kind: ClassVar[str] = "delay_rod"
    memory: ClassVar[str] = "delay kernel"
    impedance: float
    round_trip: float
    reflection: float

    @property
    def rod(self) -> base.Rod:
        return base.Rod(self.impedance, self.round_trip / 2, self.reflection)

    @property
    def highest_rate(self) -> float:
        return 20 / self.round_trip

    def inverse_mass(self) -> Array:
        """Return 1/(rho A l) = 2/(Z T) of a free rod, 0 where its end meets a resistance [1/kg]."""
        return np.array([[2 / (self.impedance * self.round_trip) if self.reflection == 1.0 else 0.0]])

    def scaled(self, factor: float) -> DelayRod:
        return replace(self, impedance=self.impedance / base.check_factor(factor))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.asarray(t, dtype=float)
        n = np.floor(np.maximum(time, 0.0) / self.round_trip)
        return np.where(time < 0, 0.0, (1.0 + 2.0 * self._geometric(n)) / self.impedance)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        n, r = np.floor(time / self.round_trip), self.reflection
        if r == -1.0:  # a triangle wave
            phase = np.mod(time, 2 * self.round_trip)
            return np.asarray((self.round_trip - np.abs(phase - self.round_trip)) / self.impedance)
        if r == 1.0:
            return np.asarray((time + 2 * n * time - self.round_trip * n * (n + 1)) / self.impedance)
        delays = _sum_of_k_powers(r, n)
        return np.asarray((time + 2 * (time * self._geometric(n) - self.round_trip * delays)) / self.impedance)

    def _geometric(self, n: Array) -> Array:
        r = self.reflection
        return np.asarray(n if r == 1.0 else r * (1 - r**n) / (1 - r))

    def static_compliance(self) -> Array:
        """Return l/(EA) for a fixed end; ``inf`` otherwise."""
        value = self.round_trip / (2 * self.impedance) if self.reflection == -1.0 else np.inf
        return np.array([[value]])

    def initial_value(self) -> Array:
        return np.array([[1.0 / self.impedance]])

    def displacement_at(self, time: Array, at: float) -> Array:
        """Return S = (1/Z) sum_k R^k [<t - x/c - kT> + R <t + x/c - (k+1)T>],  <s> = max(s, 0)."""
        delay = at * self.round_trip / 2
        outgoing, back = self._ramps(time - delay), self._ramps(time + delay - self.round_trip)
        return np.asarray((outgoing + self.reflection * back) / self.impedance)

    def force_at(self, time: Array, at: float) -> Array:
        """Return E = sum_k R^k [H(t - x/c - kT) - R H(t + x/c - (k+1)T)]; right-continuous."""
        delay = at * self.round_trip / 2
        outgoing, back = self._fronts(time - delay), self._fronts(time + delay - self.round_trip)
        return np.asarray(outgoing - self.reflection * back)

    def _fronts(self, s: Array) -> Array:
        """Return sum_k R^k H(s - k T); round-off below a whole number of trips is taken as that number."""
        relative = s / self.round_trip
        nearest = np.round(relative)
        settled = np.where(np.abs(relative - nearest) < 1e-9, nearest, relative)
        n, r = np.floor(np.maximum(settled, -1.0)) + 1.0, self.reflection
        count = n if r == 1.0 else (1 - r**n) / (1 - r)
        return np.asarray(np.where(n > 0, count, 0.0))

    def _ramps(self, s: Array) -> Array:
        """Return sum_k R^k <s - k T>."""
        s, r = np.maximum(s, 0.0), self.reflection
        n = np.floor(s / self.round_trip)
        if r == 1.0:
            return np.asarray((n + 1) * (s - self.round_trip * n / 2))
        delays = _sum_of_k_powers(r, n)
        return np.asarray(s * (1 - r ** (n + 1)) / (1 - r) - self.round_trip * delays)


def _sum_of_k_powers(r: float, n: Array) -> Array:
    """Return the sum of k r^k, k = 1 ... n."""
    return np.asarray(r * (1 - (n + 1) * r**n + n * r ** (n + 1)) / (1 - r) ** 2)


Term = Callable[[complex], ComplexArray]
_TINY, _SMALL = 1e-4, 0.4  # |q| up to which 4, and 36, terms of the dilogarithm's power series are summed


def divided_difference(term: Term, zeta: float, omega: float) -> Array:
    """Return (term(lambda) - term(conj lambda))/(2 i sqrt(1 - zeta^2)), lambda = (-zeta + i sqrt(1 - zeta^2)) omega.

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
    """Return the factor of uniform modal damping on g(0+): (2/pi) acos(zeta)/sqrt(1 - zeta^2), acosh above 1."""
    if zeta < 0:
        raise base.GreensFunctionError(f"damping ratio {zeta:g} must be >= 0")
    if abs(zeta - 1) < 1e-6:
        return 2 / math.pi
    if zeta < 1:
        return 2 / math.pi * math.acos(zeta) / math.sqrt(1 - zeta * zeta)
    return 2 / math.pi * math.acosh(zeta) / math.sqrt(zeta * zeta - 1)


def legendre_chi2(q: ComplexArray) -> ComplexArray:
    """Return chi_2(q) = sum q^(2k+1)/(2k+1)^2 = (Li_2(q) - Li_2(-q))/2, complex |q| <= 1."""
    return np.asarray((dilogarithm(q) - dilogarithm(-q)) / 2)


def dilogarithm(q: ComplexArray) -> ComplexArray:
    """Return Li_2(q) = sum q^k/k^2, complex |q| <= 1; by this sum where it is short, as for a rod nearly at rest."""
    q = np.asarray(q)
    size, out = np.abs(q), np.empty_like(q)
    parts = ((size <= _TINY, 4), ((size > _TINY) & (size <= _SMALL), 36))  # the term left out is below 1e-17 of the sum
    for chosen, terms in parts:
        total, few = np.zeros_like(q[chosen]), q[chosen]
        for k in range(terms, 0, -1):
            total = few * (1 / k**2 + total)
        out[chosen] = total
    large = ~(size <= _SMALL)
    out[large] = scipy.special.spence(1 - q[large])
    return out


_MEMORYLESS = 36.7  # exp(-36.7) = 1.1e-16: a mode that decays by this within a step remembers nothing
_AT_REST = 40.0  # exp(-40) = 4e-18: the step response is the static compliance


@dataclass(frozen=True)
class DampedRod(base.ExactPort):
    """A rod, every elastic mode damped by the same ratio zeta; its far end decides which modes it has.

    ``impedance``: Z = rho c A [N s/m]; ``transit``: l/c [s]; ``damping_ratio``: zeta > 0, above 1 a pair of real
    exponents.
    """

    reflection: ClassVar[float]
    impedance: float
    transit: float
    damping_ratio: float

    @property
    def rod(self) -> base.Rod:
        return base.Rod(self.impedance, self.transit, self.reflection, self.damping_ratio)

    @property
    def highest_rate(self) -> float:
        return 10 / self.transit

    def scaled(self, factor: float) -> Self:
        return replace(self, impedance=self.impedance / base.check_factor(factor))

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
        """Return the smallest of all decay rates: zeta w_1, overdamped w_1/(zeta + sqrt(zeta^2 - 1)) [1/s]."""
        z = self.damping_ratio
        return self.omega_1 * (z if z < 1 else 1 / (z + math.sqrt(z * z - 1)))

    def _after_start(self, time: Array) -> Array:
        return self._take_difference(lambda rate: np.arctanh(np.exp(rate * time)))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        time: Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        moving = time < _AT_REST / self.slowest_decay
        now, out = time[moving], np.full(time.shape, self.transit / self.impedance)
        out[moving] = self._take_difference(lambda rate: (legendre_chi2(np.exp(rate * now)) - math.pi**2 / 8) / rate)
        return out

    def displacement_at(self, time: Array, at: float) -> Array:
        """Return the sum of chi_2 that `impact.after.rods.displacement_response` states."""
        turn = 0.5j * math.pi * at

        def term(rate: complex) -> ComplexArray:
            return (legendre_chi2(np.exp(rate * time + turn)) + legendre_chi2(np.exp(rate * time - turn))) / 2 / rate

        return np.asarray((1 - at) * self.transit / self.impedance + self._take_difference(term))

    def force_at(self, time: Array, at: float) -> Array:
        """Return minus the derivative of the displacement along x; its limit from the right at t = 0."""
        if at == 0.0:
            return np.ones_like(time)
        turn, slope = 0.5j * math.pi * at, self.impedance * self.omega_1  # EA d theta/dx

        def term(rate: complex) -> ComplexArray:
            pair = np.arctanh(np.exp(rate * time + turn)) - np.arctanh(np.exp(rate * time - turn))
            return np.asarray(pair * (0.5j * slope / rate))

        return np.asarray(np.where(time > 0, 1.0 - self._take_difference(term), 0.0))

    def _take_difference(self, term: Term) -> Array:
        """Return 4/(pi Z) times the divided difference of ``term`` over the pair of exponents."""
        return 4 / (math.pi * self.impedance) * divided_difference(term, self.damping_ratio, self.omega_1)

    def static_compliance(self) -> Array:
        """Return l/(EA) [m/N], whatever the damping."""
        return np.array([[self.transit / self.impedance]])

    def step_kernel(self, dt: float, n_steps: int) -> base.StepKernel:
        """Return the modes that outlive a step and the compliance of those that do not: exact at this step.

        A mode with decay * dt > 36.7 follows a stepwise force like a spring. With too many that do not, exact weights.
        """
        count = self.lasting_modes(dt)
        if not self.marches(dt, n_steps):
            return super().step_kernel(dt, n_steps)
        return base.StepKernel(self.modes(count), None, f"pole recursion, {count} poles (all that outlive a step)")

    def modes(self, count: int) -> modal.ModalGreens:
        """Return the first ``count`` modes, and the compliance of the rest."""
        omega = (2.0 * np.arange(1, count + 1, dtype=np.float64) - 1.0) * np.float64(self.omega_1)
        factor = 2 / (self.impedance * self.transit)
        tail = max(self.transit / self.impedance - math.fsum(factor / omega**2), 0.0)
        damping, shapes = np.full(count, self.damping_ratio), np.full((count, 1), math.sqrt(factor))
        return modal.ModalGreens(omega, damping, shapes, modal.Residual.spring(tail))

    def marches(self, dt: float, n_steps: float) -> bool:
        """Return whether its memory is that of poles, over ``n_steps`` of ``dt`` [s]; else of exact step weights."""
        (most, most_in_all), count = self.most_poles, self.lasting_modes(dt)
        return count <= most and count * float(n_steps) <= most_in_all

    def lasting_modes(self, dt: float) -> int:
        """Return how many modes are not at rest again within a step ``dt`` [s]."""
        return int(min(_MEMORYLESS / (self.slowest_decay * dt) / 2 + 1, 1e9))


class BareFixedRod(DampedFixedRod):
    """The fixed rod without its energies: by step weights as soon as these are faster than poles."""

    most_poles: ClassVar[tuple[int, float]] = 500, math.inf  # there both took as long


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


def spring(*, stiffness: float) -> modal.ModalGreens:
    """Return a massless spring: u = N/k, ``stiffness`` k [N/m]. The usual seat model, and baseline of every result."""
    base.check_positive(stiffness=stiffness)
    return _closed(modal.Residual.spring(1.0 / stiffness), kind="spring", stiffness=stiffness)


def semi_infinite_rod(
    *, young: float, density: float, area: float, length: float = math.inf, damping_ratio: float = 0.0
) -> modal.ModalGreens:
    """Return a rod without reflections: a dashpot, g = 1/Z, Z = A sqrt(E rho) [N s/m].

    It takes the arguments of the other rods, to stand in for them: ``length`` has no effect, and ``damping_ratio``
    that of the limit length -> inf of a rod with uniform modal damping, g = (2/pi) acos(zeta)/sqrt(1 - zeta^2)/Z.
    """
    base.check_positive(young=young, density=density, area=area)
    if length != math.inf:
        base.check_positive(length=length)
    value = damped_start(damping_ratio) / (area * math.sqrt(young * density))
    origin = {"young": young, "density": density, "area": area, "damping_ratio": damping_ratio}
    return _dashpot(value, kind="semi_infinite_rod", **origin)


def infinite_plate(*, young: float, poisson: float, density: float, thickness: float) -> modal.ModalGreens:
    """Return an infinite Kirchhoff plate struck at a point: g = 1/(8 sqrt(D rho h)), D = E h^3/(12 (1 - nu^2)).

    E [Pa], rho [kg/m^3], h [m]. Source: Boussinesq; used for impact by Zener, Phys. Rev. 59 (1941) 669.
    """
    base.check_positive(young=young, density=density, thickness=thickness)
    if not -1.0 < poisson < 0.5:
        raise base.GreensFunctionError(f"poisson = {poisson:g} is outside (-1, 0.5)")
    rigidity = young * thickness**3 / (12 * (1 - poisson**2))
    value = 1.0 / (8 * math.sqrt(rigidity * density * thickness))
    return _dashpot(value, kind="infinite_plate", young=young, poisson=poisson, density=density, thickness=thickness)


def infinite_beam(*, young: float, density: float, area: float, second_moment: float) -> PowerGreens:
    """Return an infinite Euler-Bernoulli beam struck at a point: g = C t^(1/2)/Gamma(3/2), C = (4EI/rho A)^(3/4)/(8EI).

    E [Pa], rho [kg/m^3], A [m^2], I [m^4]; from u(0) = F/(8 EI b^3), 4 b^4 = rho A s^2/EI, in the Laplace domain.
    """
    base.check_positive(young=young, density=density, area=area, second_moment=second_moment)
    ei = young * second_moment
    coefficient = (4 * ei / (density * area)) ** 0.75 / (8 * ei)
    return PowerGreens(coefficient / math.gamma(1.5), 0.5)


def single_mode(*, frequency_hz: float, mass: float, damping_ratio: float = 0.0) -> modal.ModalGreens:
    """Return one damped oscillator of modal ``mass`` m [kg]: g(t) = exp(-zeta w t) sin(wd t)/(m wd), w = 2 pi
    frequency_hz.

    As g(0+) = 0, a rigid (Signorini) contact with it needs another body with g(0+) > 0; else take a compliant law.
    """
    base.check_positive(frequency_hz=frequency_hz, mass=mass)
    omega = np.array([2 * np.pi * frequency_hz])
    shapes = np.array([[1.0 / math.sqrt(mass)]])
    origin = {"kind": "single_mode", "frequency_hz": frequency_hz, "mass": mass, "damping_ratio": damping_ratio}
    return modal.ModalGreens(
        omega,
        np.array([damping_ratio]),
        shapes,
        modal.Residual.none(),
        error=base.ErrorEstimate(0.0, 0.0),
        origin=origin,
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
    base.check_positive(damping_ratio=damping_ratio)
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
    base.check_positive(damping_ratio=damping_ratio)
    return DampedFreeRod(rod.impedance, length / math.sqrt(young / density), damping_ratio)


def rod_with_end_impedance(
    *, young: float, density: float, area: float, length: float, end_impedance: float
) -> DelayRod:
    """Return an elastic rod whose far end moves against a dashpot ``end_impedance`` Z_e [N s/m] >= 0; 0 free, inf
    fixed.

    g(t) = (1/Z) (H(t) + 2 sum_k R^k H(t - 2 k l/c)) [m/(N s)], R = (Z - Z_e)/(Z + Z_e).
    """
    if not end_impedance >= 0:
        raise base.GreensFunctionError(f"end_impedance = {end_impedance:g} must be >= 0: the end would feed energy")
    rod = _delay_rod(young, density, area, length, reflection=-1.0)
    z, is_fixed = rod.impedance, math.isinf(end_impedance)
    return rod if is_fixed else replace(rod, reflection=(z - end_impedance) / (z + end_impedance))


@dataclass(frozen=True)
class PowerGreens(base.ExactPort):
    """A Green's function g(t) = coefficient * t^exponent, exponent > -1."""

    kind: ClassVar[str] = "power_law"
    coefficient: float
    exponent: float

    def inverse_mass(self) -> Array:
        """Return lim g/t [1/kg]: the coefficient for exponent 1, 0 below (an infinite body), ``inf`` above."""
        return np.array([[self.coefficient if self.exponent == 1 else 0.0 if self.exponent < 1 else math.inf]])

    def scaled(self, factor: float) -> PowerGreens:
        return replace(self, coefficient=base.check_factor(factor) * self.coefficient)

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
    base.check_positive(young=young, density=density, area=area, length=length)
    return DelayRod(area * math.sqrt(young * density), 2 * length / math.sqrt(young / density), reflection)


def _dashpot(value: float, **origin: object) -> modal.ModalGreens:
    return _closed(modal.Residual(np.array([[math.sqrt(value)]]), np.zeros(1), np.zeros((1, 1))), **origin)


def _closed(residual: modal.Residual, **origin: object) -> modal.ModalGreens:
    return modal.ModalGreens(
        np.zeros(0), np.zeros(0), np.zeros((0, 1)), residual, error=base.ErrorEstimate(0.0, 0.0), origin=origin
    )
