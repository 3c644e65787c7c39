"""What holds a boundary without clamping it: springs and dashpots per area, and the absorbing boundary.

With the traction t = -(k_n n n' + k_t (I - n n')) u - (d_n n n' + d_t (I - n n')) u' on a boundary, K and C gain

    integral of N' (k_n n n' + k_t (I - n n')) N dA,        integral of N' (d_n n n' + d_t (I - n n')) N dA
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements.shape_functions import Array, Discretization
from seatfem.structures.elements.surfaces import Surface, surface
from seatfem.structures.errors import ModelError
from seatfem.structures.materials import Solid

_MINDLIN = 0.82  # tangential over normal stiffness of a contact at nu = 0.3, 2 (1 - nu)/(2 - nu)


@dataclass(frozen=True)
class Foundation:
    """Elastic foundation (Winkler): stiffness per area [N/m^3] along and across the normal of ``boundary``."""

    boundary: str
    normal: float
    tangential: float = 0.0

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class Bolted:
    """A bolted face: contact stiffness per area [N/m^3]; across the normal 0.82 of it (Mindlin 1949) unless given."""

    boundary: str
    normal: float
    tangential: float | None = None

    def __post_init__(self) -> None:
        if self.tangential is None:
            object.__setattr__(self, "tangential", _MINDLIN * self.normal)
        _check(self)


@dataclass(frozen=True)
class Dashpot:
    """Viscous support [N s/m^3] along and across the normal of ``boundary``."""

    boundary: str
    normal: float
    tangential: float = 0.0

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class Absorbing:
    """Where the mesh ends and the body does not: dashpots rho c_p along and rho c_s across the normal.

    Waves that arrive along the normal leave; others are reflected in part (Lysmer & Kuhlemeyer 1969). With ``centre``,
    the place [m] the waves come from, at the distance R, springs 4 mu/R along and 2 mu/R across the normal stand for
    the body beyond: the boundary is then right for slow motion too (Liu, Du, Du, Wang & Wu 2006).
    """

    boundary: str
    centre: tuple[float, float, float] | None = None


Support = Foundation | Bolted | Dashpot | Absorbing


def _check(support: Foundation | Bolted | Dashpot) -> None:
    for field in fields(support)[1:]:
        value = getattr(support, field.name)
        if not (np.isfinite(value) and value >= 0):
            kind = type(support).__name__
            raise ModelError(f"{kind}({support.boundary!r}): {field.name} = {value} must be finite and >= 0")


def support_matrices(
    made: Discretization, supports: Sequence[Support], solids: Sequence[Solid], region: NDArray[np.int32]
) -> Mapping[str, sparse.csr_array]:
    """What the supports add to "K" and "C", (3 n, 3 n) over all nodes; a key is absent where nothing is added."""
    patches = [surface(made, support.boundary, type(support).__name__) for support in supports]
    return spread_supports(supports, patches, solids, region, made.size)


def spread_supports(
    supports: Sequence[Support],
    patches: Sequence[Surface],
    solids: Sequence[Solid],
    region: NDArray[np.int32],
    n_nodes: int,
) -> Mapping[str, sparse.csr_array]:
    """As `support_matrices`, on the ``patches`` that belong to the supports."""
    sums: dict[str, sparse.csr_array] = {}
    for support, patch in zip(supports, patches, strict=True):
        for target, along, across in _densities(support, patch, solids, region):
            matrix = _spread(patch, along, across, 3 * n_nodes)
            sums[target] = sums[target] + matrix if target in sums else matrix
    return sums


def total(one: sparse.csr_array | None, other: sparse.csr_array | None) -> sparse.csr_array | None:
    """The sum of what there is."""
    return other if one is None else one if other is None else sparse.csr_array(one + other)


def acts(matrix: sparse.csr_array | None) -> bool:
    """Whether it is there, and not of zeros alone."""
    return matrix is not None and bool(matrix.count_nonzero())


def _densities(
    support: Support, patch: Surface, solids: Sequence[Solid], region: NDArray[np.int32]
) -> list[tuple[str, Array, Array]]:
    """What is added to K or C per area, along and across the normal, at the points (f, Q) of the patch."""
    if isinstance(support, Absorbing):
        return _absorbing(support, patch, solids, region)
    target = "C" if isinstance(support, Dashpot) else "K"
    one = np.ones(patch.weights.shape)
    return [(target, support.normal * one, (support.tangential or 0.0) * one)]


def _absorbing(
    support: Absorbing, patch: Surface, solids: Sequence[Solid], region: NDArray[np.int32]
) -> list[tuple[str, Array, Array]]:
    along, across = np.empty(patch.weights.shape), np.empty(patch.weights.shape)
    rigidity = np.empty(patch.weights.shape)
    for k, solid in enumerate(solids):
        of = region[patch.elements] == k
        along[of] = solid.density * solid.c_p_along(patch.normals[of])
        across[of] = solid.density * solid.c_s
        rigidity[of] = solid.density * solid.c_s**2
    dashpots = ("C", along, across)
    if support.centre is None:
        return [dashpots]
    if patch.places is None:
        raise ModelError(f"Absorbing({support.boundary!r}): centre serves solid models only; leave it out")
    spring = rigidity / np.linalg.norm(patch.places - np.asarray(support.centre), axis=-1)
    return [dashpots, ("K", 4 * spring, 2 * spring)]


def _spread(patch: Surface, along: Array, across: Array, size: int) -> sparse.csr_array:
    """The integral of N' (along n n' + across (I - n n')) N over the patch."""
    n = patch.normals
    tensor = across[..., None, None] * np.eye(3) + ((along - across)[..., None] * n)[..., None] * n[..., None, :]
    tensor *= patch.weights[..., None, None]
    blocks = np.einsum("fqi,fqj,fqab->fiajb", patch.shapes, patch.shapes, tensor, optimize=True)
    unknowns = (3 * patch.cells[:, :, None].astype(np.int64) + np.arange(3)).reshape(len(patch.cells), -1)
    width = unknowns.shape[1]
    rows, columns = np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, (1, width)).ravel()
    matrix = sparse.csr_array((blocks.ravel(), (rows, columns)), shape=(size, size))
    return sparse.csr_array((matrix + matrix.T) / 2)  # symmetric to the last bit
