"""Straight beams: section, modes and integrals along them, and Euler-Bernoulli beams in closed form.

These are cantilevers, with a point mass at the tip too, and beams clamped at both ends.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import Residual
from impact.quantities import check_numbers

_POINTS = 12  # Gauss points per panel; a panel is half the shortest wave, so products of modes come out to round-off


@dataclass(frozen=True)
class RectangularBeam:
    """Uniform beam of rectangular section, bending about its thin side (all SI)."""

    young: float
    density: float
    length: float
    width: float
    thickness: float

    family: ClassVar[str] = "beam"

    def __post_init__(self) -> None:
        for name in ("young", "density", "length", "width", "thickness"):
            positive(self.family, name, getattr(self, name))

    @property
    def description(self) -> Mapping[str, object]:
        """Return the kind and parameters."""
        return {"kind": self.family, **asdict(self)}

    @property
    def free_point(self) -> float:
        """Return where it is touched and measured unless stated, the tip [m]."""
        return self.length

    @property
    def area(self) -> float:
        """Return A = w h [m^2]."""
        return self.width * self.thickness

    @property
    def rigidity(self) -> float:
        """Return EI = E w h^3/12 [N m^2]."""
        return self.young * self.width * self.thickness**3 / 12

    @property
    def line_density(self) -> float:
        """Return rho A [kg/m]."""
        return self.density * self.width * self.thickness

    @property
    def mass(self) -> float:
        """Return rho A L [kg]."""
        return self.line_density * self.length

    @property
    def frequency_scale(self) -> float:
        """Return sqrt(EI/(rho A L^4)) [rad/s]: omega = (k L)^2 times it for an Euler-Bernoulli wave of number k."""
        return math.sqrt(self.rigidity / (self.line_density * self.length**4))

    def relative(self, x: ArrayLike) -> Array:
        """Return x/L in 0..1; raises `GreensFunctionError` for a position off the beam."""
        x = np.asarray(x, dtype=float)
        outside = ~((x >= 0) & (x <= self.length * (1 + 1e-12)))
        if np.any(outside):
            raise GreensFunctionError(
                f"position {x[outside].flat[0]:g} m is outside the {self.family}, 0..{self.length:g} m"
            )
        return np.minimum(x / self.length, 1.0)


@dataclass(frozen=True)
class BeamModes:
    """Modes of a beam, each of unit modal mass.

    integral of (rho A w_k w_l + rho I psi_k psi_l) dx + m w_k(L) w_l(L) = 1 for k = l, else 0.

    Attributes:
        omega: (n,) angular frequencies [rad/s].
        deflection: x -> w_k(x), (...) m -> (n, ...) [1/sqrt(kg)].
        length: of the beam [m].
        width: on which pressure acts [m]; the mean of one that varies.
        line_density: rho A [kg/m], likewise.
        tip_mass: m at x = length [kg].
        line_inertia: rho I [kg m]; 0 for an Euler-Bernoulli beam.
        rotation: x -> psi_k(x), (...) m -> (n, ...) [1/(m sqrt(kg))]; needed with ``line_inertia``.
        relative_width: x -> width over its mean, (G,) m -> (G,), of a beam of constant thickness.
        breaks: positions between which that is smooth [m].
    """

    omega: Array
    deflection: Callable[[ArrayLike], Array]
    length: float
    width: float
    line_density: float
    tip_mass: float = 0.0
    line_inertia: float = 0.0
    rotation: Callable[[ArrayLike], Array] = np.zeros_like
    relative_width: Callable[[Array], Array] = np.ones_like
    breaks: tuple[float, ...] = ()

    def quadrature(self, start: float, end: float, extra: int = 4) -> tuple[Array, Array]:
        """Return nodes and weights (G,) [m] from start to end for products of the modes, times the relative width."""
        edges = [start, *(x for x in self.breaks if start < x < end), end]
        panels = (len(self.omega) + extra) / (end - start)
        parts = [gauss(low, high, math.ceil(panels * (high - low) - 1e-9)) for low, high in pairwise(edges)]
        x, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
        return x, weights * self.relative_width(x)

    def project(self, shape: Callable[[Array], ArrayLike]) -> Array:
        """Return the (n,) modal coordinates of a deflection or velocity ``shape``, x (G,) m -> (G,), sections normal to
        the axis.

        q_k = integral of (rho A w_k w + rho I psi_k w') dx + m w_k(L) w(L). Raises `GreensFunctionError` unless finite.
        """
        x, weights = self.quadrature(0.0, self.length)
        w = np.broadcast_to(np.asarray(shape(x), dtype=float), x.shape)
        q: Array = self.deflection(x) @ (weights * self.line_density * w)
        if self.line_inertia > 0:
            q = q + self.rotation(x) @ (weights * self.line_inertia * _slope(w, weights))
        if self.tip_mass > 0:
            end = np.array([self.length])
            tip = np.broadcast_to(np.asarray(shape(end), dtype=float), end.shape)
            q = q + self.deflection(end) @ (self.tip_mass * tip)
        if not np.all(np.isfinite(q)):
            raise GreensFunctionError(
                f"a shape along the reed must be finite, {np.sum(~np.isfinite(q))} of its {len(q)} modal parts are not"
            )
        return q


def gauss(start: float, end: float, panels: int) -> tuple[Array, Array]:
    """Return nodes and weights (12 panels,) of Gauss-Legendre quadrature on ``panels`` equal panels of [start, end]."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    half = (end - start) / panels / 2
    centres = start + half * (2 * np.arange(panels) + 1)
    return (centres[:, None] + half * nodes).ravel(), np.tile(half * weights, panels)


def clamped_shape(k: Array, delta: Array, ratio: Array, xi: Array) -> Array:
    """Return the (n, ...) cosh z - cos z - s (sinh z - sin z), z = k xi, s = 1 - delta, delta = ratio exp(-k), for any
    k.

    Clamped at xi = 0; the far end chooses s. cosh z - s sinh z = exp(-z) + delta sinh z has no growing exponential.
    """
    k, delta, ratio = (np.reshape(v, (-1, *[1] * np.ndim(xi))) for v in (k, delta, ratio))
    scaled_sinh = (np.exp(k * (xi - 1)) - np.exp(-k * (xi + 1))) / 2  # sinh z exp(-k)
    z = k * xi
    return np.asarray(np.exp(-z) + ratio * scaled_sinh - np.cos(z) + (1 - delta) * np.sin(z))


def clamped_curvature(k: Array, delta: Array, ratio: Array, xi: Array) -> Array:
    """Return the (n, ...) second derivative of `clamped_shape` by z = k xi:  cosh z + cos z - s (sinh z + sin z)."""
    k, delta, ratio = (np.reshape(v, (-1, *[1] * np.ndim(xi))) for v in (k, delta, ratio))
    z = k * xi
    return clamped_shape(k, delta, ratio, xi) + 2 * (np.cos(z) - (1 - delta) * np.sin(z))


def bisected(past_root: Callable[[Array], NDArray[np.bool_]], low: ArrayLike, high: ArrayLike) -> Array:
    """Return the roots to the last digit, one in each bracket; ``past_root(x)`` answers elementwise."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    for _ in range(200):
        middle = (low + high) / 2
        if np.all((middle == low) | (middle == high)):
            break
        past = past_root(middle)
        high, low = np.where(past, middle, high), np.where(past, low, middle)
    return np.asarray((low + high) / 2)


def positive(family: str, name: str, value: float) -> None:
    """Raise `GreensFunctionError` unless ``value`` is positive and finite."""
    check_numbers(GreensFunctionError, **{name: value})
    if not (value > 0 and math.isfinite(value)):
        raise GreensFunctionError(f"{family} {name} = {value:g} must be positive and finite")


def _slope(values: Array, weights: Array) -> Array:
    """Return the derivative of the polynomial through the nodes of each panel, (G,) -> (G,)."""
    nodes, unit = np.polynomial.legendre.leggauss(_POINTS)
    vander = np.polynomial.legendre.legvander(nodes, _POINTS - 1)
    derived = np.stack(
        [np.polynomial.legendre.legval(nodes, np.polynomial.legendre.legder(e)) for e in np.eye(_POINTS)]
    ).T
    operator = derived @ np.linalg.inv(vander)
    half = weights[0] / unit[0]
    return np.asarray((values.reshape(-1, _POINTS) @ operator.T / half).ravel())


class EulerBernoulliBeam(RectangularBeam, ABC):
    """A beam with EI w'''' + rho A w'' = p and the supports of a family (all SI)."""

    @abstractmethod
    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L, the roots of the family's frequency equation."""

    @abstractmethod
    def end_condition(self, k: Array) -> Array:
        """Return (n,) (1 - s) exp(k): the s of each shape cosh - cos - s (sinh - sin), as the far end asks for it."""

    def modal_mass(self, k: Array) -> Array:
        """Return the mass of these shapes [kg], (n,) or one for all."""
        return np.asarray(self.mass)

    def shapes(self, n_modes: int, x: ArrayLike) -> Array:
        """Return the (n, ...) mass-normalised mode shapes at ``x`` [1/sqrt(kg)], cosh - cos - s (sinh - sin) over the
        root of their mass; any n keeps its digits."""
        return self._evaluate_modes(clamped_shape, self.wave_numbers(n_modes), self.relative(x))

    def _evaluate_modes(self, function: Callable[[Array, Array, Array, Array], Array], k: Array, xi: Array) -> Array:
        """Return the (n, ...) `clamped_shape`, or a derivative of it, of unit modal mass."""
        ratio = self.end_condition(k)
        scale = np.reshape(np.sqrt(self.modal_mass(k)), (-1, *[1] * xi.ndim))
        return np.asarray(function(k, ratio * np.exp(-k), ratio, xi) / scale)

    @property
    def end_mass(self) -> float:
        """Return the point mass at the end [kg]."""
        return 0.0

    def frequencies(self, n_modes: int) -> Array:
        """Return the (n,) undamped angular frequencies (k_n L)^2 sqrt(EI/(rho A L^4)) [rad/s]."""
        return np.asarray(self.wave_numbers(n_modes) ** 2 * self.frequency_scale)

    def modes(self, n_modes: int) -> BeamModes:
        """Return the lowest modes."""
        return BeamModes(
            self.frequencies(n_modes),
            lambda x: self.shapes(n_modes, x),
            length=self.length,
            width=self.width,
            line_density=self.line_density,
            tip_mass=self.end_mass,
        )

    def compliance(self, x: float, load: float) -> float:
        """Return the static deflection at ``x`` per unit force at ``load`` [m/N], of a cantilever: a^2 (3b - a)/(6 EI),
        a <= b."""
        a, b = sorted((x, load))
        return a * a * (3 * b - a) / (6 * self.rigidity)

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """Return the exponential that relaxes within half a radian of the highest mode retained, tau = 1/(2 highest).

        The continuum has no finite impedance at t = 0 (g starts like t^(1/2)); the higher modes carry energy away. A
        bare spring in their place would ring against the contact (docs/methods.md). At a tip mass it is small.
        """
        return Residual.relaxing(compliance, 2 * highest)


@dataclass(frozen=True)
class Cantilever(EulerBernoulliBeam):
    """Uniform clamped-free beam of rectangular section, bending about its thin side (all SI).

    EI w'''' + rho A w'' = p, w = w' = 0 at x = 0, M = Q = 0 at x = length.
    """

    family: ClassVar[str] = "cantilever"

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L: roots of cos x cosh x = -1 by Newton on cos x + 1/cosh x."""
        k = np.arange(1, n_modes + 1)
        x = (k - 0.5) * np.pi
        x[0] = 1.875
        for _ in range(8):
            sech = 1 / np.cosh(np.minimum(x, 700.0))
            x = x + (np.cos(x) + sech) / (np.sin(x) + sech * np.tanh(x))
        return np.asarray(x)

    def end_condition(self, k: Array) -> Array:
        """Return s = (sinh k - sin k)/(cosh k + cos k); the shapes are 2 (-1)^(n+1)/sqrt(mass) at the tip."""
        growth = np.exp(-k)
        return np.asarray(2 * (growth + np.cos(k) + np.sin(k)) / (1 + growth**2 + 2 * growth * np.cos(k)))

    def curvatures(self, n_modes: int, x: ArrayLike) -> Array:
        """Return the (n, ...) second derivatives of the mode shapes at ``x`` [1/(m^2 sqrt(kg))]; 2 (k_n/L)^2/sqrt(mass)
        at 0."""
        k, xi = self.wave_numbers(n_modes), self.relative(x)
        squares = np.reshape((k / self.length) ** 2, (-1, *[1] * xi.ndim))
        return squares * self._evaluate_modes(clamped_curvature, k, xi)


@dataclass(frozen=True)
class ClampedClamped(EulerBernoulliBeam):
    """Uniform beam of rectangular section, w = w' = 0 at x = 0 and x = length (all SI)."""

    family: ClassVar[str] = "clamped-clamped beam"

    @property
    def free_point(self) -> float:
        """Return the middle [m]."""
        return self.length / 2

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L: roots of cos x cosh x = 1 near (n + 1/2) pi, by bisection of cos x - 1/cosh x."""
        n = np.arange(1, n_modes + 1)
        centre = (n + 0.5) * np.pi

        def past(k: Array) -> NDArray[np.bool_]:
            return np.asarray((np.cos(k) - 1 / np.cosh(np.minimum(k, 700.0))) * (-1.0) ** n < 0)

        return bisected(past, centre - 0.5, centre + 0.5)

    def end_condition(self, k: Array) -> Array:
        """Return s = (cosh k - cos k)/(sinh k - sin k)."""
        growth = np.exp(-k)
        denominator = (1 - growth**2) / 2 - growth * np.sin(k)  # (sinh k - sin k) exp(-k)
        return np.asarray((np.cos(k) - np.sin(k) - growth) / denominator)

    def compliance(self, x: float, load: float) -> float:
        """Return a^2 c^2 (3 b L - a (3 b + c))/(6 EI L^3) [m/N], a <= b the distances from the clamp, c = L - b."""
        a, b = sorted((x, load))
        c = max(self.length - b, 0.0)
        return a**2 * c**2 * (3 * b * self.length - a * (3 * b + c)) / (6 * self.rigidity * self.length**3)


@dataclass(frozen=True)
class TipMassCantilever(EulerBernoulliBeam):
    """`Cantilever` with the point mass ``tip_mass`` [kg] at x = length:  EI w''' = tip_mass * w'' (in time) there.

    Frequency equation, mu = tip_mass/(rho A L):  1 + cos k cosh k + mu k (cos k sinh k - sin k cosh k) = 0.

    Source: Blevins, Formulas for Natural Frequency and Mode Shape, beams with concentrated masses; derived here.
    """

    tip_mass: float

    family: ClassVar[str] = "tip-mass cantilever"

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self.family, "tip_mass", self.tip_mass)

    @property
    def mass_ratio(self) -> float:
        """Return mu = tip_mass/(rho A L)."""
        return self.tip_mass / self.mass

    @property
    def end_mass(self) -> float:
        """Return the tip mass [kg]."""
        return self.tip_mass

    def wave_numbers(self, n_modes: int) -> Array:
        """Return the (n,) k_n L, one between each clamped-pinned root (mu = inf) and clamped-free root (mu = 0), by
        bisection."""
        n = np.arange(n_modes)
        mu = self.mass_ratio

        def past(k: Array) -> NDArray[np.bool_]:
            sech = 1 / np.cosh(np.minimum(k, 700.0))
            return np.asarray((np.cos(k) + sech + mu * k * (np.cos(k) * np.tanh(k) - np.sin(k))) * (-1.0) ** n < 0)

        # clamped-pinned roots lie at most 4e-4 below (n + 1/4) pi, clamped-free ones within 0.31 of (n + 1/2) pi
        low = np.where(n == 0, 0.0, (n + 0.2495) * np.pi)
        return bisected(past, low, (n + 0.5) * np.pi + 0.31)

    def end_condition(self, k: Array) -> Array:
        """Return s = (cosh k + cos k)/(sinh k + sin k): no moment at the tip."""
        return np.asarray((np.sin(k) - np.cos(k) - np.exp(-k)) / _sines(k))

    def modal_mass(self, k: Array) -> Array:
        """Return the (n,) rho A L/4 ((1 + mu) w^2 + 2 mu w w') [kg], w and w' = dw/d(x/L) at the tip; the tip mass
        included."""
        growth, ratio, denominator, mu = np.exp(-k), self.end_condition(k), _sines(k), self.mass_ratio
        # tip: 2 (cosh k sin k - cos k sinh k)/(sinh k + sin k); by the frequency equation no digits go for large mu k
        direct = (1 + growth**2) / 2 * np.sin(k) - (1 - growth**2) / 2 * np.cos(k)
        by_mass = (growth + (1 + growth**2) / 2 * np.cos(k)) / (mu * k)
        tip = 2 * np.where(mu * k > 1, by_mass, direct) / denominator
        slope = k * (-growth + ratio * (1 + growth**2) / 2 + np.sin(k) + (1 - ratio * growth) * np.cos(k))
        return np.asarray(self.mass / 4 * ((1 + mu) * tip**2 + 2 * mu * tip * slope))


def _sines(k: Array) -> Array:
    """Return (sinh k + sin k) exp(-k)."""
    return np.asarray((1 - np.exp(-2 * k)) / 2 + np.exp(-k) * np.sin(k))
