"""Where on a surface a value is largest around: distinct places, and how far they are from singular edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from seatfem.structures.model import Array


def local_maxima(points: Array, values: Array, apart: float, *, least: float = 0.0) -> NDArray[np.int64]:
    """Return the numbers of the points (P, d) that have the largest of the values (P,) within a distance of ``apart``
    [m], the largest first; of equal ones the first of the list. Values below ``least`` times the largest are no
    maxima."""
    order = np.lexsort((np.arange(len(values)), -values))
    order = order[values[order] >= least * values.max(initial=0.0)]
    rank = np.full(len(values), len(values))
    rank[order] = np.arange(len(order))
    tree, maxima = cKDTree(points), []
    for number in order:
        if rank[tree.query_ball_point(points[number], apart)].min() == rank[number]:
            maxima.append(int(number))
    return np.array(maxima, dtype=np.int64)


def edge_distances(points: Array, singular: Array) -> Array:
    """Return (P,) distances from each point to the nearest of the singular ones [m]; ``inf`` where there are none."""
    if not len(singular):
        return np.full(len(points), np.inf)
    return np.asarray(cKDTree(singular).query(points)[0])
