"""Euler-Bernoulli cantilever whose width varies along it, by finite elements of high order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import pairwise
from typing import ClassVar, Final

import numpy as np
import scipy
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import ArrayLike

from impact.beams.euler_bernoulli import BeamModes, gauss, positive
from impact.greens.base import Array, GreensFunctionError
from impact.greens.modal import Residual

PER_MODE: Final = 0.75  # elements per half wave of the highest mode: its error is 1e-6, and falls with order 12
SHORTEST: Final = 0.1  # shortest element, over the usual one; breaks nearer to each other lie within one
_BUBBLES: Final = 4  # shapes without end values beside four cubics of deflections and slopes: polynomials of degree 7


@dataclass(frozen=True)
class SteppedCantilever:
    """Clamped-free beam of constant thickness and varying width, bending about its thin side (all SI).

    (EI w'')'' + rho A w'' = p with I = b(x) h^3/12, A = b(x) h;  w = w' = 0 at x = 0, M = Q = 0 at the end. Galerkin's
    method with polynomials of degree 7, continuous in w and w': frequencies are bounds from above, of order 12.

    Attributes:
        young, density: of the material.
        thickness: h.
        widths: (x, b) from x = 0 to the free end, b linear between them; two at the same x are a step. The last b may
            be 0, a pointed end.

    Raises:
        GreensFunctionError: a value that is not positive, positions that do not rise from 0, one thrice.
    """

    young: float
    density: float
    thickness: float
    widths: tuple[tuple[float, float], ...]

    family: ClassVar[str] = "stepped cantilever"

    def __post_init__(self) -> None:
        for name in ("young", "density", "thickness"):
            positive(self.family, name, getattr(self, name))
        if len(self.widths) < 2 or not np.all(np.isfinite(self.widths)):
            raise GreensFunctionError(f"{self.family} widths: give two finite pairs of position and width at least")
        x, b = self._table
        if x[0] != 0 or np.any(np.diff(x) < 0) or x[-1] == x[-2]:
            raise GreensFunctionError(f"{self.family} widths: positions must rise from 0 to the free end")
        if np.any(x[2:] == x[:-2]):
            raise GreensFunctionError(
                f"{self.family} widths: a position is given three times; give it twice for a step"
            )
        if np.any(b[:-1] <= 0) or b[-1] < 0:
            raise GreensFunctionError(f"{self.family} widths: all must be positive, the last may be 0")

    @property
    def description(self) -> Mapping[str, object]:
        """Return the kind and parameters."""
        return {"kind": self.family, **asdict(self)}

    @property
    def _table(self) -> tuple[Array, Array]:
        x, b = np.array(self.widths, dtype=float).T
        return x, b

    @property
    def length(self) -> float:
        """Return the length L [m]."""
        return float(self.widths[-1][0])

    @property
    def free_point(self) -> float:
        """Return the tip [m]."""
        return self.length

    @property
    def mean_width(self) -> float:
        """Return the mean width [m]."""
        x, b = self._table
        return float(np.trapezoid(b, x)) / self.length

    @property
    def mass(self) -> float:
        """Return the mass [kg]."""
        return self.density * self.thickness * self.mean_width * self.length

    def width_at(self, x: ArrayLike) -> Array:
        """Return the width b(x) [m]; beyond a step that at the step itself."""
        return np.asarray(np.interp(np.asarray(x, dtype=float), *self._table))

    def rigidity_at(self, x: ArrayLike) -> Array:
        """Return the bending stiffness EI(x) [N m^2]."""
        return np.asarray(self.young * self.thickness**3 / 12 * self.width_at(x))

    @property
    def breaks(self) -> tuple[float, ...]:
        """Return positions between which the width is linear [m], both ends among them."""
        return tuple(dict.fromkeys(x for x, _ in self.widths))

    def modes(self, n_modes: int) -> BeamModes:
        """Return the lowest modes, w'' > 0 at the clamp."""
        elements, omega, coefficients = _solved(self, n_modes)
        return BeamModes(
            omega,
            lambda x: elements.values(coefficients, x),
            length=self.length,
            width=self.mean_width,
            line_density=self.mass / self.length,
            relative_width=lambda x: self.width_at(x) / self.mean_width,
            breaks=self.breaks,
        )

    def frequencies(self, n_modes: int) -> Array:
        """Return the (n,) undamped angular frequencies [rad/s]."""
        return _solved(self, n_modes)[1]

    def compliance(self, x: float, load: float) -> float:
        """Return the static deflection at ``x`` per unit force at ``load`` [m/N]: integral of (x - s)(load - s)/EI(s)
        ds to the nearer one."""
        end = min(x, load)
        edges = [*(s for s in self.breaks if s < end), end]
        parts = [gauss(low, high, 4) for low, high in pairwise(edges)]
        return math.fsum(float(ds @ ((x - s) * (load - s) / self.rigidity_at(s))) for s, ds in parts)

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """Return the exponential that relaxes within half a radian of the highest mode, as of `EulerBernoulliBeam`."""
        return Residual.relaxing(compliance, 2 * highest)


@dataclass(frozen=True)
class Elements:
    """Polynomials of degree 7 between ``edges`` (e + 1,) [m]: of each element w and w' times ``length`` at both ends,
    and bubbles (1 - s^2)^2 P_k(s), s from -1 to 1."""

    edges: Array
    length: float

    @property
    def places(self) -> Array:
        """Return the (e, 8) unknowns of each element among all, the nodes' first."""
        count = len(self.edges) - 1
        first = 2 * np.arange(count)[:, None] + np.arange(4)
        inner = 2 * len(self.edges) + _BUBBLES * np.arange(count)[:, None] + np.arange(_BUBBLES)
        return np.concatenate([first, inner], axis=1)

    def shapes(self, element: int, s: Array, derivative: int = 0) -> Array:
        """Return the (8, G) shape functions of one element, or a derivative of them by x."""
        half = float(self.edges[element + 1] - self.edges[element]) / 2
        slope = half / self.length
        values = [shape.deriv(derivative)(s) if derivative else shape(s) for shape in _SHAPES]
        scale = np.array([1, slope, 1, slope, *[1] * _BUBBLES])
        return np.asarray(np.array(values) * scale[:, None] / half**derivative)

    def values(self, coefficients: Array, x: ArrayLike, derivative: int = 0) -> Array:
        """Return the (n, ...) values at x [m] of functions with coefficients (unknowns, n). Raises off the beam."""
        x = np.asarray(x, dtype=float)
        if np.any(outside := ~((x >= 0) & (x <= self.length * (1 + 1e-12)))):
            raise GreensFunctionError(f"position {x[outside].flat[0]:g} m is outside the beam, 0..{self.length:g} m")
        flat = x.ravel()
        element = np.clip(np.searchsorted(self.edges, flat, side="right") - 1, 0, len(self.edges) - 2)
        values, places = np.empty((coefficients.shape[1], flat.size)), self.places
        for e in np.unique(element):
            inside, (low, high) = element == e, self.edges[e : e + 2]
            s = np.clip((2 * flat[inside] - low - high) / (high - low), -1.0, 1.0)
            values[:, inside] = coefficients[places[e]].T @ self.shapes(int(e), s, derivative)
        return values.reshape(-1, *x.shape)


def _hermite() -> tuple[Polynomial, ...]:
    s, bubble = Polynomial([0, 1]), Polynomial([1, 0, -1]) ** 2
    ends = (
        (1 - s) ** 2 * (2 + s) / 4,
        (1 - s) ** 2 * (1 + s) / 4,
        (1 + s) ** 2 * (2 - s) / 4,
        (1 + s) ** 2 * (s - 1) / 4,
    )
    return (*ends, *(bubble * Legendre.basis(k).convert(kind=Polynomial) for k in range(_BUBBLES)))


_SHAPES: Final = _hermite()


def elements_of(beam: SteppedCantilever, size: float) -> Elements:
    """Return elements of at most ``size`` [m] between the beam's breaks, but for those so near each other that digits
    would be lost."""
    edges = [0.0]
    for x in beam.breaks:
        if x - edges[-1] >= SHORTEST * size:
            edges.append(x)
    edges = [*(x for x in edges if beam.length - x >= SHORTEST * size), beam.length]
    parts = [np.linspace(a, b, math.ceil((b - a) / size - 1e-9) + 1)[:-1] for a, b in pairwise(edges)]
    return Elements(np.append(np.concatenate(parts), beam.length), beam.length)


def eigen(beam: SteppedCantilever, elements: Elements, n_modes: int) -> tuple[Array, Array]:
    """Return the (n,) angular frequencies [rad/s] and (unknowns, n) shapes of unit modal mass.

    Of M y = (K + s M) y/(w^2 + s) with s between the lowest and the highest; w^2 is the quotient of the energies of y,
    summed over the elements: K itself has lost the digits that its condition takes, 1e-9 of the lowest of 100 modes.
    Raises `GreensFunctionError`: more modes than unknowns.
    """
    places = elements.places
    size = int(places.max()) + 1
    if n_modes > size - 2:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at most {size - 2}, the unknowns of the elements")
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    parts = []
    for e, (low, high) in enumerate(pairwise(elements.edges)):
        cuts = [low, *(cut for cut in beam.breaks if low < cut < high), high]
        x, dx = (np.concatenate(each) for each in zip(*(gauss(*ends, 1) for ends in pairwise(cuts)), strict=True))
        s = (2 * x - low - high) / (high - low)
        block = np.ix_(places[e], places[e])
        bent = elements.shapes(e, s, 2) * np.sqrt(dx * beam.rigidity_at(x))
        moved = elements.shapes(e, s) * np.sqrt(dx * beam.density * beam.thickness * beam.width_at(x))
        stiffness[block] += bent @ bent.T
        mass[block] += moved @ moved.T
        parts.append((places[e], bent, moved))
    stiffness, mass = stiffness[2:, 2:], mass[2:, 2:]  # clamped
    wave = beam.young * beam.thickness**2 / (12 * beam.density)  # w^2/k^4, of any width
    shift = wave * (1.875 * n_modes * math.pi / beam.length**2) ** 2
    last = size - 3
    _, shapes = scipy.linalg.eigh(mass, stiffness + shift * mass, subset_by_index=(last - n_modes + 1, last))
    full = np.concatenate([np.zeros((2, n_modes)), shapes[:, ::-1]])
    bent, moved = (sum(((each[k].T @ full[each[0]]) ** 2).sum(axis=0) for each in parts) for k in (1, 2))
    return np.sqrt(bent / moved), full * (np.sign(elements.values(full, 0.0, 2)) / np.sqrt(moved))


@lru_cache(maxsize=8)
def _solved(beam: SteppedCantilever, n_modes: int) -> tuple[Elements, Array, Array]:
    elements = elements_of(beam, beam.length / (PER_MODE * n_modes + 1))
    return elements, *eigen(beam, elements, n_modes)
