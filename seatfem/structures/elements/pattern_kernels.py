"""Compiled loops over the sparsity pattern: the graph of the nodes, the rows and columns of the unknowns.

n nodes, three unknowns a node. None of these functions calls another, so numba's cache follows each edit.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@njit(cache=True)
def node_graph(cells: Ints, n: int) -> tuple[Ints, Ints]:
    """Return (indptr, indices) of the nodes that share an element, rows sorted; ``cells`` is (m, L)."""
    m, local = cells.shape
    start = np.zeros(n + 1, np.int64)
    for e in range(m):
        for a in range(local):
            start[cells[e, a] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    around, fill = np.empty(m * local, np.int32), start[:-1].copy()
    for e in range(m):
        for a in range(local):
            around[fill[cells[e, a]]] = e
            fill[cells[e, a]] += 1
    seen = np.full(n, -1, np.int32)
    indptr = np.zeros(n + 1, np.int32)
    for i in range(n):
        count = 0
        for p in range(start[i], start[i + 1]):
            for b in range(local):
                j = cells[around[p], b]
                if seen[j] != i:
                    seen[j] = i
                    count += 1
        indptr[i + 1] = indptr[i] + count
    # row i goes, as entry i, to the rows it names: the graph is symmetric, so they come out whole and sorted
    indices, place = np.empty(indptr[n], np.int32), indptr[:-1].copy()
    seen[:] = -1
    for i in range(n):
        for p in range(start[i], start[i + 1]):
            for b in range(local):
                j = cells[around[p], b]
                if seen[j] != i:
                    seen[j] = i
                    indices[place[j]] = i
                    place[j] += 1
    return indptr, indices


@njit(cache=True)
def expand_pattern(indptr: Ints, indices: Ints, unknown: Ints, free: int) -> tuple[Ints, Ints, Ints]:
    """Return the pattern of all couplings of the unknowns, for the graph (indptr, indices) of the nodes.

    ``unknown`` (n, 3) numbers the unknowns of a node, -1 where held. Returns (rows, columns, offset): ``offset`` of an
    entry of the graph is where, within the rows of its first node, the columns of its second begin.
    """
    n = len(indptr) - 1
    width = np.zeros(n, np.int32)
    for j in range(n):
        for b in range(3):
            width[j] += unknown[j, b] >= 0
    rows, offset = np.zeros(free + 1, np.int32), np.empty(len(indices), np.int32)
    for i in range(n):
        total = 0
        for k in range(indptr[i], indptr[i + 1]):
            offset[k] = total
            total += width[indices[k]]
        for a in range(3):
            if unknown[i, a] >= 0:
                rows[unknown[i, a] + 1] = total
    for r in range(free):
        rows[r + 1] += rows[r]
    columns = np.empty(rows[free], np.int32)
    for i in range(n):
        for a in range(3):
            if unknown[i, a] < 0:
                continue
            p = rows[unknown[i, a]]
            for k in range(indptr[i], indptr[i + 1]):
                for b in range(3):
                    if unknown[indices[k], b] >= 0:
                        columns[p] = unknown[indices[k], b]
                        p += 1
    return rows, columns, offset


@njit(cache=True)
def expand_scalar(indptr: Ints, indices: Ints, values: Floats, unknown: Ints, free: int) -> tuple[Ints, Ints, Floats]:
    """Return rows, columns and data of values (x) I over the unknowns: a component couples only with its own kind."""
    n = len(indptr) - 1
    rows = np.zeros(free + 1, np.int32)
    for i in range(n):
        for k in range(indptr[i], indptr[i + 1]):
            for a in range(3):
                if unknown[i, a] >= 0 and unknown[indices[k], a] >= 0:
                    rows[unknown[i, a] + 1] += 1
    for r in range(free):
        rows[r + 1] += rows[r]
    columns, data = np.empty(rows[free], np.int32), np.empty(rows[free])
    for i in range(n):
        for a in range(3):
            if unknown[i, a] < 0:
                continue
            p = rows[unknown[i, a]]
            for k in range(indptr[i], indptr[i + 1]):
                if unknown[indices[k], a] >= 0:
                    columns[p], data[p] = unknown[indices[k], a], values[k]
                    p += 1
    return rows, columns, data
