"""Elements, nodes and unknowns of a seat's mesh, and its memory.

Before there is a mesh, its numbers of elements, surface faces and vertices are estimated roughly; all others follow by
Euler's formula.

Two nodes are coupled if an element contains both. Each couple belongs to exactly one vertex, edge, face or element,
the smallest that contains both, so couples are counted without a matrix: with V, E, F, T vertices, edges, faces and
elements, V + 2 E for tetrahedra and V + 2 E + 4 F + 8 T for hexahedra of order 1, V + 7 E + 12 F + 6 T and
V + 7 E + 49 F + 343 T for order 2. Nested dissection of n unknowns of a compact body fills a factor with c n^(4/3)
entries (A. George, SIAM J. Numer. Anal. 10 (1973) 345); the separators of slender and flat bodies are smaller, by about
the ratio of a cube's surface to theirs at the same number of elements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple, cast

import numpy as np

from impact.notices import SeatfemError
from seatfem.machine import libraries
from seatfem.machine.resources import available_memory
from seatfem.structures.mesh import meshing, plane_meshes
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import (
    AUTO,
    CHEAPEST_FIRST,
    AnyLevel,
    Level,
    Method,
    Solver,
    cheapest_solver,
    compactness,
)
from seatfem.structures.patch import Patch
from seatfem.structures.reduction import greens
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.structures.kinds import drawn, structure

GB: Final = 1e9
FILL: Final = 19.5  # entries of the factor over n^(4/3), for a cube; METIS orderings, order 2
FACTOR_ENTRY: Final = 8.7  # bytes of an entry of the factor, which shares its row numbers with others
MATRIX_ENTRY: Final = 12  # bytes of an entry of a sparse matrix
ASSEMBLY_ENTRY: Final = 21  # bytes of an entry of K while K is made
FACTORIZED_ENTRY: Final = 45  # bytes of an entry of K in its factorisation: K, K + s^2 M, triangle, PARDISO's copy
GRIDS_ENTRY: Final = 3.3  # memory of a reduction on two grids over that of K and M: single precision, coarse space
KRYLOV_VECTORS: Final = 150  # 100 vectors for one port, and the allocated room
_COUPLES: Final = {
    ("tetrahedron", 1): (1, 2, 0, 0),
    ("tetrahedron", 2): (1, 7, 12, 6),
    ("hexahedron", 1): (1, 2, 4, 8),
    ("hexahedron", 2): (1, 7, 49, 343),
}
_NODES: Final = {
    ("tetrahedron", 1): (1, 0, 0, 0),
    ("tetrahedron", 2): (1, 1, 0, 0),
    ("hexahedron", 1): (1, 0, 0, 0),
    ("hexahedron", 2): (1, 1, 1, 1),
}
_CUBE: Final = {"tetrahedron": (6, 12), "hexahedron": (1, 6)}  # elements, faces on the surface of one cell of a cube


class MemoryNeedError(SeatfemError, ValueError):
    """A computation that exceeds the memory; the message has predicted and available GB, the key and what fits."""


@dataclass(frozen=True)
class Counts:
    """Numbers on which memory depends.

    Attributes:
        dof: unknowns, those of fixed faces included.
        nnz: entries of K.
        mass_nnz: entries of M.
        compactness: compactness of the mesh, 1 for a cube, less for plates and bars.
    """

    dof: float
    nnz: float
    mass_nnz: float
    compactness: float = 1.0

    def scaled(self, factor: float) -> Counts:
        """Return the counts of a body of the same form with ``factor`` times as many unknowns."""
        return Counts(factor * self.dof, factor * self.nnz, factor * self.mass_nnz, self.compactness)


def counts_of(mesh: meshing.SeatMesh) -> Counts:
    """Return the counts of K and M on a mesh; hexahedra have a diagonal mass."""
    grid = mesh.mesh
    parts = (int(grid.nvertices), grid.edges.shape[1], grid.facets.shape[1], int(grid.nelements))
    return counts_from(mesh.shape, mesh.order, parts, grid.boundary_facets().size)


def counts_from(shape: str, order: int, parts: tuple[float, float, float, float], surface: float) -> Counts:
    """Return the counts of K and M from the numbers of vertices, edges, faces and elements (``parts``) and of faces on
    the ``surface``."""
    nodes, couples = (
        sum(a * b for a, b in zip(table[shape, order], parts, strict=True)) for table in (_NODES, _COUPLES)
    )
    cells, faces = _CUBE[shape]
    compact = compactness(parts[3], surface, cells=cells, faces=faces)
    return Counts(3 * nodes, 9 * couples, 3 * (nodes if shape == "hexahedron" else couples), compact)


def memory_need(counts: Counts, solver: Solver = "double") -> float:
    """Return the peak memory of assembly and reduction with a ``solver`` [bytes], without the program itself."""
    mass, vector = MATRIX_ENTRY * counts.mass_nnz, 8 * counts.dof
    fill = FILL * counts.compactness * counts.dof ** (4 / 3) * (1.0 if solver == "double" else 0.5)
    assembly = ASSEMBLY_ENTRY * counts.nnz + mass
    factorized = FACTORIZED_ENTRY * counts.nnz + mass + FACTOR_ENTRY * fill + KRYLOV_VECTORS * vector
    if solver == "two grids":
        factorized = GRIDS_ENTRY * (MATRIX_ENTRY * counts.nnz + mass) + KRYLOV_VECTORS * vector
    return float(max(assembly, factorized))


def solver_of(counts: Counts, method: Method, rings: float = 1, *, tetrahedra: bool = True) -> Solver:
    """Return the solver by which a reduction computes its vectors; ``tetrahedra``: whether these are the elements."""
    named = None if method.reduction == AUTO else greens.named(method.reduction)
    if not (named is None or named.bears_rounding):
        return "double"
    solver = cheapest_solver(counts.dof, rings, counts.compactness, method.tolerance)
    if solver == "two grids" and tetrahedra and method.order == 2:
        return solver
    return "single" if solver != "double" and libraries.has_pardiso() else "double"


def check_memory(
    counts: Counts,
    *,
    solver: Solver = "double",
    size: float = 0.0,
    levels: Sequence[AnyLevel] = (),
    available: float | None = None,
) -> float:
    """Return the predicted peak memory [bytes], if it is available.

    Args:
        counts: counts of the model.
        solver: what solves for its vectors.
        size: element size [m], for the advice; 0 where it is not known.
        levels: cheaper models that describe the seat, for the advice.
        available: available memory [bytes]; default: what the system reports, without limit if it reports nothing.

    Raises:
        MemoryNeedError: the peak is above the available memory.
    """
    need = memory_need(counts, solver)
    memory = available_memory() if available is None else available
    if need <= memory:
        return need
    fraction = _fitting_fraction(counts, solver, memory)
    coarser = (
        f'use seat.mesh.size = "{1e3 * size * fraction ** (-1 / 3):.2g} mm"'
        if size
        else f"make the mesh coarser, about {fraction * counts.dof:.2g} unknowns fit"
    )
    advice = ", or ".join([coarser, *(f'seat.model = "{level}"' for level in levels)])
    raise MemoryNeedError(
        f"seat.mesh.size: {counts.dof:.3g} unknowns need about {need / GB:.2g} GB of memory, {memory / GB:.2g} GB are "
        f"available; {advice}"
    )


def check_elastic(
    body: structure.Structure, mesh: meshing.SeatMesh | plane_meshes.MeridianMesh, level: Level, method: Method
) -> None:
    """Raise `MemoryNeedError` if a body on this mesh does not fit; half sections always do."""
    if level in ("axisymmetric", "harmonics"):
        return
    cheaper = CHEAPEST_FIRST[: CHEAPEST_FIRST.index(level)]
    levels = [option.level for option in body.levels() if option.applies and option.level in cheaper]
    counts, rings = counts_of(solid := cast("meshing.SeatMesh", mesh)), method.rings or 1
    solver = solver_of(counts, method, rings, tetrahedra=solid.shape == "tetrahedron")
    check_memory(counts, solver=solver, size=mesh.provenance.size, levels=levels)


def _fitting_fraction(counts: Counts, solver: Solver, available: float) -> float:
    """Return the fraction of the unknowns that fits into 90 % of the memory, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        fits = memory_need(counts.scaled(middle), solver) <= 0.9 * available
        low, high = (middle, high) if fits else (low, middle)
    return max(low, 1e-12)


SECTION_ENTRIES: Final = 11.5  # coupled nodes for each node of a section of order 2
ROUGHLY_INSIDE, ROUGHLY_IN_A_SECTION = 4.0, 2.3  # rough number of elements over int dV/h^d
IN_A_BAR: Final = 13.0  # elements in a length h of a bar that is thinner than h
STEPS: Final = 200  # steps of distance from the patch in that integral
MARGIN: Final = 4.0  # factor on rough numbers: a mesh that may fit after all is made, and counted exactly
MOST_ELEMENTS: Final = 2e7  # most elements: gmsh makes some 1e5 in a second, and needs 1 kB for each


class Rough(NamedTuple):
    """Number of elements of a mesh, and its unknowns and matrix entries, fixed faces included."""

    elements: float
    counts: Counts


def rough_counts(spec: MeshSpec, level: Level, patch: Patch, inside: float) -> Rough:
    """Return rough numbers of a mesh without making any: the integral of 1/h^d over distance from the patch, taken as a
    strip, up to the body's volume; for a slender body at least one element after the other over its depth.

    ``inside``: volume of the body [m^3], or area of its half section [m^2].
    """
    plane, fine = level in ("axisymmetric", "harmonics"), spec.patch_size
    distance = np.linspace(0.0, 1.0, STEPS) ** 2 * (fine + spec.transition)
    depth = math.pi * np.minimum(distance, patch.depth)
    front = patch.width + depth if plane else patch.area * (1 + depth / patch.width) + 2 * distance * depth
    pieces = (front[1:] + front[:-1]) / 2 * np.diff(distance)
    near = np.cumsum(pieces) < inside
    reach = [fine, max(fine + spec.transition, 1.001 * fine)]
    h = np.interp((distance[1:] + distance[:-1]) / 2, reach, [fine, spec.size])
    dimension, roughly = (2, ROUGHLY_IN_A_SECTION) if plane else (3, ROUGHLY_INSIDE)
    rest = inside - float(pieces[near].sum())
    elements = max(1.0, roughly * float(np.sum((pieces / h**dimension)[near]) + rest / spec.size**dimension))
    if plane:
        nodes, directions = elements if spec.order == 1 else 3 * elements - 1, 3 if level == "harmonics" else 2
        entries = directions**2 * SECTION_ENTRIES * nodes
        return Rough(elements, Counts(directions * nodes, entries, entries / directions, 0.0))
    elements = max(elements, IN_A_BAR * patch.depth / spec.size)
    outside, vertices = 4 * elements ** (2 / 3), 0.2 * elements + 4
    faces = 2 * elements + outside / 2
    parts = (vertices, vertices + faces - elements, faces, elements)
    return Rough(elements, counts_from("tetrahedron", spec.order, parts, outside))


def check_before_meshing(body: drawn.Drawn, spec: MeshSpec, level: Level, method: Method) -> None:
    """Raise `MemoryNeedError` if the mesh of a level, and its reduction, would be far too large for this computer."""
    sizes = body.rough_counts(spec, level)
    tetrahedra = level not in ("axisymmetric", "harmonics")
    need = memory_need(sizes.counts, solver_of(sizes.counts, method, method.rings or 1, tetrahedra=tetrahedra))
    available = available_memory()
    if need <= MARGIN * available and sizes.elements <= MARGIN * MOST_ELEMENTS:
        return
    chosen = (
        ""
        if body.mesh.size
        else f" (from seat.greens.bandwidth = {write_quantity(method.bandwidth or 0.0, 'frequency', 3)})"
    )
    raise MemoryNeedError(
        f"seat.mesh.size = {1e3 * spec.size:.3g} mm{chosen}, contact_size = {1e3 * spec.patch_size:.3g} mm: about "
        f"{sizes.elements:.2g} elements, which need about {need / GB:.2g} GB of memory, {available / GB:.2g} GB are "
        "available; take larger elements, a lower seat.greens.bandwidth or a cheaper seat.model"
    )
