"""Removes the flat corners of a plane mesh whose elements are to be curved.

A vertex on a smooth piece of boundary where one element has both boundary edges turns through 180 degrees once the
edges are curved: det J vanishes there. Such a quadrilateral is cut into triangles; a triangle is first merged with its
neighbour across the opposite edge.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, ...]

FLAT = np.deg2rad(160.0)


def corner_angles(points: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Interior angles (m, c) at the vertices of curved plane elements of order 2, from the tangents of their edges.

    ``cells`` (m, 6 | 8 | 9): vertices counter-clockwise, then the middles of the edges 01, 12, ...
    """
    corners = 3 if cells.shape[1] == 6 else 4
    x = points[cells[:, :corners]]
    middle = points[cells[:, corners : 2 * corners]]
    forth = 4 * middle - 3 * x - np.roll(x, -1, axis=1)
    back = 4 * np.roll(middle, 1, axis=1) - 3 * x - np.roll(x, 1, axis=1)
    cross = forth[..., 0] * back[..., 1] - forth[..., 1] * back[..., 0]
    return np.asarray(np.arctan2(cross, np.sum(forth * back, axis=2)) % (2 * np.pi))


def without_flat_corners(
    points: NDArray[np.float64], angles: Mapping[Cell, NDArray[np.float64]]
) -> tuple[list[Cell], list[Cell]]:
    """``angles``: triangles and quadrilaterals by their vertices (rows of ``points``), and their `corner_angles`.

    Returns the cells to be removed and the triangles to be put in their place. A triangle without a neighbour stays.
    """
    across = {edge: cell for cell in angles for edge in _edges(cell)}
    removed: list[Cell] = []
    added: list[Cell] = []
    for cell, turns in angles.items():
        if turns.max() <= FLAT:
            continue
        loop = _from(cell, int(turns.argmax()))
        gone = [cell]
        if len(cell) == 3:
            neighbour = across.get((loop[2], loop[1]))
            if neighbour is None:
                continue
            loop = (*loop[:2], *_from(neighbour, neighbour.index(loop[2]))[2:], loop[2])
            gone.append(neighbour)
        if not set(gone) & set(removed):
            interior = {node: sum(float(angles[c][c.index(node)]) for c in gone if node in c) for node in loop}
            removed += gone
            added += _best_fan(points, loop, interior)
    return removed, added


def _best_fan(points: NDArray[np.float64], loop: Cell, interior: Mapping[int, float]) -> list[Cell]:
    """The triangles of a polygon that meet in one vertex, chosen for the largest smallest angle.

    The two vertices beside that one become corners of single triangles: how far they are from flat counts too.
    """

    def score(ring: Cell) -> float:
        straight = min(_smallest_angle(points[list(triangle)]) for triangle in _fan(ring))
        return min(straight, np.pi - interior[ring[1]], np.pi - interior[ring[-1]])

    return _fan(max((_from(loop, k) for k in range(len(loop))), key=score))


def _fan(ring: Cell) -> list[Cell]:
    return [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]


def _from(ring: Cell, first: int) -> Cell:
    return ring[first:] + ring[:first]


def _smallest_angle(triangle: NDArray[np.float64]) -> float:
    """Negative for a triangle that is turned over."""
    forth, back = np.roll(triangle, -1, axis=0) - triangle, np.roll(triangle, 1, axis=0) - triangle
    cross = forth[:, 0] * back[:, 1] - forth[:, 1] * back[:, 0]
    return float(np.min(np.arctan2(cross, np.sum(forth * back, axis=1))))


def _edges(cell: Cell) -> list[tuple[int, int]]:
    return [(cell[k - 1], cell[k]) for k in range(len(cell))]
