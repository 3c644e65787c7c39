"""Linear elastic solids, isotropic and orthotropic: stiffness, wave speeds and damping; and a list of them by name.

Voigt order is xx, yy, zz, yz, xz, xy with engineering shear strains, in global axes. Values of the list are generic
ones at room temperature, each from a source; alloys of one name differ by a few percent in the modulus, castings by
more: state what you have measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seatfem.structures.errors import ModelError


class NamedMaterial(NamedTuple):
    """An isotropic material's Young's modulus [Pa], Poisson's ratio and density [kg/m^3], and where they are from."""

    young: float
    poisson: float
    density: float
    source: str


NAMED_MATERIALS: Final[Mapping[str, NamedMaterial]] = MappingProxyType(
    {
        "steel": NamedMaterial(
            200e9, 0.3, 7850.0, "ANSI/AISC 360: E = 200 GPa, G = 77.2 GPa; AISC Manual, weights: 490 lb/ft^3"
        ),
        "stainless valve steel": NamedMaterial(
            215e9, 0.3, 7700.0, "EN 10088-1, annex E, martensitic 1.4031 (strip like 7C27Mo2); EN 1993-1-4"
        ),
        "stainless steel": NamedMaterial(
            200e9, 0.3, 7900.0, "EN 10088-1, annex E, austenitic 1.4301; EN 1993-1-4, 2.1.3"
        ),
        "grey cast iron": NamedMaterial(
            110e9, 0.26, 7200.0, "EN 1561, annex A, EN-GJL-250: E = 103 to 118 GPa, nu = 0.26, 7.20 g/cm^3"
        ),
        "ductile cast iron": NamedMaterial(
            169e9, 0.275, 7100.0, "EN 1563, EN-GJS-400-15: E = 169 GPa, nu = 0.275, 7.1 g/cm^3"
        ),
        "aluminium": NamedMaterial(70e9, 0.3, 2700.0, "EN 1999-1-1, 3.2.5: design values of wrought alloys"),
        "titanium": NamedMaterial(
            113.8e9, 0.342, 4430.0, "Ti-6Al-4V, annealed; Materials Properties Handbook: Titanium Alloys, ASM (1994)"
        ),
        "PEEK": NamedMaterial(
            4.0e9, 0.4, 1300.0, "unfilled; Victrex 450G data sheet (ISO 527, ISO 1183); nu of the maker's guide"
        ),
    }
)
"""By the name that a scene may write."""

ALIASES: Final[Mapping[str, str]] = MappingProxyType({"cast iron": "grey cast iron", "aluminum": "aluminium"})


def named_material(name: str) -> NamedMaterial | None:
    """Return the material of that name, whatever its case; ``None`` where the list has none."""
    wanted = " ".join(name.casefold().replace("_", " ").replace("-", " ").split())
    wanted = ALIASES.get(wanted, wanted)
    return next((material for known, material in NAMED_MATERIALS.items() if known.casefold() == wanted), None)


Array = NDArray[np.float64]

VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
_CONSTANTS = ("young", "poisson", "density")
_DIRECTIONS = 400  # directions in which the slowest shear wave is searched


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic solid.

    Attributes:
        young: Young's modulus E > 0 [Pa].
        poisson: Poisson's ratio, -1 < nu < 0.5.
        density: rho > 0 [kg/m^3].
        name: for people.
        loss_factor: eta >= 0 of structural damping, K (1 + i eta).
        rayleigh: (alpha [1/s], beta [s]) >= 0 of the damping alpha M + beta K.

    Raises:
        ModelError: a constant outside its range.
    """

    young: float
    poisson: float
    density: float
    name: str = ""
    loss_factor: float = 0.0
    rayleigh: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _positive(self, ("young", "Pa"), ("density", "kg/m^3"))
        if not -1.0 < self.poisson < 0.5:
            raise ModelError(f"material {self.name!r}: poisson = {self.poisson} must lie strictly between -1 and 0.5")
        _damping(self)

    @property
    def lame(self) -> tuple[float, float]:
        """Return Lame's constants (lambda, mu) [Pa]."""
        nu = self.poisson
        return self.young * nu / ((1 + nu) * (1 - 2 * nu)), self.young / (2 * (1 + nu))

    @property
    def elasticity(self) -> Array:
        """Return the (6, 6) stiffness [Pa] in Voigt order."""
        lam, mu = self.lame
        stiffness = np.diag([2 * mu, 2 * mu, 2 * mu, mu, mu, mu])
        stiffness[:3, :3] += lam
        return stiffness

    @property
    def c_p(self) -> float:
        """Return the speed of pressure waves sqrt((lambda + 2 mu)/rho) [m/s]."""
        lam, mu = self.lame
        return float(np.sqrt((lam + 2 * mu) / self.density))

    def c_p_along(self, normals: ArrayLike) -> Array:
        """Return the (...,) speed of pressure waves [m/s] along (..., 3) directions: the same in all."""
        return np.full(np.shape(normals)[:-1], self.c_p)

    @property
    def c_s(self) -> float:
        """Return the speed of shear waves sqrt(mu/rho) [m/s]."""
        return float(np.sqrt(self.lame[1] / self.density))

    @property
    def c_0(self) -> float:
        """Return the speed of long waves in a thin rod sqrt(E/rho) [m/s]."""
        return float(np.sqrt(self.young / self.density))


@dataclass(frozen=True)
class Orthotropic:
    """Orthotropic linear elastic solid (Lekhnitskii 1963): compliance S_11 = 1/E_1, S_12 = -nu_12/E_1, S_44 = 1/G_23.

    Attributes:
        young: (E_1, E_2, E_3) [Pa].
        poisson: (nu_12, nu_13, nu_23); nu_ij is the contraction along j per extension along i.
        shear: (G_12, G_13, G_23) [Pa].
        density: rho > 0 [kg/m^3].
        axes: rows are the unit vectors of the material's axes 1, 2, 3.
        name: for people.
        loss_factor, rayleigh: as `Material`.

    Raises:
        ModelError: a constant outside its range, a stiffness that is not positive, axes that are not orthonormal.
    """

    young: tuple[float, float, float]
    poisson: tuple[float, float, float]
    shear: tuple[float, float, float]
    density: float
    axes: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    name: str = ""
    loss_factor: float = 0.0
    rayleigh: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _positive(self, ("young", "Pa"), ("shear", "Pa"), ("density", "kg/m^3"))
        _damping(self)
        axes = np.asarray(self.axes, dtype=float)
        if axes.shape != (3, 3) or not np.abs(axes @ axes.T - np.eye(3)).max() < 1e-6:
            raise ModelError(f"material {self.name!r}: axes must be three orthonormal rows, they are {self.axes}")
        if (least := np.linalg.eigvalsh(self._normal_compliance)[0]) <= 0:
            raise ModelError(
                f"material {self.name!r}: poisson = {self.poisson} gives strain energy of the wrong sign "
                f"(compliance {least:.2e} 1/Pa); |nu_ij| must stay below sqrt(E_i/E_j)"
            )

    @property
    def _normal_compliance(self) -> Array:
        (e1, e2, e3), (nu12, nu13, nu23) = self.young, self.poisson
        return np.array(
            [[1 / e1, -nu12 / e1, -nu13 / e1], [-nu12 / e1, 1 / e2, -nu23 / e2], [-nu13 / e1, -nu23 / e2, 1 / e3]]
        )

    @cached_property
    def elasticity(self) -> Array:
        """Return the (6, 6) stiffness [Pa] in Voigt order and global axes."""
        local = np.zeros((6, 6))
        local[:3, :3] = np.linalg.inv(self._normal_compliance)
        g12, g13, g23 = self.shear
        local[3:, 3:] = np.diag([g23, g13, g12])
        q = np.asarray(self.axes, dtype=float)
        turned = np.einsum("ia,jb,ijkl,kc,ld->abcd", q, q, stiffness_tensor(local), q, q, optimize=True)
        stiffness = np.array([[turned[*row, *column] for column in VOIGT] for row in VOIGT])
        symmetric: Array = (stiffness + stiffness.T) / 2
        return symmetric

    def _speeds(self, normals: ArrayLike) -> Array:
        """Return (..., 3) phase speeds [m/s] along (..., 3) directions, slowest first, by Christoffel's equation."""
        n = np.asarray(normals, dtype=float)
        n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        acoustic = np.einsum("...b,abcd,...d->...ac", n, stiffness_tensor(self.elasticity), n, optimize=True)
        speeds: Array = np.sqrt(np.linalg.eigvalsh(acoustic) / self.density)
        return speeds

    def c_p_along(self, normals: ArrayLike) -> Array:
        """Return the (...,) speed of the quasi-pressure wave [m/s] along (..., 3) directions."""
        speeds: Array = self._speeds(normals)[..., 2]
        return speeds

    @cached_property
    def c_s(self) -> float:
        """Return the speed of the slowest wave [m/s] over a spiral of directions and the material's axes."""
        k = np.arange(_DIRECTIONS) + 0.5
        height, angle = 1 - 2 * k / _DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
        width = np.sqrt(1 - height**2)
        spiral = np.stack([width * np.cos(angle), width * np.sin(angle), height], axis=1)
        return float(self._speeds(np.concatenate([spiral, np.asarray(self.axes, dtype=float)])).min())


Solid = Material | Orthotropic


def stiffness_tensor(elasticity: Array) -> Array:
    """Return the (3, 3, 3, 3) stiffness [Pa] from its (6, 6) Voigt form."""
    place = np.empty((3, 3), dtype=np.int64)
    for k, (a, b) in enumerate(VOIGT):
        place[a, b] = place[b, a] = k
    return np.asarray(elasticity[place[:, :, None, None], place[None, None]])


def material_from(values: Mapping[str, Any]) -> Material:
    """Return a `Material` from a mapping; the error lists what is missing."""
    missing = [key for key in _CONSTANTS if key not in values]
    if missing:
        raise ModelError(f"material: give {', '.join(missing)} too (given: {', '.join(values) or 'nothing'})")
    young, poisson, density = (_number(key, values[key]) for key in _CONSTANTS)
    return Material(young, poisson, density, str(values.get("name", "")))


def _number(key: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ModelError(f"material: {key} = {value!r} is not a number; give it in SI units, without a unit") from None


def _positive(material: Solid, *keys: tuple[str, str]) -> None:
    for key, unit in keys:
        value = np.asarray([_number(key, each) for each in np.atleast_1d(getattr(material, key)).tolist()])
        if not (np.all(np.isfinite(value)) and np.all(value > 0)):
            raise ModelError(
                f"material {material.name!r}: {key} = {getattr(material, key)} {unit} must be positive and finite"
            )


def _damping(material: Solid) -> None:
    for key in ("loss_factor", "rayleigh"):
        value = np.asarray(getattr(material, key), dtype=float)
        if value.shape != (() if key == "loss_factor" else (2,)) or not np.all(np.isfinite(value) & (value >= 0)):
            raise ModelError(f"material {material.name!r}: {key} = {getattr(material, key)} must be finite and >= 0")
