"""Directions in which nodes may not move, and the unknowns that remain.

At each node the forbidden directions span a space; the unknowns are the displacements along an orthonormal basis of its
complement, so that K -> T'KT keeps symmetry and T'MT keeps a nodal mass diagonal.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.model import Array

Constraint = tuple[NDArray[np.int64], Array]
"""Nodes, and the (d,) direction in which none of them may move."""


def free_directions(n_nodes: int, components: int, constraints: Iterable[Constraint]) -> sparse.csr_array:
    """(components * n_nodes, n_free) T with orthonormal columns: nodal displacements = T unknowns.

    A node held in no direction keeps its coordinate axes as unknowns, in order.
    """
    forbidden = np.zeros((n_nodes, components, components))
    for nodes, direction in constraints:
        unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        forbidden[nodes] += np.outer(unit, unit)
    held = np.flatnonzero(forbidden.any(axis=(1, 2)))
    bases = np.broadcast_to(np.eye(components), (n_nodes, components, components)).copy()
    kept = np.ones((n_nodes, components), dtype=bool)
    if held.size:
        strength, vectors = np.linalg.eigh(forbidden[held])
        bases[held], kept[held] = vectors, strength < 1e-9
    node, column = np.nonzero(kept)
    values = bases[node, :, column]
    rows = node[:, None] * components + np.arange(components)
    columns = np.broadcast_to(np.arange(len(node))[:, None], rows.shape)
    used = values != 0
    shape = (n_nodes * components, len(node))
    return sparse.csr_array((values[used], (rows[used], columns[used])), shape=shape)
