"""Timoshenko cantilever reed: exact modes, on both sides of the cutoff frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.beams.euler_bernoulli import BeamModes, RectangularBeam, bisected, gauss, positive
from impact.exact.closed_form import damped_start
from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import Residual


@dataclass(frozen=True)
class TimoshenkoCantilever(RectangularBeam):
    """Uniform clamped-free beam of rectangular section with shear and rotary inertia (all SI).

    kappa A G (w' - psi)' + p = rho A w'',   EI psi'' + kappa A G (w' - psi) = rho I psi'',   where the derivatives on
    the right sides are those in time; w = psi = 0 at x = 0, M = Q = 0 at x = length. Above the cutoff
    sqrt(kappa G A/(rho I)) both wave families propagate.

    Attributes:
        poisson: G = young/(2 (1 + poisson)).
        shear_factor: kappa; 5/6 for a parabolic shear stress, 10 (1 + nu)/(12 + 11 nu) after Cowper.

    Source: Timoshenko, Phil. Mag. 41 (1921) 744; Huang, J. Appl. Mech. 28 (1961) 579 (frequency equation).
    """

    poisson: float = 0.3
    shear_factor: float = 5 / 6

    family: ClassVar[str] = "Timoshenko cantilever"

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self.family, "shear_factor", self.shear_factor)
        if not -1.0 < self.poisson < 0.5:
            raise GreensFunctionError(f"{self.family} poisson = {self.poisson:g} is outside (-1, 0.5)")

    @property
    def shear_rigidity(self) -> float:
        """Return kappa A G [N]."""
        return self.shear_factor * self.area * self.young / (2 * (1 + self.poisson))

    @property
    def line_inertia(self) -> float:
        """Return rho I [kg m]."""
        return self.line_density * self.thickness**2 / 12

    @property
    def cutoff(self) -> float:
        """Return the angular frequency sqrt(kappa G A/(rho I)) above which both wave families propagate [rad/s]."""
        return math.sqrt(self.shear_rigidity / self.line_inertia)

    def waves(self, omega: Array) -> Waves:
        """Return the wave numbers at the angular frequencies ``omega`` [rad/s]."""
        rotary = self.thickness**2 / (12 * self.length**2)
        shear = self.rigidity / (self.shear_rigidity * self.length**2)
        return Waves.from_frequency(np.asarray(omega) / self.frequency_scale, rotary, shear)

    def frequencies(self, n_modes: int) -> Array:
        """Return the (n,) undamped angular frequencies [rad/s], by bisection of the exact count of modes below omega.

        No mode is missed or found twice. Source: Wittrick & Williams, Q. J. Mech. Appl. Math. 24 (1971) 263.
        """
        numbers = np.arange(1, n_modes + 1)
        high = np.array([self.frequency_scale])
        while self.count_below(high)[0] < n_modes:
            high = 2 * high
        return bisected(lambda w: self.count_below(w) >= numbers, np.zeros(n_modes), np.full(n_modes, high[0]))

    def count_below(self, omega: Array) -> Array:
        """Return how many modes lie below each angular frequency, (n,) rad/s -> (n,)."""
        waves = self.waves(omega)
        # halve the beam until a piece that is clamped at both ends has no mode below omega: with w = psi = 0 at both
        # ends of a piece of length l (Poincare's inequality, and (w' - psi)^2 >= w'^2/2 - psi^2), each mode has
        # omega^2 >= min(E/rho (pi/l)^2 - cutoff^2, kappa G/(2 rho) (pi/l)^2)
        rod, shear, top = self.young / self.density, self.shear_rigidity / (self.area * self.density), np.max(omega)
        wave = math.sqrt(max((float(top) ** 2 + self.cutoff**2) / rod, 2 * float(top) ** 2 / shear))
        cut = 2.0 ** -max(0, math.ceil(math.log2(self.length * wave / math.pi)))
        clamped = np.zeros(len(omega), dtype=np.int64)
        even, odd = waves.even_odd(cut / 2)
        while cut < 1:  # join two clamped spans: each negative stiffness of the joint in the middle is a mode more
            both = even * odd
            even, odd = waves.even_odd(cut)
            clamped = 2 * clamped + (even * both < 0) + (odd * both < 0)
            cut = 2 * cut
        both = even * odd
        _, turning = waves.even_odd(1.0)
        negative = np.where(waves.determinant() * both < 0, 1, np.where(turning * both < 0, 2, 0))
        return np.asarray(clamped + negative)

    def modes(self, n_modes: int) -> BeamModes:
        """Return the lowest modes, with unit modal mass by Gauss quadrature, rotary inertia included; M > 0 at the
        clamp."""
        omega = self.frequencies(n_modes)
        waves = self.waves(omega)
        scale = np.sqrt(self.mass * waves.inertia(self.thickness**2 / (12 * self.length**2)))[:, None]

        def evaluate(values: ArrayLike, part: int, unit: float) -> Array:
            xi = self.relative(values)
            shape = waves.shapes(xi.ravel())[part] / (scale * unit)
            return np.asarray(shape.reshape(-1, *xi.shape))

        return BeamModes(
            omega,
            lambda x: evaluate(x, 0, 1.0),
            length=self.length,
            width=self.width,
            line_density=self.line_density,
            line_inertia=self.line_inertia,
            rotation=lambda x: evaluate(x, 1, self.length),
        )

    def compliance(self, x: float, load: float) -> float:
        """Return the static deflection at ``x`` per unit force at ``load`` [m/N]: a^2 (3b - a)/(6 EI) + a/(kappa A G)
        with a the smaller and b the larger of both distances."""
        a, b = sorted((x, load))
        return a * a * (3 * b - a) / (6 * self.rigidity) + a / self.shear_rigidity

    def initial_value(self, x: float) -> float:
        """Return g(0+) at ``x`` [m/(N s)]: 1/(A sqrt(kappa G rho)) at the tip, half of it elsewhere, where shear waves
        leave in two directions."""
        impedance = math.sqrt(self.shear_rigidity * self.line_density)
        return (1.0 if x >= self.length * (1 - 1e-9) else 0.5) / impedance

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """Return the residual flexibility as an exponential with the static ``compliance`` and with the beam's g(0+)
        under its modal damping."""
        start = np.diag([self.initial_value(x) for x in at]) * damped_start(damping_ratio)
        return Residual.exponential(compliance, start)


@dataclass(frozen=True)
class Waves:
    """The two wave families at n frequencies: cos, sin of beta x/L and cosh, sinh of alpha x/L (cos, sin above cutoff).

    All attributes are (n,): the ``frequency`` omega/sqrt(EI/(rho A L^4)), the wave numbers ``alpha`` and ``beta``, the
    ratios |psi|/|w| of the two families ``p`` and ``q``, and whether the frequency lies ``above`` the cutoff.
    """

    frequency: Array
    alpha: Array
    beta: Array
    p: Array
    q: Array
    above: NDArray[np.bool_]

    @staticmethod
    def from_frequency(b: Array, rotary: float, shear: float) -> Waves:
        """Return the waves at relative frequencies ``b``, from rotary = I/(A L^2) and shear = EI/(kappa G A L^2):
        alpha^2 beta^2 = b^2 |1 - b^2 rotary shear|."""
        b = np.maximum(b, 1e-9)
        beta2 = (b**2 * (rotary + shear) + b * np.sqrt(b**2 * (rotary - shear) ** 2 + 4)) / 2
        signed = b**2 * (1 - b**2 * rotary * shear) / beta2
        above = signed < 0
        alpha2 = np.maximum(np.abs(signed), 1e-16 * beta2)  # at the cutoff itself all formulas hold in the limit
        alpha, beta = np.sqrt(alpha2), np.sqrt(beta2)
        p = np.where(above, b**2 * shear - alpha2, b**2 * shear + alpha2) / alpha
        return Waves(b, alpha, beta, p, (beta2 - b**2 * shear) / beta, above)

    def even_odd(self, span: float) -> tuple[Array, Array]:
        """Return two functions whose sign changes are the even and the odd modes of a beam of length 2 ``span`` that is
        clamped at both ends."""
        a, c, s = self.alpha * span, np.cos(self.beta * span), np.sin(self.beta * span)
        ch, sh = np.where(self.above, np.cos(a), 1.0), np.where(self.above, np.sin(a), np.tanh(a))
        ratio = self.p / self.q
        return ch * s + ratio * c * sh, ratio * ch * s - np.where(self.above, -1.0, 1.0) * c * sh

    def determinant(self) -> Array:
        """Return the frequency function of the cantilever, divided by cosh alpha below the cutoff; zero at a mode."""
        a, c, s = self.alpha, np.cos(self.beta), np.sin(self.beta)
        sign = np.where(self.above, -1.0, 1.0)
        one = np.where(self.above, 1.0, 1 / np.cosh(np.minimum(a, 700.0)))
        ch, sh = np.where(self.above, np.cos(a), 1.0), np.where(self.above, np.sin(a), np.tanh(a))
        moments = self.p * a / (self.q * self.beta)
        return np.asarray(2 * one + (moments + 1 / moments) * ch * c + (sign * a / self.beta - self.beta / a) * sh * s)

    def inertia(self, rotary: float) -> Array:
        """Return the (n,) integral of (w^2 + rotary psi^2) over x/L = 0..1, in blocks that bound the memory."""
        x, weights = gauss(0.0, 1.0, math.ceil(0.2 * float(self.beta.max())) + 4)  # below two half waves a panel
        total = np.zeros(len(self.beta))
        block = max(1, 2**20 // len(self.beta))
        for start in range(0, len(x), block):
            w, psi = self.shapes(x[start : start + block])
            total += (w**2 + rotary * psi**2) @ weights[start : start + block]
        return total

    def shapes(self, x: Array) -> tuple[Array, Array]:
        """Return w and psi (n, G) of the cantilever's modes, of arbitrary amplitude, at x/L (G,)."""
        w, psi = np.zeros((2, len(self.alpha), len(x)))
        for part, pair in ((~self.above, _below), (self.above, _above)):
            if np.any(part):
                a, b, p, q = (v[part, None] for v in (self.alpha, self.beta, self.p, self.q))
                (w1, psi1), (w2, psi2), end = pair(a, b, p, q, x)
                # their sum, free of moment and shear force at the end, by the larger of both equations; first >= 0
                m1, m2, q1, q2 = end
                moment, force = (np.hypot(u, v) / (np.abs(u).max() + np.abs(v).max()) for u, v in ((m1, m2), (q1, q2)))
                first, second = np.where(moment >= force, -m2, -q2), np.where(moment >= force, m1, q1)
                size = np.copysign(np.hypot(first, second), first)
                first, second = first / size, second / size
                w[part], psi[part] = first * w1 + second * w2, first * psi1 + second * psi2
        return w, psi


Pair = tuple[tuple[Array, Array], tuple[Array, Array], tuple[Array, Array, Array, Array]]


def _below(a: Array, b: Array, p: Array, q: Array, x: Array) -> Pair:
    """Return two motions (w, psi) that are clamped at x = 0 and bounded for any alpha, and their moments and shear
    forces at the free end, below the cutoff."""
    e, c, s = np.exp(-a * x), np.cos(b * x), np.sin(b * x)
    far, echo = np.exp(a * (x - 1)), np.exp(-a * (x + 1))
    unit = 1 + np.exp(-2 * a)  # 2 exp(-a) cosh a
    sech = 2 * np.exp(-a) / unit
    one = (e - c + p / q * s, p * (c - e) + q * s)
    two = ((far - echo) / unit - p / q * s * sech, p * ((far + echo) / unit - c * sech))
    c, s = np.cos(b), np.sin(b)
    end = (
        p * a * np.exp(-a) - p * b * s + q * b * c,
        p * (a * np.tanh(a) + b * s * sech),
        np.exp(-a) / a + s / b + p / q * c / b,
        -(1 / a + p / q * c / b * sech),
    )
    return one, two, end


def _above(a: Array, b: Array, p: Array, q: Array, x: Array) -> Pair:
    """Return what `_below` returns, above the cutoff."""
    one = (np.cos(a * x) - np.cos(b * x), p * np.sin(a * x) + q * np.sin(b * x))
    two = (np.sin(a * x) + p / q * np.sin(b * x), p * (np.cos(b * x) - np.cos(a * x)))
    ca, sa, c, s = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    end = (p * a * ca + q * b * c, p * (a * sa - b * s), s / b - sa / a, ca / a + p / q * c / b)
    return one, two, end
