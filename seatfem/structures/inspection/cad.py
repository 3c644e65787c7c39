"""What a geometry's solids and faces are: of a CAD file as gmsh reads it, without a mesh to compute on."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np

from seatfem.structures.errors import GeometryError, ModelError
from seatfem.structures.inspection.opened import FileState, state_of
from seatfem.structures.inspection.shape import Array, Integers, Shape
from seatfem.structures.lands import Land, land_of
from seatfem.structures.mesh.gmsh_process import run_gmsh
from seatfem.structures.shapes import CadPart, Geometry, decode, encode
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.faces import Colour, Vector

EVEN: Final = 1e-6  # of the cosine between normals of faces that look the same way


EMPTY: Final = Shape(np.zeros((0, 3)), np.zeros((0, 3), np.int64), {}, np.zeros((0, 4), np.int64), 0.0)


@dataclass(frozen=True)
class FoundFace:
    """One face of a geometry's solids; lengths in metres.

    Attributes:
        numbers: places in the file's order, from 1, by which scenes may select it.
        kind: of surface.
        area, centre: of the face.
        normal: outward, of a flat face.
        axis: a point and the direction of a cylinder's or cone's axis, and the cone's half angle [rad].
        radii: the least and the largest distance from that axis.
        colour, name: of the file.
        groups: that select it.
        solids: that it bounds, from 1.
    """

    numbers: tuple[int, ...]
    kind: str
    area: float
    centre: Vector
    normal: Vector | None
    axis: tuple[Vector, Vector, float] | None
    radii: tuple[float, float] | None
    colour: Colour | None
    name: str
    groups: tuple[str, ...]
    solids: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Inspected:
    """A geometry's solids and faces.

    Attributes:
        faces: all of them.
        problems: fields of the geometry's specification, and what is wrong with each.
        regions: names of the solids.
        shape: coarse, with the groups that could be selected; its rows of triangles by face in ``parts``.
        parts: rows of the shape's triangles on each face.
        edges: by group of flat faces, (e, 2, 3) ends of the straight parts of what bounds it [m].
    """

    faces: tuple[FoundFace, ...]
    problems: tuple[tuple[str, str], ...]
    regions: tuple[str, ...]
    shape: Shape
    parts: tuple[Integers, ...] = field(repr=False)
    edges: Mapping[str, Array] = field(default_factory=dict, repr=False)

    @property
    def meshed(self) -> bool:
        """Return whether gmsh could fill the solids with coarse elements."""
        return len(self.shape.cells) > 0

    @lru_cache(maxsize=4)  # noqa: B019  few are kept, as inspections are
    def land(self, group: str, along: Vector | None = None) -> Land:
        """Return a group as the land of a lip. Raises as `land_of`, which takes ``along``."""
        normals = [face.normal for face in self.faces if group in face.groups]
        if group not in self.edges or not normals or normals[0] is None or not _alike(normals):
            raise ModelError("the struck face is not flat: take flat faces, or strike it as a whole")
        return land_of(self.edges[group], normals[0], along)


def inspect_geometry(geometry: Geometry, *, picture: bool = False) -> Inspected:
    """Return the geometry's faces, groups and problems; a file is read once in a process, as long as it stays as it is.

    ``picture``: with triangles that show curved faces well, and without cells.

    Raises:
        OSError: the file is not there.
        MeshingError: gmsh cannot be run, or crashes.
    """
    state = state_of(geometry.path) if isinstance(geometry, CadPart) else None
    return _inspected(json.dumps(encode(geometry), sort_keys=True), state, picture)


@lru_cache(maxsize=4)
def _inspected(encoded: str, state: FileState | None, picture: bool) -> Inspected:
    data = json.loads(encoded)
    if state is not None:
        data["path"] = str(state.path)
        try:
            check_readable(decode(json.loads(encoded)).path)
        except GeometryError as error:
            return _nothing(error)
    try:
        arrays = run_gmsh({"task": "inspect", "geometry": data, "picture": picture})
    except GeometryError as error:  # what is found before anything is built, as a unit that is not known
        return _nothing(error)
    answer = json.loads(str(arrays["found"]))
    rows = [np.flatnonzero(arrays["faces"] == face["tag"]) for face in answer["faces"]] if answer["faces"] else []
    if not rows:
        return Inspected((), _problems(answer), (), EMPTY, ())
    groups = {
        name: np.flatnonzero(np.isin(arrays["faces"], tags)).astype(np.int64) for name, tags in answer["groups"].items()
    }
    shape = Shape(arrays["points"], arrays["triangles"], groups, arrays["cells"], float(answer["volume"]))
    faces = tuple(_face(face, answer["groups"]) for face in answer["faces"])
    edges = {name: arrays["edges"][arrays["edges_of"] == k] for k, name in enumerate(answer["flat"])}
    return Inspected(faces, _problems(answer), tuple(answer["regions"]), shape, tuple(rows), edges)


def _alike(normals: Sequence[Vector | None]) -> bool:
    """Return whether all look the same way."""
    return all(normal is not None and np.dot(normal, normals[0]) > 1 - EVEN for normal in normals)  # type: ignore[arg-type]


def _nothing(error: GeometryError) -> Inspected:
    return Inspected((), ((error.field or "path", str(error)),), (), EMPTY, ())


def _problems(found: Mapping[str, object]) -> tuple[tuple[str, str], ...]:
    problems = found["problems"]
    assert isinstance(problems, list)
    return tuple((str(key) or "path", str(message)) for key, message in problems)


def _face(face: Mapping[str, object], groups: Mapping[str, list[int]]) -> FoundFace:
    def plain(key: str) -> object:
        value = face[key]
        return tuple(tuple(v) if isinstance(v, list) else v for v in value) if isinstance(value, list) else value

    keys = ("numbers", "kind", "area", "centre", "normal", "axis", "radii", "colour", "name", "solids")
    mine = tuple(name for name, tags in groups.items() if face["tag"] in tags)
    return FoundFace(**{key: plain(key) for key in keys}, groups=mine)  # type: ignore[arg-type]
