"""The way from a geometry to the mesh of a seat."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from impact.files.atomic import whole_file
from impact.progress import Progress, silent
from seatfem.structures.mesh.gmsh_process import STAGE, Gmsh, run_gmsh
from seatfem.structures.mesh.hexes import make_hexes
from seatfem.structures.mesh.io import MeshError, from_gmsh, groups
from seatfem.structures.mesh.seat_mesh import MeshProvenance, SeatMesh, seat_mesh
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
        hexes = make_hexes(geometry, spec, sector, progress, gmsh)
        arrays, version = hexes.arrays, hexes.gmsh_version
        cad_volume, cad = hexes.cad_volume, dict(hexes.cad_areas)
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
    _check_volume(seat, spec)
    progress(STAGE, 1.0)
    return seat


def _check_volume(seat: SeatMesh, spec: MeshSpec) -> None:
    """Raise `MeshError` of a curved mesh of order 2 without the volume of its CAD."""
    exact, volume = seat.quality.cad_volume, seat.quality.volume
    if exact and spec.order == 2 and spec.curved and abs(volume / exact - 1.0) > VOLUME_TOLERANCE:
        raise MeshError(
            f"{seat.provenance.source}: the mesh has {1e9 * volume:.6g} mm^3, the CAD {1e9 * exact:.6g} mm^3; use "
            f"smaller elements where faces curve (MeshSpec.curvature), or mend the CAD"
        )


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
