"""The way from a mesh file to the mesh of a seat."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np

from impact.files.safe_files import MB, check_file
from impact.notices import Progress, silent
from seatfem.structures.formats import abaqus, meshio_files, nastran_mesh
from seatfem.structures.formats.file_mesh import FileMesh, merged, to_arrays
from seatfem.structures.mesh import checks, meshing
from seatfem.structures.mesh.gmsh_process import STAGE, MeshingError, run_gmsh
from seatfem.structures.mesh.io import MeshArrays, MeshError, distinct, groups
from seatfem.structures.shapes import GeometryError
from seatfem.structures.shapes.cad import LARGEST, SMALLEST

BY_GMSH = (".msh", ".med")
READERS: Mapping[str, Callable[[Path], FileMesh]] = MappingProxyType(
    {
        ".unv": nastran_mesh.read_unv,
        ".inp": abaqus.read_abaqus,
        ".bdf": nastran_mesh.read_nastran,
        ".nas": nastran_mesh.read_nastran,
        ".dat": nastran_mesh.read_nastran,
        ".fem": nastran_mesh.read_nastran,
    }
    | dict.fromkeys(meshio_files.FORMATS, meshio_files.read_by_meshio)
)
CAD = (".step", ".stp", ".brep", ".iges", ".igs")
LIMIT = 2048 * MB


def read_mesh(
    path: str | Path,
    *,
    contact: str | None = "contact",
    fixed: str | None = "fixed",
    unit: float = 1.0,
    merge: float | None = None,
    parts: int = 1,
    progress: Progress = silent,
) -> meshing.SeatMesh:
    """Read a mesh of tetrahedra or hexahedra of order 1 or 2, straight or curved.

    Files: gmsh .msh (2 and 4), .med; .unv (`read_unv`); Abaqus .inp (`read_abaqus`); Nastran .bdf, .nas, .dat, .fem
    (`read_nastran`); what meshio reads (`read_by_meshio`). Every named surface becomes a boundary, every named volume a
    subdomain; a node set is the surface of the free faces all of whose vertices it holds.

    ``contact``, ``fixed``: names of the file's groups, renamed "contact" and "fixed"; upper and lower case are ignored
    if exactly one group matches; ``fixed=None``: the seat is free; ``contact=None``: nothing is struck. ``unit``:
    metres per length unit of the file (files carry none). ``merge``: nodes nearer than this [m] become one; None:
    coincident nodes are an error; 0: they are kept. ``parts``: how many parts that share no node the mesh has. A
    mesh with every element mirrored is turned right side out, which the provenance notes.

    Raises `FileNotFoundError`, and `MeshError` naming the file: unreadable, elements of another or of several kinds, a
    size outside 0.1 mm to 10 m, a missing or empty group, and what `check_mesh` finds.
    """
    path = Path(path)
    _check_request(path, unit, merge)
    if contact is not None and contact == fixed:
        raise MeshError(f"{path}: contact and fixed are both {contact!r}: must be two groups")
    mesh, version = _read(path, progress)
    if merge:
        mesh = merged(mesh, merge / unit, str(path))
    arrays = to_arrays(mesh, unit, str(path))
    _check_size(arrays, unit)
    names = {name: role for name, role in ((contact, "contact"), (fixed, "fixed")) if name is not None}
    arrays = _renamed(arrays, names, mesh)
    if merge is None:
        checks.check_coincident(arrays)
    provenance = meshing.MeshProvenance(
        source=str(path), content_hash=_content_hash(arrays), gmsh_version=version, geometry={}, spec={}
    )
    seat = meshing.seat_mesh(arrays, provenance, required=tuple(names.values()), parts=parts)
    progress(STAGE, 1.0)
    return seat


def _content_hash(arrays: MeshArrays) -> str:
    """Return the SHA-256 of the mesh as it is used: two files of the same mesh share it."""
    digest = hashlib.sha256()
    named = {f"{kind}:{name}": rows for kind in ("surfaces", "volumes") for name, rows in getattr(arrays, kind).items()}
    for key, values in {"points": arrays.points, "cells": arrays.cells, **dict(sorted(named.items()))}.items():
        digest.update(f"{key} {values.shape} ".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _check_request(path: Path, unit: float, merge: float | None) -> None:
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such mesh file; check the path")
    check_file(path, LIMIT, MeshError)
    suffix = path.suffix.lower()
    if suffix in CAD:
        raise MeshError(f"{path}: not a mesh; a CAD file is meshed by make_mesh(CadPart(path), MeshSpec(...))")
    if suffix in meshio_files.SURFACES_ONLY:
        raise MeshError(f"{path}: {suffix} files hold surfaces only; fill them with volume elements first")
    if suffix not in BY_GMSH and suffix not in READERS:
        known = ", ".join((*BY_GMSH, *READERS))
        raise MeshError(f"{path}: {suffix or 'no suffix'}: mesh files must be one of {known}")
    if not 0.0 < unit < float("inf"):
        raise MeshError(f"{path}: unit = {unit:g}: must be > 0 (metres per length unit of the file)")
    if merge is not None and not 0.0 <= merge < float("inf"):
        raise MeshError(f"{path}: merge = {merge:g} m: must be >= 0 (distance within which nodes become one)")


def read_file(path: Path) -> FileMesh:
    """Return the content of a mesh file, in its unit and under its own names. Raises `MeshError`."""
    return _read(path, silent)[0]


def _read(path: Path, progress: Progress) -> tuple[FileMesh, str]:
    """Return the mesh in the file's unit, and the version of gmsh where that has read it."""
    reader = READERS.get(path.suffix.lower())
    if path.suffix.lower() == ".msh":  # Fluent's meshes are called so, too, and begin with a bracket
        with path.open("rb") as file:
            reader = partial(meshio_files.read_by_meshio, form="ansys") if file.read(1) == b"(" else None
    if reader is None:
        try:
            arrays = run_gmsh({"task": "read", "path": str(path.resolve()), "unit": 1.0}, progress)
        except (GeometryError, MeshingError) as error:
            message = str(error).removeprefix(f"{path.resolve()}: ")
            raise MeshError(f"{path}: {message}") from error
        surfaces, volumes, node_sets = (groups(arrays, kind) for kind in ("surface", "volume", "nodes"))
        return FileMesh(arrays["points"], arrays["cells"], surfaces, volumes, node_sets), str(arrays["gmsh_version"])
    progress(STAGE, 0.0)
    try:
        mesh = reader(path)
    except MeshError:
        raise
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # numbers too large, rows too short
        raise MeshError(f"{path}: not readable as a mesh ({type(error).__name__}: {error}); export it again") from error
    if len(mesh.cells) == 0 or mesh.points.ndim != 2 or mesh.points.shape[1] != 3:
        raise MeshError(f"{path}: {len(mesh.cells)} elements and points {mesh.points.shape}: must be a mesh in space")
    return mesh, ""


def _check_size(arrays: MeshArrays, unit: float) -> None:
    extent = np.ptp(arrays.points[distinct(arrays.vertices)], axis=0)
    if SMALLEST <= extent.max() <= LARGEST:
        return
    number = " x ".join(f"{length / unit:.4g}" for length in extent)
    raise MeshError(
        f"{arrays.source}: the mesh would be {' x '.join(f'{length:.4g}' for length in extent)} m large "
        f"(unit = {unit:g} m); give the unit. Its numbers span {number}: in millimetres that is unit = 0.001, "
        "in metres unit = 1",
        field="unit",
    )


def _renamed(arrays: MeshArrays, names: Mapping[str, str], mesh: FileMesh) -> MeshArrays:
    """Return surfaces under the program's names; another group called "contact" becomes "contact of the file"."""
    new: dict[str, str] = {}
    missing: list[tuple[str, str]] = []
    for name, role in names.items():
        try:
            new[_found(name, arrays, mesh)] = role
        except MeshError as error:
            missing.append((role, str(error)))
    if missing:
        raise MeshError("\n".join(message for _, message in missing), problems=tuple(missing))
    given_away = {name: f"{name} of the file" for name in new.values()}
    surfaces = {new.get(name, given_away.get(name, name)): faces for name, faces in arrays.surfaces.items()}
    return dataclasses.replace(arrays, surfaces=surfaces)


def _found(name: str, arrays: MeshArrays, mesh: FileMesh) -> str:
    """Return the name of a surface as the file spells it."""
    if name in arrays.surfaces:
        return name
    alike = [own for own in arrays.surfaces if own.casefold() == name.casefold()]
    if len(alike) == 1:
        return alike[0]
    listed = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
    points = ", ".join(map(repr, sorted(mesh.node_sets.keys() - arrays.surfaces.keys())))
    extra = f"; node sets that hold no whole face: {points}" if points else ""
    raise MeshError(f"{arrays.source}: no surface group named {name!r}; the file has: {listed}{extra}")
