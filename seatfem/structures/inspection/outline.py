"""Outlines of flat sheets in DXF and STEP files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from impact.greens.base import Array
from seatfem.structures.errors import GeometryError
from seatfem.structures.formats.dxf_outline import read_outline
from seatfem.structures.inspection.opened import FileState, state_of
from seatfem.structures.mesh.gmsh_process import MeshingError, run_gmsh
from seatfem.structures.shapes.cad import STEP_SUFFIXES, check_readable
from seatfem.structures.shapes.outlined import Corner


@dataclass(frozen=True)
class DrawnOutline:
    """What a file holds.

    Attributes:
        outline, holes: closed loops of corners (x, y, bulge) [m].
        thickness: of a solid plate [m]; ``None``: only a face, or a drawing.
    """

    outline: tuple[Corner, ...]
    holes: tuple[tuple[Corner, ...], ...]
    thickness: float | None = None


def outline_in(path: Path, unit: float | None = None) -> DrawnOutline:
    """The outline in a file, which is read once in a process as long as it stays as it is.

    STEP: of its one plane face, or of a plate, whose thickness is found. The face is square to an axis of the file, and
    seen against that axis: x and y are the file's where it is z; y and z, or z and x, where it is x, or y.

    Args:
        path: of a STEP file, else DXF.
        unit: metres per unit of a DXF drawing.

    Raises:
        GeometryError: "Outlined.file = ..." of a file that is damaged or holds something else.
    """
    try:
        return _read(state_of(path), path, unit)
    except (MeshingError, OSError) as error:
        raise GeometryError(f"Outlined.file = {path.name}: {error}") from error


@lru_cache(maxsize=8)
def _read(state: FileState, path: Path, unit: float | None) -> DrawnOutline:
    if not is_step(path):
        outline, *holes = map(_corners, read_outline(path, unit))
        return DrawnOutline(outline, tuple(holes))
    try:
        check_readable(path)
    except GeometryError as error:
        raise GeometryError(f"Outlined.file = {error}") from error
    found = run_gmsh({"task": "outline", "path": str(path)})
    outline, *holes = (_corners(found[f"loop:{k}"]) for k in range(sum(name.startswith("loop:") for name in found)))
    return DrawnOutline(outline, tuple(holes), float(found["thickness"]) if "thickness" in found else None)


def is_step(path: Path) -> bool:
    """Whether a file is STEP by its name."""
    return path.suffix.lower() in STEP_SUFFIXES


def _corners(loop: Array) -> tuple[Corner, ...]:
    return tuple((float(x), float(y), float(bulge)) for x, y, bulge in loop)
