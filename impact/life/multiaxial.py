"""Multiaxial criteria of unlimited life (or of N cycles), and the stress below a Hertzian contact.

Stress histories are (n, 6) of one block, in Voigt order xx, yy, zz, yz, xz, xy with tensor shear stresses [Pa]. Every
criterion compares an equivalent shear amplitude with the fatigue limit t-1 in torsion. The equivalent amplitude is
homogeneous of degree one in stress, so that t-1 over it is the factor on all stresses at which the limit is met. The
constant of each criterion makes it t-1 for both pure bending with the amplitude f-1 and pure torsion with t-1. The
shear amplitude of a path is the root of its mean square over all planes, or the radius of the smallest sphere around
the path of the deviators.

To add a criterion, write a subclass of the frozen dataclass `Multiaxial` with its ``name``, ``within`` and ``value``.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from impact.exact.contact_stress import circular_axis_stress
from impact.greens.base import Array
from impact.life.strength import LifeError, Strength, criterion
from impact.march.loop.compiled import compiled

_FIRST, _FINEST = 8, 256  # numbers of polar angles over the sphere in the first and in the finest grid
_FEW = 64  # largest number of points whose hull is computed without removing inner points first


def mean_square_shear(stress: Array, tolerance: float = 1e-6) -> float:
    """Return <Ta^2> [Pa^2], with Ta half the range of the shear stress along a direction m on a plane with normal n.

        <Ta^2> = 1/(8 pi^2) int int int Ta^2(theta, phi, chi) dchi sin(theta) dtheta dphi

    The integral over chi is exact: Ta is half the width of the convex hull of the shear vectors on a plane. That over
    the normals is by Gauss-Legendre points in cos(theta) and equidistant ones in phi: exact for a stress path that is a
    segment or an ellipse, of third order for one with corners. The number of angles is doubled until a quarter of the
    last change is within the relative ``tolerance``, and so is a quarter of an eighth of the change before, in case two
    values agree by chance. ``stress``: (n, 6) [Pa], one block in Voigt order. Raises `LifeError` if the value does not
    converge.
    """
    path = stress - stress.mean(axis=0)
    scale = float(np.abs(path).max())
    if scale == 0.0:
        return 0.0
    path, number, change = path / scale, _FIRST, math.inf
    value = _average(path, *_polar(number))
    while number < _FINEST:
        number *= 2
        last, before, value = change, value, _average(path, *_polar(number))
        change = abs(value - before)
        if max(change, last / 8) <= 4 * tolerance * value:
            return float(value) * scale**2
    raise LifeError(
        f"the mean over planes changes by {change / value:.1e} from {number // 2} to {number} polar angles, too much "
        f"for a tolerance of {tolerance:g}: ask for less"
    )


def _polar(number: int) -> tuple[Array, Array]:
    """Return cosines of polar angles and their weights over half the sphere, as opposite normals are one plane."""
    cosines, weights = np.polynomial.legendre.leggauss(number)
    return cosines[number // 2 :], weights[number // 2 :]


@compiled()
def _average(stress, cosines, weights):  # type: ignore[no-untyped-def]
    """Return <Ta^2> of a stress path by these polar angles."""
    around = 4 * len(cosines)
    vectors = np.empty((len(stress), 2))
    total = 0.0
    for i in range(len(cosines)):
        height, width = cosines[i], math.sqrt(1 - cosines[i] ** 2)
        for j in range(around):
            c, s = math.cos(2 * math.pi * j / around), math.sin(2 * math.pi * j / around)
            for k in range(len(stress)):
                xx, yy, zz, yz, xz, xy = stress[k]
                tx = (xx * c + xy * s) * width + xz * height
                ty = (xy * c + yy * s) * width + yz * height
                tz = (xz * c + yz * s) * width + zz * height
                vectors[k, 0] = c * ty - s * tx
                vectors[k, 1] = (c * tx + s * ty) * height - width * tz
            total += weights[i] / around * _half_width_squared(vectors)
    return total


@compiled()
def _half_width_squared(points):  # type: ignore[no-untyped-def]
    """Return the mean over all directions of the squared half width of points in a plane.

    With the edges of the hull sorted by their directions mod pi, e_1, e_2, ..., the width is the support function of
    the symmetric polygon with the corners v_0 = -sum e_i/2, v_1 = v_0 + e_1, ...: v_k . u between the normals of e_k
    and e_(k+1).
    """
    edges = _hull_edges(_outer(points) if len(points) > _FEW else points)
    angles = np.empty(len(edges))
    for k in range(len(edges)):
        if edges[k, 1] < 0 or (edges[k, 1] == 0 and edges[k, 0] < 0):
            edges[k] = -edges[k]
        angles[k] = math.atan2(edges[k, 1], edges[k, 0])
    x, y = -0.5 * edges[:, 0].sum(), -0.5 * edges[:, 1].sum()
    total = 0.0
    order = np.argsort(angles)
    for place in range(len(order)):
        k = order[place]
        x, y = x + edges[k, 0], y + edges[k, 1]
        last = place + 1 == len(order)
        end = angles[order[0]] + math.pi if last else angles[order[place + 1]]
        middle, span = 0.5 * (angles[k] + end), end - angles[k]
        along, across = x * math.sin(middle) - y * math.cos(middle), x * math.cos(middle) + y * math.sin(middle)
        total += 0.5 * (along**2 + across**2) * span + 0.5 * (along**2 - across**2) * math.sin(span)
    return 0.25 * total / math.pi


@compiled()
def _outer(points):  # type: ignore[no-untyped-def]
    """Return the points that do not lie inside the octagon of the extreme points along eight directions (Akl and
    Toussaint 1978)."""
    at, reach = np.zeros(9, dtype=np.int64), np.full(8, -np.inf)
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        for d, along in enumerate((x, x + y, y, y - x, -x, -x - y, -y, x - y)):
            if along > reach[d]:
                reach[d], at[d] = along, k
    at[8] = at[0]
    corners = points[at]
    kept = 0
    outer = np.empty_like(points)
    for k in range(len(points)):
        inside = True
        for d in range(8):
            right, up = corners[d + 1, 0] - corners[d, 0], corners[d + 1, 1] - corners[d, 1]
            cross = right * (points[k, 1] - corners[d, 1]) - up * (points[k, 0] - corners[d, 0])
            inside &= cross > 0 or (right == 0 and up == 0)
        if not inside:
            outer[kept] = points[k]
            kept += 1
    return outer[:kept]


@compiled()
def _hull_edges(points):  # type: ignore[no-untyped-def]
    """Return the edges of the convex hull, by Andrew's monotone chain."""
    upwards = np.argsort(points[:, 1])
    order = upwards[np.argsort(points[upwards, 0], kind="mergesort")]
    chain = np.empty((2 * len(points), 2))
    size = 0
    for side in range(2):
        start = size
        for place in range(len(order)):
            p = points[order[place] if side == 0 else order[len(order) - 1 - place]]
            while size >= start + 2 and (
                (chain[size - 1, 0] - chain[size - 2, 0]) * (p[1] - chain[size - 2, 1])
                <= (chain[size - 1, 1] - chain[size - 2, 1]) * (p[0] - chain[size - 2, 0])
            ):
                size -= 1
            chain[size] = p
            size += 1
    edges = np.empty((size, 2))
    for k in range(size):
        edges[k] = chain[(k + 1) % size] - chain[k]
    return edges


_INSIDE = 1e-12  # relative tolerance of the squared radius within which a point counts as inside
_MOST = 2000  # largest number of exchanges of points; usually about ten are made


def enclosing_sphere(points: Array) -> tuple[Array, float]:
    """Return the (d,) centre and the radius of the smallest sphere around (n, d) points, d <= 6, all finite.

    At most d + 1 of the points determine the sphere. The point furthest outside is added to such a set; the smallest
    sphere around the enlarged set is one of the circumscribed spheres of its subsets, and this subset is the next set.
    The radius grows, so that no set recurs and the exact sphere is reached; raises `LifeError` otherwise.

    Source: E. Welzl, LNCS 555 (1991) 359; B. Gaertner, LNCS 1643 (1999) 325, for the exchange of the furthest point.
    """
    if not np.isfinite(points).all():
        raise LifeError(f"the stress history must be finite, {np.sum(~np.isfinite(points))} values are not")
    origin = points.mean(axis=0)
    scale = float(np.abs(points - origin).max())
    if scale == 0.0:
        return origin, 0.0
    centre, squared, converged = _smallest((points - origin) / scale)
    if not converged:
        raise LifeError(f"no smallest sphere around {len(points)} points after {_MOST} exchanges; report this history")
    return origin + scale * centre, scale * math.sqrt(squared)


@compiled()
def _furthest(points, centre):  # type: ignore[no-untyped-def]
    """Return the squared distance and the number of the point furthest from the centre."""
    best, at = -1.0, 0
    for k in range(points.shape[0]):
        distance = 0.0
        for j in range(points.shape[1]):
            distance += (points[k, j] - centre[j]) ** 2
        if distance > best:
            best, at = distance, k
    return best, at


@compiled()
def _smallest(points):  # type: ignore[no-untyped-def]
    """Return the centre of the smallest sphere, the squared distance of the furthest point, and whether the iteration
    converged."""
    size = points.shape[1]
    held = np.empty((size + 2, size))
    held[0] = points[_furthest(points, points[0])[1]]
    count, centre, squared = 1, held[0].copy(), 0.0
    for _ in range(_MOST):
        distance, at = _furthest(points, centre)
        if distance <= squared * (1 + _INSIDE):
            return centre, distance, True
        held[count] = points[at]
        new_centre, new_squared, chosen = _around(held[: count + 1])
        if new_squared <= squared:  # by round-off alone
            return centre, distance, distance <= squared * (1 + 1e-6)
        centre, squared = new_centre, new_squared
        kept = 0
        for k in range(count + 1):
            if chosen >> k & 1:
                held[kept] = held[k]
                kept += 1
        count = kept
    return centre, squared, False


@compiled()
def _around(few):  # type: ignore[no-untyped-def]
    """Return the smallest sphere around at most d + 2 points, through the last one: its centre, its squared radius, and
    the subset of points that determine it, as bits."""
    count, size = few.shape
    best, centre, chosen = np.inf, few[0].copy(), 0
    for subset in range(1, 1 << (count - 1)):
        members = 0
        for k in range(count - 1):
            members += subset >> k & 1
        if members <= size:
            trial = _circumscribed(few, subset)
            squared = _furthest(few, trial)[0]
            if squared < best:
                best, centre, chosen = squared, trial, subset | 1 << (count - 1)
    return centre, best, chosen


@compiled()
def _circumscribed(few, subset):  # type: ignore[no-untyped-def]
    """Return the centre of the circumscribed sphere of the subset and the last point, in their plane.

    Its coordinates lam along the edges from the last point, with Gram matrix G, solve 2 G lam = diag G.
    """
    count, size = few.shape
    edges = np.empty((count, size))
    m = 0
    for k in range(count - 1):
        if subset >> k & 1:
            edges[m] = few[k] - few[count - 1]
            m += 1
    edges = edges[:m]
    matrix = 2 * edges @ edges.T
    right = 0.5 * np.diag(matrix)
    for k in range(m):  # elimination with pivoting; linearly dependent edges are omitted
        pivot = k + np.argmax(np.abs(np.diag(matrix)[k:]))
        for each in range(m):
            matrix[k, each], matrix[pivot, each] = matrix[pivot, each], matrix[k, each]
        for each in range(m):
            matrix[each, k], matrix[each, pivot] = matrix[each, pivot], matrix[each, k]
        right[k], right[pivot] = right[pivot], right[k]
        edges[k], edges[pivot] = edges[pivot].copy(), edges[k].copy()
        if matrix[k, k] <= 1e-24:
            m = k
            break
        for row in range(k + 1, m):
            factor = matrix[row, k] / matrix[k, k]
            matrix[row] -= factor * matrix[k]
            right[row] -= factor * right[k]
    centre = few[count - 1].copy()
    weights = np.zeros(m)
    for k in range(m - 1, -1, -1):
        weights[k] = (right[k] - matrix[k, k + 1 : m] @ weights[k + 1 :]) / matrix[k, k]
        centre += weights[k] * edges[k]
    return centre


ROOT_3 = math.sqrt(3)


@dataclass(frozen=True)
class Multiaxial(ABC):
    """A criterion calibrated by two fatigue limits.

    Attributes:
        torsion_limit: t-1, limit of the fully reversed shear amplitude [Pa].
        bending_limit: f-1, limit of the fully reversed bending amplitude at the same number of cycles [Pa].

    Raises:
        LifeError: t-1/f-1 outside the range ``within`` of the criterion, lower bound excluded.
    """

    name: ClassVar[str]
    within: ClassVar[tuple[float, float]]
    torsion_limit: float
    bending_limit: float

    def __post_init__(self) -> None:
        least, most = self.within
        if not least < self.ratio <= most:
            raise LifeError(
                f"torsion_limit/bending_limit = {self.ratio:.4g}: {self.name} holds above {least:.4g} and up to "
                f"{most:g}; take another criterion, or check that both limits are of one survival and one N"
            )

    @property
    def ratio(self) -> float:
        """Return t-1/f-1."""
        return self.torsion_limit / self.bending_limit

    @abstractmethod
    def value(self, stress: ArrayLike) -> float:
        """Return the equivalent shear amplitude [Pa] of an (n, 6) block; raises `LifeError` for another shape."""

    def margin(self, stress: ArrayLike) -> float:
        """Return t-1/value: the factor on all stresses at which the limit is met; ``inf`` without stress."""
        value = self.value(stress)
        return self.torsion_limit / value if value > 0 else math.inf


class Crossland(Multiaxial):
    """sqrt(J2a) + (3 t-1/f-1 - sqrt 3) pmax <= t-1, with sqrt(J2a) the radius of the smallest sphere around the
    deviators.

    For t-1/f-1 < 1/sqrt 3 the constant would be negative, and compression would be damaging; a ratio above 1, more
    strength in torsion than in bending, is not observed in metals.

    Source: B. Crossland, Proc. Int. Conf. Fatigue of Metals, IMechE, London 1956, 138.
    """

    name: ClassVar[str] = "crossland"
    within: ClassVar[tuple[float, float]] = (1 / ROOT_3, 1.0)

    def value(self, stress: ArrayLike) -> float:
        tensors = _checked(stress)
        radius = enclosing_sphere(deviators(tensors))[1]
        return radius + (3 * self.ratio - ROOT_3) * float(pressure(tensors).max())


class DangVan(Multiaxial):
    """max over t of tau(t) + (3 t-1/f-1 - 3/2) p(t) <= t-1, tau the largest shear stress about the shakedown state.

    The microscopic stress is the deviator relative to the centre of the smallest sphere around the block's deviators,
    the residual stress after shakedown of grains; tau is half its largest difference of principal stresses (Tresca).

    Source: K. Dang Van et al., in Biaxial and Multiaxial Fatigue, EGF 3 (1989) 479; ASTM STP 1191 (1993) 120.
    """

    name: ClassVar[str] = "dang_van"
    within: ClassVar[tuple[float, float]] = (0.5, 1.0)

    def value(self, stress: ArrayLike) -> float:
        tensors = _checked(stress)
        path = deviators(tensors)
        shear = largest_shear(path - enclosing_sphere(path)[0])
        return float((shear + (3 * self.ratio - 1.5) * pressure(tensors)).max())


@dataclass(frozen=True)
class Papadopoulos(Multiaxial):
    """sqrt(5 <Ta^2>) + (3 t-1/f-1 - sqrt 3) pmax <= t-1, for hard metals.

    Ta is half the range of the resolved shear stress, averaged over all planes and all directions in them. If all
    components are harmonic at one frequency, stress = A cos + B sin, 5 <Ta^2> = J2(A) + J2(B), whatever the phases.

    Attributes:
        tolerance: relative tolerance of the mean square (`impact.life.multiaxial.mean_square_shear`).

    Source: I. V. Papadopoulos, Int. J. Fatigue 16 (1994) 377; Papadopoulos et al., Int. J. Fatigue 19 (1997) 219.
    """

    name: ClassVar[str] = "papadopoulos"
    within: ClassVar[tuple[float, float]] = (1 / ROOT_3, 0.8)
    tolerance: float = 1e-6

    def value(self, stress: ArrayLike) -> float:
        tensors = _checked(stress)
        shear = math.sqrt(5 * mean_square_shear(tensors, self.tolerance))
        return shear + (3 * self.ratio - ROOT_3) * float(pressure(tensors).max())


def multiaxial(name: str, strength: Strength) -> Multiaxial:
    """Return the criterion crossland, dang_van or papadopoulos; raises `LifeError` for another name, or for limits
    outside its range."""
    return criterion(Multiaxial, name, strength)  # type: ignore[type-abstract]


def pressure(stress: Array) -> Array:
    """Return the (n,) hydrostatic stress p = (xx + yy + zz)/3, > 0 in tension [Pa]."""
    return np.asarray(stress[:, :3].sum(axis=1) / 3)


def deviators(stress: Array) -> Array:
    """Return the (n, 5) deviators in Ilyushin's space, scaled so that the squared length is J2 = s:s/2 [Pa]."""
    xx, yy, zz, yz, xz, xy = stress.T
    return np.stack([(2 * xx - yy - zz) / (2 * ROOT_3), (yy - zz) / 2, yz, xz, xy], axis=1)


def largest_shear(path: Array) -> Array:
    """Return the (n,) half of the largest difference of principal values of (n, 5) `deviators` [Pa].

    (s1 - s3)/2 = sqrt(J2) sin(theta + pi/3), cos(3 theta) = (3 sqrt 3/2) J3/J2^(3/2), 0 <= theta <= pi/3.
    """
    a, b, yz, xz, xy = path.T
    x, y, z = 2 * a / ROOT_3, b - a / ROOT_3, -b - a / ROOT_3
    second = (path**2).sum(axis=1)
    third = x * y * z + 2 * xy * yz * xz - x * yz**2 - y * xz**2 - z * xy**2
    cube = second**1.5
    cosine = np.divide(1.5 * ROOT_3 * third, cube, out=np.ones_like(cube), where=cube > 0)
    return np.asarray(np.sqrt(second) * np.sin(np.arccos(np.clip(cosine, -1, 1)) / 3 + math.pi / 3))


def _checked(stress: ArrayLike) -> Array:
    tensors = np.ascontiguousarray(stress, dtype=float)
    if tensors.ndim != 2 or tensors.shape[1] != 6 or not len(tensors):
        raise LifeError(
            f"a history of stress tensors must be (n, 6), in order xx, yy, zz, yz, xz, xy, not {tensors.shape}"
        )
    if not np.isfinite(tensors).all():
        raise LifeError(f"the stress history must be finite, {np.sum(~np.isfinite(tensors))} values are not")
    return tensors


DEPTHS: Final = 40
"""Number of depths on the axis, down to 1.5 radii of the largest contact; the largest shear stress is at 0.5 radii."""
WIDTHS: Final = 60
"""Number of contact radii, up to the largest, at which the stress is computed."""


def hertz_path(force: float, *, stiffness: float, modulus: float, poisson: float = 0.3) -> Iterator[tuple[str, Array]]:
    """Yield names of depths with the (n, 6) stress there [Pa], while the force of a contact N = k d^(3/2) grows from 0
    to ``force`` [N].

    The radius of curvature is R = (3 k/(4 E*))^2; at a contact radius a the largest pressure is p0 = 2 E* a/(pi R), and
    the stress on the axis is p0 times that of `circular_axis_stress`. The history of the force does not matter: at each
    depth loading and unloading follow the same path of tensors, and the criteria of `impact.life.multiaxial` depend on
    the path only. ``stiffness``: k [N/m^1.5]; ``modulus``: E* of both bodies [Pa]; ``poisson``: Poisson's ratio of the
    evaluated body. Raises `LifeError` for a stiffness or modulus that is not positive, or a force below 0.

    Source: K. L. Johnson, Contact Mechanics, Cambridge 1985, 3.45, 4.22 - 4.24.
    """
    if not (stiffness > 0 and modulus > 0 and force >= 0):
        raise LifeError(
            f"a Hertzian contact of stiffness {stiffness:g} N/m^1.5 and modulus {modulus:g} Pa under {force:g} N: both "
            "must be positive, the force not below 0"
        )
    radius = (3 * stiffness / (4 * modulus)) ** 2
    widest = (3 * force * radius / (4 * modulus)) ** (1 / 3)
    widths = widest * np.arange(1, WIDTHS + 1) / WIDTHS
    for depth in widest * 1.5 * np.arange(DEPTHS + 1) / DEPTHS:
        path = np.zeros((WIDTHS + 1, 6))
        if widest > 0:
            across, along = circular_axis_stress(depth / widths, poisson=poisson)
            pressure = 2 * modulus * widths / (math.pi * radius)
            path[1:, 0] = path[1:, 1] = pressure * across
            path[1:, 2] = pressure * along
        yield f"{1e6 * depth:.3g} um below the contact", path
