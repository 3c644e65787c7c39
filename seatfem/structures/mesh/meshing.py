"""The mesh of a seat: what every way to it ends with, and the way from a geometry."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from impact.brief import brief
from impact.files.atomic import whole_file
from impact.progress import Progress, silent
from seatfem.structures.mesh.checks import MeshQuality, check_mesh, measure
from seatfem.structures.mesh.gmsh_process import STAGE, Gmsh, run_gmsh
from seatfem.structures.mesh.hexes import make_hexes
from seatfem.structures.mesh.io import MeshArrays, MeshError, SolidMesh, distinct, from_gmsh, groups, to_skfem
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import (
    CONTACT_COLOUR,
    FIXED_COLOUR,
    CadPart,
    Geometry,
    GeometryError,
    encode,
    fingerprint,
)
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.shape import check_sectors

VOLUME_TOLERANCE = 0.02  # relative; a circle of four curved elements is 1.3 % off
PLURALS = MappingProxyType({"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"})


@dataclass(frozen=True)
class MeshProvenance:
    """The origin of a mesh.

    ``geometry`` and ``spec`` are plain data, empty where it was read from a file; ``gmsh_version``: "" where gmsh had
    no part in it; ``notes``: what was mended on the way.
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
    MeshTet or MeshHex for order 1, MeshTet2 or MeshHex2 (isoparametric) for order 2. ``shape``: of its elements,
    "tetrahedron" or "hexahedron".
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
    return SeatMesh(mesh, arrays.order, quality, dataclasses.replace(provenance, notes=tuple(notes)), arrays.shape)


def content_hash(geometry: Geometry, spec: MeshSpec, sector: int = 1) -> str:
    """Return the SHA-256 of everything that decides the mesh; a CAD file counts by its content. Raises `OSError`."""
    data = {"geometry": fingerprint(geometry), "spec": asdict(spec), "sector": sector}
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


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
    ``gmsh``: what carries out the job; a `GmshSession` makes several meshes of one geometry in one process.
    Raises `GeometryError` for a geometry that cannot be built or cut or whose faces cannot be found, `MeshingError`
    where gmsh fails, and `MeshError` for a mesh with inverted elements.
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
        with _replacing(msh) as temporary:
            answer = gmsh(job | {"msh": temporary}, progress)
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


def write_step(geometry: Geometry, path: str | Path, progress: Progress = silent) -> None:
    """Write a geometry as STEP in millimetres, "contact" painted red and "fixed" blue: `CadPart`'s default colours.

    Raises `GeometryError` and `MeshingError` like `make_mesh`.
    """
    colours = {"contact": CONTACT_COLOUR, "fixed": FIXED_COLOUR}
    job = {"task": "step", "geometry": _encoded(geometry), "colours": colours}
    with _replacing(Path(path)) as temporary:
        run_gmsh(job | {"step": temporary}, progress)


def _encoded(geometry: Geometry) -> dict[str, Any]:
    data: dict[str, Any] = encode(geometry)
    if isinstance(geometry, CadPart):
        if not geometry.path.is_file():
            raise FileNotFoundError(f"{geometry.path}: no such CAD file; check the path")
        check_readable(geometry.path)
        data["path"] = str(geometry.path.resolve())
    return data


@contextmanager
def _replacing(path: Path | None) -> Iterator[str | None]:
    """Yield a temporary name beside ``path``, moved there when the block succeeds and removed when it does not."""
    if path is None:
        yield None
        return
    with whole_file(path) as temporary:
        yield str(temporary.resolve())
