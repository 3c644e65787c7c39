"""Multiaxial criteria of unlimited life (or of N cycles), and the stress below a Hertzian contact.

Stress histories are (n, 6) of one block, in Voigt order xx, yy, zz, yz, xz, xy with tensor shear stresses [Pa]. Every
criterion compares an equivalent shear amplitude with t-1. The amplitude is homogeneous of degree one in stress, so that
t-1 over it is the factor on all stresses at which the limit is met. The constant of each criterion follows from
amplitudes of t-1 for both pure bending with f-1 and pure torsion with t-1.

To add a criterion: a frozen dataclass that is a `Multiaxial`, with its ``name`` and ``within``.
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
from impact.life.planes import enclosing_sphere, mean_square_shear
from impact.life.strength import LifeError, Strength, criterion

ROOT_3 = math.sqrt(3)


@dataclass(frozen=True)
class Multiaxial(ABC):
    """A criterion calibrated by two limits.

    Attributes:
        torsion_limit: t-1, fully reversed shear amplitude [Pa].
        bending_limit: f-1, fully reversed bending amplitude, at the same number of cycles [Pa].

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
    """sqrt(J2a) + (3 t-1/f-1 - sqrt 3) pmax <= t-1, sqrt(J2a) the radius of the smallest sphere around the deviators.

    For t-1/f-1 < 1/sqrt 3 the constant would be negative, so that compression did damage; a ratio above 1, more
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
    """max over t of tau(t) + (3 t-1/f-1 - 3/2) p(t) <= t-1, tau the largest shear stress around the shaken-down state.

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
    """sqrt(5 <Ta^2>) + (3 t-1/f-1 - sqrt 3) pmax <= t-1, the mean over all planes and directions in them.

    Ta is half the range of the resolved shear stress. If all components are harmonic at one frequency,
    stress = A cos + B sin, 5 <Ta^2> = J2(A) + J2(B), independent of phases. For hard metals.

    Attributes:
        tolerance: relative tolerance of the mean square (`impact.life.planes.mean_square_shear`).

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
    """Return the criterion crossland, dang_van or papadopoulos; raises `LifeError` for others, or unfit limits."""
    return criterion(Multiaxial, name, strength)  # type: ignore[type-abstract]


def pressure(stress: Array) -> Array:
    """Return the (n,) hydrostatic stress p = (xx + yy + zz)/3, > 0 in tension [Pa]."""
    return np.asarray(stress[:, :3].sum(axis=1) / 3)


def deviators(stress: Array) -> Array:
    """Return the (n, 5) deviators in Ilyushin's space, scaled so that the squared length is J2 = s:s/2 [Pa]."""
    xx, yy, zz, yz, xz, xy = stress.T
    return np.stack([(2 * xx - yy - zz) / (2 * ROOT_3), (yy - zz) / 2, yz, xz, xy], axis=1)


def largest_shear(path: Array) -> Array:
    """Return (n,) half the largest difference of principal values of (n, 5) `deviators` [Pa].

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
"""Number of depths on the axis, down to 1.5 radii of the largest contact; the largest shear stress lies at 0.5."""
WIDTHS: Final = 60
"""Number of radii of the contact, up to the largest."""


def hertz_path(force: float, *, stiffness: float, modulus: float, poisson: float = 0.3) -> Iterator[tuple[str, Array]]:
    """Yield names of depths with the (n, 6) stress there [Pa], while a contact of N = k d^(3/2) goes from 0 to
    ``force`` [N].

    Its radius is R = (3 k/(4 E*))^2; at the half-width a the pressure is p0 = 2 E* a/(pi R), and the stress on the axis
    p0 times that of `circular_axis_stress`. The history of the force does not matter: at each depth loading and
    unloading follow the same path of tensors, and the criteria of `impact.life.multiaxial` depend on the path only.
    ``stiffness``: k [N/m^1.5]; ``modulus``: E* of both bodies [Pa]; ``poisson``: ratio of the evaluated body. Raises
    `LifeError` for a stiffness or modulus that is not positive, or a force below 0.

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
