"""Elements, nodes and unknowns of a seat's mesh, and the memory that it needs, predicted without a mesh.

The numbers of elements and of faces on the surface follow from integrals over the size field; all others from them by
Euler's formula. The factors were fitted to meshes of all families (benchmarks/predicted.py compares).

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
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, cast

from seatfem.machine.resources import available_memory
from seatfem.structures import reduction
from seatfem.structures.estimates.samples import Body, body_of, plan_of, section_of, solid_of
from seatfem.structures.kinds import drawn, structure
from seatfem.structures.mesh.spec import LEAST_LAYERS, MeshSpec, graded, half_axis
from seatfem.structures.method import AUTO, CHEAPEST_FIRST, AnyLevel, Level, Method
from seatfem.structures.shapes import Geometry, GeometryError
from seatfem.structures.shapes.profile import profile_of
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
    compactness = min(1.0, faces * (parts[3] / cells) ** (2 / 3) / surface)
    return nodes, Counts(3 * nodes, 9 * couples, 3 * (nodes if shape == "hexahedron" else couples), compactness)


def memory_need(counts: Counts, *, single: bool = False) -> MemoryNeed:
    """Return the peaks [bytes] of assembly and reduction; ``single``: by factors in single precision."""
    mass, vector = MATRIX_ENTRY * counts.mass_nnz, 8 * counts.dof
    fill = FILL * counts.compactness * counts.dof ** (4 / 3) * (0.5 if single else 1.0)
    assembly = ASSEMBLY_ENTRY * counts.nnz + mass
    factorized = FACTORIZED_ENTRY * counts.nnz + mass + FACTOR_ENTRY * fill + KRYLOV_VECTORS * vector
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


TETRAHEDRA: Final = (2.26, 4.77)  # elements over int dV/h^3 and over int dA/h^2
FACES: Final = 2.69  # on the surface, over int dA/h^2
VERTICES: Final = (0.145, 0.347)  # over elements and faces on the surface
TRIANGLES: Final = (2.23, 1.06)  # over int dA/h^2 and int ds/h
QUADRILATERALS: Final = (3.5, 3.23)  # the same, h being twice the size asked for
TRIANGLE_SIDES, QUADRILATERAL_SIDES = 1.2, 2.9  # on the outline, over int ds/h
HALVED: Final = 2.0  # gmsh meshes this many times coarser, then quarters
SECTION_ENTRIES: Final = {"tet": 11.5, "hex": 16.0}  # coupled nodes for each node of a section of order 2
MARGIN: Final = 2.0  # on predicted memory: a mesh that may fit after all is made, and counted exactly
FILE_MARGIN: Final = 4.0  # of a part from a file, whose small features may ask for more elements
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


def body_in_numbers(geometry: Geometry, sectors: int = 1) -> Body:
    """Return samples of the solid, or of one of its equal sectors."""
    return body_of(geometry) if geometry.is_imported else solid_of(geometry, sectors)


def predicted_sizes(geometry: Geometry, spec: MeshSpec, level: Level, sectors: int = 1) -> Sizes:
    """Return the mesh of a seat at a level ("axisymmetric", "harmonics", "sector" with so many sectors, or "3d")."""
    if geometry.is_imported:
        return _tetrahedra(body_of(geometry), spec)
    if level in ("axisymmetric", "harmonics"):
        return _section(geometry, spec, 3 if level == "harmonics" else 2)
    if spec.shape == "hex":
        return _hexahedra(geometry, spec, sectors)
    return _tetrahedra(solid_of(geometry, sectors), spec)


def _tetrahedra(body: Body, spec: MeshSpec) -> Sizes:
    volume, surface = body.inner.count(spec, 3), body.outer.count(spec, 2)
    elements, surface = TETRAHEDRA[0] * volume + TETRAHEDRA[1] * surface, FACES * surface
    vertices = VERTICES[0] * elements + VERTICES[1] * surface
    faces = 2 * elements + surface / 2
    edges = vertices + faces - elements
    nodes, counts = counts_from("tetrahedron", spec.order, (vertices, edges, faces, elements), surface)
    return Sizes(elements, nodes, surface, counts)


def _plane(body: Body, spec: MeshSpec) -> tuple[float, float, float]:
    """Return the elements, vertices and sides on the outline of a plane mesh."""
    inner, outer = body.inner.count(spec, 2), body.outer.count(spec, 1)
    if spec.shape == "hex":
        elements, sides = QUADRILATERALS[0] * inner + QUADRILATERALS[1] * outer, QUADRILATERAL_SIDES * outer
        return elements, elements + sides / 2 + 1, sides
    elements, sides = TRIANGLES[0] * inner + TRIANGLES[1] * outer, TRIANGLE_SIDES * outer
    return elements, elements / 2 + sides / 2 + 1, sides


def _as_meshed(spec: MeshSpec) -> MeshSpec:
    """Return the size that gmsh is given before it quarters."""
    if spec.shape == "tet":
        return spec
    return replace(spec, size=HALVED * spec.size, contact_size=HALVED * spec.patch_size)


def _section(geometry: Geometry, spec: MeshSpec, directions: int) -> Sizes:
    meshed = _as_meshed(spec)
    elements, vertices, sides = _plane(section_of(profile_of(geometry)), meshed)
    nodes = vertices
    if spec.order == 2:
        nodes += vertices + elements - 1 + (elements if spec.shape == "hex" else 0.0)
    entries = directions**2 * SECTION_ENTRIES[spec.shape] * nodes
    return Sizes(elements, nodes, sides, Counts(directions * nodes, entries, entries / directions, 0.0))


def _hexahedra(geometry: Geometry, spec: MeshSpec, sectors: int) -> Sizes:
    meshed, plan, profile = _as_meshed(spec), geometry.plan, geometry.profile
    if plan is not None:
        layers = spec.layers or len(graded(plan.height, spec.patch_size, spec.size, spec.grading)) - 1
        rectangle = geometry.rectangle
        plane = _plane(plan_of(geometry, sectors), meshed) if rectangle is None else _grid(rectangle, spec, sectors)
        return _swept(*plane, layers, spec, closed=False)
    if profile is None:
        raise GeometryError(f"{geometry.source} is neither a solid of revolution nor extruded; set shape = 'tet'")
    around = spec.layers or max(LEAST_LAYERS, math.ceil(2 * math.pi * profile.outer_radius / spec.size))
    plane = _plane(section_of(profile), meshed)
    return _swept(*plane, math.ceil(around / sectors), spec, closed=sectors == 1)


def _grid(rectangle: Rectangle, spec: MeshSpec, sectors: int) -> tuple[float, float, float]:
    """Return the elements, vertices and sides of the grid under a rectangular solid; exact."""
    sides, patch = rectangle.sides, rectangle.patch or rectangle.sides
    x, y = (len(half_axis(side, edge, spec)) - 1 for side, edge in zip(sides, patch, strict=True))
    x, y = x * (1 if sectors == 4 else 2), y * (1 if sectors > 1 else 2)
    return x * y, (x + 1) * (y + 1), 2 * (x + y)


def _swept(plane: float, vertices: float, sides: float, layers: int, spec: MeshSpec, *, closed: bool) -> Sizes:
    """Return the hexahedra above a plane mesh of ``plane`` quadrilaterals."""
    levels = layers if closed else layers + 1
    elements, points = plane * layers, vertices * levels
    edges = (vertices + plane - 1) * levels + vertices * layers
    faces = plane * levels + (vertices + plane - 1) * layers
    surface = sides * layers + (0.0 if closed else 2 * plane)
    nodes, counts = counts_from("hexahedron", spec.order, (points, edges, faces, elements), surface)
    return Sizes(elements, nodes, surface, counts)


def check_before_meshing(body: drawn.Drawn, spec: MeshSpec, level: Level, method: Method | None = None) -> None:
    """Raise `MemoryNeedError` where the mesh of a level would be far too large for this computer.

    ``method``: of the reduction; by default as the body's table states it.
    """
    how = body.stated() if method is None else method
    sizes = predicted_sizes(body.geometry(), spec, level, body.copies.get(level, 1))
    need = memory_need(sizes.counts)
    least = need.of_reduction(how.reduction, distributed=how.distributed)
    margin = FILE_MARGIN if body.files() else MARGIN
    available = available_memory()
    if least <= margin * available and sizes.elements <= margin * MOST_ELEMENTS:
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
