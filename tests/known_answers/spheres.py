"""Free elastic sphere: breathing, torsional and spheroidal modes of the axisymmetric model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import skfem
from scipy.optimize import brentq
from scipy.special import spherical_jn

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.model import Material, SecondOrderModel
from seatfem.structures.reduction.modes import solve_modes
from seatfem.verify import Case

from .limits import converged, limit_cases

_LAMB = "Lamb, Proc. London Math. Soc. 13 (1882) 189"
_SPHERE = 0.3  # Poisson's ratio


def sphere_cases() -> tuple[Case, ...]:
    """Free elastic sphere: breathing, torsional and spheroidal modes of the axisymmetric model.

    By harmonics 0 and 2.
    """
    return (*_breathing(), *_degree_two())


def sphere_frequency(kind: str, low: float, high: float, poisson: float = _SPHERE) -> float:
    """Return w a/c_s of a free sphere between the bounds; kind "radial", or "torsional", "spheroidal" of degree 2."""
    ratio = math.sqrt((1 - 2 * poisson) / (2 - 2 * poisson))  # c_s/c_p

    def radial(x: float) -> float:
        y = ratio * x
        return float(y * math.cos(y) - (1 - x**2 / 4) * math.sin(y))

    def torsional(x: float) -> float:
        return float(spherical_jn(2, x) - x * spherical_jn(3, x))

    def spheroidal(x: float) -> float:
        y = ratio * x
        normal = (2 - x**2 / 2) * spherical_jn(2, y) + 2 * y * spherical_jn(3, y)
        shear = spherical_jn(2, y) - y * spherical_jn(3, y)
        normal_s = 6 * (spherical_jn(2, x) - x * spherical_jn(3, x))
        shear_s = (3 - x**2 / 2) * spherical_jn(2, x) + x * spherical_jn(3, x)
        return float(normal * shear_s - shear * normal_s)

    equations = {"radial": radial, "torsional": torsional, "spheroidal": spheroidal}
    return float(brentq(equations[kind], low, high, xtol=1e-14))


def _half_disk(n: int) -> Any:
    """Return the meridian of the unit sphere: curved triangles, about 1/n wide."""
    whole = skfem.MeshTri.init_circle(round(math.log2(n)))
    half = whole.restrict(np.flatnonzero(whole.p[0][whole.t].mean(axis=0) > 0))
    outside = np.flatnonzero(np.all(np.abs(np.hypot(*half.p[:, half.facets]) - 1) < 1e-9, axis=0))
    curved = skfem.MeshTri2.from_mesh(half)
    points = curved.doflocs.copy()
    middles = curved.dofs.facet_dofs[0, outside]
    points[:, middles] /= np.hypot(*points[:, middles])
    points[0, np.abs(points[0]) < 1e-12] = 0.0
    return skfem.MeshTri2(points, curved.t, _boundaries={"surface": outside})


def _sphere(n: int, young: float, harmonic: int) -> SecondOrderModel:
    material = Material(young, _SPHERE, 1.0)
    ports = {"surface": "surface"} if harmonic == 0 else {}
    return assemble_axisymmetric(_half_disk(n), material, harmonic=harmonic, fixed=(), ports=ports, order=2)


def _breathing() -> tuple[Case, ...]:
    """Return the cases of the modes with harmonic 0 that move the surface outward on the mean: degree 0."""
    unit = Material(1.0, _SPHERE, 1.0)

    def solve(n: int, young: float) -> Sequence[float]:
        model = _sphere(n, young, 0)
        modes = solve_modes(model, 80, shift_hz=0.1)
        mean = np.abs(model.port_matrix[:, 0] @ modes.shapes)
        strongest = np.sort(np.argsort(mean * (modes.omega > 0.1))[-len(exact) :])
        return tuple(modes.omega[strongest] / unit.c_p)

    exact = (2.670214733, 6.091989067, 9.300894506)
    quantities = {f"w a/c_p, breathing mode {i + 1}": value for i, value in enumerate(exact)}
    return limit_cases("free sphere, nu = 0.3", quantities, 1e-7, _LAMB, converged(solve, 8, 4))


def _degree_two() -> tuple[Case, ...]:
    """Return the cases of the lowest torsional and spheroidal modes of degree 2, of which harmonic 2 holds one each."""
    unit = Material(1.0, _SPHERE, 1.0)

    def solve(n: int, young: float) -> Sequence[float]:
        return tuple(solve_modes(_sphere(n, young, 2), 2, shift_hz=0.1).omega / unit.c_s)

    bounds = {"torsional": (2.0, 3.0), "spheroidal": (2.3, 3.0)}
    exact = {f"w a/c_s, {kind}, degree 2": sphere_frequency(kind, *ends) for kind, ends in bounds.items()}
    return limit_cases("free sphere, nu = 0.3", exact, 1e-9, _LAMB, converged(solve, 2, 4))
