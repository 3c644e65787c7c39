"""Points that stand for areas and outlines, denser where distances are small."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from impact.greens.base import Array
from seatfem.structures.shapes.profile import Point

COARSEST = 24  # squares along the longer side of the rectangle that is searched
OUTLINE = 60  # samples of a straight edge, and of a circle
HALVINGS = 10
FINEST = 1 / 150  # of the longer side: distances below it are not told apart
PER_DISTANCE = 0.8  # side of a square over its distance from the patch
Distance = Callable[[Array], Array]


def squares(low: Point, high: Point, distance: Distance) -> tuple[Array, Array]:
    """Centres (n, 2) and areas (n,) of rectangles that tile a rectangle, smaller where |``distance``| is."""
    extent = np.subtract(high, low)
    finest = FINEST * float(extent.max())
    counts = np.maximum(1, np.ceil(COARSEST * extent / extent.max() - 1e-9)).astype(int)
    steps = extent / counts
    axes = [low[k] + steps[k] * (np.arange(counts[k]) + 0.5) for k in range(2)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    found, areas = [], []
    for level in range(HALVINGS + 1):
        coarse = steps.max() > PER_DISTANCE * np.maximum(np.abs(distance(centres)), finest)
        coarse &= level < HALVINGS
        found.append(centres[~coarse])
        areas.append(np.full(len(found[-1]), steps.prod()))
        steps = steps / 2
        corners = steps / 2 * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
        centres = (centres[coarse][:, None, :] + corners).reshape(-1, 2)
    return np.concatenate(found), np.concatenate(areas)


def circle_points(centres: Array, radius: float) -> tuple[Array, Array]:
    """Points (n, 2) on circles about some centres, and the length around each."""
    angles = 2 * math.pi * np.arange(OUTLINE) / OUTLINE
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    points = (centres[:, None, :] + ring).reshape(-1, 2)
    return points, np.full(len(points), 2 * math.pi * radius / OUTLINE)


def side_points(half: Point) -> tuple[Array, Array]:
    """Points (n, 2) on the sides of a rectangle about the origin, and the length around each."""
    corners = np.array([(-half[0], -half[1]), (half[0], -half[1]), half, (-half[0], half[1])])
    along = np.roll(corners, -1, axis=0) - corners
    t = (np.arange(OUTLINE) + 0.5) / OUTLINE
    points = (corners[:, None, :] + t[:, None] * along[:, None, :]).reshape(-1, 2)
    return points, np.repeat(np.linalg.norm(along, axis=1) / OUTLINE, OUTLINE)
