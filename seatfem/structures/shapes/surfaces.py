"""What kind of surface a face of a gmsh model lies on: as OpenCASCADE says, or as its points and normals tell.

CAD programs write planes and cylinders as splines or extrusions too; gmsh calls those "Unknown" or by the spline.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.shapes.faces import Axis, Vector

KNOWN: Final = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
SAMPLES: Final = 6  # along each parameter
ALIKE: Final = 1e-5  # of the face's extent, and of unit normals
FREEFORM: Final = "Freeform"


def surface_of(model: Any, tag: int, unit: float) -> tuple[str, Axis | None]:
    """Kind of the surface, and the axis of a cylinder or cone; ``unit``: metres per length unit of the model."""
    kind = str(model.getType(2, tag))
    if kind in ("Cylinder", "Cone"):
        return kind, _axis(model, tag, unit)
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
    """A point and the direction of the axis of the cylinder that points (n, 3) with these normals lie on.

    p = c + r n for all points, with normals at right angles to the axis; ``None`` where one is off by more than
    ``tolerance`` times ``extent`` [m], or its normal by ``tolerance``.
    """
    direction = np.linalg.svd(normals, full_matrices=False)[2][2]
    if np.abs(normals @ direction).max() > tolerance:
        return None
    across = points - np.outer(points @ direction, direction)
    matrix = np.concatenate([np.tile(np.eye(3), (len(points), 1)), normals.reshape(-1, 1)], axis=1)
    found, *_ = np.linalg.lstsq(matrix, across.ravel(), rcond=None)
    off = matrix @ found - across.ravel()
    return (found[:3], direction) if np.abs(off).max() < tolerance * extent else None


def _axis(model: Any, tag: int, unit: float) -> Axis:
    """OpenCASCADE's surface is P = O + (R + v sin a) e(u) + v cos a Z with the unit vector e normal to Z."""
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
    """Three plain numbers."""
    x, y, z = values
    return float(x), float(y), float(z)
