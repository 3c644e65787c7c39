"""Finite element models of bodies whose answer is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import Material
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes.bar import Bar
from seatfem.verification.case import Case, Estimate

_BAR = Bar(length=40e-3, width=6e-3, height=6e-3)
_YOUNG, _DENSITY = 200e9, 7850.0
_COARSE, _FINE = 6e-3, 3e-3  # element sizes [m]


def finite_element_cases() -> tuple[Case, ...]:
    """Bar meshed by gmsh, nu = 0: the fixed rod's frequencies (2n - 1) c/4l. The meshes are made once, when needed."""

    @cache
    def mesh(size: float) -> SeatMesh:
        return make_mesh(_BAR, MeshSpec(size=size))

    return tuple(_frequency(mesh, n) for n in (1, 2, 3))


def _frequency(mesh: Callable[[float], SeatMesh], n: int) -> Case:
    exact = (2 * n - 1) * math.sqrt(_YOUNG / _DENSITY) / (4 * _BAR.length)

    def frequency(size: float, young: float) -> float:
        model = assemble(mesh(size), Material(young, 0.0, _DENSITY), fixed="fixed", sliding=("sides_x", "sides_y"))
        return float(solve_modes(model, n, check=False).frequencies_hz[n - 1])

    def compute(coefficient: float) -> Estimate:
        coarse, fine = (frequency(size, coefficient * _YOUNG) for size in (_COARSE, _FINE))
        return Estimate(fine, abs(fine - coarse))

    name = "bar, 3-D quadratic tetrahedra, nu = 0"
    return Case(name, f"f_{n} = {2 * n - 1} c/4 l [Hz]", exact, 1e-9, "d'Alembert's waves", compute)
