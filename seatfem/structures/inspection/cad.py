"""Inspection of a CAD file as gmsh reads it, before anything is planned: its solids and faces."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatfem.structures import errors, lands
from seatfem.structures.mesh.gmsh_process import run_gmsh
from seatfem.structures.shapes import CadPart, Geometry, decode, encode, loops
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.faces import Colour, Vector

if TYPE_CHECKING:
    from seatfem.structures.kinds.structure import Finding


class FileState(NamedTuple):
    """A file as it is now: equal states are taken for equal contents."""

    path: Path
    changed: int
    size: int


def state_of(path: Path) -> FileState:
    """Return the state of a file. Raises `OSError`."""
    status = path.stat()
    return FileState(path.resolve(), status.st_mtime_ns, status.st_size)


def opened(read: Callable[[], object], files: Mapping[str, Path | None]) -> Iterator[Finding]:
    """Yield a reader's message at the key of the file that it names; of none, at the last."""
    try:
        read()
    except (ValueError, OSError) as error:
        key = next((key for key, file in files.items() if file is not None and str(file) in str(error)), [*files][-1])
        yield (key,), str(error)


def naming(file: Path, message: str) -> str:
    """Return the message, with the file's name in front where it lacks it."""
    return message if file.name in message else f"{file}: {message}"


def listed(names: Collection[str]) -> str:
    """Return the names, one after the other."""
    return ", ".join(map(repr, names)) or "none"


Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SAMPLED: Final = 400  # points of the struck outline from which distances are taken
BLOCK: Final = 256  # points to which distances are taken at once
DIRECTED: Final = 0.1  # least excess of the normals along one direction; a cone of 60 degrees has 1/8
BESIDE: Final = 0.5  # part of the depth by which held faces may lie beside the struck ones of a bulky body


@dataclass(frozen=True, eq=False)
class Shape:
    """Attributes:
    points: (n, 3) [m].
    triangles: (m, 3) of the surface.
    groups: named parts of the surface, rows of ``triangles``.
    cells: (k, 4) tetrahedra; none where they are not known.
    volume: [m^3].
    """

    points: Array
    triangles: Integers
    groups: dict[str, Integers]
    cells: Integers
    volume: float

    @cached_property
    def extent(self) -> Array:
        """Return the (3,) sides of the bounding box [m]."""
        used = self.points[np.unique(self.triangles)] if len(self.triangles) else self.points
        return np.asarray(np.ptp(used, axis=0))

    @cached_property
    def _crosses(self) -> Array:
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.asarray(np.cross(b - a, c - a)) / 2

    @cached_property
    def areas(self) -> Array:
        """Return the (m,) areas of the triangles [m^2]."""
        return np.asarray(np.linalg.norm(self._crosses, axis=1))

    @cached_property
    def normals(self) -> Array:
        """Return the (m, 3) unit normals of the triangles, of either sign; zero where one has no area."""
        return np.asarray(self._crosses / np.maximum(self.areas[:, None], np.finfo(float).tiny))

    def area(self, group: str) -> float:
        """Return the area [m^2]."""
        return float(self.areas[self.groups[group]].sum())

    def normal(self, group: str) -> Array | None:
        """Return the (3,) unit vector that most of the group's faces look along, or its opposite; ``None``: a bore."""
        rows = self.groups[group]
        n = self.normals[rows]
        values, vectors = np.linalg.eigh(np.einsum("i,ij,ik->jk", self.areas[rows], n, n))
        return np.asarray(vectors[:, 2]) if values[2] - values[1] > DIRECTED * values.sum() else None

    def outline(self, group: str) -> Integers:
        """Return the (e, 2) edges that bound the group."""
        rows = self.triangles[self.groups[group]]
        edges = np.sort(np.concatenate([rows[:, [0, 1]], rows[:, [1, 2]], rows[:, [2, 0]]]), axis=1)
        return loops.unshared(edges)

    def width(self, group: str) -> float:
        """Return twice the area over the length of the outline [m]: of a ring its width, of a disc its radius."""
        edges = self.outline(group)
        around = float(np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1).sum())
        return 2 * self.area(group) / around if around > 0 else math.sqrt(self.area(group))

    def depth(self, group: str) -> float:
        """Return the depth behind the group, along its normal [m]; where that has none, the body's shortest side."""
        normal = self.normal(group)
        if normal is None:
            return float(self.extent.min())
        return float(np.ptp(self.points[np.unique(self.triangles)] @ normal))

    def span(self, group: str, held: Sequence[str]) -> float:
        """Return the mean distance, along its plane, from the group to the held faces [m]; 0 where these lie beneath.

        Of a body that nothing holds: to the farthest point.
        """
        depth = self.depth(group)
        held_triangles = [self.triangles[self.groups[name]] for name in held if name in self.groups]
        nodes = np.unique(self.triangles[self.groups[group]])
        points = self.points[nodes[:: max(1, len(nodes) // SAMPLED)]]
        if not held_triangles:
            return float(np.linalg.norm(points.mean(axis=0) - self.points, axis=1).max())
        away = float(np.mean(distances(points, self._sampled(np.concatenate(held_triangles)))))
        beside = math.sqrt(max(0.0, away**2 - depth**2))
        return beside if beside > BESIDE * depth else 0.0

    def _sampled(self, triangles: Integers) -> Array:
        corners = self.points[triangles]
        return np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])


def distances(points: Array, others: Array) -> Array:
    """Return (n,) distances from ``points`` (n, 3) to the nearest of ``others`` (m, 3), some hundreds."""
    nearest = np.full(len(points), np.inf)
    squares = np.einsum("ij,ij->i", points, points)
    for some in np.array_split(others, max(1, len(others) // BLOCK)):
        off = squares[:, None] - 2 * points @ some.T + np.einsum("ij,ij->i", some, some)
        np.minimum(nearest, off.min(axis=1, initial=np.inf), out=nearest)
    return np.asarray(np.sqrt(np.maximum(nearest, 0.0)))


FILLED: Final = 0.6  # of its bounding box, for a part whose volume is not known
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
    def filled(self) -> float:
        """Return the volume [m^3], of solids that gmsh cannot fill about."""
        return self.shape.volume or FILLED * float(self.shape.extent.prod())

    @lru_cache(maxsize=4)  # noqa: B019  few are kept, as inspections are
    def land(self, group: str, along: Vector | None = None) -> lands.Land:
        """Return a group as the land of a lip. Raises as `land_of`, which takes ``along``."""
        normals = [face.normal for face in self.faces if group in face.groups]
        if group not in self.edges or not normals or normals[0] is None or not _alike(normals):
            raise errors.ModelError("the struck face is not flat: take flat faces, or strike it as a whole")
        return lands.land_of(self.edges[group], normals[0], along)


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
        except errors.GeometryError as error:
            return _nothing(error)
    try:
        arrays = run_gmsh({"task": "inspect", "geometry": data, "picture": picture})
    except errors.GeometryError as error:  # what is found before anything is built, as a unit that is not known
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
    """Return whether all normals have the same direction."""
    return all(normal is not None and np.dot(normal, normals[0]) > 1 - EVEN for normal in normals)  # type: ignore[arg-type]


def _nothing(error: errors.GeometryError) -> Inspected:
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
