"""Mesh files in all formats, read and checked as the mesh of a seat; those of meshio in a separate process."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import MB, MissingFileError, check_file, read_text
from impact.notices import Progress, silent
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import answer_of, end_worker, start_worker, tell_worker
from seatfem.structures.errors import MeshError
from seatfem.structures.formats import abaqus, decks, file_mesh, nastran_mesh, universal
from seatfem.structures.formats.file_mesh import FileMesh, merged, to_arrays
from seatfem.structures.mesh import checks, meshing
from seatfem.structures.mesh.gmsh_process import STAGE, MeshingError, run_gmsh
from seatfem.structures.mesh.io import Integers, MeshArrays, distinct, groups
from seatfem.structures.shapes import GeometryError
from seatfem.structures.shapes.cad import LARGEST, SMALLEST

MESHIO_LIMIT: Final = 1024 * MB
PATIENCE: Final = 3600.0  # longest wall time for a file, sufficient on a busy machine [s]
FORMATS: Final[Mapping[str, str]] = MappingProxyType(
    {f".{form}": form for form in ("vtu", "vtk", "xdmf", "cgns", "h5m", "hmf", "su2", "ugrid", "mdpa")}
    | {".xmf": "xdmf", ".avs": "avsucd", ".xml": "dolfin-xml", ".e": "exodus", ".exo": "exodus", ".ex2": "exodus"}
    | {".mesh": "medit", ".meshb": "medit", ".vol": "netgen", ".post": "permas", ".dato": "permas", ".tec": "tecplot"}
    | {".ele": "tetgen", ".node": "tetgen", ".f3grid": "flac3d"}
)
SURFACES_ONLY: Final = (".stl", ".ply", ".obj", ".off", ".svg", ".wkt", ".ply2")
SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27")
OTHER_SOLIDS = ("tetra", "hexa", "wedge", "pyramid", "poly", "voxel", "VTK_LAGRANGE_", "VTK_BEZIER_")
SKINS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
MOST_GROUPS = 256  # largest number of values in an array of cell groups; an array with more numbers the cells
_BESIDE = re.compile(r">([^<>:]*):/")  # blanks are stripped later: two ways to match them take quadratic time


def read_by_meshio(path: Path, form: str = "") -> file_mesh.FileMesh:
    """Return tetrahedra and hexahedra of a file in one of `FORMATS`, with all groups.

    In a named cell set, solids are a volume, triangles or quadrilaterals a surface; named point sets are node sets.
    Groups may also be whole-number data: a cell array of 0 and 1 is a group of the array's name; one of up to 256 other
    values is a group "NAME VALUE" for each value except 0. A point array of 0 and 1 is a node set. Raises `MeshError`.
    """
    form = form or FORMATS[path.suffix.lower()]
    with private_folder("mesh") as folder:
        copy = _alone(path, form, folder)
        arrays, names = _convert(copy, form, folder, path)
    blocks = [(kind, np.asarray(arrays[f"cells {k}"], dtype=np.int64)) for k, kind in enumerate(names["types"])]
    solids = [(kind, rows, kind in SOLIDS) for kind, rows in blocks if kind in SOLIDS or kind.startswith(OTHER_SOLIDS)]
    cells = file_mesh.to_gmsh(file_mesh.one_kind(solids, str(path)), file_mesh.VTK)
    points, width = arrays["points"], file_mesh.face_width(cells)
    faces = file_mesh.stacked([rows[:, :width] for kind, rows in blocks if SKINS.get(kind) == width], width)
    used = np.concatenate([cells.ravel(), faces.ravel()])
    if outside := int(np.sum((used < 0) | (used >= len(points)))):
        raise MeshError(f"{path}: {outside} node numbers of its cells are outside 0 ... {len(points) - 1}")
    sizes = [len(rows) for _, rows in blocks]
    is_solid = np.repeat([kind in SOLIDS for kind, _ in blocks], sizes)
    is_skin = np.repeat([SKINS.get(kind) == width for kind, _ in blocks], sizes)
    groups = _cell_groups(names, arrays, sizes)
    volumes = {name: np.flatnonzero(mask[is_solid]) for name, mask in groups.items() if np.any(mask[is_solid])}
    surfaces = {name: faces[mask[is_skin]] for name, mask in groups.items() if np.any(mask[is_skin])}
    node_sets: dict[str, Integers] = {}
    for n, name in enumerate(names["point_sets"]):
        node_sets[name] = np.flatnonzero(np.isin(np.arange(len(points)), arrays[f"point_sets {n}"]))
    for n, name in enumerate(names["point_data"]):
        data = arrays[f"point_data {n}"]
        if _values(name, data) == [(name, 1)]:
            node_sets[name] = np.flatnonzero(data)
    return file_mesh.FileMesh(points, cells, surfaces, volumes, node_sets)


def _alone(path: Path, form: str, folder: Path) -> Path:
    """Return a copy with a plain name in a private folder, beside copies of the other files that belong to it."""
    check_file(path, MESHIO_LIMIT, MeshError)
    copy = folder / f"input{path.suffix.lower()}"
    shutil.copyfile(path, copy)
    if form in ("xdmf", "vtu", "dolfin-xml"):
        text = read_text(copy, MESHIO_LIMIT, MeshError, "latin-1")
        if "\0" in text[:4] or re.search(r"<!\s*(DOCTYPE|ENTITY)|xi:include|XInclude", text, re.IGNORECASE):
            raise MeshError(f"{path}: defines or includes entities, which are not read; write plain XML")
        if form == "xdmf" and re.search(r"Format\s*=\s*[\"']Binary", text, re.IGNORECASE):
            raise MeshError(f"{path}: takes numbers from a file of raw bytes, not read; write them as XML or HDF")
    for other in beside(path):
        target = copy.with_suffix(other.suffix) if form == "tetgen" else folder / other.name
        if other != path.parent / other.name or target.exists():
            raise MeshError(f"{path}: takes numbers from {str(other)!r}; put it into the same folder")
        check_file(other, MESHIO_LIMIT, MeshError)
        shutil.copyfile(other, target)
    return copy


def beside(path: Path) -> tuple[Path, ...]:
    """Return the other files of a mesh, whether they exist or not: tetgen's second file, the HDF5 files of an .xdmf."""
    form = FORMATS.get(path.suffix.lower())
    if form == "tetgen":
        return (path.with_suffix({".ele": ".node", ".node": ".ele"}[path.suffix.lower()]),)
    names = _BESIDE.findall(read_text(path, MESHIO_LIMIT, MeshError, "latin-1")) if form == "xdmf" else []
    return tuple(path.parent / name for name in sorted({name.strip() for name in names}))


def all_files(path: Path) -> tuple[Path, ...]:
    """Return ``path`` and every existing file that belongs to it: included files, and the files of `beside`."""
    included = decks.with_included(path)
    return (*included, *(other for other in beside(path) if other.is_file())) if included else ()


def _convert(copy: Path, form: str, folder: Path, path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    result, log = folder / "arrays.npz", folder / "log.txt"
    job = {"file": str(copy), "format": form, "arrays": str(result), "size": path.stat().st_size}
    worker = start_worker("seatfem.structures.formats._meshio_worker", log=log)
    try:
        tell_worker(worker, json.dumps(job))
        answer = answer_of(worker, PATIENCE)
        names = json.loads(answer) if answer else {"error": "its reader ended without a word, or took too long"}
    except TimeoutError as error:
        names = {"error": f"its reader gave {error}"}
    finally:
        end_worker(worker)
    if "error" in names:
        reason = names["error"].replace(str(folder), str(path.parent))
        raise MeshError(f"{path}: not readable as a {path.suffix} file ({reason}); export it again")
    with np.load(result, allow_pickle=False) as arrays:
        return dict(arrays), names


def _cell_groups(names: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], sizes: list[int]) -> dict[str, Any]:
    """Return group name -> mask (n,) of the cells of all blocks, which are of these ``sizes``."""
    groups: dict[str, NDArray[np.bool_]] = {}
    for n, array in enumerate(names["cell_data"]):
        data = np.concatenate([arrays[f"cell_data {n} {k}"] for k in range(len(sizes))])
        groups |= {name: data == value for name, value in _values(array, data)}
    for n, name in enumerate(names["cell_sets"]):
        members = [np.isin(np.arange(size), arrays[f"cell_sets {n} {k}"]) for k, size in enumerate(sizes)]
        groups[name] = np.concatenate(members)
    return groups


def _values(name: str, data: NDArray[Any]) -> list[tuple[str, int]]:
    """Return names and values of the groups in an array; none for real numbers, vectors and numberings."""
    values = [int(value) for value in np.unique(data) if value != 0] if data.dtype.kind in "iub" else []
    if values == [1]:
        return [(name, 1)]
    return [(f"{name} {value}", value) for value in values] if len(values) <= MOST_GROUPS else []


BY_GMSH = (".msh", ".med")
READERS: Mapping[str, Callable[[Path], FileMesh]] = MappingProxyType(
    {".unv": universal.read_unv, ".inp": abaqus.read_abaqus}
    | dict.fromkeys((".bdf", ".nas", ".dat", ".fem"), nastran_mesh.read_nastran)
    | dict.fromkeys(FORMATS, read_by_meshio)
)
CAD = (".step", ".stp", ".brep", ".iges", ".igs")
LIMIT = 2048 * MB
LARGEST_ASSUMED = 1.0  # largest size of a mesh whose unit nobody states [m]


def read_mesh(
    path: str | Path,
    *,
    contact: str | None = "contact",
    fixed: str | None = "fixed",
    unit: float | None = None,
    merge: float | None = None,
    parts: int = 1,
    progress: Progress = silent,
) -> meshing.SeatMesh:
    """Read a mesh of tetrahedra or hexahedra of order 1 or 2, straight or curved.

    Files: gmsh .msh (2 and 4), .med; .unv (`read_unv`); Abaqus .inp (`read_abaqus`); Nastran .bdf, .nas, .dat, .fem
    (`read_nastran`); formats of meshio (`read_by_meshio`). Every named surface becomes a boundary, every named volume a
    subdomain; a node set becomes the surface of the free faces of which it holds all vertices.

    ``contact``, ``fixed``: names of the file's groups, renamed "contact" and "fixed"; case is ignored if exactly one
    group matches; ``fixed=None``: the seat is free; ``contact=None``: nothing is struck. ``unit``: metres per length
    unit; ``None``: as the file states, otherwise 1. ``merge``: distance [m] within which nodes are merged; ``None``:
    coincident nodes are an error; 0: they are kept. ``parts``: number of parts of the mesh that share no node. A mesh
    with every element mirrored is reflected back, which the provenance notes.

    Raises `FileNotFoundError`, and `MeshError` naming the file: unreadable, other or several kinds of elements, a size
    outside 0.1 mm to 10 m (1 m if nobody states the unit), a missing or empty group, and the errors of `check_mesh`.
    """
    path = Path(path)
    _check_request(path, unit, merge)
    if contact is not None and contact == fixed:
        raise MeshError(f"{path}: contact and fixed are both {contact!r}: must be two groups")
    mesh = read_file(path, progress)
    is_known = unit is not None or bool(mesh.unit)
    unit, notes = _unit_of(mesh, unit)
    if merge:
        mesh = merged(mesh, merge / unit, str(path))
    arrays = to_arrays(mesh, unit, str(path))
    _check_size(arrays, unit, LARGEST if is_known else LARGEST_ASSUMED)
    names = {name: role for name, role in ((contact, "contact"), (fixed, "fixed")) if name is not None}
    arrays = _renamed(arrays, names, mesh)
    if merge is None:
        checks.check_coincident(arrays)
    provenance = meshing.MeshProvenance(str(path), _content_hash(arrays), notes=(*mesh.notes, *notes))
    seat = meshing.seat_mesh(arrays, provenance, required=tuple(names.values()), parts=parts)
    progress(STAGE, 1.0)
    return seat


def _unit_of(mesh: FileMesh, unit: float | None) -> tuple[float, tuple[str, ...]]:
    """Return metres per length unit, and a note on it unless only the caller states it; the caller's counts."""
    stated = mesh.unit
    if not stated:
        return (unit, ()) if unit else (1.0, ("states no unit of length, m is assumed; unit says otherwise",))
    if unit is None:
        return stated, (f"states its unit of length, {stated:.6g} m",)
    other = abs(stated / unit - 1) > 1e-6
    return unit, (f"states a unit of length of {stated:.6g} m; the stated one, {unit:.6g} m, counts",) * other


def _content_hash(arrays: MeshArrays) -> str:
    """Return the SHA-256 of the mesh's arrays, which is the same for two files of one mesh."""
    digest = hashlib.sha256()
    named = {f"{kind}:{name}": rows for kind in ("surfaces", "volumes") for name, rows in getattr(arrays, kind).items()}
    for key, values in {"points": arrays.points, "cells": arrays.cells, **dict(sorted(named.items()))}.items():
        digest.update(f"{key} {values.shape} ".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _check_request(path: Path, unit: float | None, merge: float | None) -> None:
    if not path.exists():
        raise MissingFileError(f"{path}: no such mesh file; check the path")
    check_file(path, LIMIT, MeshError)
    suffix = path.suffix.lower()
    if suffix in CAD:
        raise MeshError(f"{path}: not a mesh; a CAD file is meshed by make_mesh(CadPart(path), MeshSpec(...))")
    if suffix in SURFACES_ONLY:
        raise MeshError(f"{path}: {suffix} files hold surfaces only; fill them with volume elements first")
    if suffix not in BY_GMSH and suffix not in READERS:
        raise MeshError(f"{path}: mesh files must be one of {', '.join((*BY_GMSH, *READERS))}")
    if unit is not None and not 0.0 < unit < float("inf"):
        raise MeshError(f"{path}: unit = {unit:g}: must be > 0 (metres per length unit of the file)")
    if merge is not None and not 0.0 <= merge < float("inf"):
        raise MeshError(f"{path}: merge = {merge:g} m: must be >= 0 (distance within which nodes become one)")


def read_file(path: Path, progress: Progress = silent) -> FileMesh:
    """Return the content of a mesh file, in its unit and with its own names. Raises `MeshError`."""
    reader = READERS.get(path.suffix.lower())
    if path.suffix.lower() == ".msh":  # also the suffix of Fluent's meshes, which begin with a bracket
        with path.open("rb") as file:
            reader = partial(read_by_meshio, form="ansys") if file.read(1) == b"(" else None
    if reader is None:
        try:
            arrays = run_gmsh({"task": "read", "path": str(path.resolve()), "unit": 1.0}, progress)
        except (GeometryError, MeshingError) as error:
            raise MeshError(f"{path}: {str(error).removeprefix(f'{path.resolve()}: ')}") from error
        surfaces, volumes, node_sets = (groups(arrays, kind) for kind in ("surface", "volume", "nodes"))
        return FileMesh(arrays["points"], arrays["cells"], surfaces, volumes, node_sets)
    progress(STAGE, 0.0)
    try:
        mesh = reader(path)
    except MeshError:
        raise
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # numbers too large, rows too short
        raise MeshError(f"{path}: not readable as a mesh ({type(error).__name__}: {error}); export it again") from error
    if len(mesh.cells) == 0 or mesh.points.ndim != 2 or mesh.points.shape[1] != 3:
        raise MeshError(f"{path}: {len(mesh.cells)} elements and points {mesh.points.shape}: must be a mesh in space")
    return mesh


def _check_size(arrays: MeshArrays, unit: float, largest: float) -> None:
    extent = np.ptp(arrays.points[distinct(arrays.vertices)], axis=0)
    size, numbers = (" x ".join(f"{length:.4g}" for length in lengths) for lengths in (extent, extent / unit))
    if not SMALLEST <= extent.max() <= largest:
        why = f"the mesh would be {size} m large (unit = {unit:g} m); give the unit in which its numbers span {numbers}"
        raise MeshError(f"{arrays.source}: {why}", field="unit")


def _renamed(arrays: MeshArrays, names: Mapping[str, str], mesh: FileMesh) -> MeshArrays:
    """Return surfaces with the program's names; another group called "contact" becomes "contact of the file"."""
    new: dict[str, str] = {}
    missing: list[tuple[str, str]] = []
    listed = ", ".join(map(repr, sorted(arrays.surfaces))) or "none"
    if points := ", ".join(map(repr, sorted(mesh.node_sets.keys() - arrays.surfaces.keys()))):
        listed += f"; node sets that hold no whole face: {points}"
    for name, role in names.items():
        alike = [spelled for spelled in arrays.surfaces if spelled.casefold() == name.casefold()]
        if name in alike or len(alike) == 1:
            new[name if name in alike else alike[0]] = role
        else:
            missing.append((role, f"{arrays.source}: no surface group named {name!r}; the file has: {listed}"))
    if missing:
        raise MeshError("\n".join(message for _, message in missing), problems=tuple(missing))
    given_away = {name: f"{name} of the file" for name in new.values()}
    surfaces = {new.get(name, given_away.get(name, name)): faces for name, faces in arrays.surfaces.items()}
    return dataclasses.replace(arrays, surfaces=surfaces)
