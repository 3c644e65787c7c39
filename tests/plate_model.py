"""Rectangles of plate elements, of which tests make plates."""

from collections.abc import Callable

import numpy as np

from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.model import Array

Warp = Callable[[Array], Array]


def grid(counts: tuple[int, int], sides: tuple[float, float], warp: Warp | None = None) -> PlateMesh:
    """Return a rectangle of nx by ny elements, or what ``warp`` makes of it."""
    nx, ny = counts
    x, y = np.meshgrid(np.linspace(0, sides[0], 2 * nx + 1), np.linspace(0, sides[1], 2 * ny + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    i, j = (2 * k.ravel() for k in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    steps = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    lines = {"left": number[0], "right": number[-1], "bottom": number[:, 0], "top": number[:, -1]}
    cells = np.stack([number[i + a, j + b] for a, b in steps], axis=1)
    return PlateMesh(points if warp is None else warp(points), cells, lines)
