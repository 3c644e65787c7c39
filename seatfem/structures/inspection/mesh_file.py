"""Faces of a part in a CAD or mesh file, and properties of a mesh that are needed before a model is made.

Faces of a mesh are parts of its surface without sharp edges inside; planes and cylinders are recognized.
"""

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.structures import errors, lands
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.inspection.cad import Array, FoundFace, Integers, Part, Shape, inspect_geometry
from seatfem.structures.kinds.parts import METRES, LengthUnit
from seatfem.structures.mesh.meshing import SeatMesh
from seatfem.structures.shapes import CadPart, Geometry, GeometryError, cad, inspect
from seatfem.structures.shapes.selectors import Axis

SHARP: Final = math.radians(25.0)  # largest angle between neighbouring triangles of one face
FLAT: Final = 1e-3  # largest scatter of the unit normals of a plane
EVEN: Final = 0.01  # largest scatter of the unit normals of a flat contact face: coordinates have few digits
ON_CYLINDER: Final = 0.06  # largest deviation of coarse triangles from a cylinder, over its extent, and of unit normals
ROUND: Final = 0.01  # largest relative scatter of the radius of a cylinder


def shape_of(mesh: SeatMesh) -> Shape:
    """Return the surface with its named faces, as outward-oriented straight triangles, two per quadrilateral."""
    solid = mesh.mesh
    outside = np.unique(np.concatenate([solid.boundary_facets(), *(solid.boundaries or {}).values()]))
    corners = solid.facets[:, outside].T
    points = np.ascontiguousarray(solid.doflocs[:, : int(solid.t.max()) + 1].T)
    if corners.shape[1] == 4:
        corners = _around(corners, points)
    inner = points[solid.t[:, solid.f2t[0, outside]]].mean(axis=0)
    edges = points[corners[:, 1:3]] - points[corners[:, :1]]
    inwards = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), points[corners[:, 0]] - inner) < 0
    corners[inwards] = corners[inwards][:, ::-1]
    halves = [corners[:, [0, k, k + 1]] for k in range(1, corners.shape[1] - 1)]
    triangles = np.concatenate(halves)
    row = np.full(solid.facets.shape[1], -1)
    row[outside] = np.arange(len(outside))
    groups = {
        name: np.concatenate([row[facets] + part * len(outside) for part in range(len(halves))])
        for name, facets in (solid.boundaries or {}).items()
    }
    return Shape(points, triangles, groups, mesh.quality.volume)


@lru_cache(maxsize=4)
def land_of_mesh(mesh: SeatMesh, group: str) -> lands.Land:
    """Return the flat faces of a named boundary with their axes. Raises the errors of `lands.land_of`."""
    shape = shape_of(mesh)
    normals, areas = shape.normals[shape.groups[group]], shape.areas[shape.groups[group]]
    mean = np.average(normals, axis=0, weights=areas)
    if np.abs(normals - mean).max() > EVEN:
        raise errors.ModelError("the struck face is not flat: take a flat one, or strike it as a whole")
    return lands.land_of(shape.points[shape.outline(group)], mean)


def _around(quadrilaterals: Integers, points: Array) -> Integers:
    """Return the (n, 4) vertices in order around each quadrilateral, by their angles about its middle."""
    arms = points[quadrilaterals] - points[quadrilaterals].mean(axis=1, keepdims=True)
    crosses = np.cross(arms[:, :1], arms[:, 1:])
    normal = crosses[np.arange(len(arms)), np.linalg.norm(crosses, axis=2).argmax(axis=1)]
    across = np.cross(normal, arms[:, 0])
    across *= (np.linalg.norm(arms[:, 0], axis=1) / np.linalg.norm(across, axis=1))[:, None]
    angles = np.arctan2(np.einsum("nij,nj->ni", arms, across), np.einsum("nij,nj->ni", arms, arms[:, 0]))
    return np.asarray(np.take_along_axis(quadrilaterals, angles.argsort(axis=1), axis=1))


def regions_of(mesh: Any) -> tuple[str, ...]:
    """Return the names of the volumes to which materials may be assigned; "seat" if the mesh names none."""
    return tuple(name for name in getattr(mesh, "mesh", mesh).subdomains or () if name != "seat") or ("seat",)


def faces_of(shape: Shape) -> tuple[tuple[FoundFace, ...], tuple[Integers, ...]]:
    """Return the faces in the order of the mesh's triangles, and the rows of each; named groups bound faces."""
    label = _labels(shape)
    order = np.unique(label, return_index=True)[1].argsort()
    rows = tuple(np.flatnonzero(label == label_of) for label_of in np.unique(label)[order])
    return tuple(_described(shape, part, number) for number, part in enumerate(rows, 1)), rows


def _labels(shape: Shape) -> Integers:
    """Return the (m,) number of each triangle's face."""
    normals = shape.normals
    edges = np.sort(shape.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(shape.triangles)), 3)
    order = np.lexsort(edges.T)
    same = np.all(edges[order[1:]] == edges[order[:-1]], axis=1)
    a, b = owner[order[:-1]][same], owner[order[1:]][same]
    member = np.zeros((len(shape.triangles), max(1, len(shape.groups))), dtype=bool)
    for column, group in enumerate(shape.groups.values()):
        member[group, column] = True
    smooth = np.abs(np.einsum("ij,ij->i", normals[a], normals[b])) > math.cos(SHARP)
    smooth &= np.all(member[a] == member[b], axis=1)
    n = len(shape.triangles)
    graph = coo_array((np.ones(int(smooth.sum())), (a[smooth], b[smooth])), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _described(shape: Shape, rows: Integers, number: int) -> FoundFace:
    areas, normals = shape.areas[rows], shape.normals[rows]
    middles = shape.points[shape.triangles[rows]].mean(axis=1)
    kind, normal, axis, ends = inspect.FREEFORM, None, None, tuple[float, ...]()
    if np.abs(normals - normals[0]).max() < FLAT:
        kind, normal = "Plane", inspect.triple(normals[0])
    elif len(rows) > 3 and (cylinder := _cylinder(shape, rows, normals)) is not None:
        kind, (point, direction, radius) = "Cylinder", cylinder
        axis, ends = Axis(inspect.triple(point), inspect.triple(direction)), (radius, radius)
    return FoundFace(
        numbers=(number,),
        kind=kind,
        area=float(areas.sum()),
        centre=inspect.triple(np.average(middles, axis=0, weights=areas)),
        normal=normal,
        axis=axis,
        ends=ends,
        colour=(),
        name="",
        groups=tuple(name for name, group in shape.groups.items() if np.isin(rows[0], group)),
        solids=(),
    )


def _cylinder(shape: Shape, rows: Integers, normals: Array) -> tuple[Array, Array, float] | None:
    """Return a point on the axis, the direction and the radius of a fitted cylinder; ``None`` if there is none.

    As triangles are chords, their centres and normals fit only roughly; the radius is that of their corners.
    """
    middles = shape.points[shape.triangles[rows]].mean(axis=1)
    extent = float(np.linalg.norm(np.ptp(middles, axis=0)))
    if (axis := inspect.fitted_cylinder(middles, normals, extent, ON_CYLINDER)) is None:
        return None
    point, direction = axis
    arms = shape.points[np.unique(shape.triangles[rows])] - point
    away = np.linalg.norm(arms - np.outer(arms @ direction, direction), axis=1)
    return (point, direction, float(away.mean())) if np.ptp(away) < ROUND * away.mean() else None


def open_part(path: Path, unit: LengthUnit | None = None) -> Part:
    """Return the part in a STEP, BREP or mesh file.

    Args:
        unit: length unit of a file that states none; millimetres are assumed of BREP files, metres of meshes.

    Raises:
        GeometryError, MeshError: a file that cannot be read.
        MeshingError, OSError: gmsh cannot be run, or the file does not exist.
    """
    if path.suffix.lower() in cad.STEP_SUFFIXES + cad.BREP_SUFFIXES:
        return _describe_cad(path, unit)
    mesh = read_mesh(path, contact=None, fixed=None, unit=None if unit is None else METRES[unit])
    return describe_mesh(path.name, mesh, tuple(f"{path.name} {note}" for note in mesh.provenance.notes))


def describe_geometry(geometry: Geometry, name: str) -> Part:
    """Return the faces of a geometry, with notes on keys of the scene that select none."""
    part = _named(name, inspect_geometry(geometry, picture=True))
    return replace(part, notes=tuple(f"seat.{key}: {text.partition(chr(10))[0]}" for key, text in part.problems))


def _describe_cad(path: Path, unit: LengthUnit | None) -> Part:
    brep = path.suffix.lower() in cad.BREP_SUFFIXES
    geometry = CadPart(path, METRES[unit or "mm"] if unit or brep else None, solid=0)
    part = _named(path.name, inspect_geometry(geometry, picture=True))
    assumed = f"{path.name} states no unit of length, mm is assumed; --unit m says otherwise"
    return replace(part, notes=(assumed,)) if brep and unit is None else part


def _named(name: str, part: Part) -> Part:
    """Return the part with its name. Raises `GeometryError` if it has no faces."""
    if not part.faces:
        raise GeometryError("\n".join(message for _, message in part.problems))
    return replace(part, name=name)


def describe_mesh(name: str, mesh: SeatMesh, notes: tuple[str, ...]) -> Part:
    """Return the faces of a mesh: parts of its surface without sharp edges inside."""
    shape = shape_of(mesh)
    faces, rows = faces_of(shape)
    return Part(faces, (), regions_of(mesh), shape, rows, name=name, notes=notes, numbered=False)
