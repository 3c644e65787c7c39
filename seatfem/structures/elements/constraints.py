"""Which displacements are held, in every model alike, and the unknowns that remain.

At each node the forbidden directions span a space; the unknowns are the displacements along an orthonormal basis of its
complement, so that K -> T'KT keeps symmetry and T'MT keeps a nodal mass diagonal.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements.shape_functions import Array, Discretization
from seatfem.structures.elements.surfaces import surface
from seatfem.structures.errors import ModelError

Constraint = tuple[NDArray[np.integer], Array]
"""Nodes, and the (3,) direction in which none of them may move."""
_ALIGNED = 1e-6  # a unit normal this close to an axis is that axis
_FREE = 1e-9  # least eigenvalue of the sum of d d' over held unit directions d that counts as held


@dataclass(frozen=True)
class Freedom:
    """The unknowns left of three displacements a node.

    Attributes:
        displacements: (3 n, n_free) T with orthonormal columns: displacements = T unknowns.
        free: (n_free,) 3 node + component of each unknown; nodes whose unknowns are turned count them instead.
    """

    displacements: sparse.csr_array
    free: NDArray[np.int64]

    @cached_property
    def base(self) -> NDArray[np.int64]:
        """Return the (n_base,) numbers 3 node + component of the displacements that move at all: those that are
        assembled."""
        return np.flatnonzero(np.diff(self.displacements.indptr))

    @cached_property
    def unknown(self) -> NDArray[np.int32]:
        """Return the (n, 3) number of each displacement among those assembled, -1 where held."""
        numbers = np.full(self.displacements.shape[0], -1, dtype=np.int32)
        numbers[self.base] = np.arange(len(self.base))
        return numbers.reshape(-1, 3)

    @cached_property
    def turn(self) -> sparse.csr_array | None:
        """Return the (n_base, n_free) matrix from the unknowns to the displacements assembled, ``None`` where they are
        the same."""
        return None if np.array_equal(self.base, self.free) else sparse.csr_array(self.displacements[self.base])

    def turned(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Return a matrix over the displacements assembled, in the unknowns."""
        if self.turn is None:
            return matrix
        product = (self.turn.T @ matrix @ self.turn).tocsr()
        return sparse.csr_array((product + product.T) / 2)

    def vector(self, values: Array) -> Array:
        """Return a (3 n,) vector of all displacements, in the unknowns."""
        return np.asarray(self.displacements.T @ values)

    def restricted(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Return a (3 n, 3 n) matrix of all displacements, in the unknowns."""
        return self.turned(sparse.csr_array(matrix[self.base][:, self.base]))


def freedom(n_nodes: int, constraints: Iterable[Constraint]) -> Freedom:
    """Return unknowns that constraints leave. A node whose held directions are axes keeps the other axes, in order."""
    forbidden = np.zeros((n_nodes, 3, 3))
    for nodes, direction in constraints:
        unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        forbidden[nodes] += np.outer(unit, unit)
    axes = np.eye(3, dtype=bool)
    strength, bases = forbidden[:, axes], np.broadcast_to(np.eye(3), forbidden.shape).copy()
    oblique = np.flatnonzero(np.any(forbidden[:, ~axes], axis=1))
    if oblique.size:
        strength[oblique], bases[oblique] = np.linalg.eigh(forbidden[oblique])
    node, column = np.nonzero(strength < _FREE)
    values, rows = bases[node, :, column], 3 * node[:, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(len(node))[:, None], rows.shape)
    used = values != 0
    shape = (3 * n_nodes, len(node))
    turned = sparse.csr_array((values[used], (rows[used], columns[used])), shape=shape)
    return Freedom(turned, 3 * node + column)


def held(
    made: Discretization, fixed: Sequence[str], sliding: Sequence[str], antisymmetric: Sequence[str]
) -> Iterator[Constraint]:
    """Yield what is held of faces clamped (``fixed``), planes without normal (``sliding``) or tangential
    (``antisymmetric``) motion.

    Raises:
        ModelError: a boundary that is missing, empty or, for the latter two, not plane.
    """
    for name in fixed:
        nodes = surface(made, name, "fixed").nodes
        yield from ((nodes, axis) for axis in np.eye(3))
    for role, group in (("sliding", sliding), ("antisymmetric", antisymmetric)):
        for name in group:
            plane = surface(made, name, role)
            normal, *along = _frame(plane.normals.reshape(-1, 3), f"{role}: boundary {name!r}")
            yield from ((plane.nodes, axis) for axis in ([normal] if role == "sliding" else along))


def _frame(normals: Array, what: str) -> Array:
    """Return (3, 3) rows: the one normal of a plane, an axis where it is close to one, and two directions across it."""
    n = normals[0] / np.linalg.norm(normals[0])
    if (off := 1 - np.abs(normals @ n).min()) > _ALIGNED:
        raise ModelError(f"{what} must be plane (its normal turns by {np.degrees(np.arccos(1 - off)):.2g} degrees)")
    axis = int(np.argmax(np.abs(n)))
    if 1 - abs(n[axis]) <= _ALIGNED:
        return np.roll(np.eye(3), -axis, axis=0)
    across = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    across /= np.linalg.norm(across)
    return np.stack([n, across, np.cross(n, across)])
