"""Meshes in VTK's XML files of unstructured grids (.vtu)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.elements.element_orders import VTK, to_gmsh
from seatfem.formats.file_mesh import FileMesh, face_width, one_kind, stacked
from seatfem.mesh.cell_kinds import Integers
from seatfem.mesh.io import MeshError

SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27")
OTHER_SOLIDS = ("tetra", "hexa", "wedge", "pyramid", "poly", "voxel", "VTK_LAGRANGE_", "VTK_BEZIER_")
SKINS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
MOST_GROUPS = 256  # an array of more different values numbers the cells; it does not group them


def read_vtu(path: Path) -> FileMesh:
    """Tetrahedra and hexahedra of a .vtu file; VTK has no names for groups, so they travel as whole-number data.

    A cell array of 0 and 1 is a group of the array's name; one of up to 256 other values is a group "NAME VALUE" for
    each value but 0. Its solid cells are a volume, its triangles or quadrilaterals, cells of the same grid, a surface.
    A point array of 0 and 1 is a node set: the surface of the free faces all of whose vertices it holds. Raises
    `MeshError`.
    """
    import meshio  # here, for it brings readers of every other format along

    try:
        mesh = meshio.vtu.read(path)
    except Exception as error:  # a broken file makes numpy, zlib or the XML parser raise what they like
        raise MeshError(f"{path}: not readable as a .vtu file ({type(error).__name__}: {error})") from error
    blocks = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
    one_kind(_by_type(blocks), str(path))
    solid = [k for k, (kind, _) in enumerate(blocks) if kind in SOLIDS]
    cells = to_gmsh(np.concatenate([blocks[k][1] for k in solid]), VTK)
    _refuse_missing_nodes(path, [rows for _, rows in blocks], len(mesh.points))
    width = face_width(cells)
    skin = [k for k, (kind, _) in enumerate(blocks) if SKINS.get(kind) == width]
    faces = stacked([blocks[k][1][:, :width] for k in skin], width)
    surfaces: dict[str, Integers] = {}
    volumes: dict[str, Integers] = {}
    for array, data in mesh.cell_data.items():
        for name, value in _groups(array, data):
            on_solid, on_skin = (_equal(data, part, value) for part in (solid, skin))
            volumes |= {name: on_solid} if len(on_solid) else {}
            surfaces |= {name: faces[on_skin]} if len(on_skin) else {}
    node_sets = {
        name: np.flatnonzero(data) for name, data in mesh.point_data.items() if _groups(name, [data]) == [(name, 1)]
    }
    return FileMesh(np.asarray(mesh.points, dtype=float), cells, surfaces, volumes, node_sets)


def _refuse_missing_nodes(path: Path, blocks: list[Integers], nodes: int) -> None:
    used = np.concatenate([rows.ravel() for rows in blocks])
    if outside := int(np.sum((used < 0) | (used >= nodes))):
        raise MeshError(f"{path}: {outside} node numbers of its cells are outside 0 ... {nodes - 1}")


def _by_type(blocks: list[tuple[str, Integers]]) -> dict[str, tuple[int, Integers | None]]:
    found: dict[str, tuple[int, Integers | None]] = {}
    for kind, cells in blocks:
        if kind in SOLIDS or kind.startswith(OTHER_SOLIDS):
            found[kind] = (found.get(kind, (0, None))[0] + len(cells), cells if kind in SOLIDS else None)
    return found


def _groups(name: str, data: list[NDArray[Any]]) -> list[tuple[str, int]]:
    """Names and values of the groups that an array tells apart; none for real numbers, vectors and numberings."""
    if any(part.ndim != 1 or part.dtype.kind not in "iub" for part in data):
        return []
    values = [int(value) for value in np.unique(np.concatenate(data)) if value != 0]
    if values == [1]:
        return [(name, 1)]
    return [(f"{name} {value}", value) for value in values] if len(values) <= MOST_GROUPS else []


def _equal(data: list[NDArray[Any]], blocks: list[int], value: int) -> Integers:
    return np.flatnonzero(np.concatenate([np.empty(0, dtype=bool), *(data[k] == value for k in blocks)]))
