"""Mesh of a seat from its geometry: tetrahedra by gmsh, or hexahedra swept from plane quadrilaterals."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import whole_file
from impact.notices import Progress, silent
from impact.quantities import brief
from seatfem.structures.mesh.checks import MeshQuality, check_mesh, measure
from seatfem.structures.mesh.gmsh_process import STAGE, Gmsh, run_gmsh
from seatfem.structures.mesh.io import MeshArrays, MeshError, SolidMesh, distinct, from_gmsh, groups, to_skfem
from seatfem.structures.mesh.spec import LEAST_LAYERS, MeshSpec, cut_lines, graded, rectangle_plan
from seatfem.structures.shapes import CadPart, Geometry, GeometryError, Profile, encode, fingerprint
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.shape import EVERYWHERE, Plan, check_sectors

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Plane = Mapping[str, NDArray[Any]]

# (level, node of the quadrilateral) for every node of gmsh's hexahedra; levels 0, 1, 2 are bottom, middle and top.
HEX27 = (
    *((0, 0), (0, 1), (0, 2), (0, 3), (2, 0), (2, 1), (2, 2), (2, 3)),
    *((0, 4), (0, 7), (1, 0), (0, 5), (1, 1), (0, 6), (1, 2), (1, 3), (2, 4), (2, 7), (2, 5), (2, 6)),
    *((0, 8), (1, 4), (1, 7), (1, 5), (1, 6), (2, 8), (1, 8)),
)
HEX8 = ((0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2), (1, 3))
ORDERS = {4: 1, 9: 2}  # order of elements by the number of nodes of a quadrilateral
REVERSED = {4: [0, 3, 2, 1], 9: [0, 3, 2, 1, 7, 6, 5, 4, 8]}


@dataclass(frozen=True, eq=False)
class _Levels:
    """Copies of the plane mesh, one per level: copy j of node i is point j n + i; if closed, the last is the first."""

    nodes: int
    layers: int
    order: int
    closed: bool

    @property
    def count(self) -> int:
        return self.order * self.layers + (0 if self.closed else 1)

    def nodes_at(self, layer: int, level: int, nodes: Integers) -> Integers:
        return ((self.order * layer + level) % self.count) * self.nodes + nodes

    def cells(self, quadrilaterals: Integers) -> Integers:
        """Return the hexahedra, layer by layer."""
        pattern = HEX8 if self.order == 1 else HEX27
        stacks = [
            np.column_stack([self.nodes_at(layer, level, quadrilaterals[:, column]) for level, column in pattern])
            for layer in range(self.layers)
        ]
        return np.concatenate(stacks)

    def walls(self, ends: Integers) -> Integers:
        """Return the faces swept by lines."""
        corners = ((0, 0), (0, 1), (self.order, 1), (self.order, 0))
        parts = [
            np.column_stack([self.nodes_at(layer, level, ends[:, end]) for level, end in corners])
            for layer in range(self.layers)
        ]
        return np.concatenate(parts)

    def floor(self, quadrilaterals: Integers) -> Integers:
        return self.nodes_at(0, 0, quadrilaterals[:, :4])

    def ceiling(self, quadrilaterals: Integers) -> Integers:
        return self.nodes_at(self.layers - 1, self.order, quadrilaterals[:, :4])


def revolve(section: Plane, layers: int, sectors: int, curved: bool, source: str) -> MeshArrays:
    """Return the hexahedra of the sector 0 <= theta <= 2 pi / ``sectors`` from the half section (r, z), in ``layers``.

    The section's lines become surfaces; a sector's cut faces are "symmetry_0" and "symmetry_1". ``curved`` = False
    puts the nodes between the layers on chords.
    """
    quadrilaterals = _turned(section, REVERSED, wanted=-1.0)
    levels = _Levels(len(section["points"]), layers, ORDERS[quadrilaterals.shape[1]], sectors == 1)
    angles = np.arange(levels.count) * (2 * np.pi / sectors / (levels.order * layers))
    r, z = section["points"].T
    x, y = np.outer(np.cos(angles), r), np.outer(np.sin(angles), r)
    points = np.stack([x, y, np.broadcast_to(z, x.shape)])
    if not curved and levels.order == 2:
        points[:, 1::2] = (points[:, ::2] + np.roll(points, -2, axis=1)[:, ::2])[:, : points[:, 1::2].shape[1]] / 2
    surfaces = {name: levels.walls(ends) for name, ends in groups(section, "line").items() if name != "axis"}
    if sectors > 1:
        surfaces |= {"symmetry_0": levels.floor(quadrilaterals), "symmetry_1": levels.ceiling(quadrilaterals)}
    return MeshArrays(points.reshape(3, -1).T.copy(), levels.cells(quadrilaterals), surfaces, {}, source)


def extrude(
    flat: Plane, plan: Plan, fractions: Floats, top: Callable[[Floats], Floats] | None, source: str
) -> MeshArrays:
    """Return hexahedra above a plan (x, y); ``fractions``: borders of the layers over the height, from 0 to 1.

    ``top``: height of the upper side at points (n, 2), that of the plan if None; nodes in between are shifted in
    proportion. Lines of the plan become surfaces; ``plan`` assigns its areas to surfaces at top and bottom.
    """
    quadrilaterals = _turned(flat, REVERSED, wanted=1.0)
    order = ORDERS[quadrilaterals.shape[1]]
    levels = _Levels(len(flat["points"]), len(fractions) - 1, order, closed=False)
    if order == 2:
        fractions = np.insert(fractions, range(1, len(fractions)), (fractions[1:] + fractions[:-1]) / 2)
    height = np.full(len(flat["points"]), plan.height) if top is None else top(flat["points"])
    x, y = (np.tile(column, len(fractions)) for column in flat["points"].T)
    points = np.column_stack([x, y, np.outer(fractions, height).ravel()])
    surfaces = {name: levels.walls(ends) for name, ends in groups(flat, "line").items()}
    for named, face in ((plan.top, levels.ceiling), (plan.bottom, levels.floor)):
        for name, areas in named.items():
            rows = _rows(flat, areas, len(quadrilaterals))
            if len(rows):
                surfaces[name] = face(quadrilaterals[rows])
    return MeshArrays(points, levels.cells(quadrilaterals), surfaces, {}, source)


def _rows(flat: Plane, areas: tuple[str, ...], cells: int) -> Integers:
    if EVERYWHERE in areas:
        return np.arange(cells)
    parts = [flat[f"area:{name}"] for name in areas if f"area:{name}" in flat]
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *parts]))


def _turned(flat: Plane, order: Mapping[int, list[int]], wanted: float) -> Integers:
    """Return the quadrilaterals, with the nodes reversed if their signed area has not the wanted sign."""
    cells = flat["cells"]
    a, b, c, d = np.moveaxis(flat["points"][cells[:, :4]], 1, 0)
    diagonals = (c - a)[:, 0] * (d - b)[:, 1] - (c - a)[:, 1] * (d - b)[:, 0]
    return np.where((wanted * diagonals < 0)[:, None], cells[:, order[cells.shape[1]]], cells)


Hexes = tuple[MeshArrays, str, float | None, Mapping[str, float]]
"""Arrays of a mesh of hexahedra, the version of gmsh, and the volume and areas of the part, which are exact."""


def make_hexes(
    geometry: Geometry, spec: MeshSpec, sectors: int, progress: Progress = silent, gmsh: Gmsh = run_gmsh
) -> Hexes:
    """Return the hexahedra of a solid of revolution or of an extruded one, or of one of its equal sectors.

    Raises `GeometryError` for a geometry that is neither.
    """
    if geometry.plan is not None:
        return _extruded(geometry, geometry.plan, spec, sectors, progress, gmsh)
    if geometry.profile is not None:
        return _revolved(geometry, geometry.profile, spec, sectors, progress, gmsh)
    what = "a CAD part is" if geometry.is_imported else "what is neither turned nor extruded is"
    raise GeometryError(f"{geometry.source}: {what} meshed by tetrahedra; set shape = 'tet'")


def _revolved(
    geometry: Geometry, profile: Profile, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh
) -> Hexes:
    job = {"task": "section", "geometry": encode(geometry), "spec": asdict(spec)}
    section = gmsh(job, progress)
    around = spec.layers or max(LEAST_LAYERS, math.ceil(2 * math.pi * profile.outer_radius / spec.size))
    layers = math.ceil(around / sectors)
    arrays = revolve(section, layers, sectors, spec.curved, type(geometry).__name__)
    areas = {name: profile.area(name) / sectors for name in profile.names}
    return arrays, str(section["gmsh_version"]), profile.volume / sectors, areas


def _extruded(geometry: Geometry, plan: Plan, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh) -> Hexes:
    plane, version, cad = _plane(geometry, spec, sectors, progress, gmsh)
    if sectors > 1:
        plane = cut_lines(plane, sectors)
    fractions = (
        np.linspace(0.0, 1.0, spec.layers + 1)
        if spec.layers
        else 1.0 - graded(plan.height, spec.patch_size, spec.size, spec.grading)[::-1] / plan.height
    )
    arrays = extrude(plane, plan, fractions, geometry.dome, type(geometry).__name__)
    areas = {
        name: sum(cad[area] for area in names if area in cad)
        for groups in (plan.top, plan.bottom)
        for name, names in groups.items()
        if any(area in cad for area in names)
    }
    if (profile := geometry.profile) is not None:
        volume = profile.volume / sectors
        areas = {name: profile.area(name) / sectors for name in areas}
    else:
        volume = cad[EVERYWHERE] * plan.height
    return arrays, version, volume, areas


def _plane(
    geometry: Geometry, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh
) -> tuple[dict[str, NDArray[Any]], str, dict[str, float]]:
    """Return plane arrays of the plan, the version of gmsh ("" where it was not needed), and exact areas by name."""
    if (rectangle := geometry.rectangle) is not None:
        cad = {EVERYWHERE: 4 * math.prod(rectangle.sides) / sectors}
        if rectangle.patch is not None:
            cad["patch"] = 4 * math.prod(rectangle.patch) / sectors
        return rectangle_plan(rectangle, spec, sectors), "", cad
    job = {"task": "plan", "geometry": encode(geometry), "spec": asdict(spec), "sectors": sectors}
    plane = gmsh(job, progress)
    cad = {name: float(value) for name, value in groups(plane, "cad").items()}
    return plane, str(plane["gmsh_version"]), cad


VOLUME_TOLERANCE = 0.02  # largest relative error of the volume; a circle of four curved elements has 0.013
PLURALS = MappingProxyType({"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"})


def content_hash(geometry: Geometry, spec: MeshSpec, sector: int = 1) -> str:
    """Return the SHA-256 of all data that determine the mesh; a CAD file counts by its content. Raises `OSError`."""
    data = {"geometry": fingerprint(geometry), "spec": asdict(spec), "sector": sector}
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class MeshProvenance:
    """The origin of a mesh.

    ``geometry`` and ``spec`` are plain data, empty for a mesh from a file; ``gmsh_version``: "" if gmsh was not used;
    ``notes``: repairs of the geometry or the mesh.
    """

    source: str
    content_hash: str
    gmsh_version: str
    geometry: Mapping[str, Any]
    spec: Mapping[str, Any]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class SeatMesh:
    """Mesh of a seat in metres, of tetrahedra or hexahedra.

    ``mesh``: scikit-fem's, with boundaries "contact" and "fixed" (and others) and the subdomain "seat" (and others):
    MeshTet or MeshHex for order 1, MeshTet2 or MeshHex2 (isoparametric) for order 2. ``shape``: shape of the
    elements, "tetrahedron" or "hexahedron".
    """

    mesh: SolidMesh
    order: int
    quality: MeshQuality
    provenance: MeshProvenance
    shape: str = "tetrahedron"

    __repr__ = brief

    def __str__(self) -> str:
        q = self.quality
        patches = ", ".join(f"{name} {1e6 * area:.5g} mm^2" for name, area in q.areas.items())
        return (
            f"{self.provenance.source}: {q.nodes} nodes ({3 * q.nodes} dof), {q.elements} {PLURALS[self.shape]} of "
            f"order {self.order}, volume {1e9 * q.volume:.6g} mm^3, {patches}, "
            f"smallest scaled Jacobian {q.min_scaled_jacobian:.2f}"
            + "".join(f"; {note}" for note in self.provenance.notes)
        )


def seat_mesh(
    arrays: MeshArrays,
    provenance: MeshProvenance,
    cad_volume: float | None = None,
    cad_areas: Mapping[str, float] = MappingProxyType({}),
    required: tuple[str, ...] = ("contact", "fixed"),
    parts: int = 1,
) -> SeatMesh:
    """Return the mesh checked, converted and measured. Raises `MeshError` like `check_mesh` and `to_skfem`."""
    checked = check_mesh(arrays, required, parts)
    notes = list(provenance.notes)
    if checked is not arrays:
        notes.append("all elements were in mirrored node order and are reordered")
    if loose := len(arrays.points) - len(distinct(arrays.cells)):
        notes.append(f"{loose} nodes of no element are dropped")
    mesh = to_skfem(checked)
    for name in required:
        facets = mesh.boundaries[name]
        if inside := int(np.sum(mesh.f2t[1, facets] >= 0)):
            raise MeshError(
                f"{arrays.source}: {inside} of {len(facets)} faces of {name!r} lie inside the mesh: must be outside"
            )
    quality = measure(mesh, checked, cad_volume, cad_areas)
    stated = dataclasses.replace(provenance, notes=tuple(notes))
    return SeatMesh(mesh, arrays.kind.order, quality, stated, arrays.kind.shape)


def make_mesh(
    geometry: Geometry,
    spec: MeshSpec,
    progress: Progress = silent,
    *,
    sector: int = 1,
    msh: Path | None = None,
    gmsh: Gmsh = run_gmsh,
) -> SeatMesh:
    """Mesh a geometry, or the first of its ``sector`` equal sectors.

    A sector begins at the half plane y = 0, x > 0; its cut faces are "symmetry_0" there and "symmetry_1" at the angle
    2 pi / ``sector``. ``msh``: also write gmsh's own file there, in metres, with the group names (tetrahedra only).
    ``gmsh``: function that carries out the job; a `GmshSession` makes several meshes of one geometry in one process.
    Raises `GeometryError` for a geometry that cannot be built or cut or whose faces are not found, `MeshingError` if
    gmsh fails, and `MeshError` for a mesh with inverted elements.
    """
    data = _encoded(geometry)
    check_sectors(geometry, sector)
    source = geometry.source
    if spec.shape == "hex":
        if msh is not None:
            raise GeometryError(f"{msh}: only tetrahedra are written as .msh; use shape='tet'")
        notes: tuple[str, ...] = ()
        arrays, version, cad_volume, areas = make_hexes(geometry, spec, sector, progress, gmsh)
        cad = dict(areas)
    else:
        job = {"task": "mesh", "geometry": data, "spec": asdict(spec), "sectors": sector}
        with nullcontext() if msh is None else whole_file(msh) as temporary:
            answer = gmsh(job | {"msh": temporary and str(temporary.resolve())}, progress)
        arrays, version = from_gmsh(answer, source), str(answer["gmsh_version"])
        cad = {name: float(value) for name, value in groups(answer, "cad").items()}
        cad_volume = cad.pop("volume")
        notes = tuple(str(note) for note in answer["notes"])
    provenance = MeshProvenance(
        source=source,
        content_hash=content_hash(geometry, spec, sector),
        gmsh_version=version,
        geometry=encode(geometry),
        spec=asdict(spec) | {"sector": sector},
        notes=notes,
    )
    required = tuple(name for name in ("contact", "fixed") if name in geometry.patches)
    seat = seat_mesh(arrays, provenance, cad_volume, cad, required)
    exact, volume = cad_volume, seat.quality.volume
    if exact and spec.order == 2 and spec.curved and abs(volume / exact - 1.0) > VOLUME_TOLERANCE:
        raise MeshError(
            f"{source}: the mesh has {1e9 * volume:.6g} mm^3, the CAD {1e9 * exact:.6g} mm^3; use smaller elements "
            "where faces curve (MeshSpec.curvature), or mend the CAD"
        )
    progress(STAGE, 1.0)
    return seat


def _encoded(geometry: Geometry) -> dict[str, Any]:
    data: dict[str, Any] = encode(geometry)
    if isinstance(geometry, CadPart):
        if not geometry.path.is_file():
            raise FileNotFoundError(f"{geometry.path}: no such CAD file; check the path")
        check_readable(geometry.path)
        data["path"] = str(geometry.path.resolve())
    return data
