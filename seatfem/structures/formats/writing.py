"""Files for other programs: a seat's mesh, written by meshio, and reduced models with their state space."""

from __future__ import annotations

import math
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from scipy import io, sparse
from skfem.assembly import Dofs

from impact.files.safe_files import whole_file, write_whole
from impact.greens import base, poles
from seatfem.structures.errors import MeshError
from seatfem.structures.formats import file_mesh, mesh_files
from seatfem.structures.mesh.io import CELL_KINDS, Floats, Integers
from seatfem.structures.mesh.meshing import SeatMesh

READ_ONLY: Final = (".node", ".su2", ".hmf", ".ugrid", ".f3grid")
"""Suffixes that are read but not written: .node goes with .ele; meshio 5.3 cannot write, or not reread, the others."""
WRITTEN: Final[Mapping[str, str]] = MappingProxyType(
    {".msh": "gmsh22", ".inp": "abaqus", ".med": "med"}
    | dict.fromkeys((".bdf", ".nas", ".dat", ".fem"), "nastran")
    | {suffix: form for suffix, form in mesh_files.FORMATS.items() if suffix not in READ_ONLY}
)
NUMBERED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "gmsh22": "gmsh:physical",
        "med": "cell_tags",
        "avsucd": "avsucd:material",
        "medit": "medit:ref",
        "netgen": "netgen:index",
        "nastran": "nastran:ref",
    }
)
"""Formats with numbered groups: the key of their array. The first two name the numbers; Nastran's are PIDs."""
MARKED: Final = ("vtk", "vtu", "xdmf")
"""Formats in which a group is a named array of 0 and 1."""
POINTS: Final = ("abaqus", "exodus")
"""Formats with named node sets; the first has element sets, too."""
OPTIONS: Final[Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {"xdmf": {"data_format": "XML"}, "gmsh22": {"binary": False}}
)
_SOLIDS = {4: "tetra", 10: "tetra10", 8: "hexahedron", 27: "hexahedron27"}
_SKINS = {3: "triangle", 4: "quad"}


def write_mesh(seat: SeatMesh, path: str | Path, *, unit: float = 1.0) -> tuple[str, ...]:
    """Write a seat's mesh in the format of the file's suffix, one of `WRITTEN`; the files are complete or absent.

    ``unit``: length unit of the file [m]. Solids come first, then the faces of every boundary, by name. Groups keep
    their names if the format has names; otherwise they are numbered from 1 in the order that is returned: boundaries,
    then subdomains.

    Returns:
        Names of the groups.

    Raises:
        MeshError: a suffix that is not known, a unit that is not positive, elements that the format does not support.
    """
    import meshio  # imported here, because it loads readers of all formats

    path = Path(path)
    form = WRITTEN.get(path.suffix.lower())
    if form is None:
        raise MeshError(f"{path}: {path.suffix or 'no suffix'}: choose one of {', '.join(WRITTEN)}")
    if not 0.0 < unit < float("inf"):
        raise MeshError(f"{path}: unit = {unit:g}: must be > 0 (metres per length unit of the file)")
    points, cells = _nodes(seat)
    if form == "tetgen" and cells.shape[1] != 4:  # meshio omits them, and hangs when it reads the file
        raise MeshError(f"{path}: the format does not hold {_SOLIDS[cells.shape[1]]} elements; write .msh")
    points = points / unit
    if form == "nastran":  # its fields have 16 characters, and meshio fails for longer numbers
        points = np.round(points, 10 - math.ceil(math.log10(np.ptp(points, axis=0).max())))
    names, mesh = _mesh(meshio, form, points, cells, seat)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=path.parent) as folder:
        try:
            meshio.write(Path(folder) / path.name, mesh, file_format=form, **OPTIONS.get(form, {}))
        except (Exception, SystemExit) as error:
            content = f"{len(cells)} {_SOLIDS[cells.shape[1]]}"
            raise MeshError(
                f"{path}: cannot be written as {form} ({content}: {type(error).__name__}: {error}); try .msh"
            ) from error
        if form == "nastran":
            # meshio names its elements CTETRA_ and CHEXA_, which no other program knows
            written = (Path(folder) / path.name).read_text(encoding="utf-8")
            text = re.sub(r"^(CTETRA|CHEXA)_", r"\1 ", written, flags=re.MULTILINE)
            comments = "".join(f"$ PID {number}: {name}\n" for number, name in enumerate(names, start=1))
            write_whole(Path(folder) / path.name, (comments + text).encode("utf-8"))
        _check(Path(folder) / path.name, path, cells)
        for file in sorted(Path(folder).iterdir()):
            os.replace(file, path.parent / file.name)
    return names


def _check(written: Path, path: Path, cells: Integers) -> None:
    """Raise `MeshError` if elements are not read back: some writers omit those that their format does not support."""
    try:
        back = mesh_files.read_file(written).cells
    except MeshError as error:
        raise MeshError(f"{path}: the format does not hold {_SOLIDS[cells.shape[1]]} elements; write .msh") from error
    if back.shape != cells.shape:
        raise MeshError(
            f"{path}: {len(cells)} elements of {cells.shape[1]} nodes come back as {len(back)} of {back.shape[1]}: the "
            "format does not hold them; write .msh"
        )


def _nodes(seat: SeatMesh) -> tuple[Floats, Integers]:
    """Return positions (n, 3), and cells (m, k) in VTK's order, which is meshio's."""
    mesh = seat.mesh
    kind = next(kind for kind in CELL_KINDS.values() if kind.shape == seat.shape and kind.order == seat.order)
    if kind.order == 1:
        points, rows = mesh.p.T, mesh.t
    else:
        points, rows = mesh.doflocs.T, Dofs(mesh, kind.element).element_dofs
    return np.asarray(points, dtype=float), file_mesh.to_vtk(rows, kind)


def _mesh(meshio: Any, form: str, points: Floats, cells: Integers, seat: SeatMesh) -> tuple[tuple[str, ...], Any]:
    """Return the names of the groups, and a mesh of two blocks: solids, and the faces of all boundaries in sequence."""
    mesh = seat.mesh
    surfaces = {name: mesh.facets[:, facets].T for name, facets in mesh.boundaries.items()}
    volumes = {name: rows for name, rows in mesh.subdomains.items() if name != "seat" or len(mesh.subdomains) == 1}
    names = (*surfaces, *volumes)
    ends = np.cumsum([0, *(len(faces) for faces in surfaces.values())])
    faces = np.concatenate([np.empty((0, mesh.facets.shape[0]), dtype=np.int64), *surfaces.values()])
    blocks = [(_SOLIDS[cells.shape[1]], cells), (_SKINS[faces.shape[1]], faces)]
    none = np.arange(0)
    members = {name: [none, np.arange(*ends[k : k + 2])] for k, name in enumerate(surfaces)}
    members |= {name: [np.asarray(rows), none] for name, rows in volumes.items()}
    numbers = [np.zeros(len(rows), dtype=np.int32) for _, rows in blocks]
    for number, parts in enumerate(members.values(), start=1):
        for array, rows in zip(numbers, parts, strict=True):
            array[rows] = -number if form == "med" else number
    if form == "nastran":  # every element needs a property
        numbers = [np.where(array == 0, 1 + len(members), array) for array in numbers]
    data: dict[str, list[Any]] = {}
    if form in MARKED:
        data = {
            name: [_mark(rows, len(block)) for rows, (_, block) in zip(parts, blocks, strict=True)]
            for name, parts in members.items()
        }
    elif key := NUMBERED.get(form):
        data = {key: numbers} | ({"gmsh:geometrical": numbers} if form == "gmsh22" else {})
    meshio_mesh = meshio.Mesh(
        points,
        blocks,
        cell_data=data,
        cell_sets=members if form == "abaqus" else {},
        point_sets={name: np.unique(faces) for name, faces in surfaces.items()} if form in POINTS else {},
        field_data={name: np.array([k, 2 if name in surfaces else 3]) for k, name in enumerate(names, start=1)}
        if form == "gmsh22"
        else {},
    )
    if form == "med":
        meshio_mesh.cell_tags = {-number: [name] for number, name in enumerate(names, start=1)}
    return names, meshio_mesh


def _mark(rows: Integers, count: int) -> Integers:
    mark = np.zeros(count, dtype=np.int32)
    mark[rows] = 1
    return np.asarray(mark)


README: Final = """\
A reduced model of the seat, written by seatfem export --to reduced. SI units throughout; {count} port(s): {ports}.
F [N] and u [m] of a port are the force on its patch and its mean displacement, positive along the outward normal.

reduced.npz, reduced.mat hold the same arrays.

State space, exact:      x' = A x + B F,  u = C x + D F;  g(t) = C exp(A t) B + D delta(t)  [m/(N s)]
    A ({s}, {s}), B ({s}, {p}), C ({p}, {s}), D ({p}, {p}) [m/N]; states, in order:
{states}
{second}
error_reduction, error_mesh: relative errors of g after a Hann pulse of the band, as estimated; NaN: not known.
valid_for: until when g is known [s].
"""
SECOND: Final = """\
Second order:            M q'' + Cq q' + K q = phi' F,  u = phi q + what is left over, below
    M, Cq, K ({m}, {m}), phi ({p}, {m}) [1/sqrt(kg)]: mass-normalised modal coordinates q [m sqrt(kg)].
    Left over: sum_r a_r a_r' exp(-rate_r t) + c delta(t), with residual_shapes a ({r}, {p}) [sqrt(m/(N s))],
    residual_rates ({r},) [1/s] and residual_compliance c ({p}, {p}) [m/N], which is D.
    mass.mtx, damping.mtx, stiffness.mtx, {files}: the same for kind = "matrices" of a scene, with
    first_dof = 1 and greens.bandwidth above all modes.
"""


def write_reduced(greens: base.GreensFunction, folder: Path) -> Iterator[Path]:
    """Write reduced.npz, reduced.mat and README.txt; for modal functions also matrices for ``kind = "matrices"``.

    Raises:
        GreensFunctionError: a function that is no finite sum of poles.
        OutputError: ``folder`` cannot be written to.
    """
    space, modal = poles.state_space(greens), greens.modal
    arrays: dict[str, Any] = {name: getattr(space, name) for name in "ABCD"}
    estimate = greens.error_estimate
    arrays |= {f"error_{n}": np.nan if (e := getattr(estimate, n)) is None else e for n in ("reduction", "mesh")}
    arrays |= {"valid_for": greens.valid_for, "ports": np.array(space.ports), "states": np.array(space.states)}
    second: dict[str, Any] = {}
    if modal is not None:
        w, residual = modal.omega, modal.residual
        second = {"M": np.eye(len(w)), "Cq": np.diag(2 * modal.zeta * w), "K": np.diag(w**2), "phi": modal.shapes.T}
        arrays |= second | {f"residual_{name}": getattr(residual, name) for name in ("shapes", "rates", "compliance")}
    named = {name: np.asarray(value) for name, value in arrays.items()}
    plain = {name: value.astype(object) if value.dtype.kind == "U" else value for name, value in named.items()}
    saves = {
        "reduced.npz": partial(np.savez, **arrays),
        "reduced.mat": partial(io.savemat, mdict=plain, oned_as="column"),
    }
    for name, save in saves.items():
        with whole_file(folder / name) as temporary, temporary.open("wb") as file:
            save(file)
        yield folder / name
    files = [f"{port}.csv" for port in _file_names(space.ports)]
    if second:
        for name, key in (("mass", "M"), ("damping", "Cq"), ("stiffness", "K")):
            with whole_file(folder / f"{name}.mtx") as temporary, temporary.open("wb") as out:
                io.mmwrite(out, sparse.coo_array(second[key]), symmetry="symmetric", precision=17)
            yield folder / f"{name}.mtx"
        for name, weights in zip(files, second["phi"], strict=True):
            rows = "".join(f"{k},{weight!r}\n" for k, weight in enumerate(weights.tolist(), start=1))
            write_whole(folder / name, f"dof,weight\n{rows}".encode())
            yield folder / name
    write_whole(folder / "README.txt", _readme(space.states, space.ports, second, arrays, files).encode())
    yield folder / "README.txt"


def _file_names(ports: tuple[str, ...]) -> Iterator[str]:
    """Return file names for ports, whose names may contain characters that paths must not."""
    plain = ["".join(c if c.isalnum() or c in "-_" else "_" for c in port) for port in ports]
    return (name if plain.count(name) == 1 else f"{name}_{k}" for k, name in enumerate(plain, start=1))


def _readme(
    states: tuple[str, ...], ports: tuple[str, ...], second: Any, arrays: Mapping[str, Any], files: list[str]
) -> str:
    s, p = len(states), len(ports)
    words = "\n".join(f"    {k:5d}  {state}" for k, state in enumerate(states, start=1))
    listed = ", ".join(files[:4]) + (", ..." if p > 4 else "")
    r = len(arrays["residual_rates"]) if second else 0
    second_order = SECOND.format(m=len(second["M"]), p=p, r=r, files=listed) if second else ""
    return README.format(count=p, ports=", ".join(ports), s=s, p=p, states=words, second=second_order)
