"""Meshes in the formats that meshio knows, read in a process of its own and written."""

import json
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import MB, check_file, read_text
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import LineWorker
from seatfem.structures.formats import abaqus, file_mesh
from seatfem.structures.mesh.io import Integers, MeshError

LIMIT: Final = 1024 * MB
PATIENCE: Final = 3600.0  # seconds of the clock for a file, enough on a busy machine
FORMATS: Final[Mapping[str, str]] = MappingProxyType(
    {
        ".vtu": "vtu",
        ".vtk": "vtk",
        ".xdmf": "xdmf",
        ".xmf": "xdmf",
        ".cgns": "cgns",
        ".h5m": "h5m",
        ".avs": "avsucd",
        ".xml": "dolfin-xml",
        ".e": "exodus",
        ".exo": "exodus",
        ".ex2": "exodus",
        ".hmf": "hmf",
        ".mesh": "medit",
        ".meshb": "medit",
        ".vol": "netgen",
        ".post": "permas",
        ".dato": "permas",
        ".su2": "su2",
        ".tec": "tecplot",
        ".ele": "tetgen",
        ".node": "tetgen",
        ".ugrid": "ugrid",
        ".f3grid": "flac3d",
        ".mdpa": "mdpa",
    }
)
SURFACES_ONLY: Final = (".stl", ".ply", ".obj", ".off", ".svg", ".wkt", ".ply2")
SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27")
OTHER_SOLIDS = ("tetra", "hexa", "wedge", "pyramid", "poly", "voxel", "VTK_LAGRANGE_", "VTK_BEZIER_")
SKINS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
MOST_GROUPS = 256  # most values of an array that groups the cells; one with more numbers them
_BESIDE = re.compile(r">([^<>:]*):/")  # blanks are stripped after: two ways to match one of them take squares of time


def read_by_meshio(path: Path, form: str = "") -> file_mesh.FileMesh:
    """Return tetrahedra and hexahedra of a file in one of `FORMATS`, with whatever groups they have.

    Named cell sets: solids are a volume, triangles or quadrilaterals a surface; named point sets are node sets. Groups
    that travel as whole-number data: a cell array of 0 and 1 is a group of the array's name; one of up to 256 other
    values is a group "NAME VALUE" for each value but 0. A point array of 0 and 1 is a node set. Raises `MeshError`.
    """
    form = form or FORMATS[path.suffix.lower()]
    with private_folder("mesh") as folder:
        copy = _alone(path, form, folder)
        arrays, said = _read(copy, form, folder, path)
    blocks = [(kind, np.asarray(arrays[f"cells {k}"], dtype=np.int64)) for k, kind in enumerate(said["types"])]
    elements: dict[str, tuple[int, Integers | None]] = {}
    for kind, rows in blocks:
        if kind in SOLIDS or kind.startswith(OTHER_SOLIDS):
            elements[kind] = (elements.get(kind, (0, None))[0] + len(rows), rows if kind in SOLIDS else None)
    file_mesh.one_kind(elements, str(path))
    solid = [k for k, (kind, _) in enumerate(blocks) if kind in SOLIDS]
    points = arrays["points"]
    cells = file_mesh.to_gmsh(np.concatenate([blocks[k][1] for k in solid]), file_mesh.VTK)
    width = file_mesh.face_width(cells)
    skin = [k for k, (kind, _) in enumerate(blocks) if SKINS.get(kind) == width]
    faces = file_mesh.stacked([blocks[k][1][:, :width] for k in skin], width)
    used = np.concatenate([cells.ravel(), faces.ravel()])
    if outside := int(np.sum((used < 0) | (used >= len(points)))):
        raise MeshError(f"{path}: {outside} node numbers of its cells are outside 0 ... {len(points) - 1}")
    surfaces: dict[str, Integers] = {}
    volumes: dict[str, Integers] = {}
    for name, marks in _cell_groups(said, arrays, blocks).items():
        on_solid, on_skin = (np.flatnonzero(_joined(marks, part)) for part in (solid, skin))
        volumes |= {name: on_solid} if len(on_solid) else {}
        surfaces |= {name: faces[on_skin]} if len(on_skin) else {}
    node_sets = {name: _rows(arrays[f"point_sets {n}"], len(points)) for n, name in enumerate(said["point_sets"])}
    for n, name in enumerate(said["point_data"]):
        data = arrays[f"point_data {n}"]
        if _values(name, [data]) == [(name, 1)]:
            node_sets[name] = np.flatnonzero(data)
    return file_mesh.FileMesh(points, cells, surfaces, volumes, node_sets)


def _alone(path: Path, form: str, folder: Path) -> Path:
    """Return a copy under a plain name in a private folder, with the one file beside it that the format has."""
    check_file(path, LIMIT, MeshError)
    copy = folder / f"input{path.suffix.lower()}"
    shutil.copyfile(path, copy)
    if form == "tetgen":
        other = _other_half(path)
        check_file(other, LIMIT, MeshError)
        shutil.copyfile(other, copy.with_suffix(other.suffix))
    if form in ("xdmf", "vtu", "dolfin-xml"):
        text = read_text(copy, LIMIT, MeshError, "latin-1")
        if "\0" in text[:4] or re.search(r"<!\s*(DOCTYPE|ENTITY)|xi:include|XInclude", text, re.IGNORECASE):
            raise MeshError(f"{path}: defines or includes entities, which are not read; write plain XML")
        if form == "xdmf":
            _copy_beside(text, path, folder)
    return copy


def _other_half(path: Path) -> Path:
    """Return the other one of tetgen's two files of a mesh."""
    return path.with_suffix({".ele": ".node", ".node": ".ele"}[path.suffix.lower()])


def beside(path: Path) -> tuple[Path, ...]:
    """Return the other files of a mesh, whether they exist or not: tetgen's other half, the HDF5 of an .xdmf."""
    form = FORMATS.get(path.suffix.lower())
    if form == "tetgen":
        return (_other_half(path),)
    if form == "xdmf":
        names = {match.strip() for match in _BESIDE.findall(read_text(path, LIMIT, MeshError, "latin-1"))}
        return tuple(path.parent / name for name in sorted(names))
    return ()


def all_files(path: Path) -> tuple[Path, ...]:
    """Return ``path`` and every existing file that belongs to it: includes, and the files of `beside`."""
    included = abaqus.with_included(path)
    return (*included, *(other for other in beside(path) if other.is_file())) if included else ()


def _copy_beside(text: str, path: Path, folder: Path) -> None:
    """Copy the HDF5 files of an .xdmf, which must lie in its own folder."""
    if re.search(r"Format\s*=\s*[\"']Binary", text, re.IGNORECASE):
        raise MeshError(f"{path}: takes numbers from a file of raw bytes, which is not read; write them as XML or HDF")
    for name in sorted({match.strip() for match in _BESIDE.findall(text)}):
        if name != Path(name).name or name in ("", ".", "..") or (folder / name).exists():
            raise MeshError(f"{path}: takes numbers from {name!r}; put it into the same folder")
        check_file(path.parent / name, LIMIT, MeshError)
        shutil.copyfile(path.parent / name, folder / name)


def _read(copy: Path, form: str, folder: Path, path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    result, log = folder / "arrays.npz", folder / "log.txt"
    job = {"file": str(copy), "format": form, "arrays": str(result), "size": path.stat().st_size}
    try:
        with LineWorker("seatfem.structures.formats._meshio_worker", log=log) as worker:
            answer = worker.ask(json.dumps(job), PATIENCE)
    except TimeoutError as error:
        raise MeshError(
            f"{path}: not readable as a {path.suffix} file (its reader gave {error}); export it again"
        ) from error
    said = json.loads(answer) if answer else {"error": "its reader ended without a word, or took too long"}
    if "error" in said:
        reason = said["error"].replace(str(folder), str(path.parent))
        raise MeshError(f"{path}: not readable as a {path.suffix} file ({reason}); export it again")
    with np.load(result, allow_pickle=False) as arrays:
        return dict(arrays), said


def _cell_groups(
    said: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], blocks: list[tuple[str, Integers]]
) -> dict[str, list[NDArray[np.bool_]]]:
    """Return name -> which cells of each block."""
    groups: dict[str, list[NDArray[np.bool_]]] = {}
    for n, array in enumerate(said["cell_data"]):
        data = [arrays[f"cell_data {n} {k}"] for k in range(len(blocks))]
        groups |= {name: [part == value for part in data] for name, value in _values(array, data)}
    for n, name in enumerate(said["cell_sets"]):
        groups[name] = []
        for k, (_, rows) in enumerate(blocks):
            members = np.zeros(len(rows), dtype=bool)
            members[_rows(arrays[f"cell_sets {n} {k}"], len(rows))] = True
            groups[name].append(members)
    return groups


def _rows(members: NDArray[Any], count: int) -> Integers:
    rows = np.asarray(members, dtype=np.int64)
    return rows[(rows >= 0) & (rows < count)]


def _joined(marks: list[NDArray[np.bool_]], blocks: list[int]) -> NDArray[np.bool_]:
    return np.concatenate([np.empty(0, dtype=bool), *(marks[k] for k in blocks)])


def _values(name: str, data: list[NDArray[Any]]) -> list[tuple[str, int]]:
    """Return names and values of the groups in an array; none for reals, vectors and numberings."""
    joined = np.concatenate(data) if data else np.empty(0)
    if joined.dtype.kind not in "iub":
        return []
    values = [int(value) for value in np.unique(joined) if value != 0]
    if values == [1]:
        return [(name, 1)]
    return [(f"{name} {value}", value) for value in values] if len(values) <= MOST_GROUPS else []
