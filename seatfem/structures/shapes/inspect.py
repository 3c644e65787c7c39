"""Faces and measures of the solid in a gmsh model, in metres; ``unit``: metres per length unit of the model.

The kind of a face's surface is that of OpenCASCADE, or determined from points and normals if gmsh reports a spline or
"Unknown", as CAD programs also write planes and cylinders as splines or extrusions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.shapes.selectors import Axis, Colour, Face, Patches, Vector, select

KNOWN: Final = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
SAMPLES: Final = 6  # number of points along each parameter of a surface
ALIKE: Final = 1e-5  # largest deviation from a plane or cylinder, over the face's extent, and of unit normals
FREEFORM: Final = "Freeform"
NO_COLOUR = (0, 0, 255, 0)  # colour that gmsh returns for an entity that was never painted
POINTS_PER_CURVE = 17
STEP_OFF_FACE = 1e-3  # distance from a face at which it is tested for its inner side, over the root of its area


def surface_of(model: Any, tag: int, unit: float) -> tuple[str, Axis | None]:
    """Return the kind of the surface, and the axis of a cylinder or cone; ``unit``: metres per length unit of the
    model."""
    kind = str(model.getType(2, tag))
    if kind in ("Cylinder", "Cone"):
        axis = _axis(model, tag, unit)
        return kind, axis if kind == "Cone" else Axis(axis.point, axis.direction)
    return (kind, None) if kind in KNOWN else _recognised(model, tag, unit)


def _recognised(model: Any, tag: int, unit: float) -> tuple[str, Axis | None]:
    low, high = model.getParametrizationBounds(2, tag)
    grid = np.stack(np.meshgrid(*(np.linspace(a, b, SAMPLES) for a, b in zip(low, high, strict=True))), axis=-1)
    points = np.reshape(model.getValue(2, tag, grid.ravel()), (-1, 3))
    normals = np.reshape(model.getNormal(tag, grid.ravel()), (-1, 3))
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not (np.all(np.isfinite(points)) and np.all(np.isfinite(normals)) and extent > 0):
        return FREEFORM, None
    if np.abs(normals - normals[0]).max() < ALIKE and np.abs((points - points[0]) @ normals[0]).max() < ALIKE * extent:
        return "Plane", None
    axis = fitted_cylinder(points, normals, extent, ALIKE)
    if axis is None:
        return FREEFORM, None
    point, direction = axis
    return "Cylinder", Axis(triple(unit * point), triple(direction))


def fitted_cylinder(
    points: NDArray[np.float64], normals: NDArray[np.float64], extent: float, tolerance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return a point on the axis and the direction of a cylinder fitted to points (n, 3) with these normals.

    It solves p = c + r n for all points, with normals perpendicular to the axis; ``None`` if a point deviates by more
    than ``tolerance`` times ``extent`` [m], or a normal by ``tolerance``.
    """
    direction = np.linalg.svd(normals, full_matrices=False)[2][2]
    if np.abs(normals @ direction).max() > tolerance:
        return None
    across = points - np.outer(points @ direction, direction)
    matrix = np.concatenate([np.tile(np.eye(3), (len(points), 1)), normals.reshape(-1, 1)], axis=1)
    solution, *_ = np.linalg.lstsq(matrix, across.ravel(), rcond=None)
    off = matrix @ solution - across.ravel()
    return (solution[:3], direction) if np.abs(off).max() < tolerance * extent else None


def _axis(model: Any, tag: int, unit: float) -> Axis:
    """Return the axis; OpenCASCADE's surface is P = O + (R + v sin a) e(u) + v cos a Z with the unit vector e normal to
    Z."""
    low, high = model.getParametrizationBounds(2, tag)
    where = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2]
    point = model.getValue(2, tag, where)
    along = model.getDerivative(2, tag, where)[3:]
    to_axis = model.getSecondDerivative(2, tag, where)[:3]
    sine = -(along @ to_axis) / np.linalg.norm(to_axis)
    direction = along + sine * to_axis / np.linalg.norm(to_axis)
    return Axis(
        triple(unit * (point + to_axis)), triple(direction / np.linalg.norm(direction)), abs(math.asin(float(sine)))
    )


def triple(values: NDArray[np.float64]) -> Vector:
    """Return an array of three numbers as a tuple of floats."""
    x, y, z = values
    return float(x), float(y), float(z)


class Mark(NamedTuple):
    """Properties of a face in a CAD file: colour, name, and its numbers in the file's order."""

    colour: Colour = ()
    name: str = ""
    numbers: tuple[int, ...] = ()


def painted(model: Any) -> dict[int, Mark]:
    """Return the marks of the faces of a model on which no operation was carried out."""
    return {tag: Mark(colour_of(model, 2, tag), "", (tag,)) for _, tag in model.getEntities(2)}


def faces_of(model: Any, unit: float, marks: Mapping[int, Mark]) -> list[Face]:
    """Return all faces of the solids."""
    return [_face(model, tag, unit, marks.get(tag, Mark())) for _, tag in model.getEntities(2)]


def patch_tags(model: Any, patches: Patches, unit: float, marks: Mapping[int, Mark]) -> dict[str, list[int]]:
    """Return the gmsh tags of the faces of each group. Raises `GeometryError` on an empty or ambiguous selection."""
    faces = faces_of(model, unit, marks)
    return {
        name: sorted({face.tag for selector in selectors for face in select(faces, selector, name)})
        for name, selectors in patches.items()
    }


def volume_of(model: Any, unit: float) -> float:
    """Return the volume of the CAD solid in cubic metres."""
    return unit**3 * float(sum(model.occ.getMass(3, tag) for _, tag in model.getEntities(3)))


def area_of(model: Any, tags: list[int], unit: float) -> float:
    """Return the area of CAD faces in square metres."""
    return unit**2 * float(sum(model.occ.getMass(2, tag) for tag in tags))


def _face(model: Any, tag: int, unit: float, mark: Mark) -> Face:
    curves = [abs(curve) for _, curve in model.getBoundary([(2, tag)], oriented=False)]
    kind, axis = surface_of(model, tag, unit)
    x, y, z = (unit * c for c in model.occ.getCenterOfMass(2, tag))
    return Face(
        tag=tag,
        kind=kind,
        centre=(x, y, z),
        area=area_of(model, [tag], unit),
        outline=outline_of(model, curves, unit),
        curves=frozenset(curves),
        normal=_normal(model, tag, curves) if kind == "Plane" else None,
        colour=mark.colour,
        name=mark.name,
        numbers=mark.numbers,
        axis=axis,
        distance=lambda point: _distance(model, tag, point, unit),
    )


def _distance(model: Any, tag: int, point: Vector, unit: float) -> float:
    marker = model.occ.addPoint(*(c / unit for c in point))
    distance = model.occ.getDistance(0, marker, 2, tag)[0]
    model.occ.remove([(0, marker)])
    return unit * float(distance)


def outline_of(model: Any, curves: list[int], unit: float) -> NDArray[np.float64]:
    """Return the points on curves, (n, 3)."""
    points = []
    for curve in curves:
        low, high = model.getParametrizationBounds(1, curve)
        where = np.linspace(low[0], high[0], POINTS_PER_CURVE)
        points.append(np.reshape(model.getValue(1, curve, where), (-1, 3)))
    return unit * np.concatenate(points) if points else np.empty((0, 3))


def _normal(model: Any, tag: int, curves: list[int]) -> Vector:
    """Return the outward normal, as that of gmsh points inwards on some imprinted faces; between two solids, that of
    gmsh."""
    low, high = model.getParametrizationBounds(2, tag)
    normal = np.asarray(model.getNormal(tag, [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2]))
    solids = model.getAdjacencies(2, tag)[0]
    if len(solids) == 1:
        step = STEP_OFF_FACE * math.sqrt(model.occ.getMass(2, tag))
        inside = _point_inside(model, tag, curves, normal, step)
        if inside is not None and model.isInside(3, solids[0], list(inside + step * normal)):
            normal = -normal
    return triple(normal)


def _point_inside(
    model: Any, tag: int, curves: list[int], normal: NDArray[np.float64], step: float
) -> NDArray[np.float64] | None:
    """Return a point inside a plane face, at the distance ``step`` from the middle of a boundary curve."""
    for curve in curves:
        low, high = model.getParametrizationBounds(1, curve)
        middle = [(low[0] + high[0]) / 2]
        along = np.asarray(model.getDerivative(1, curve, middle))
        across = step * np.cross(normal, along / np.linalg.norm(along))
        for point in (model.getValue(1, curve, middle) + across, model.getValue(1, curve, middle) - across):
            if model.isInside(2, tag, list(point)):
                return np.asarray(point)
    return None


def colour_of(model: Any, dimension: int, tag: int) -> Colour:
    """Return the colour of a face or solid, empty if it has none."""
    colour = tuple(int(c) for c in model.getColor(dimension, tag))
    return () if colour == NO_COLOUR else (colour[0], colour[1], colour[2], colour[3])
