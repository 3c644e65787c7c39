"""From a geometry, or a mesh file, to the mesh of a seat."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from skfem import MeshTet, MeshTet2

from impact.progress import Progress, silent
from seatfem.geometry import CONTACT_COLOUR, FIXED_COLOUR, CadPart, Geometry, GeometryError, encode, fingerprint
from seatfem.gmsh_process import STAGE, Arrays, MeshingError, run_gmsh
from seatfem.mesh_io import MeshArrays, MeshError, MeshQuality, measure, to_skfem
from seatfem.mesh_spec import MeshSpec

__all__ = [
    "MeshError",
    "MeshProvenance",
    "MeshSpec",
    "MeshingError",
    "SeatMesh",
    "content_hash",
    "make_mesh",
    "read_mesh",
    "write_step",
]


@dataclass(frozen=True)
class MeshProvenance:
    """Where a mesh came from. ``geometry`` and ``spec`` are plain data, empty where it was read from a file."""

    source: str
    content_hash: str
    gmsh_version: str
    geometry: Mapping[str, Any]
    spec: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SeatMesh:
    """Tetrahedral mesh of a seat in metres.

    ``mesh``: scikit-fem's, with boundaries "contact" and "fixed" (and others) and the subdomain "seat"; of type
    MeshTet for order 1, MeshTet2 (isoparametric) for order 2.
    """

    mesh: MeshTet | MeshTet2
    order: int
    quality: MeshQuality
    provenance: MeshProvenance

    def __str__(self) -> str:
        q = self.quality
        patches = ", ".join(f"{name} {1e6 * area:.5g} mm^2" for name, area in q.areas.items())
        return (
            f"{self.provenance.source}: {q.nodes} nodes ({3 * q.nodes} dof), {q.elements} tetrahedra of order "
            f"{self.order}, volume {1e9 * q.volume:.6g} mm^3, {patches}, "
            f"smallest scaled Jacobian {q.min_scaled_jacobian:.2f}"
        )


def content_hash(geometry: Geometry, spec: MeshSpec) -> str:
    """SHA-256 of everything that decides the mesh; a CAD file counts by its content. Raises `OSError`."""
    text = json.dumps({"geometry": fingerprint(geometry), "spec": asdict(spec)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def make_mesh(geometry: Geometry, spec: MeshSpec, progress: Progress = silent, *, msh: Path | None = None) -> SeatMesh:
    """Mesh a geometry with gmsh; ``msh``: also write gmsh's own file there, in metres, with the group names.

    Raises `GeometryError` for a geometry that cannot be built or whose faces cannot be told, `MeshingError` where
    gmsh fails, and `MeshError` for a mesh with inverted elements.
    """
    job = {"task": "mesh", "geometry": _encoded(geometry), "spec": asdict(spec)}
    with _replacing(msh) as temporary:
        found = run_gmsh(job | {"msh": temporary}, progress)
    source = str(geometry.path) if isinstance(geometry, CadPart) else type(geometry).__name__
    cad = {name: float(value) for name, value in _group(found, "cad").items()}
    cad_volume = cad.pop("volume")
    provenance = MeshProvenance(
        source=source,
        content_hash=content_hash(geometry, spec),
        gmsh_version=str(found["gmsh_version"]),
        geometry=encode(geometry),
        spec=asdict(spec),
    )
    return _seat_mesh(_mesh_arrays(found, source), provenance, progress, cad_volume, cad)


def read_mesh(
    path: str | Path, *, contact: str = "contact", fixed: str = "fixed", unit: float = 1.0, progress: Progress = silent
) -> SeatMesh:
    """Read a gmsh mesh file (.msh, versions 2 and 4) of tetrahedra of order 1 or 2.

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
    arrays = _renamed(_mesh_arrays(found, str(path)), {contact: "contact", fixed: "fixed"})
    provenance = MeshProvenance(
        source=str(path),
        content_hash=hashlib.sha256(path.read_bytes() + f"{contact} {fixed} {unit!r}".encode()).hexdigest(),
        gmsh_version=str(found["gmsh_version"]),
        geometry={},
        spec={},
    )
    return _seat_mesh(arrays, provenance, progress, None, {})


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
            raise FileNotFoundError(f"{geometry.path}: no such CAD file")
        data["path"] = str(geometry.path.resolve())
    return data


@contextmanager
def _replacing(path: Path | None) -> Iterator[str | None]:
    """A temporary name beside ``path``, moved there when the block succeeds and removed when it does not."""
    if path is None:
        yield None
        return
    temporary = path.with_name(f".{os.getpid()}-{path.name}").resolve()
    try:
        yield str(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _group(found: Arrays, kind: str) -> Arrays:
    prefix = f"{kind}:"
    return {name.removeprefix(prefix): array for name, array in found.items() if name.startswith(prefix)}


def _mesh_arrays(found: Arrays, source: str) -> MeshArrays:
    return MeshArrays(found["points"], found["tets"], _group(found, "surface"), _group(found, "volume"), source)


def _renamed(arrays: MeshArrays, names: Mapping[str, str]) -> MeshArrays:
    for name in names:
        if name not in arrays.surfaces:
            there = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
            raise MeshError(f"{arrays.source}: no surface group named {name!r}; the file has: {there}")
    surfaces = {names.get(name, name): triangles for name, triangles in arrays.surfaces.items()}
    return MeshArrays(arrays.points, arrays.tets, surfaces, arrays.volumes, arrays.source)


def _seat_mesh(
    arrays: MeshArrays,
    provenance: MeshProvenance,
    progress: Progress,
    cad_volume: float | None,
    cad_areas: Mapping[str, float],
) -> SeatMesh:
    mesh = to_skfem(arrays)
    quality = measure(mesh, arrays, cad_volume, cad_areas)
    progress(STAGE, 1.0)
    return SeatMesh(mesh, arrays.order, quality, provenance)
