"""The faces of a part in whatever file it is, CAD or mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.inspection.cad import FoundFace, Inspected, inspect_geometry
from seatfem.structures.inspection.mesh_file import faces_of, regions_of, shape_of
from seatfem.structures.inspection.shape import Integers, Shape
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.mesh.meshing import SeatMesh
from seatfem.structures.shapes import CadPart, Geometry, GeometryError
from seatfem.structures.shapes.cad import BREP_SUFFIXES, STEP_SUFFIXES


@dataclass(frozen=True, eq=False)
class Part:
    """Attributes:
    name: of the file, or of the scene's seat.
    faces: all that bound its solids.
    shape: its surface; ``rows``: of its triangles, by face.
    regions: names of its solids.
    notes: what is worth telling: groups that could not be selected, a unit that was assumed.
    numbered: whether a scene may select its faces by number.
    """

    name: str
    faces: tuple[FoundFace, ...]
    shape: Shape
    rows: tuple[Integers, ...]
    regions: tuple[str, ...]
    notes: tuple[str, ...] = ()
    numbered: bool = True


def open_part(path: Path, unit: LengthUnit | None = None) -> Part:
    """Return the part in a STEP, BREP or mesh file.

    Args:
        unit: length unit of a file that states none; millimetres are assumed of BREP files, metres of meshes.

    Raises:
        GeometryError, MeshError: a file that cannot be read.
        MeshingError, OSError: gmsh cannot be run; the file is not there.
    """
    if path.suffix.lower() in STEP_SUFFIXES + BREP_SUFFIXES:
        return _of_cad(path, unit)
    length: LengthUnit = unit or "m"
    notes = () if unit else (_assumed(path, length, "--unit mm"),)
    return of_mesh(path.name, read_mesh(path, contact=None, fixed=None, unit=METRES[length]), notes)


def of_geometry(geometry: Geometry, name: str) -> Part:
    """Return the faces of a geometry, with the keys of a scene that select none."""
    return _of_found(name, inspect_geometry(geometry, picture=True), "seat.", ())


def _of_cad(path: Path, unit: LengthUnit | None) -> Part:
    brep = path.suffix.lower() in BREP_SUFFIXES
    length: LengthUnit | None = "mm" if brep and unit is None else unit
    part = CadPart(path, None if length is None else METRES[length])
    inspected = inspect_geometry(part, picture=True)
    notes = (_assumed(path, "mm", "--unit m"),) if brep and unit is None else ()
    return _of_found(path.name, inspected, None, notes)


def _of_found(name: str, found: Inspected, keys: str | None, notes: tuple[str, ...]) -> Part:
    """Return the part; ``keys``: in front of the fields that problems name; ``None``: problems are left out."""
    if not found.faces:
        raise GeometryError("\n".join(message for _, message in found.problems))
    messages = (
        () if keys is None else tuple(f"{keys}{key}: {text.partition(chr(10))[0]}" for key, text in found.problems)
    )
    return Part(name, found.faces, found.shape, found.parts, found.regions, (*notes, *messages))


def of_mesh(name: str, mesh: SeatMesh, notes: tuple[str, ...]) -> Part:
    """Return the faces of a mesh: parts of its surface without a sharp edge within."""
    shape = shape_of(mesh)
    faces, rows = faces_of(shape)
    return Part(name, faces, shape, rows, regions_of(mesh), notes, numbered=False)


def _assumed(path: Path, unit: str, other: str) -> str:
    return f"{path.name} states no unit of length, {unit} is assumed; {other} says otherwise"
