"""Modes of a straight beam in closed form, its section, and the integrals along it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.greens.base import Array, GreensFunctionError

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
        relative_width: x -> width over its mean, (G,) m -> (G,), of a beam of constant thickness; ``None``: uniform.
        breaks: positions between which that is smooth [m].
    """

    omega: Array
    deflection: Callable[[ArrayLike], Array]
    length: float
    width: float
    line_density: float
    tip_mass: float = 0.0
    line_inertia: float = 0.0
    rotation: Callable[[ArrayLike], Array] | None = None
    relative_width: Callable[[Array], Array] | None = None
    breaks: tuple[float, ...] = ()

    def quadrature(self, start: float, end: float, extra: int = 4) -> tuple[Array, Array]:
        """Return nodes and weights (G,) [m] from start to end for products of the modes, times the relative width."""
        edges = [start, *(x for x in self.breaks if start < x < end), end]
        panels = (len(self.omega) + extra) / (end - start)
        parts = [gauss(low, high, math.ceil(panels * (high - low) - 1e-9)) for low, high in pairwise(edges)]
        x, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
        return x, weights if self.relative_width is None else weights * self.relative_width(x)

    def project(self, shape: Callable[[Array], ArrayLike]) -> Array:
        """Return the (n,) modal coordinates of a deflection or velocity ``shape``, x (G,) m -> (G,), sections normal to
        the axis.

        q_k = integral of (rho A w_k w + rho I psi_k w') dx + m w_k(L) w(L). Raises `GreensFunctionError` unless finite.
        """
        x, weights = self.quadrature(0.0, self.length)
        w = np.broadcast_to(np.asarray(shape(x), dtype=float), x.shape)
        q: Array = self.deflection(x) @ (weights * self.line_density * w)
        if self.line_inertia > 0 and self.rotation is not None:
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
