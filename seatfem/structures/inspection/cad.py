"""Inspection of the solids and faces of a geometry or CAD file by gmsh."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from seatfem.structures import errors, lands
from seatfem.structures.kinds.structure import Finding
from seatfem.structures.mesh.checks import nearest_distances
from seatfem.structures.mesh.gmsh_process import run_gmsh
from seatfem.structures.shapes import CadPart, Geometry, decode, encode, loops
from seatfem.structures.shapes.cad import check_readable
from seatfem.structures.shapes.selectors import Axis, Colour, Vector


def opened(read: Callable[[], object], files: Mapping[str, Path | None]) -> Iterator[Finding]:
    """Yield the message of a failing ``read``, with the key of the file that it names, or else the last key."""
    try:
        read()
    except (ValueError, OSError) as error:
        key = next((key for key, file in files.items() if file is not None and str(file) in str(error)), [*files][-1])
        yield (key,), str(error)


def naming(file: Path, message: str) -> str:
    """Return the message, preceded by the file's name unless it contains it."""
    return message if file.name in message else f"{file}: {message}"


def listed(names: Collection[str]) -> str:
    """Return the quoted names, separated by commas, or "none"."""
    return ", ".join(map(repr, names)) or "none"


Array = NDArray[np.float64]
Integers = NDArray[np.int64]
SAMPLED: Final = 400  # number of points of the contact face from which distances are computed
DIRECTED: Final = 0.1  # least difference of the two largest mean squares of the normals; 1/8 for a cone of 60 degrees
BESIDE: Final = 0.5  # lateral distance of the held faces over the depth up to which they count as beneath


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangulated surface of a body.

    Attributes:
        points: (n, 3) coordinates [m].
        triangles: (m, 3) rows of ``points``.
        groups: named parts of the surface, rows of ``triangles``.
        volume: volume of the body [m^3].
    """

    points: Array
    triangles: Integers
    groups: dict[str, Integers]
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
        """Return the (m, 3) unit normals of the triangles, of either sign; zero for a triangle without area."""
        return np.asarray(self._crosses / np.maximum(self.areas[:, None], np.finfo(float).tiny))

    def area(self, group: str) -> float:
        """Return the area of the group [m^2]."""
        return float(self.areas[self.groups[group]].sum())

    def normal(self, group: str) -> Array | None:
        """Return the (3,) prevailing unit normal of the group, of either sign; ``None`` without one, as in a bore."""
        rows = self.groups[group]
        n = self.normals[rows]
        values, vectors = np.linalg.eigh(np.einsum("i,ij,ik->jk", self.areas[rows], n, n))
        return np.asarray(vectors[:, 2]) if values[2] - values[1] > DIRECTED * values.sum() else None

    def rise(self, group: str) -> tuple[float, float]:
        """Return by how much the group's points rise over the plane fitted to them, from the lowest to the highest,
        and the largest side of their bounding box [m]."""
        points = self.points[np.unique(self.triangles[self.groups[group]])]
        normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][-1]
        return float(np.ptp(points @ normal)), float(np.ptp(points, axis=0).max())

    def outline(self, group: str) -> Integers:
        """Return the (e, 2) edges that bound the group."""
        return loops.rim(self.triangles[self.groups[group]])

    def width(self, group: str) -> float:
        """Return twice the area over the length of the outline [m]: the width of a ring, the radius of a disc."""
        edges = self.outline(group)
        around = float(np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1).sum())
        return 2 * self.area(group) / around if around > 0 else math.sqrt(self.area(group))

    def depth(self, group: str) -> float:
        """Return the depth of the body along the group's normal [m], or its shortest side if there is no normal."""
        normal = self.normal(group)
        if normal is None:
            return float(self.extent.min())
        return float(np.ptp(self.points[np.unique(self.triangles)] @ normal))

    def span(self, group: str, held: Sequence[str]) -> float:
        """Return the mean lateral distance from the group to the held faces [m]; 0 if these lie beneath.

        For an unsupported body it is the distance to the farthest point.
        """
        depth = self.depth(group)
        held_triangles = [self.triangles[self.groups[name]] for name in held if name in self.groups]
        nodes = np.unique(self.triangles[self.groups[group]])
        points = self.points[nodes[:: max(1, len(nodes) // SAMPLED)]]
        if not held_triangles:
            return float(np.linalg.norm(points.mean(axis=0) - self.points, axis=1).max())
        away = float(np.mean(nearest_distances(points, self._sampled(np.concatenate(held_triangles)))))
        beside = math.sqrt(max(0.0, away**2 - depth**2))
        return beside if beside > BESIDE * depth else 0.0

    def _sampled(self, triangles: Integers) -> Array:
        corners = self.points[triangles]
        return np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])


FILLED: Final = 0.6  # assumed volume over that of the bounding box, for a part of unknown volume
EVEN: Final = 1e-6  # largest 1 - cos of the angle between parallel normals


EMPTY: Final = Shape(np.zeros((0, 3)), np.zeros((0, 3), np.int64), {}, 0.0)


@dataclass(frozen=True)
class FoundFace:
    """One face of a geometry's solids; lengths in metres.

    Attributes:
        numbers: positions in the file's order, from 1, by which scenes may select it.
        kind: kind of surface, such as "Plane".
        area, centre: area and centroid.
        normal: outward normal of a flat face.
        axis: axis of a cylinder or cone.
        ends: least and largest distance from that axis; () without one.
        colour, name: colour and name in the file.
        groups: names of the groups that contain it.
        solids: numbers of the solids in the file that it bounds, from 1.
    """

    numbers: tuple[int, ...]
    kind: str
    area: float
    centre: Vector
    normal: Vector | None
    axis: Axis | None
    ends: tuple[float, ...]
    colour: Colour
    name: str
    groups: tuple[str, ...]
    solids: tuple[int, ...]


@dataclass(frozen=True)
class FoundSolid:
    """One solid of a file: its number in the file's order, from 1, its name there, the region that it belongs to, its
    volume [m^3] and centroid [m]."""

    number: int
    name: str
    region: str
    volume: float
    centre: Vector


@dataclass(frozen=True, eq=False)
class Part:
    """The solids and faces of a geometry, CAD file or mesh.

    Attributes:
        faces: all faces.
        problems: fields of the geometry's specification, each with its problem.
        regions: names of the solids.
        shape: triangulated surface, with the groups that could be selected.
        rows: rows of the shape's triangles on each face.
        edges: (e, 2, 3) ends of the straight segments that bound each group of flat faces [m].
        solids: solids of a CAD file that count, of ``in_file`` in all.
        name: name of the file, or of the scene's seat.
        notes: notes for the user: groups that could not be selected, or an assumed unit.
        numbered: whether a scene may select its faces by number.
    """

    faces: tuple[FoundFace, ...] = ()
    problems: tuple[tuple[str, str], ...] = ()
    regions: tuple[str, ...] = ()
    shape: Shape = EMPTY
    rows: tuple[Integers, ...] = field(default=(), repr=False)
    edges: Mapping[str, Array] = field(default_factory=dict, repr=False)
    solids: tuple[FoundSolid, ...] = ()
    in_file: int = 0
    name: str = ""
    notes: tuple[str, ...] = ()
    numbered: bool = True

    @property
    def filled(self) -> float:
        """Return the volume [m^3], estimated if gmsh could not determine it."""
        return self.shape.volume or FILLED * float(self.shape.extent.prod())

    @lru_cache(maxsize=4)  # noqa: B019  few results are cached
    def land(self, group: str, along: tuple[float, ...] = ()) -> lands.Land:
        """Return the flat faces of a group with their axes; ``along`` and errors as in `lands.land_of`."""
        normals = [face.normal for face in self.faces if group in face.groups]
        if group not in self.edges or not normals or normals[0] is None or not _alike(normals):
            raise errors.ModelError("the struck face is not flat: take flat faces, or strike it as a whole")
        return lands.land_of(self.edges[group], normals[0], along)


def inspect_geometry(geometry: Geometry, *, picture: bool = False) -> Part:
    """Return the geometry's faces, groups and problems, cached in the process while its file is unchanged.

    ``picture``: with finer triangles on curved faces.

    Raises:
        OSError: the file does not exist.
        MeshingError: gmsh cannot be run, or crashes.
    """
    files = (geometry.path,) if isinstance(geometry, CadPart) else ()
    return read_once(_inspect, (json.dumps(encode(geometry), sort_keys=True), *files), picture=picture)


def _inspect(encoded: str, *files: Path, picture: bool) -> Part:
    data = json.loads(encoded)
    try:
        for file in files:
            check_readable(file)
            data["path"] = str(file.resolve())
        arrays = run_gmsh({"task": "inspect", "geometry": data, "picture": picture})
    except errors.GeometryError as error:  # raised before the geometry is built, as for an unknown unit
        return Part(problems=((error.field or "path", str(error)),))
    answer = json.loads(str(arrays["found"]))
    problems = tuple((str(key) or "path", str(message)) for key, message in answer["problems"])
    if not answer["faces"]:
        return Part(problems=problems)
    groups = {
        name: np.flatnonzero(np.isin(arrays["faces"], tags)).astype(np.int64) for name, tags in answer["groups"].items()
    }
    return Part(
        tuple(_face(face, answer["groups"]) for face in answer["faces"]),
        problems,
        tuple(answer["regions"]),
        Shape(arrays["points"], arrays["triangles"], groups, float(answer["volume"])),
        tuple(np.flatnonzero(arrays["faces"] == face["tag"]) for face in answer["faces"]),
        {name: arrays["edges"][arrays["edges_of"] == k] for k, name in enumerate(answer["flat"])},
        tuple(FoundSolid(**{key: decode(value) for key, value in solid.items()}) for solid in answer["solids"]),
        answer["in_file"],
    )


def _alike(normals: Sequence[Vector | None]) -> bool:
    """Return whether all normals have the same direction."""
    return all(normal is not None and np.dot(normal, normals[0]) > 1 - EVEN for normal in normals)  # type: ignore[arg-type]


def _face(face: Mapping[str, object], groups: Mapping[str, list[int]]) -> FoundFace:
    containing = tuple(name for name, tags in groups.items() if face["tag"] in tags)
    return FoundFace(**{key: decode(value) for key, value in face.items() if key != "tag"}, groups=containing)


Made = TypeVar("Made")


def read_once(read: Callable[..., Made], arguments: tuple[Any, ...], *others: Path, **options: Any) -> Made:
    """Return ``read(*arguments, **options)``, cached in the process while the files among the arguments, and
    ``others``, are unchanged. Raises `OSError` for a missing file."""
    files = (*(each for each in arguments if isinstance(each, Path)), *others)
    states = tuple((path.resolve(), (status := path.stat()).st_mtime_ns, status.st_size) for path in files)
    result: Made = _read(read, arguments, states, **options)
    return result


@lru_cache(maxsize=16)
def _read(read: Callable[..., Any], arguments: tuple[Any, ...], states: tuple[Any, ...], **options: Any) -> Any:
    del states  # part of the cache key
    return read(*arguments, **options)
