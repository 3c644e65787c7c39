"""Which displacements are held: clamped faces, and planes on which only one part of the motion is free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements.shape_functions import Array, Discretization
from seatfem.structures.elements.surfaces import Surface, surface
from seatfem.structures.errors import ModelError

_ALIGNED = 1e-6  # a unit normal this close to an axis is that axis
_FREE = 1e-9  # least eigenvalue of the sum of d d' over held directions d that counts as held


@dataclass(frozen=True)
class Freedom:
    """The unknowns left.

    Attributes:
        unknown: (n, 3) number of each Cartesian component that is assembled, -1 where held.
        free: (n_free,) 3 node + component of each unknown; nodes on oblique planes count their own free directions.
        base: (n_base,) 3 node + component of each assembled component.
        turn: (n_base, n_free) from the unknowns to the assembled components, ``None`` where they are the same.
    """

    unknown: NDArray[np.int32]
    free: NDArray[np.int64]
    base: NDArray[np.int64]
    turn: sparse.csr_array | None

    def turned(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A matrix over the assembled components, in the unknowns."""
        if self.turn is None:
            return matrix
        product = (self.turn.T @ matrix @ self.turn).tocsr()
        return sparse.csr_array((product + product.T) / 2)

    def vector(self, values: Array) -> Array:
        """A (3 n,) vector of all components, in the unknowns."""
        some = values[self.base]
        return some if self.turn is None else np.asarray(self.turn.T @ some)

    def restricted(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A (3 n, 3 n) matrix of all components, in the unknowns."""
        return self.turned(sparse.csr_array(matrix[self.base][:, self.base]))

    def displacements(self) -> sparse.csr_array | None:
        """(3 n, n_free) Cartesian displacements of the unknowns, ``None`` where unknowns are Cartesian."""
        if self.turn is None:
            return None
        size = self.unknown.size
        spread = sparse.csr_array(
            (np.ones(len(self.base)), (self.base, np.arange(len(self.base)))), (size, len(self.base))
        )
        return sparse.csr_array(spread @ self.turn)


def freedom(
    made: Discretization, fixed: Sequence[str], sliding: Sequence[str], antisymmetric: Sequence[str]
) -> Freedom:
    """Unknowns of a body clamped on ``fixed``, without normal (``sliding``) or tangential (``antisymmetric``) motion.

    Raises:
        ModelError: a boundary that is missing, empty or, for the latter two, not plane; nothing left to move.
    """
    held = np.zeros((made.size, 3), dtype=bool)
    for name in fixed:
        held[surface(made, name, "fixed").nodes] = True
    against = np.zeros((made.size, 3, 3))  # sum of d d' over held oblique directions d
    for role, group in (("sliding", sliding), ("antisymmetric", antisymmetric)):
        for name in group:
            _hold_plane(surface(made, name, role), role, name, held, against)
    oblique = np.flatnonzero(np.any(against, axis=(1, 2)) & ~held.all(axis=1))
    kept = ~held
    kept[oblique] = True
    base = np.flatnonzero(kept.ravel())
    if base.size == 0:
        raise ModelError(f"fixed: {', '.join(fixed)} hold every node: nothing is left to move; mesh finer")
    unknown = np.full(kept.size, -1, dtype=np.int32)
    unknown[base] = np.arange(len(base))
    if not oblique.size:
        return Freedom(unknown.reshape(-1, 3), base, base, None)
    directions = against[oblique] + held[oblique, :, None] * np.eye(3)
    return _turned(unknown.reshape(-1, 3), base, oblique, directions)


def _hold_plane(plane: Surface, role: str, name: str, held: NDArray[np.bool_], against: Array) -> None:
    normals = plane.normals.reshape(-1, 3)
    n = normals[0] / np.linalg.norm(normals[0])
    if (off := 1 - np.abs(normals @ n).min()) > _ALIGNED:
        raise ModelError(
            f"{role}: boundary {name!r} is not plane (its normal turns by {np.degrees(np.arccos(1 - off)):.2g} degrees)"
        )
    axis = int(np.argmax(np.abs(n)))
    if 1 - abs(n[axis]) <= _ALIGNED:
        axes = [axis] if role == "sliding" else [a for a in range(3) if a != axis]
        held[plane.nodes[:, None], axes] = True
    else:
        against[plane.nodes] += np.outer(n, n) if role == "sliding" else np.eye(3) - np.outer(n, n)


def _turned(unknown: NDArray[np.int32], base: NDArray[np.int64], oblique: NDArray[np.int64], held: Array) -> Freedom:
    """Unknowns along the eigenvectors of ``held`` (k, 3, 3) that no held direction has a part in."""
    values, vectors = np.linalg.eigh(held)
    loose = values < _FREE * values[:, -1:]
    cartesian = np.ones(unknown.shape, dtype=bool)
    cartesian[oblique] = False
    straight = base[cartesian.ravel()[base]]
    node, which = np.nonzero(loose)
    free = np.sort(np.concatenate([straight, 3 * oblique[node] + which]))
    place = {"straight": np.searchsorted(free, straight), "turned": np.searchsorted(free, 3 * oblique[node] + which)}
    rows = np.concatenate([unknown.ravel()[straight], unknown[oblique[node]].ravel()])
    columns = np.concatenate([place["straight"], np.repeat(place["turned"], 3)])
    entries = np.concatenate([np.ones(len(straight)), vectors[node, :, which].ravel()])
    turn = sparse.csr_array((entries, (rows, columns)), shape=(len(base), len(free)))
    return Freedom(unknown, free, base, turn)
