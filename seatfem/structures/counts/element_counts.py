"""Elements, nodes and unknowns of a seat's mesh, predicted without gmsh.

The numbers of elements and of faces on the surface follow from integrals over the size field; all others from them by
Euler's formula. The factors were fitted to meshes of all families (benchmarks/predicted.py compares).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from seatfem.machine.memory import available_memory
from seatfem.structures.counts.bodies import Body, body_of, plan_of, section_of, solid_of
from seatfem.structures.counts.memory_need import GB, Counts, MemoryNeedError, counts_from, memory_need
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.mesh.plan_grid import graded, half_axis
from seatfem.structures.mesh.spec import LEAST_LAYERS, MeshSpec
from seatfem.structures.method import Level, Method
from seatfem.structures.shapes import Geometry, GeometryError
from seatfem.structures.shapes.profile import profile_of
from seatfem.structures.shapes.shape import Rectangle
from seatfem.units import write_quantity

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


def check_before_meshing(body: Drawn, spec: MeshSpec, level: Level, method: Method | None = None) -> None:
    """Raise `MemoryNeedError` where the mesh of a level would be far too large for this computer.

    ``method``: of the reduction; by default as the body's table states it.
    """
    how = body.stated() if method is None else method
    sizes = predicted_sizes(body.geometry(), spec, level, body.copies.get(level, 1))
    need = memory_need(sizes.counts)
    least = need.of(how.reduction, distributed=how.distributed)
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
