"""Removes the flat corners of a plane mesh whose elements are to be curved.

A vertex on a smooth piece of boundary where one element has both boundary edges turns through 180 degrees once the
edges are curved: det J vanishes there. Such an element is merged with neighbours until the union can be cut into
triangles that all meet in one of its vertices and none of which is flat.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, ...]

FLAT = np.deg2rad(160.0)
GOOD = np.deg2rad(15.0)
MOST_MERGED = 4


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

    Returns the cells to be removed and the triangles to be put in their place; no cell is removed twice.
    """
    across = {edge: cell for cell in angles for edge in _edges(cell)}
    removed: list[Cell] = []
    added: list[Cell] = []
    for cell in [cell for cell, turns in angles.items() if turns.max() > FLAT]:
        gone, ring = [cell], cell
        while (best := _best(points, ring, _interior(angles, gone, ring)))[0] < GOOD and len(gone) < MOST_MERGED:
            unions = [
                (*_best(points, union, _interior(angles, [*gone, other], union)), other)
                for edge in _edges(ring)
                if (other := across.get((edge[1], edge[0]))) is not None
                and len(set(union := _merged(ring, edge, other))) == len(union)
            ]
            if not unions:
                break
            _, ring, other = max(unions, key=lambda found: found[0])
            gone.append(other)
        if len(gone) + len(cell) > 4 and not set(gone) & set(removed):
            removed += gone
            added += _fan(best[1])
    return removed, added


def _merged(ring: Cell, edge: tuple[int, int], other: Cell) -> Cell:
    """The union of a polygon with the cell across one of its edges."""
    return _from(ring, ring.index(edge[1])) + _from(other, other.index(edge[1]))[2:]


def _interior(angles: Mapping[Cell, NDArray[np.float64]], cells: list[Cell], ring: Cell) -> dict[int, float]:
    """Angle of a union of cells at each vertex of its outline."""
    return {node: sum(float(angles[cell][cell.index(node)]) for cell in cells if node in cell) for node in ring}


def _best(points: NDArray[np.float64], loop: Cell, interior: Mapping[int, float]) -> tuple[float, Cell]:
    """How good the best triangulation by lines from one vertex is, and the polygon from that vertex on.

    Measured by the smallest angle; a corner of the polygon that stays the corner of one triangle counts by how far
    its curved edges are from flat.
    """

    def score(ring: Cell) -> float:
        straight = min(_smallest_angle(points[list(triangle)]) for triangle in _fan(ring))
        single = (ring[1], ring[-1]) if len(ring) > 3 else ring
        return min(straight, *(np.pi - interior[node] for node in single))

    return max((score(ring), ring) for ring in (_from(loop, k) for k in range(len(loop))))


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
