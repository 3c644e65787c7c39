"""Thick plates by Mindlin elements: the simply supported square."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from seatfem.structures.elements.mindlin import PlateMesh, Unknown, assemble_plate
from seatfem.structures.materials import Material
from seatfem.structures.model import Array
from seatfem.structures.reduction.modes import solve_modes
from seatfem.verify import Case

from .limits import converged, limit_cases

_MINDLIN = "Mindlin, J. Appl. Mech. 18 (1951) 31 (exact)"
_POISSON = 0.3
_WAVES = ((1, 1), (1, 2), (2, 2))  # half waves along both sides
_MODES = (0, 1, 3)  # the second is double
_HELD: dict[str, tuple[Unknown, ...]] = {"across": ("w", "a_y"), "along": ("w", "a_x")}


def thick_plate_cases() -> tuple[Case, ...]:
    """Thick plates by Mindlin elements: the simply supported square.

    w [rad/s] of the unit square, E = rho = 1, hard supports, on curved elements.
    """
    return tuple(case for thickness in (0.2, 0.01) for case in _supported(thickness))


def _supported(thickness: float) -> tuple[Case, ...]:
    def solve(n: int, young: float) -> Sequence[float]:
        model = assemble_plate(_bulged(n), Material(young, _POISSON, 1.0), thickness, held=_HELD)
        return tuple(solve_modes(model, max(_MODES) + 1).omega[list(_MODES)])

    exact = {f"w, {m} by {n} half waves": _exact(thickness, m, n) for m, n in _WAVES}
    name = f"simply supported Mindlin plate, h/a = {thickness:g}"
    return limit_cases(name, exact, 1e-6, _MINDLIN, converged(solve, 6, 4))


def _exact(thickness: float, m: int, n: int) -> float:
    """Return the exact frequency: w = sin(m pi x) sin(n pi y), a = A grad w leave two equations for w and A."""
    square = np.pi**2 * (m**2 + n**2)
    bending = thickness**3 / (12 * (1 - _POISSON**2)) * square**2
    shear = 5 / 6 * thickness / (2 * (1 + _POISSON)) * square
    mass = np.diag([thickness, thickness**3 / 12 * square])
    values: Array = np.asarray(scipy.linalg.eigvalsh([[shear, -shear], [-shear, bending + shear]], mass), dtype=float)
    return float(np.sqrt(values[0]))


def _bulged(n: int) -> PlateMesh:
    """Return the unit square of n by n elements whose inner sides are curved."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(0.0, 1.0, 2 * n + 1)] * 2, indexing="ij"))
    first = (2 * (2 * n + 1) * np.arange(n)[:, None] + 2 * np.arange(n)).ravel()
    steps = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))
    cells = np.stack([first + i * (2 * n + 1) + j for i, j in steps], axis=1)
    lines = {"across": np.flatnonzero((x == 0) | (x == 1)), "along": np.flatnonzero((y == 0) | (y == 1))}
    bulge = 0.06 * np.sin(np.pi * x) * np.sin(np.pi * y)
    return PlateMesh(np.stack([x + bulge * np.cos(2 * y), y - bulge], axis=1), cells, lines)
