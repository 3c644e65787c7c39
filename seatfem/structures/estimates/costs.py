"""Predicted cost of the Green's function of a body of finite elements: time by stage, and peak memory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from seatfem.machine import rates
from seatfem.structures.estimates.sizes import (
    COARSE_UNKNOWNS,
    KRYLOV_VECTORS,
    MATRIX_ENTRY,
    Sizes,
    counts_of,
    memory_need,
    solver_of,
)
from seatfem.structures.method import BEYOND, COARSENING, Method, Solver
from seatfem.structures.method import memory as forgotten_after
from seatfem.structures.rings import rings_to_compare
from seatfem.structures.shapes.profile import profile_of

if TYPE_CHECKING:
    from seatfem.structures.kinds.drawn import Drawn
    from seatfem.structures.kinds.structure import Structure
    from seatfem.structures.mesh.meshing import SeatMesh


SECTION_ELEMENT: Final = 0.5  # time to mesh a triangle of a section, over that of a tetrahedron
SECTION_ENTRY: Final = 10.0  # time to assemble an entry of a section's matrix, over that of a solid's
SINGLE_FACTOR, SINGLE_SOLVE = 0.6, 0.62  # times of factor and solve in single precision, over those in double
GRIDS_SOLVE: Final = 1.0  # time of a solve on two grids, over that of a product with the matrix
GRIDS_SETUP: Final = 5.0  # time of its preparation, without the coarse factorisation, over the same
SECTION_FACTOR: Final = 0.5  # times of factorisation and solves of a section, over those of a solid
FEWEST_HARMONICS, STATIC_HARMONICS = 5, 3  # harmonics reduced at least; further ones that are solved statically
ROOM: Final = 32  # Krylov vectors that are allocated at first; doubled if too few
FAST: Final = 1.8  # speed of pressure waves over that of shear waves
PORTS_POWER: Final = 0.6  # exponent of the number of rings in the number of vectors
TOLERANCE_POWER: Final = -0.141  # exponent of the tolerance in the number of vectors
HIGHEST: Final = 0.45  # frequency of the highest pole, over the bandwidth and over tolerance^(-1/2)
HIGHEST_OF_ALL: Final = 7.0  # frequency of the highest pole, over the bandwidth, of models with all their modes
STRICTER: Final = 8.0  # tolerance of the sum of harmonics over that of each
ALL_MODES: Final = 200  # unknowns up to which all modes are computed, as in `seatfem.structures.reduction.modal`


@dataclass(frozen=True)
class Numbers:
    """Size of a body's finite-element model.

    Attributes:
        sizes: numbers of elements, nodes and unknowns.
        modes: number of modes in the band, by Weyl's law.
        runs: number of harmonics, each reduced by itself; 1 for other bodies.
        section: whether the mesh is a half section.
        drawn: whether gmsh makes the mesh.
        kept: poles of the Green's function, if fewer than those of the reductions.
    """

    sizes: Sizes
    modes: float
    runs: float = 1.0
    section: bool = False
    drawn: bool = True
    kept: float | None = None


@dataclass(frozen=True)
class SeatModel(Numbers):
    """Size of a body's finite-element model and of its reduction. ``vectors``: Krylov vectors of each harmonic;
    ``solver``: solver by which they are computed."""

    vectors: float = 0.0
    solver: Solver = "double"

    def stricter(self, ratio: float) -> SeatModel:
        """Return the cost model at the tolerance of the reduction times ``ratio``."""
        return replace(self, vectors=min(self.vectors * ratio**TOLERANCE_POWER, self.sizes.counts.dof))

    @property
    def poles(self) -> float:
        """Return the number of poles of the reduced Green's function."""
        return 0.85 * self.vectors * self.runs if self.kept is None else self.kept


def seat_model(structure: Structure, method: Method, duration: float, coarser: float = 1.0) -> SeatModel | None:
    """Return the size of a structure's model by a method, with elements ``coarser`` times as large, for a ``duration``
    [s]; ``None`` without finite elements, or if their number is unknown."""
    numbers = None if structure.elastic is None else structure.elastic.numbers(method, coarser)
    if numbers is None:
        return None
    rings = (method.rings or 1) if coarser == 1.0 else rings_to_compare(method.rings or 1)
    if numbers.kept is not None and not numbers.section:  # a mode or a static solution costs about as much as a vector
        return SeatModel(**vars(numbers), vectors=min(numbers.kept, numbers.sizes.counts.dof))
    vectors = krylov_vectors(structure, method, duration, numbers.modes) * rings**PORTS_POWER
    counts = numbers.sizes.counts
    solver = solver_of(counts, method, rings, tetrahedra=not numbers.section)
    return SeatModel(**vars(numbers), vectors=min(vectors, counts.dof), solver=solver)


def numbers_of_drawn(body: Drawn, method: Method, coarser: float) -> Numbers:
    """Return the size of the model of a body that gmsh meshes, predicted from its coarsest mesh."""
    assert method.bandwidth is not None
    level, spec = body.elements_of(method), body.mesh_spec(method)
    spec = replace(spec, size=coarser * spec.size, contact_size=coarser * spec.patch_size)
    sizes = body.sizes(spec, level)
    section, inside = level in ("axisymmetric", "harmonics"), body.measures_inside(level)
    modes = (_modes_of_area if section else modes_of_volume)(inside, method.bandwidth, body.slowest)
    around = 1.0
    if level == "harmonics":
        lengths = 2 * math.pi * profile_of(body.geometry()).outer_radius * method.bandwidth / body.slowest
        around = max(FEWEST_HARMONICS, 0.9 * lengths * (BEYOND if method.in_arcs else 1.0))
    poles = _lip_poles(method, body.measures_inside("3d"), body.slowest) if method.in_arcs else None
    return Numbers(sizes, modes, around, section, kept=poles)


def _lip_poles(method: Method, volume: float, slowest: float) -> float:
    """Return the number of poles of a lip in arcs: modes up to the cutoff, and one exponential for each part."""
    assert method.bandwidth is not None
    assert method.lip is not None
    return modes_of_volume(volume, BEYOND * method.bandwidth, slowest) + len(method.lip.division.names)


def numbers_of_mesh(mesh: SeatMesh, slowest: float, method: Method) -> Numbers:
    """Return the size of the model on a given mesh; ``slowest``: speed of its slowest waves [m/s]."""
    assert method.bandwidth is not None
    modes = modes_of_volume(mesh.quality.volume, method.bandwidth, slowest)
    poles = _lip_poles(method, mesh.quality.volume, slowest) if method.in_arcs else None
    return Numbers(_sizes_of(mesh), modes, drawn=False, kept=poles)


def highest_pole(model: SeatModel | None, tolerance: float) -> float:
    """Return the frequency of the highest pole of a reduction, over the bandwidth."""
    if model is not None and model.sizes.counts.dof <= ALL_MODES:
        return HIGHEST_OF_ALL
    stricter = STRICTER if model is not None and model.runs > 1 else 1.0
    return HIGHEST * math.sqrt(stricter / tolerance)


def _modes_of_area(area: float, band: float, slow: float) -> float:
    """Return the number of a section's modes in a band, by Weyl's law A k^2 (1/c_s^2 + 1/c_p^2)/(4 pi), k = 2 pi
    band."""
    return area * (2 * math.pi * band) ** 2 * (slow**-2 + (FAST * slow) ** -2) / (4 * math.pi)


def modes_of_volume(volume: float, band: float, slow: float) -> float:
    """Return the number of modes of a solid in a band, by Weyl's law V k^3 (2/c_s^3 + 1/c_p^3)/(6 pi^2), k = 2 pi band.

    Source: M. Dupuis, R. Mazo, L. Onsager, J. Chem. Phys. 33 (1960) 1452.
    """
    return volume * (2 * math.pi * band) ** 3 * (2 * slow**-3 + (FAST * slow) ** -3) / (6 * math.pi**2)


def krylov_vectors(structure: Structure, method: Method, duration: float, modes: float) -> float:
    """Return the number of Krylov vectors for one port by a fitted law, right to a third (less so without damping)."""
    assert method.bandwidth is not None
    k = 2 * math.pi * method.bandwidth
    memory = min(duration, forgotten_after(structure.loss, method.bandwidth))
    modes = min(modes, method.bandwidth * memory)
    loss = structure.loss if structure.elastic is None else structure.elastic.loss_at(k)
    ratio = min(1.0, loss + 0.15 / (k * memory))
    return float(3.2 * (modes + 8) ** 0.4 * ratio**-0.286 * method.tolerance**TOLERANCE_POWER)


@lru_cache(maxsize=2)
def _sizes_of(mesh: SeatMesh) -> Sizes:
    surface = float(mesh.mesh.boundary_facets().size)
    return Sizes(mesh.quality.elements, mesh.quality.nodes, surface, counts_of(mesh))


def seat_seconds(model: SeatModel, *, static: bool = False) -> Mapping[str, float]:
    """Return the times of mesh, assembly and reduction [s]; ``static``: with one static solution as the reduction."""
    counts, sizes = model.sizes.counts, model.sizes
    weight = SECTION_ELEMENT if model.section else 1.0
    effort, solver = SECTION_FACTOR if model.section else 1.0, "double" if static else model.solver
    assembly = counts.nnz * rates.ENTRY * (SECTION_ENTRY if model.section else 1.0)
    n, vectors = counts.dof, 1.0 if static else model.vectors
    product, single = rates.PRODUCT * counts.nnz, solver != "double"
    factorized = n / COARSE_UNKNOWNS if solver == "two grids" else n
    factor = rates.FACTOR_START + effort * rates.FACTOR * factorized**1.47 * (SINGLE_FACTOR if single else 1.0)
    solve = effort * rates.SOLVE * n ** (4 / 3) * (SINGLE_SOLVE if single else 1.0)
    if solver == "two grids":
        factor, solve = factor + GRIDS_SETUP * product, GRIDS_SOLVE * product
    vector = solve + product + rates.CHECK + rates.INNER * n * vectors
    mesh = (rates.MESHING_START if model.drawn else 0.0) + sizes.elements * weight * rates.ELEMENT
    if model.runs == 1.0:
        return {"mesh": mesh, "assembly": assembly, "reduction": factor + vectors * vector}
    around = model.runs * (factor + vectors * vector + assembly) + STATIC_HARMONICS * (factor + assembly)
    return {"mesh": mesh, "reduction": around}


def count_elements(structure: Structure, method: Method, duration: float) -> tuple[SeatModel | None, SeatModel | None]:
    """Return the size of a run's finite-element model and of the coarser one for its mesh error; ``None`` for a closed
    form, for a size not known yet and, for the coarser, if gmsh makes no mesh."""
    if method.exact:
        return None, None
    coarser = None if structure.drawn is None else seat_model(structure, method, duration, COARSENING)
    return seat_model(structure, method, duration), coarser


def seat_memory(model: SeatModel) -> tuple[float, float]:
    """Return the peak memory of the reduction, and that of matrices, modes and mesh afterwards [bytes]."""
    counts = model.sizes.counts
    room = ROOM * 2 ** max(0, math.ceil(math.log2(max(model.vectors, 1.0) / ROOM)))
    peak = memory_need(counts, model.solver) + 8 * counts.dof * max(0.0, room - KRYLOV_VECTORS)
    return peak, MATRIX_ENTRY * (counts.nnz + counts.mass_nnz) + 8 * 60 * counts.dof
