"""From a mesh file to the mesh of a seat."""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path

from impact.progress import Progress, silent
from seatfem.geometry import GeometryError
from seatfem.gmsh_process import STAGE, MeshingError, run_gmsh
from seatfem.mesh_io import MeshArrays, MeshError, from_gmsh
from seatfem.seat_mesh import MeshProvenance, SeatMesh, seat_mesh


def read_mesh(
    path: str | Path, *, contact: str = "contact", fixed: str = "fixed", unit: float = 1.0, progress: Progress = silent
) -> SeatMesh:
    """Read a gmsh mesh file (.msh, versions 2 and 4) of tetrahedra or hexahedra of order 1 or 2.

    ``contact``, ``fixed``: names of the file's surface groups, called "contact" and "fixed" from here on.
    ``unit``: metres per length unit of the file. Raises `FileNotFoundError`, and `MeshError` naming the file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such mesh file")
    if path.suffix.lower() != ".msh":
        raise MeshError(f"{path}: not a .msh file; a CAD file is meshed by make_mesh(CadPart(path), MeshSpec(...))")
    if not 0.0 < unit < float("inf"):
        raise MeshError(f"{path}: unit = {unit:g}: must be > 0 (metres per length unit of the file)")
    try:
        found = run_gmsh({"task": "read", "path": str(path.resolve()), "unit": unit}, progress)
    except (GeometryError, MeshingError) as error:
        raise MeshError(f"{path}: {error}") from error
    arrays = _renamed(from_gmsh(found, str(path)), {contact: "contact", fixed: "fixed"})
    provenance = MeshProvenance(
        source=str(path),
        content_hash=hashlib.sha256(path.read_bytes() + f"{contact} {fixed} {unit!r}".encode()).hexdigest(),
        gmsh_version=str(found["gmsh_version"]),
        geometry={},
        spec={},
    )
    seat = seat_mesh(arrays, provenance)
    progress(STAGE, 1.0)
    return seat


def _renamed(arrays: MeshArrays, names: dict[str, str]) -> MeshArrays:
    for name in names:
        if name not in arrays.surfaces:
            there = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
            raise MeshError(f"{arrays.source}: no surface group named {name!r}; the file has: {there}")
    surfaces = {names.get(name, name): faces for name, faces in arrays.surfaces.items()}
    return dataclasses.replace(arrays, surfaces=surfaces)
