"""The faces of a mesh: parts of its surface without a sharp edge within, planes and cylinders told as such."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from seatfem.structures.inspection.cad import FoundFace
from seatfem.structures.inspection.shape import Array, Integers, Shape
from seatfem.structures.shapes.faces import Vector
from seatfem.structures.shapes.surfaces import FREEFORM, fitted_cylinder

SHARP: Final = math.radians(25.0)  # between neighbouring triangles of different faces
FLAT: Final = 1e-3  # of unit normals
CHORDS: Final = 0.06  # the same of triangles on a cylinder, and their middles over its extent
ROUND: Final = 0.01  # scatter of the radius


def faces_of(shape: Shape) -> tuple[tuple[FoundFace, ...], tuple[Integers, ...]]:
    """Faces in the order of the mesh's own triangles, and the rows of triangles of each; named groups bound faces."""
    label = _labels(shape)
    order = np.unique(label, return_index=True)[1].argsort()
    rows = tuple(np.flatnonzero(label == label_of) for label_of in np.unique(label)[order])
    return tuple(_described(shape, part, number) for number, part in enumerate(rows, 1)), rows


def _labels(shape: Shape) -> Integers:
    """(m,) the face of each triangle."""
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
    alone = Shape(shape.points, shape.triangles[rows], {"": np.arange(len(rows))}, shape.cells, 0.0)
    edges = alone.outline("")
    kind, normal, axis, radii = FREEFORM, None, None, None
    if np.abs(normals - normals[0]).max() < FLAT:
        kind, normal = "Plane", _triple(normals[0])
    elif len(rows) > 3 and (found := _cylinder(shape, rows, normals)) is not None:
        kind, (point, direction, radius) = "Cylinder", found
        axis, radii = (_triple(point), _triple(direction), 0.0), (radius, radius)
    return FoundFace(
        numbers=(number,),
        kind=kind,
        area=float(areas.sum()),
        centre=_triple(np.average(middles, axis=0, weights=areas)),
        perimeter=float(np.linalg.norm(shape.points[edges[:, 0]] - shape.points[edges[:, 1]], axis=1).sum()),
        normal=normal,
        axis=axis,
        radii=radii,
        colour=None,
        name="",
        groups=tuple(name for name, group in shape.groups.items() if np.isin(rows[0], group)),
        solids=(),
    )


def _cylinder(shape: Shape, rows: Integers, normals: Array) -> tuple[Array, Array, float] | None:
    """Triangles are chords: their middles and normals fit a cylinder roughly, their corners give its radius."""
    middles = shape.points[shape.triangles[rows]].mean(axis=1)
    extent = float(np.linalg.norm(np.ptp(middles, axis=0)))
    if (found := fitted_cylinder(middles, normals, extent, CHORDS)) is None:
        return None
    point, direction = found
    arms = shape.points[np.unique(shape.triangles[rows])] - point
    away = np.linalg.norm(arms - np.outer(arms @ direction, direction), axis=1)
    return (point, direction, float(away.mean())) if np.ptp(away) < ROUND * away.mean() else None


def _triple(values: Array) -> Vector:
    x, y, z = values
    return float(x), float(y), float(z)
