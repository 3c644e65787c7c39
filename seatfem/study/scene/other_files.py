"""Files of other kinds given where a scene is expected: what they are, and where they go."""

from __future__ import annotations

from pathlib import Path
from typing import Final

SCENE: Final = (".toml", "")
_PARTS: Final = (
    "`seatfem faces {file}` shows its faces; `seatfem init {kind}` writes a scene, in which seat.file names it"
)
_OTHERS: Final = {
    ".dxf": (
        "a drawing",
        "`seatfem init sheet` writes a scene, in which reed.file = {file!r} may replace reed.outline",
    ),
    ".csv": (
        "a table",
        "in a scene it may be the course of a load, pressure = {{ file = {file!r} }} in [[load]], or with "
        "`seatfem init frf` a measured response",
    ),
    ".uff": ("a universal file", "`seatfem init modes` or `init frf` writes a scene, in which seat.file names it"),
    ".mtx": (
        "a matrix",
        "`seatfem init matrices` writes a scene, in which seat.mass and seat.stiffness name such files",
    ),
    ".h5": ("a result", "`seatfem report` and `seatfem view` take its folder; `seatfem init greens` a seat of a run"),
    ".json": ("a table of results", "the folder that it is in has scene.toml: run that"),
}
_ALIKE: Final = {".58": ".uff", ".npz": ".mtx", ".npy": ".mtx", ".hdf5": ".h5"}


def no_scene(path: Path) -> str:
    """Return why a file of this name is no scene and what to do with it; "" for one that may be, or is not there."""
    suffix = path.suffix.lower()
    if path.is_dir() and suffix != ".toml":
        return "cannot be read: is a folder, no scene (TOML); `seatfem report` and `seatfem view` take folders of runs"
    if suffix in SCENE or not path.exists():
        return ""
    if (known := _ALIKE.get(suffix, suffix)) in _OTHERS:
        what, remedy = _OTHERS[known]
        return f"is {what}, no scene (TOML); {remedy.format(file=path.name)}"
    from seatfem.structures.formats.mesh_files import BY_GMSH, CAD, READERS  # of mistakes only
    from seatfem.structures.formats.meshio_files import SURFACES_ONLY

    if suffix in CAD:
        return f"is a CAD part, no scene (TOML); {_PARTS.format(file=path.name, kind='cad')}"
    if suffix in (*BY_GMSH, *READERS):
        return f"is a mesh, no scene (TOML); {_PARTS.format(file=path.name, kind='mesh')}"
    if suffix in SURFACES_ONLY:
        return "is a surface, no scene (TOML); a solid is needed: a STEP file (`seatfem init cad`), or a mesh of one"
    return ""
