"""The half-space as a block of finite elements: a disk and a square on it, at rest and suddenly, and a rigid face."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from impact.greens.oscillator import hann
from impact.greens.sampled import SampledGreens
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.method import spring_of
from seatfem.structures.model import Array, Material, SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.transient import march
from seatfem.structures.rings import face_compliance, ring_borders, ring_names, with_fewer_rings
from seatfem.verify import Case, Estimate

from .grids import box, section, split
from .half_space import unit_patch
from .limits import converged, limit_cases, recomputed, richardson

_JOHNSON = "Johnson, Contact Mechanics, ch. 3"
_LOVE = "Love, Phil. Trans. A 228 (1929) 377"
_PEKERIS = "Pekeris' point load averaged over the disk by quadrature"
_GROUND = 0.25  # Poisson's ratio
_BOUSSINESQ = "Boussinesq 1885; Johnson, Contact Mechanics, 3.4"
_FINEST = 8  # rings


def ground_cases() -> tuple[Case, ...]:
    """The half-space as a block of finite elements: a disk and a square pressed on it, at rest and suddenly."""
    return (*_disk_at_rest(), _square_at_rest(), *_disk_step())


def _half_space_model(radius: float, n: int, young: float) -> SecondOrderModel:
    """Return a clamped cylinder, radius and depth ``radius``, under a loaded disk of radius 1; n: cells per
    interval."""
    far = 2.0 ** np.arange(1, round(math.log2(radius)) + 1)
    r = split([0.0, 0.5, 0.8, 0.95, 1.0, 1.05, 1.2, 1.5, *far], n)
    z = split([0.0, 0.05, 0.2, 0.5, 1.0, 1.5, *far], n)
    mesh = section(r, z).with_boundaries({"contact": lambda x: (x[1] < 1e-12) & (x[0] < 1.0)})
    material = Material(young, _GROUND, 1.0)
    return assemble_axisymmetric(mesh, material, fixed=("outer", "top"), order=2)


def _disk_at_rest() -> tuple[Case, ...]:
    """Return the cases of w E a/((1 - nu^2) F), extrapolated to infinite depth R = 8, 16, 32, then to the mesh.

    The clamped bottom takes away a rigid displacement ~1/R and, by symmetry, nothing until ~1/R^3.
    """

    def displacements(radius: float, n: int, young: float) -> Array:
        model = _half_space_model(radius, n, young)
        assert model.dofs is not None
        u = factorize(model.K).solve(model.port_matrix)[:, 0]
        down, (r, _, z) = -model.expand(u)[2], model.dofs.points
        at = [int(np.flatnonzero((np.abs(r - place) < 1e-9) & (np.abs(z) < 1e-9))[0]) for place in (0.0, 1.0)]
        return np.array([float(model.port_matrix[:, 0] @ u), *np.abs(down[at])]) / (1 - _GROUND**2)

    def solve(n: int, young: float) -> Sequence[float]:
        one, two, four = (displacements(radius, n, young) for radius in (8.0, 16.0, 32.0))
        before, after = 2 * two - one, 2 * four - two
        return tuple(after + (after - before) / 7)

    exact = {"mean": 16 / (3 * math.pi**2), "centre": 2 / math.pi, "edge": 4 / math.pi**2}
    quantities = {f"{at} w E a/((1 - nu^2) F)": value for at, value in exact.items()}
    return limit_cases("half-space of finite elements, disk load", quantities, 1e-6, _JOHNSON, converged(solve, 1, 3))


def _square_at_rest() -> Case:
    """Return the case of a quarter of a loaded square of side 1 on a block of hexahedra with three clamped sides.

    R = 4 on meshes n = 1, 2, 4. The stress is like log r at the edge of the pressure, so that the elements there leave
    an error ~n^-2 of the energy. What the depth takes away: R = 4, 8, 16 with n = 2, uncertain by what n = 1 differs.
    """

    @cache
    def compliance(radius: float, n: int, young: float) -> float:
        places = [0.0, 0.5, 1.5, 4.0, *(place for place in (8.0, 16.0) if place <= radius)]
        axis = split(places, n)
        mesh = box(axis, axis, axis).with_boundaries(
            {"contact": lambda x: (x[2] < 1e-12) & (x[0] < 0.5) & (x[1] < 0.5)}
        )
        material = Material(young, _GROUND, 1.0)
        model = assemble(mesh, material, fixed=("x1", "y1", "z1"), sliding=("x0", "y0"), order=2)
        b = model.port_matrix  # the quarter carries F/4
        return float(np.vdot(b, factorize(model.K).solve(b))) / (4 * (1 - _GROUND**2))

    def depth(n: int) -> float:
        one, two, four = (compliance(radius, n, 1.0) for radius in (4.0, 8.0, 16.0))
        before, after = 2 * two - one, 2 * four - two
        return after + (after - before) / 7 - one

    @cache
    def limit() -> Estimate:
        near = richardson(lambda n: compliance(4.0, n, 1.0), 1, 2)
        far = depth(2)
        return replace(near, value=near.value + far, uncertainty=near.uncertainty + abs(far - depth(1)))

    quantity = "mean w E b/((1 - nu^2) F)"
    exact = 0.9464020088
    compute = recomputed(lambda k: compliance(4.0, 1, k), limit)
    return Case("half-space of finite elements, square load", quantity, exact, 1e-4, _LOVE, compute)


def _disk_step() -> tuple[Case, ...]:
    """Return the cases of a disk loaded within 0.5 a/c_s, before an echo from the clamped bottom returns."""
    width, times = 0.5, (0.5, 1.0, 1.5, 2.0, 2.7)
    patch = unit_patch(_GROUND)
    static = patch.static_compliance()[0, 0]

    def switched(step: Callable[[Array], Array]) -> Array:
        """Return the mean of u(t - s) with Hann's weight of s; the trapezoidal rule is exact to all orders."""
        s = width * np.arange(200) / 200
        weight = hann(s, width) * width / 200
        return np.array([float(weight @ step(np.maximum(t - s, 0.0))) for t in times])

    def solve(n: int, young: float) -> Sequence[float]:
        mesh = section(np.linspace(0.0, 3.5, 7 * n + 1), np.linspace(0.0, 2.5, 5 * n + 1))
        mesh = mesh.with_boundaries({"contact": lambda x: (x[1] < 1e-12) & (x[0] < 1.0)})
        material = Material(patch.young * young, _GROUND, 1.0)
        model = assemble_axisymmetric(mesh, material, fixed=("outer", "top"), order=2)
        dt = 0.1 / n
        greens = SampledGreens(march(model, dt, 27 * n + 1), dt)
        return tuple(switched(greens.step_response) / static)

    values = map(float, switched(patch.step_response) / static)
    exact = {f"mean u/u_static at c_s t/a = {t:g}": value for t, value in zip(times, values, strict=True)}
    name = "half-space of finite elements, disk load switched on in 0.5 a/c_s"
    return limit_cases(name, exact, 1e-6, _PEKERIS, converged(solve, 2, 2))


def rigid_face_cases() -> tuple[Case, ...]:
    """A rigid face on the half-space: the struck patch in rings, each with a contact of its own.

    w E a/((1 - nu^2) F) of a flat punch, 1/2, from 2, 4 and 8 rings; a patch that moves as its mean has 0.5404.
    """

    @cache
    def compliance(young: float) -> Array:
        """Return (8, 8) of the rings, at infinite depth; see the docstring of the module."""
        one, two, four = (_rings(radius, young) for radius in (8.0, 16.0, 32.0))
        before, after = 2 * two - one, 2 * four - two
        return np.asarray(after + (after - before) / 7)

    def solve(rings: int, young: float) -> float:
        ground = spring_of(compliance(young), 0.0, ring_names("contact", _FINEST), {})
        return face_compliance(with_fewer_rings(ground, rings)) / (1 - _GROUND**2)

    def limit() -> Estimate:
        return richardson(lambda rings: solve(rings, 1.0), _FINEST // 4, 2)

    compute = recomputed(lambda k: solve(_FINEST, k), limit)
    quantity = "w E a/((1 - nu^2) F), in rings"
    return (Case("half-space of finite elements, rigid disk", quantity, 0.5, 1e-6, _BOUSSINESQ, compute),)


def _rings(radius: float, young: float) -> Array:
    """Return the compliances (8, 8) of the rings of a unit disk on a clamped cylinder of this radius and depth."""
    far = 2.0 ** np.arange(1, round(math.log2(radius)) + 1)
    r = split([*np.sqrt(ring_borders(_FINEST)), 1.02, 1.06, 1.2, 1.5, *far], 2)
    z = split([0.0, 0.01, 0.04, 0.12, 0.3, 0.6, 1.0, 1.5, *far], 2)
    mesh = section(r, z).with_boundaries({"contact": lambda x: (x[1] < 1e-12) & (x[0] < 1.0)})
    material = Material(young, _GROUND, 1.0)
    model = assemble_axisymmetric(mesh, material, fixed=("outer", "top"), order=2, rings=_FINEST)
    return np.asarray(model.port_matrix.T @ factorize(model.K).solve(model.port_matrix))
