"""The memory that a three-dimensional seat needs, known before it is taken.

Two nodes are coupled where some element holds both. Each couple belongs to exactly one vertex, edge, face or element,
the smallest that holds both, so the couples are counted without a matrix: with V, E, F, T vertices, edges, faces and
elements, V + 2 E for tetrahedra and V + 2 E + 4 F + 8 T for hexahedra of order 1, V + 7 E + 12 F + 6 T and
V + 7 E + 49 F + 343 T for order 2. Nested dissection of n unknowns of a compact body fills a factor with c n^(4/3)
entries (A. George, SIAM J. Numer. Anal. 10 (1973) 345); the separators of slender and flat bodies are smaller, by about
the ratio of a cube's surface to theirs at the same number of elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

from seatfem.machine.memory import available_memory
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.method import AUTO, CHEAPEST_FIRST, AnyLevel, Level

if TYPE_CHECKING:
    from seatfem.structures.mesh.meridian import MeridianMesh
    from seatfem.structures.mesh.meshing import SeatMesh

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

    def of(self, method: str, *, distributed: bool = False) -> float:
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


def memory_need(counts: Counts) -> MemoryNeed:
    """Return the peaks [bytes] of assembly and reduction."""
    mass, vector = MATRIX_ENTRY * counts.mass_nnz, 8 * counts.dof
    fill = FILL * counts.compactness * counts.dof ** (4 / 3)
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
    least = need.of(method, distributed=distributed)
    memory = available_memory() if available is None else available
    if least <= memory:
        return need
    raise MemoryNeedError(
        f"seat.mesh.size: {counts.dof:.3g} unknowns need about {least / GB:.2g} GB of memory, {memory / GB:.2g} GB are "
        f"available; {', or '.join(_advice(counts, method, size, levels, memory))}"
    )


def check_elastic(
    body: Structure, mesh: SeatMesh | MeridianMesh, level: Level, method: str, *, distributed: bool = False
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
    from seatfem.structures.reduction.greens import reducers  # for load time, as below

    for name, each in reducers().items() if _factorizes(method) else ():
        if not each.factorizes and (diagonal or not each.diagonal_mass) and least <= there:
            others.append(f'seat.greens.method = "{name}" ({least / GB:.2g} GB)')
        elif not each.factorizes and each.diagonal_mass and not diagonal:
            others.append(f'seat.mesh.shape = "hex" with seat.greens.method = "{name}", which factorizes nothing')
    return [coarser, *others]


def _factorizes(method: str) -> bool:
    if method == AUTO:
        return True
    from seatfem.structures.reduction.greens import named  # for load time: most scenes name none

    return named(method).factorizes


def _share(counts: Counts, method: str, there: float) -> float:
    """Return which part of the unknowns fits into 90 % of the memory, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        need = memory_need(counts.scaled(middle))
        fits = need.of(method) <= 0.9 * there
        low, high = (middle, high) if fits else (low, middle)
    return max(low, 1e-12)
