"""Supports of a body, and the second-order model by its matrices, damping and supports, for all solid models.

At each node the forbidden directions span a space; the unknowns are the displacements along an orthonormal basis of its
complement, so that K -> T'KT keeps symmetry and T'MT keeps a nodal mass diagonal. With the traction
t = -(k_n n n' + k_t (I - n n')) u - (d_n n n' + d_t (I - n n')) u' on a boundary, K and C gain

    integral of N' (k_n n n' + k_t (I - n n')) N dA,        integral of N' (d_n n n' + d_t (I - n n')) N dA
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures import materials, model
from seatfem.structures.elements.ports import of_solids
from seatfem.structures.elements.shape_functions import Array, Discretization, Surface, surface
from seatfem.structures.errors import ModelError

Constraint = tuple[NDArray[np.integer], Array]
"""Nodes, and the (3,) direction in which their displacement is zero."""
_ALIGNED = 1e-6  # largest 1 - cos of the angle between normals, or between a normal and the axis that replaces it
_FREE = 1e-9  # eigenvalue of the sum of d d' over held unit directions d below which a direction is free


@dataclass(frozen=True)
class Freedom:
    """Unknowns after constraints on the three displacements of each node.

    Attributes:
        displacements: (3 n, n_free) T with orthonormal columns: displacements = T unknowns.
        free: (n_free,) 3 node + component of each unknown; 3 node + a counter for unknowns oblique to the axes.
    """

    displacements: sparse.csr_array
    free: NDArray[np.int64]

    @cached_property
    def base(self) -> NDArray[np.int64]:
        """Return (n_base,) numbers 3 node + component of the displacements that are not zero: they are assembled."""
        return np.flatnonzero(np.diff(self.displacements.indptr))

    @cached_property
    def unknown(self) -> NDArray[np.int32]:
        """Return the (n, 3) number of each displacement among those assembled, -1 if it is held."""
        numbers = np.full(self.displacements.shape[0], -1, dtype=np.int32)
        numbers[self.base] = np.arange(len(self.base))
        return numbers.reshape(-1, 3)

    @cached_property
    def turn(self) -> sparse.csr_array | None:
        """Return the (n_base, n_free) map from unknowns to assembled displacements, ``None`` if they are the same."""
        return None if np.array_equal(self.base, self.free) else sparse.csr_array(self.displacements[self.base])

    def turned(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Return a matrix of the assembled displacements transformed to the unknowns."""
        if self.turn is None:
            return matrix
        product = (self.turn.T @ matrix @ self.turn).tocsr()
        return sparse.csr_array((product + product.T) / 2)


def freedom(n_nodes: int, constraints: Iterable[Constraint]) -> Freedom:
    """Return the unknowns under constraints; a node held along coordinate axes has the other axes as unknowns."""
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
    """Yield nodes and held directions of clamped faces, and of planes without normal or without tangential motion.

    Raises:
        ModelError: a boundary that is missing or empty, or not plane although sliding or antisymmetric.
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
    """Return (3, 3) rows: the normal of a plane, or the axis to which it is close, and two directions in the plane."""
    n = normals[0] / np.linalg.norm(normals[0])
    if (off := 1 - np.abs(normals @ n).min()) > _ALIGNED:
        raise ModelError(f"{what} must be plane (its normal turns by {np.degrees(np.arccos(1 - off)):.2g} degrees)")
    axis = int(np.argmax(np.abs(n)))
    if 1 - abs(n[axis]) <= _ALIGNED:
        return np.roll(np.eye(3), -axis, axis=0)
    across = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    across /= np.linalg.norm(across)
    return np.stack([n, across, np.cross(n, across)])


_MINDLIN = 0.82  # ratio of tangential to normal contact stiffness at nu = 0.3, 2 (1 - nu)/(2 - nu)


Densities = Sequence[tuple[Literal["K", "C"], Array, Array]]
"""Stiffness (K) or damping (C) per area, along and across the normal, at the points (f, Q) of a patch."""


@dataclass(frozen=True)
class _Even:
    """Base of supports with uniform values: ``normal`` along the normal of ``boundary``, ``tangential`` across it."""

    boundary: str
    normal: float
    tangential: float | None = 0.0

    def __post_init__(self) -> None:
        for name in ("normal", "tangential"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                kind = type(self).__name__
                raise ModelError(f"{kind}({self.boundary!r}): {name} = {value} must be finite and >= 0")

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return the spring stiffness per area."""
        one = np.ones(patch.weights.shape)
        return [("K", self.normal * one, (self.tangential or 0.0) * one)]


@dataclass(frozen=True)
class Foundation(_Even):
    """Elastic foundation (Winkler): stiffness per area [N/m^3] along and across the normal of ``boundary``."""


@dataclass(frozen=True)
class Bolted(_Even):
    """A bolted face: contact stiffness per area [N/m^3]; across the normal 0.82 of it (Mindlin 1949) unless given."""

    tangential: float | None = None

    def __post_init__(self) -> None:
        if self.tangential is None:
            object.__setattr__(self, "tangential", _MINDLIN * self.normal)
        super().__post_init__()


@dataclass(frozen=True)
class Dashpot(_Even):
    """Viscous support [N s/m^3] along and across the normal of ``boundary``."""

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return the damping per area."""
        return [("C", along, across) for _, along, across in super().densities(patch, solids, region)]


@dataclass(frozen=True)
class Absorbing:
    """Boundary through which waves leave into the rest of the body: dashpots rho c_p along, rho c_s across the normal.

    Waves that arrive along the normal leave; others are reflected in part (Lysmer & Kuhlemeyer 1969). With ``centre``,
    the place [m] the waves come from, at the distance R, springs 4 mu/R along and 2 mu/R across the normal stand for
    the body beyond: the boundary is then right for slow motion too (Liu, Du, Du, Wang & Wu 2006).
    """

    boundary: str
    centre: tuple[float, float, float] | None = None

    def densities(self, patch: Surface, solids: Sequence[materials.Solid], region: NDArray[np.int32]) -> Densities:
        """Return dashpots and, with a centre, springs; `ModelError` on a meridian, which has no centre."""
        along = of_solids(patch, solids, region, lambda solid, normals: solid.density * solid.c_p_along(normals))
        across = of_solids(patch, solids, region, lambda solid, normals: solid.density * solid.c_s)
        if self.centre is None:
            return [("C", along, across)]
        if patch.places.shape[-1] != len(self.centre):
            raise ModelError(f"Absorbing({self.boundary!r}): centre serves solid models only; leave it out")
        rigidity = of_solids(patch, solids, region, lambda solid, normals: solid.density * solid.c_s**2)
        spring = rigidity / np.linalg.norm(patch.places - np.asarray(self.centre), axis=-1)
        return [("C", along, across), ("K", 4 * spring, 2 * spring)]


Support = Foundation | Bolted | Dashpot | Absorbing


def spread_supports(
    supports: Sequence[Support],
    patches: Sequence[Surface],
    solids: Sequence[materials.Solid],
    region: NDArray[np.int32],
    n_nodes: int,
) -> dict[Literal["K", "C"], sparse.csr_array]:
    """Return the matrices (3 n, 3 n) that supports on their ``patches`` add to "K" and "C"; no key if they add none."""
    sums: dict[Literal["K", "C"], sparse.csr_array] = {}
    for support, patch in zip(supports, patches, strict=True):
        for target, along, across in support.densities(patch, solids, region):
            matrix = _spread(patch, along, across, 3 * n_nodes)
            sums[target] = sums[target] + matrix if target in sums else matrix
    return sums


def _spread(patch: Surface, along: Array, across: Array, size: int) -> sparse.csr_array:
    """Return the integral of N' (along n n' + across (I - n n')) N over the patch."""
    n = patch.normals
    tensor = across[..., None, None] * np.eye(3) + ((along - across)[..., None] * n)[..., None] * n[..., None, :]
    tensor *= patch.weights[..., None, None]
    blocks = np.einsum("fqi,fqj,fqab->fiajb", patch.shapes, patch.shapes, tensor, optimize=True)
    unknowns = (3 * patch.cells[:, :, None].astype(np.int64) + np.arange(3)).reshape(len(patch.cells), -1)
    width = unknowns.shape[1]
    rows, columns = np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, (1, width)).ravel()
    matrix = sparse.csr_array((blocks.ravel(), (rows, columns)), shape=(size, size))
    return sparse.csr_array((matrix + matrix.T) / 2)  # symmetric to the last bit


Matrices = Callable[[Array], tuple[sparse.csr_array, sparse.csr_array]]
"""Function to (K, M) of a body, with stiffness and density of each region scaled by its row of (regions, 2) factors."""


def whole_model(
    matrices: Matrices,
    solids: Sequence[materials.Solid],
    rayleigh: tuple[float, float] | None,
    supports: Mapping[Literal["K", "C"], sparse.csr_array],
    ports: Mapping[str, model.Port],
    dofs: model.DofMap,
    copies: int = 1,
) -> model.SecondOrderModel:
    """Return M, K, C = sum of alpha_r M_r + beta_r K_r and H = sum of eta_r K_r over regions r, with supports.

    Args:
        matrices: function to K and M of the body, in its unknowns.
        solids: materials of the regions.
        rayleigh: (alpha [1/s], beta [s]) of all regions, in addition to their own.
        supports: matrices that supports add to K and C, in the unknowns; absent keys add nothing.
        copies: number of equal sectors; all matrices are multiplied by it.
    """
    pairs = np.array([solid.rayleigh for solid in solids]) + np.array(rayleigh or (0.0, 0.0))
    losses = np.array([solid.loss_factor for solid in solids])
    K, M = matrices(np.ones_like(pairs))
    C = H = None
    if np.ptp(pairs, axis=0).any():
        of_stiffness, of_mass = matrices(pairs[:, ::-1])
        C = of_mass + of_stiffness
    elif pairs.any():
        C = pairs[0, 0] * M + pairs[0, 1] * K
    if np.ptp(losses):
        H = matrices(np.stack([losses, np.zeros_like(losses)], axis=1))[0]
    elif losses.any():
        H = losses[0] * K
    if "K" in supports:
        K = K + supports["K"]
    if "C" in supports:
        C = supports["C"] if C is None else C + supports["C"]
    if copies > 1:
        M, K = M * copies, K * copies
        C, H = (None if matrix is None else matrix * copies for matrix in (C, H))
    springs, dashpots = (key in supports and bool(supports[key].count_nonzero()) for key in ("K", "C"))
    known = model.Damping.of_regions(pairs, losses, H, springs=springs, dashpots=dashpots)
    return model.SecondOrderModel(M, C, K, ports, dofs, H, known)
