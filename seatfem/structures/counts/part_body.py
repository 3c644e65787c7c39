"""Samples of the volume and surface of a part drawn elsewhere, from the coarse elements that its inspection made."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.counts.bodies import Body, Samples
from seatfem.structures.inspection.cad import Inspected, inspect_geometry
from seatfem.structures.inspection.shape import Integers, Shape, distances
from seatfem.structures.shapes import Geometry

FEW, MANY = 4, 64  # points in an element: far from the struck faces, and near them
NEAR: Final = 1.5  # sizes of an element within which it is near
PER_TRIANGLE: Final = 16  # points on each struck triangle
BINS, CLOSEST = 300, 1e-3  # of distances, and the smallest that is told apart over the largest
FILLED: Final = 0.6  # of its bounding box, for a part that could not be filled with elements


def body_of(part: Geometry) -> Body:
    """Return the part's volume and surface by their distance from the struck faces."""
    return _body(inspect_geometry(part))


@lru_cache(maxsize=4)
def _body(found: Inspected) -> Body:
    shape = found.shape
    struck = _struck(shape)
    outer = _samples(shape, shape.triangles, shape.areas, struck)
    if not found.meshed:  # all of it as far as its middle, on average
        volume = shape.volume or FILLED * float(shape.extent.prod())
        away = distances(np.mean(shape.points, axis=0)[None], struck)
        return Body(Samples(np.array([volume]), away), outer)
    corners = shape.points[shape.cells]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    return Body(_samples(shape, shape.cells, volumes * (shape.volume / volumes.sum()), struck), outer)


def _struck(shape: Shape) -> Array:
    """Return the points on the struck faces; of a part without any, its middle."""
    rows = shape.groups.get("contact")
    if rows is None or len(rows) == 0:
        return np.asarray(np.mean(shape.points, axis=0)[None])
    weights = np.random.default_rng(0).dirichlet(np.ones(3), PER_TRIANGLE)
    corners = shape.points[shape.triangles[rows]]
    return np.concatenate([corners.reshape(-1, 3), np.einsum("qk,nki->nqi", weights, corners).reshape(-1, 3)])


def _samples(shape: Shape, elements: Integers, measures: Array, struck: Array) -> Samples:
    """Return the points within elements, of which those near the struck faces have many: sizes change there."""
    corners = shape.points[elements]
    extent = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
    near = distances(corners.mean(axis=1), struck) < NEAR * extent
    weight, away = [], []
    for chosen, number in ((near, MANY), (~near, FEW)):
        inside = np.random.default_rng(1).dirichlet(np.ones(elements.shape[1]), number)
        points = np.einsum("qk,nki->nqi", inside, corners[chosen]).reshape(-1, 3)
        weight.append(np.repeat(measures[chosen] / number, number))
        away.append(distances(points, struck))
    return _binned(np.concatenate(weight), np.concatenate(away))


def _binned(weight: Array, away: Array) -> Samples:
    """Return samples of like distance together: `BINS` of them count as well as all, and a plan counts often."""
    edges = np.geomspace(max(float(away.max()), 1e-9) * CLOSEST, max(float(away.max()), 1e-9), BINS)
    place = np.digitize(away, edges)
    total, first = (np.asarray(np.bincount(place, each), dtype=float) for each in (weight, weight * away))
    filled = total > 0
    return Samples(total[filled], first[filled] / total[filled])
