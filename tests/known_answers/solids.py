"""Solids whose answer is known: bar, sliding box, slender cantilever, thick tube under pressure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import skfem
from scipy.optimize import brentq

from impact.beams.timoshenko import TimoshenkoCantilever
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import Array, Material, SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes.blocks import Bar
from seatfem.verify import Case, Estimate

from .grids import box, hold, plane, section
from .limits import converged, limit_cases

_NAFEMS = "NAFEMS, Selected Benchmarks for Natural Frequency Analysis"
_SIDES = (1.0, 0.8, 0.6)
_WALLS = tuple(f"{axis}{end}" for axis in "xyz" for end in (0, 1))
_POISSON = 0.3
_CELLS: dict[str, type] = {"hexahedra": skfem.MeshHex, "tetrahedra": skfem.MeshTet}
_BEAM = TimoshenkoCantilever(200e9, 7850.0, 0.2, 0.02, 0.02, poisson=0.0)
# Euler-Bernoulli bending with shear leaves out warping at the clamp and terms (k h)^4; measured 1.2e-5, 1.4e-4, 3.4e-4
_BEAM_MODEL = (1e-4, 3e-4, 7e-4)
_TUBE = (1.0, 2.0)  # radii
_BAR = Bar(length=40e-3, width=6e-3, height=6e-3)
_YOUNG, _DENSITY = 200e9, 7850.0
_COARSE, _FINE = 6e-3, 3e-3  # element sizes [m]


def solid_cases() -> tuple[Case, ...]:
    """Solids whose answer is known in three dimensions: sliding box, slender cantilever, thick tube under pressure."""
    boxes = (*_sliding_box("hexahedra"), *_sliding_box("tetrahedra"))
    return (*boxes, *_thick_plate(), _in_plane(), *_cantilever(), *_tube())


def box_frequency(wave: tuple[int, int, int], speed: float) -> float:
    """Return c |k|/(2 pi), k = pi (l/a, m/b, n/c): u_x = A sin(k_x x) cos(k_y y) cos(k_z z), A along k or across."""
    return speed / 2 * math.hypot(*(n / side for n, side in zip(wave, _SIDES, strict=True)))


def _sliding_box(shape: str) -> tuple[Case, ...]:
    """Return the cases of shear waves (1,1,0), (1,0,1) and the pressure wave (1,0,0) between sliding walls."""

    def solve(n: int, young: float) -> Sequence[float]:
        mesh = box(*(np.linspace(0.0, side, n + 1) for side in _SIDES), cells=_CELLS[shape])
        material = Material(young, _POISSON, 1.0)
        model = assemble(mesh, material, fixed=(), sliding=_WALLS, ports={}, order=2)
        return tuple(solve_modes(model, 3).frequencies_hz)

    unit = Material(1.0, _POISSON, 1.0)
    waves = (((1, 1, 0), "shear", unit.c_s), ((1, 0, 0), "pressure", unit.c_p), ((1, 0, 1), "shear", unit.c_s))
    exact = {f"f of the {kind} wave {wave}": box_frequency(wave, speed) for wave, kind, speed in waves}
    name = f"box of quadratic {shape} between sliding walls"
    return limit_cases(name, exact, 1e-9, "d'Alembert's waves", converged(solve, 2, 4))


def bending_frequency(k: float, half: float, material: Material) -> float:
    """Return f of the lowest antisymmetric Rayleigh-Lamb wave of wave number k in a plate of thickness 2 half.

    4 k^2 q tan(q d) + (q^2 - k^2)^2 tan(p d)/p = 0, d = half, p^2 = (w/c_p)^2 - k^2, q^2 = (w/c_s)^2 - k^2 < 0.
    """

    def equation(w: float) -> float:
        p, q = (math.sqrt(k**2 - (w / c) ** 2) for c in (material.c_p, material.c_s))
        return (q**2 + k**2) ** 2 * math.tanh(p * half) / p - 4 * k**2 * q * math.tanh(q * half)

    return float(brentq(equation, 0.1 * k**2 * half * material.c_s, k * material.c_s * (1 - 1e-9))) / (2 * math.pi)


def _thick_plate() -> tuple[Case, ...]:
    """Return the cases of a square plate, a/h = 10, whose edge faces are held across and along, not normally.

    Then its waves are those of the infinite plate with k = pi/a (m, n). (FV52 holds the lower edges instead: under a
    line the displacement of a solid has no bound, and frequencies of bending fall with every finer mesh.)
    """

    def solve(n: int, young: float) -> Sequence[float]:
        across, up = np.linspace(0.0, 10.0, 3 * n + 1), np.linspace(0.0, 0.5, n + 1)
        material = Material(200e9 * young, _POISSON, 8000.0)
        whole = assemble(box(across, across, up), material, fixed=(), ports={}, order=2)
        sides = [(((1, 2), (0, 2))[axis], plane(axis, end)) for axis in (0, 1) for end in (0.0, 10.0)]
        model = hold(whole, ((0, 1), plane(2, 0.0)), *sides)
        return tuple(solve_modes(model, 4).frequencies_hz[[0, 1, 3]])  # the second is double

    def frequency(*wave: int) -> float:
        return bending_frequency(math.pi / 10 * math.hypot(*wave), 0.5, Material(200e9, _POISSON, 8000.0))

    exact = {f"f {wave} [Hz]": frequency(*wave) for wave in ((1, 1), (1, 2), (2, 2))}
    name = "thick square plate of quadratic hexahedra on its edge faces, a/h = 10"
    return limit_cases(name, exact, 1e-9, "Rayleigh-Lamb waves", converged(solve, 1, 4))


def _in_plane() -> Case:
    """Return the case of the mode of FV52 that its supports leave alone: in plane, antisymmetric; an eighth."""

    def solve(n: int, young: float) -> Sequence[float]:
        across = np.linspace(0.0, 5.0, 2 * n + 1)
        material = Material(200e9 * young, _POISSON, 8000.0)
        mesh = box(across, across, np.array([0.0, 0.5]))
        whole = assemble(mesh, material, fixed=(), sliding="z0", ports={}, order=2)
        model = hold(whole, ((1,), plane(0, 0.0)), ((0,), plane(1, 0.0)))  # which leaves one rigid rotation
        return (float(solve_modes(model, 2, shift_hz=100.0).frequencies_hz[1]),)

    name = "thick square plate (FV52) of quadratic hexahedra"
    return Case(name, "f_8, in plane [Hz]", 193.59, 1e-4, _NAFEMS, converged(solve, 1, 4)(0))


def _cantilever() -> tuple[Case, ...]:
    """Return the cases of bending of a beam of nu = 0, L/h = 10: the upper half in plane strain, as good as stress."""

    def solve(n: int, young: float) -> Sequence[float]:
        half = _BEAM.thickness / 2
        mesh = box(np.linspace(0.0, _BEAM.length, 10 * n + 1), np.array([0.0, half / n]), np.linspace(0.0, half, n + 1))
        material = Material(_BEAM.young * young, 0.0, _BEAM.density)
        whole = assemble(mesh, material, fixed="x0", sliding=("y0", "y1"), ports={}, order=2)
        return tuple(solve_modes(hold(whole, ((0, 1), plane(2, 0.0))), 3).frequencies_hz)

    limit = converged(solve, 1, 4)
    exact = _BEAM.frequencies(3) / (2 * math.pi)
    name = "cantilever, L/h = 10, nu = 0, as a solid"
    source = "Timoshenko's beam, kappa = 5/6"
    return tuple(Case(name, f"f_{i + 1} [Hz]", float(f), _BEAM_MODEL[i], source, limit(i)) for i, f in enumerate(exact))


def tube_widening(inner: float, outer: float, poisson: float) -> float:
    """Return u_r E/(p a) at the bore a of a long tube under pressure p that keeps its length."""
    return (1 + poisson) * ((1 - 2 * poisson) * inner**2 + outer**2) / (outer**2 - inner**2)


def _tube() -> tuple[Case, Case]:
    exact = tube_widening(*_TUBE, _POISSON)

    def widening(model: SecondOrderModel) -> tuple[float]:
        """Return the widening from the compliance u_r/F of the bore, F = p A."""
        area = model.ports["bore"].area
        assert area is not None
        vector = model.port_matrix
        return (float(np.vdot(vector, factorize(model.K).solve(vector))) * area / _TUBE[0],)

    def revolved(n: int, young: float) -> Sequence[float]:
        mesh = section(np.linspace(*_TUBE, n + 1), np.array([0.0, 1.0 / n]))
        material = Material(young, _POISSON, 1.0)
        return widening(
            assemble_axisymmetric(mesh, material, fixed=(), sliding=("bottom", "top"), ports={"bore": "inner"}, order=2)
        )

    def quarter(n: int, young: float) -> Sequence[float]:
        material = Material(young, _POISSON, 1.0)
        sliding = ("y0", "y1", "z0", "z1")
        return widening(assemble(_quarter_tube(n), material, fixed=(), sliding=sliding, ports={"bore": "x0"}, order=2))

    def case(kind: str, limit: Any) -> Case:
        return Case(
            f"thick tube under pressure, {kind}", "u_r E/(p a) at the bore, b/a = 2", exact, 1e-9, "Lame", limit
        )

    return (
        case("axisymmetric", converged(revolved, 2, 4)(0)),
        case("quarter of curved hexahedra", converged(quarter, 1, 4)(0)),
    )


def _quarter_tube(n: int) -> Any:
    """Return a box of radius, angle and height, bent: quadratic hexahedra with nodes on the cylinders."""
    flat = box(np.linspace(*_TUBE, n + 1), np.linspace(0.0, math.pi / 2, 2 * n + 1), np.array([0.0, 0.5 / n]))
    mesh = skfem.MeshHex2.from_mesh(flat)
    radius, angle, height = mesh.doflocs
    bent: Array = np.stack([radius * np.cos(angle), radius * np.sin(angle), height])
    return skfem.MeshHex2(bent, mesh.t, _boundaries=flat.boundaries)


def finite_element_cases() -> tuple[Case, ...]:
    """Finite element models of bodies whose answer is known.

    Bar meshed by gmsh, nu = 0: the fixed rod's frequencies (2n - 1) c/4l. The meshes are made once, when needed.
    """

    @cache
    def mesh(size: float) -> SeatMesh:
        return make_mesh(_BAR, MeshSpec(size=size))

    return tuple(_frequency(mesh, n) for n in (1, 2, 3))


def _frequency(mesh: Callable[[float], SeatMesh], n: int) -> Case:
    exact = (2 * n - 1) * math.sqrt(_YOUNG / _DENSITY) / (4 * _BAR.length)

    def frequency(size: float, young: float) -> float:
        model = assemble(mesh(size), Material(young, 0.0, _DENSITY), fixed="fixed", sliding=("sides_x", "sides_y"))
        return float(solve_modes(model, n).frequencies_hz[n - 1])

    def compute(coefficient: float) -> Estimate:
        coarse, fine = (frequency(size, coefficient * _YOUNG) for size in (_COARSE, _FINE))
        return Estimate(fine, abs(fine - coarse))

    name = "bar, 3-D quadratic tetrahedra, nu = 0"
    return Case(name, f"f_{n} = {2 * n - 1} c/4 l [Hz]", exact, 1e-9, "d'Alembert's waves", compute)
