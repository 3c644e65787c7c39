"""Longitudinal and torsional waves of a round bar by the axisymmetric model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.model import Material, SecondOrderModel
from seatfem.structures.reduction.modes import solve_modes
from seatfem.verify import Case

from .grids import hold, plane, section, split
from .limits import converged, limit_cases, small_limit

_POCHHAMMER = "Pochhammer 1876; Graff, Wave Motion in Elastic Solids, ch. 8"
_RAYLEIGH = "Rayleigh 1885"
_TORSION = "c_s (2 m - 1)/(4 l), Love, A Treatise on the Mathematical Theory of Elasticity, article 287"
_BAR = 0.29  # Poisson's ratio
_WAVES = "longitudinal waves of a round bar, nu = 0.29"


def round_bar_cases() -> tuple[Case, ...]:
    """Longitudinal and torsional waves of a round bar by the axisymmetric model.

    Phase velocities of the lowest wave, and for waves much shorter than the radius; torsion of a clamped bar.
    """
    return (*_bar(), _surface_wave(), *_torsion())


def bar_frequency(k: float, poisson: float = _BAR) -> float:
    """Return w a/c_0 of the lowest longitudinal wave with wave number k/a along a free round bar.

    2 (q^2 + k^2) p^2 J(p) J(q) - (q^2 - k^2)^2 J_0(p) J(q) - 4 k^2 p^2 J(p) J_0(q) = 0, J(x) = J_1(x)/x,
    p^2 = (w/c_p)^2 - k^2, q^2 = (w/c_s)^2 - k^2, either of which may be negative.
    """
    material = Material(1.0, poisson, 1.0)

    def equation(w: float) -> float:
        p, q = (w / material.c_p) ** 2 - k**2, (w / material.c_s) ** 2 - k**2
        root_p, root_q = np.sqrt(complex(p)), np.sqrt(complex(q))
        zero_p, zero_q = jv(0, root_p), jv(0, root_q)
        one_p, one_q = jv(1, root_p) / root_p, jv(1, root_q) / root_q
        terms = 2 * (q + k**2) * p * one_p * one_q - (q - k**2) ** 2 * zero_p * one_q - 4 * k**2 * p * one_p * zero_q
        return float(terms.real)

    low = 0.5 * k * material.c_s
    grid = np.linspace(low, k, 400) + 1e-9
    values = [equation(w) for w in grid]
    first = next(i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0)
    return float(brentq(equation, grid[first], grid[first + 1], xtol=1e-14))


def _round_bar(n: int, young: float, length: float) -> SecondOrderModel:
    """Return a bar with ends that slide: standing waves of k = m pi/length are exact."""
    mesh = section(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, length, round(n * length) + 1))
    material = Material(young, _BAR, 1.0)
    return assemble_axisymmetric(mesh, material, fixed=(), sliding=("bottom", "top"), ports={}, order=2)


def _bar() -> tuple[Case, ...]:
    """Return the cases of half waves of length pi/k, 1 to 6 along a bar of 4 pi radii."""
    waves = (1, 3, 6)

    def solve(n: int, young: float) -> Sequence[float]:
        omega = solve_modes(_round_bar(n, young, 4 * math.pi), 6, shift_hz=0.1).omega
        return tuple(omega[m - 1] / (m / 4) for m in waves)

    exact = {f"c/c_0 at k a = {m / 4:g}": bar_frequency(m / 4) / (m / 4) for m in waves}
    return limit_cases(_WAVES, exact, 1e-9, _POCHHAMMER, converged(solve, 1, 4))


def _surface_wave() -> Case:
    """Return the case of the bar's wave, k a = 24, 48, ...: curvature is of order 1/(k a). Elements scale with it.

    Between a sliding end and, a quarter wave on, a plane without radial displacement it is the lowest mode.
    """

    def solve(n: int, young: float) -> Sequence[float]:
        k = 24.0 * n
        depth = np.array([0.0, 0.4, 0.8, 1.2, 1.8, 2.6, 3.6, 5.0, 7.0, 9.0, 12.0, 15.0, 19.0, 23.0]) / k
        mesh = section(split([0.0, *(1.0 - depth[::-1])], 2), np.linspace(0.0, math.pi / (2 * k), 9))
        material = Material(young, _BAR, 1.0)
        half = assemble_axisymmetric(mesh, material, fixed=(), sliding="bottom", ports={}, order=2)
        model = hold(half, ((0,), plane(2, math.pi / (2 * k))))
        return (float(solve_modes(model, 1, shift_hz=0.1 * k).omega[0]) / k,)

    return Case(_WAVES, "c/c_0 for k a to infinity", 0.57640466, 1e-5, _RAYLEIGH, small_limit(solve)(0))


def _torsion() -> tuple[Case, ...]:
    """Return the cases of the first two torsional modes of a bar clamped at one end, five radii long."""
    orders = (1, 2)

    def solve(n: int, young: float) -> Sequence[float]:
        mesh = section(np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 5.0, 5 * n + 1))
        material = Material(young, _BAR, 1.0)
        model = assemble_axisymmetric(mesh, material, torsion=True, fixed="bottom", ports={}, order=2)
        return tuple(float(solve_modes(model, 2).omega[m - 1]) for m in orders)

    exact = {f"w a/c_0, mode {m}": Material(1.0, _BAR, 1.0).c_s * (2 * m - 1) * math.pi / 10 for m in orders}
    return limit_cases("torsion of a clamped round bar, five radii long", exact, 1e-5, _TORSION, converged(solve, 1, 4))
