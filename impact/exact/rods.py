"""Uniform rods in closed form: what holds along them, and the undamped one by its reflections."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.answers import Array, ComplexArray, GreensFunctionError, Rod, check_factor
from impact.greens.stated import ExactPort


class ExactRod(ExactPort):
    """A rod that is known in closed form at every place along it, not at its struck end alone."""

    @property
    @abstractmethod
    def rod(self) -> Rod:
        """Return its impedance, transit, reflection and damping."""

    @abstractmethod
    def displacement_at(self, time: Array, at: float) -> Array:
        """Return S(x, t) [m/N] at times >= 0 and ``at`` = x/l: see `impact.after.rods.displacement_response`."""

    @abstractmethod
    def force_at(self, time: Array, at: float) -> Array:
        """Return E(x, t) [1] at times >= 0 and ``at`` = x/l: see `impact.after.rods.force_response`."""


def on_rod(at: float) -> float:
    """Return a position x/l on a rod; raises `GreensFunctionError` for one off it."""
    if not 0.0 <= at <= 1.0:
        raise GreensFunctionError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
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
    def rod(self) -> Rod:
        return Rod(self.impedance, self.round_trip / 2, self.reflection)

    @property
    def highest_rate(self) -> float:
        return 20 / self.round_trip

    def inverse_mass(self) -> Array:
        """Return 1/(rho A l) = 2/(Z T) of a free rod, 0 where its end meets a resistance [1/kg]."""
        return np.array([[2 / (self.impedance * self.round_trip) if self.reflection == 1.0 else 0.0]])

    def scaled(self, factor: float) -> DelayRod:
        return replace(self, impedance=self.impedance / check_factor(factor))

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
_TINY, _SMALL = 1e-4, 0.4  # |q| up to which the power series of the dilogarithm is summed


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
        raise GreensFunctionError(f"damping ratio {zeta:g} must be >= 0")
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
    from scipy.special import spence  # here, as it would be a third of the time to import this package

    q = np.asarray(q)
    size, out = np.abs(q), np.empty_like(q)
    parts = ((size <= _TINY, 4), ((size > _TINY) & (size <= _SMALL), 36))  # the term left out is below 1e-17 of the sum
    for chosen, terms in parts:
        total, few = np.zeros_like(q[chosen]), q[chosen]
        for k in range(terms, 0, -1):
            total = few * (1 / k**2 + total)
        out[chosen] = total
    large = ~(size <= _SMALL)
    out[large] = spence(1 - q[large])
    return out
