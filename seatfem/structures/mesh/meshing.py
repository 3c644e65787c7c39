"""Mesh of a seat: of its geometry by gmsh, in tetrahedra, or from a file, in tetrahedra or hexahedra."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from impact.files.safe_files import MissingFileError
from impact.notices import Progress, silent
from impact.quantities import brief, brief_value
from seatfem.structures.errors import GeometryError, MeshError
from seatfem.structures.mesh.checks import MeshQuality, check_mesh, measure
from seatfem.structures.mesh.gmsh_process import STAGE, run_gmsh
from seatfem.structures.mesh.io import MeshArrays, SolidMesh, distinct, from_gmsh, groups, to_skfem
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, Geometry, encode, fingerprint
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.shape import Shape, check_sectors

VOLUME_TOLERANCE = 0.02  # largest relative error of the volume; a circle of four curved elements has 0.013
PLURALS = MappingProxyType({"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"})


def content_hash(geometry: Geometry, spec: MeshSpec, sector: int = 1) -> str:
    """Return the SHA-256 of all data that determine the mesh; a CAD file counts by its content. Raises `OSError`.

    ``sector``: number of equal sectors of which one is meshed; 0: a half section is meshed.
    """
    data = {"geometry": fingerprint(geometry), "spec": asdict(spec), "sector": sector}
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class MeshProvenance:
    """The origin of a mesh.

    ``content_hash``: hash of all that determines it; ``size``: element size that was asked for [m], 0 of a mesh from a
    file; ``notes``: repairs of the geometry or the mesh.
    """

    source: str
    content_hash: str
    size: float = 0.0
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
    cad_volume: float = math.nan,
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
) -> SeatMesh:
    """Mesh a geometry, or the first of its ``sector`` equal sectors.

    A sector begins at the half plane y = 0, x > 0; its cut faces are "symmetry_0" there and "symmetry_1" at the angle
    2 pi / ``sector``. Several meshes of one geometry are made by one process within a `gmsh_session`.
    Raises `GeometryError` for a geometry that cannot be built or cut or whose faces are not found, `MeshingError` if
    gmsh fails, and `MeshError` for a mesh with inverted elements.
    """
    data = _encoded(geometry)
    check_sectors(geometry, sector)
    source = geometry.source
    answer = run_gmsh({"task": "mesh", "geometry": data, "spec": asdict(spec), "sectors": sector}, progress)
    cad = {name: float(value) for name, value in groups(answer, "cad").items()}
    cad_volume = cad.pop("volume")
    notes = tuple(str(note) for note in answer["notes"])
    provenance = MeshProvenance(source, content_hash(geometry, spec, sector), spec.size, notes)
    required = tuple(name for name in ("contact", "fixed") if name in geometry.patches)
    seat = seat_mesh(from_gmsh(answer, source), provenance, cad_volume, cad, required)
    exact, volume = cad_volume, seat.quality.volume
    if exact and spec.order == 2 and spec.curved and abs(volume / exact - 1.0) > VOLUME_TOLERANCE:
        raise MeshError(
            f"{source}: the mesh has {1e9 * volume:.6g} mm^3, the CAD {1e9 * exact:.6g} mm^3; use smaller elements "
            "where faces curve, or mend the CAD"
        )
    progress(STAGE, 1.0)
    return seat


def _encoded(geometry: Geometry) -> dict[str, Any]:
    if not isinstance(geometry, Shape):
        raise GeometryError(f"{brief_value(geometry)} is no geometry; give a shape, or CadPart(path) of a CAD file")
    data: dict[str, Any] = encode(geometry)
    if isinstance(geometry, CadPart):
        if not geometry.path.is_file():
            raise MissingFileError(f"{geometry.path}: no such CAD file; check the path")
        check_readable(geometry.path)
        data["path"] = str(geometry.path.resolve())
    return data
