"""Elements, nodes and unknowns of a seat's mesh, and the memory that it needs, predicted from its coarsest mesh.

The numbers of elements, of faces on the surface and of vertices follow from that mesh; all others by Euler's formula.

Two nodes are coupled where some element holds both. Each couple belongs to exactly one vertex, edge, face or element,
the smallest that holds both, so the couples are counted without a matrix: with V, E, F, T vertices, edges, faces and
elements, V + 2 E for tetrahedra and V + 2 E + 4 F + 8 T for hexahedra of order 1, V + 7 E + 12 F + 6 T and
V + 7 E + 49 F + 343 T for order 2. Nested dissection of n unknowns of a compact body fills a factor with c n^(4/3)
entries (A. George, SIAM J. Numer. Anal. 10 (1973) 345); the separators of slender and flat bodies are smaller, by about
the ratio of a cube's surface to theirs at the same number of elements.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from seatfem.machine.resources import available_memory
from seatfem.structures import reduction
from seatfem.structures.estimates.coarse import Tally, count_elements, size_at
from seatfem.structures.estimates.surrogate import Patch
from seatfem.structures.kinds import drawn, structure
from seatfem.structures.mesh.spec import LEAST_LAYERS, MeshSpec, graded, half_axis
from seatfem.structures.method import AUTO, CHEAPEST_FIRST, AnyLevel, Level, Method, Solver, compactness
from seatfem.structures.shapes import Geometry, GeometryError
from seatfem.structures.shapes.shape import Rectangle
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.structures.mesh.meshing import SeatMesh
    from seatfem.structures.mesh.plane_meshes import MeridianMesh


GB: Final = 1e9
FILL: Final = 19.5  # entries of the factor over n^(4/3), of a cube; METIS orderings, order 2
FACTOR_ENTRY: Final = 8.7  # bytes of an entry of the factor, its row numbers being shared
MATRIX_ENTRY: Final = 12  # bytes of an entry of a sparse matrix
ASSEMBLY_ENTRY: Final = 21  # bytes of an entry of K while K is made
FACTORIZED_ENTRY: Final = 45  # the same while it is factorized: K, K + s^2 M, its upper triangle, PARDISO's own copy
GRIDS_ENTRY: Final = 3.3  # bytes of a reduction on two grids, over those of K and M: single copies, the coarse space
COARSE_UNKNOWNS: Final = 7.0  # unknowns of the fine grid over those of the coarse one
KRYLOV_VECTORS: Final = 150  # 100 for one port, and the room they grow into
LANCZOS_VECTORS: Final = 12
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


class MemoryNeedError(ValueError):
    """A computation that would not fit; the message gives predicted and available GB, the key and what would fit."""


@dataclass(frozen=True)
class Counts:
    """Counts that memory depends on.

    Attributes:
        dof: unknowns, those of fixed faces included.
        nnz: entries of K.
        mass_nnz: entries of M.
        compactness: of the body in elements, 1 for a cube, less for plates and bars.
    """

    dof: float
    nnz: float
    mass_nnz: float
    compactness: float = 1.0

    def scaled(self, factor: float) -> Counts:
        """Return the same body with ``factor`` times as many unknowns."""
        return Counts(factor * self.dof, factor * self.nnz, factor * self.mass_nnz, self.compactness)


@dataclass(frozen=True)
class MemoryNeed:
    """Predicted peaks [bytes], beyond what the program itself takes: of reductions that factorize, and of others."""

    factorized: float
    products: float

    def of_reduction(self, method: str, *, distributed: bool = False) -> float:
        """Return the need of a reduction by name, or of "auto"; of a distributed one without its factor."""
        return self.factorized if _factorizes(method) and not distributed else self.products


def counts_of(mesh: SeatMesh) -> Counts:
    """Return counts of K and M on a mesh; hexahedra have a diagonal mass."""
    of = mesh.mesh
    parts = (int(of.nvertices), of.edges.shape[1], of.facets.shape[1], int(of.nelements))
    return counts_from(mesh.shape, mesh.order, parts, of.boundary_facets().size)[1]


def counts_from(
    shape: str, order: int, parts: tuple[float, float, float, float], surface: float
) -> tuple[float, Counts]:
    """Return the nodes, and counts of K and M, by vertices, edges, faces, elements and faces outside."""
    nodes, couples = (
        sum(a * b for a, b in zip(table[shape, order], parts, strict=True)) for table in (_NODES, _COUPLES)
    )
    cells, faces = _CUBE[shape]
    compact = compactness(parts[3], surface, cells=cells, faces=faces)
    return nodes, Counts(3 * nodes, 9 * couples, 3 * (nodes if shape == "hexahedron" else couples), compact)


def memory_need(counts: Counts, solver: Solver = "double") -> MemoryNeed:
    """Return the peaks [bytes] of assembly and reduction, whose vectors a ``solver`` solves for."""
    mass, vector = MATRIX_ENTRY * counts.mass_nnz, 8 * counts.dof
    fill = FILL * counts.compactness * counts.dof ** (4 / 3) * (1.0 if solver == "double" else 0.5)
    assembly = ASSEMBLY_ENTRY * counts.nnz + mass
    factorized = FACTORIZED_ENTRY * counts.nnz + mass + FACTOR_ENTRY * fill + KRYLOV_VECTORS * vector
    if solver == "two grids":
        factorized = GRIDS_ENTRY * (MATRIX_ENTRY * counts.nnz + mass) + KRYLOV_VECTORS * vector
    return MemoryNeed(max(assembly, factorized), assembly + LANCZOS_VECTORS * vector)


def check_memory(
    counts: Counts,
    *,
    method: str = "auto",
    size: float | None = None,
    levels: Sequence[AnyLevel] = (),
    available: float | None = None,
    distributed: bool = False,
) -> MemoryNeed:
    """Return the need, where it fits.

    Args:
        counts: of the model.
        method: of the reduction.
        size: [m] of the elements, for the advice.
        levels: cheaper models that describe the seat, for the advice.
        available: [bytes]; default: what the system says. A system that says nothing is trusted.
        distributed: whether PETSc's ranks reduce it.

    Raises:
        MemoryNeedError: the need is above what is available.
    """
    need = memory_need(counts)
    least = need.of_reduction(method, distributed=distributed)
    memory = available_memory() if available is None else available
    if least <= memory:
        return need
    raise MemoryNeedError(
        f"seat.mesh.size: {counts.dof:.3g} unknowns need about {least / GB:.2g} GB of memory, {memory / GB:.2g} GB are "
        f"available; {', or '.join(_advice(counts, method, size, levels, memory))}"
    )


def check_elastic(
    body: structure.Structure, mesh: SeatMesh | MeridianMesh, level: Level, method: str, *, distributed: bool = False
) -> None:
    """Raise `MemoryNeedError` if a body on this mesh does not fit; half sections always do.

    ``method``: of the reduction, ``distributed`` over PETSc's ranks.
    """
    if level in ("axisymmetric", "harmonics"):
        return
    cheaper = CHEAPEST_FIRST[: CHEAPEST_FIRST.index(level)]
    levels = [option.level for option in body.levels() if option.applies and option.level in cheaper]
    size: Any = mesh.provenance.spec.get("size")
    check_memory(counts_of(cast("SeatMesh", mesh)), method=method, size=size, levels=levels, distributed=distributed)


def _advice(counts: Counts, method: str, size: float | None, levels: Sequence[AnyLevel], there: float) -> list[str]:
    share = _share(counts, method, there)
    coarser = (
        f"make the mesh coarser, about {share * counts.dof:.2g} unknowns fit"
        if size is None
        else f'use seat.mesh.size = "{1e3 * size * share ** (-1 / 3):.2g} mm"'
    )
    others = [f'seat.model = "{level}"' for level in levels]
    least, diagonal = memory_need(counts).products, counts.mass_nnz == counts.dof
    for name, each in reduction.greens.reducers().items() if _factorizes(method) else ():
        if not each.factorizes and (diagonal or not each.diagonal_mass) and least <= there:
            others.append(f'seat.greens.method = "{name}" ({least / GB:.2g} GB)')
        elif not each.factorizes and each.diagonal_mass and not diagonal:
            others.append(f'seat.mesh.shape = "hex" with seat.greens.method = "{name}", which factorizes nothing')
    return [coarser, *others]


def _factorizes(method: str) -> bool:
    if method == AUTO:
        return True
    return reduction.greens.named(method).factorizes


def _share(counts: Counts, method: str, there: float) -> float:
    """Return which part of the unknowns fits into 90 % of the memory, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        need = memory_need(counts.scaled(middle))
        fits = need.of_reduction(method) <= 0.9 * there
        low, high = (middle, high) if fits else (low, middle)
    return max(low, 1e-12)


SECTION_ENTRIES: Final = {"tet": 11.5, "hex": 16.0}  # coupled nodes for each node of a section of order 2
ROUGHLY: Final = {"tet": 4.0, "hex": 1.3, "section": 2.3}  # elements over int dV/h^d
IN_A_BAR: Final = {"tet": 13.0, "hex": 1.0}  # elements in a length h of a bar that is thinner than h
STEPS: Final = 200  # of distances from the patch
MARGIN: Final = 4.0  # on rough memory: a mesh that may fit after all is made, and counted exactly
MOST_ELEMENTS: Final = 2e7  # gmsh makes some 1e5 in a second, and needs 1 kB for each


@dataclass(frozen=True)
class Sizes:
    """A mesh in numbers.

    Attributes:
        elements, nodes: of the mesh.
        surface: faces on its surface (sides on the outline of a section).
        counts: unknowns and matrix entries, fixed faces included.
    """

    elements: float
    nodes: float
    surface: float
    counts: Counts


def predicted_sizes(geometry: Geometry, spec: MeshSpec, level: Level, sectors: int, coarse: MeshSpec) -> Sizes | None:
    """Return the mesh of a seat at a level ("axisymmetric", "harmonics", "sector" with so many sectors, or "3d"), by
    one of ``coarse`` sizes; ``None`` where that cannot be made."""
    if level in ("axisymmetric", "harmonics"):
        counted = count_elements(geometry, spec, coarse, "section")
        return None if counted is None else _section(counted, spec, 3 if level == "harmonics" else 2)
    if spec.shape == "hex":
        return _hexahedra(geometry, spec, sectors, coarse)
    counted = count_elements(geometry, spec, coarse, "solid", sectors)
    return None if counted is None else _tetrahedra(counted, spec)


def _tetrahedra(counted: Tally, spec: MeshSpec) -> Sizes:
    elements, surface, vertices = counted.elements, counted.facets, counted.vertices
    faces = 2 * elements + surface / 2
    nodes, counts = counts_from(
        "tetrahedron", spec.order, (vertices, vertices + faces - elements, faces, elements), surface
    )
    return Sizes(elements, nodes, surface, counts)


def _section(counted: Tally, spec: MeshSpec, directions: int) -> Sizes:
    elements, nodes = counted.elements, counted.vertices
    if spec.order == 2:
        nodes += nodes + elements - 1 + (elements if spec.shape == "hex" else 0.0)
    entries = directions**2 * SECTION_ENTRIES[spec.shape] * nodes
    return Sizes(elements, nodes, counted.facets, Counts(directions * nodes, entries, entries / directions, 0.0))


def _hexahedra(geometry: Geometry, spec: MeshSpec, sectors: int, coarse: MeshSpec) -> Sizes | None:
    plan, profile, rectangle = geometry.plan, geometry.profile, geometry.rectangle
    if plan is not None:
        layers = spec.layers or len(graded(plan.height, spec.patch_size, spec.size, spec.grading)) - 1
        plane = (
            count_elements(geometry, spec, coarse, "plan", sectors)
            if rectangle is None
            else _grid(rectangle, spec, sectors)
        )
        return None if plane is None else _swept(plane, layers, spec, closed=False)
    if profile is None:
        raise GeometryError(f"{geometry.source} is neither a solid of revolution nor extruded; set shape = 'tet'")
    around = spec.layers or max(LEAST_LAYERS, math.ceil(2 * math.pi * profile.outer_radius / spec.size))
    plane = count_elements(geometry, spec, coarse, "section")
    return None if plane is None else _swept(plane, math.ceil(around / sectors), spec, closed=sectors == 1)


def _grid(rectangle: Rectangle, spec: MeshSpec, sectors: int) -> Tally:
    """Return the grid under a rectangular solid; exact."""
    sides, patch = rectangle.sides, rectangle.patch or rectangle.sides
    x, y = (len(half_axis(side, edge, spec)) - 1 for side, edge in zip(sides, patch, strict=True))
    x, y = x * (1 if sectors == 4 else 2), y * (1 if sectors > 1 else 2)
    return Tally(x * y, 2 * (x + y), (x + 1) * (y + 1))


def _swept(plane: Tally, layers: int, spec: MeshSpec, *, closed: bool) -> Sizes:
    """Return the hexahedra above a plane mesh."""
    levels = layers if closed else layers + 1
    elements, points = plane.elements * layers, plane.vertices * levels
    edges = (plane.vertices + plane.elements - 1) * levels + plane.vertices * layers
    faces = plane.elements * levels + (plane.vertices + plane.elements - 1) * layers
    surface = plane.facets * layers + (0.0 if closed else 2 * plane.elements)
    nodes, counts = counts_from("hexahedron", spec.order, (points, edges, faces, elements), surface)
    return Sizes(elements, nodes, surface, counts)


def rough_sizes(spec: MeshSpec, level: Level, patch: Patch, inside: float) -> Sizes:
    """Return the order of magnitude of a mesh, before any is made: int dV/h^d over what lies at each distance from a
    patch whose outline is as long as that of a strip, as far as the body goes; of a slender body no less than one after
    the other over its depth.

    ``inside``: volume [m^3], or area of a half section [m^2].
    """
    plane = level in ("axisymmetric", "harmonics")
    away = np.linspace(0.0, 1.0, STEPS) ** 2 * (spec.patch_size + spec.transition)
    deep = math.pi * np.minimum(away, patch.depth)
    front = patch.width + deep if plane else patch.area * (1 + deep / patch.width) + 2 * away * deep
    step = np.diff(away)
    pieces = (front[1:] + front[:-1]) / 2 * step
    near = np.cumsum(pieces) < inside
    h = size_at((away[1:] + away[:-1]) / 2, spec)
    dimension, shape = 2 if plane else 3, "section" if plane else spec.shape
    rest = inside - float(pieces[near].sum())
    elements = max(1.0, ROUGHLY[shape] * float(np.sum((pieces / h**dimension)[near]) + rest / spec.size**dimension))
    elements = elements if plane else max(elements, IN_A_BAR[spec.shape] * patch.depth / spec.size)
    outside = 4 * elements ** (1 - 1 / dimension)
    if plane:
        return _section(Tally(elements, outside, elements), spec, 3 if level == "harmonics" else 2)
    if spec.shape == "tet":
        return _tetrahedra(Tally(elements, outside, 0.2 * elements + 4), spec)
    return _swept(Tally(elements, outside, elements), 1, spec, closed=False)


def check_before_meshing(body: drawn.Drawn, spec: MeshSpec, level: Level, method: Method | None = None) -> None:
    """Raise `MemoryNeedError` where the mesh of a level would be far too large for this computer.

    ``method``: of the reduction; by default as the body's table states it.
    """
    how = body.stated() if method is None else method
    sizes = body.rough_sizes(spec, level)
    need = memory_need(sizes.counts)
    least, available = need.of_reduction(how.reduction, distributed=how.distributed), available_memory()
    if least <= MARGIN * available and sizes.elements <= MARGIN * MOST_ELEMENTS:
        return
    chosen = (
        ""
        if body.mesh.size
        else f" (from seat.greens.bandwidth = {write_quantity(how.bandwidth or 0.0, 'frequency', 3)})"
    )
    raise MemoryNeedError(
        f"seat.mesh.size = {1e3 * spec.size:.3g} mm{chosen}, contact_size = {1e3 * spec.patch_size:.3g} mm: about "
        f"{sizes.elements:.2g} elements, which need about {least / GB:.2g} GB of memory, {available / GB:.2g} GB are "
        "available; take larger elements, a lower seat.greens.bandwidth or a cheaper seat.model"
    )
