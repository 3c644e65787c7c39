"""What holds a boundary without clamping it: springs and dashpots per area, and the absorbing boundary.

With the traction t = -(k_n n n' + k_t (I - n n')) u - (d_n n n' + d_t (I - n n')) u' on a boundary, K and C gain

    integral of N' (k_n n n' + k_t (I - n n')) N dA,        integral of N' (d_n n n' + d_t (I - n n')) N dA
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from seatfem.structures.elements.ports import of_solids
from seatfem.structures.elements.shape_functions import Array, Discretization
from seatfem.structures.elements.surfaces import Surface, surface
from seatfem.structures.errors import ModelError
from seatfem.structures.materials import Solid

_MINDLIN = 0.82  # tangential over normal stiffness of a contact at nu = 0.3, 2 (1 - nu)/(2 - nu)


Densities = Sequence[tuple[Literal["K", "C"], Array, Array]]
"""What is added to K or C per area, along and across the normal, at the points (f, Q) of a patch."""


@dataclass(frozen=True)
class _Even:
    """The same all over ``boundary``: ``normal`` along its normal, ``tangential`` across it."""

    boundary: str
    normal: float
    tangential: float | None = 0.0

    def __post_init__(self) -> None:
        for name in ("normal", "tangential"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                kind = type(self).__name__
                raise ModelError(f"{kind}({self.boundary!r}): {name} = {value} must be finite and >= 0")

    def densities(self, patch: Surface, solids: Sequence[Solid], region: NDArray[np.int32]) -> Densities:
        """Return springs; see `Densities`."""
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

    def densities(self, patch: Surface, solids: Sequence[Solid], region: NDArray[np.int32]) -> Densities:
        """Return dashpots; see `Densities`."""
        return [("C", along, across) for _, along, across in super().densities(patch, solids, region)]


@dataclass(frozen=True)
class Absorbing:
    """Boundary where the mesh ends and the body does not: dashpots rho c_p along and rho c_s across the normal.

    Waves that arrive along the normal leave; others are reflected in part (Lysmer & Kuhlemeyer 1969). With ``centre``,
    the place [m] the waves come from, at the distance R, springs 4 mu/R along and 2 mu/R across the normal stand for
    the body beyond: the boundary is then right for slow motion too (Liu, Du, Du, Wang & Wu 2006).
    """

    boundary: str
    centre: tuple[float, float, float] | None = None

    def densities(self, patch: Surface, solids: Sequence[Solid], region: NDArray[np.int32]) -> Densities:
        """Return dashpots and, with a centre, springs; see `Densities`. Raises `ModelError` on a meridian, which has
        none."""
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


def support_matrices(
    made: Discretization, supports: Sequence[Support], solids: Sequence[Solid], region: NDArray[np.int32]
) -> dict[Literal["K", "C"], sparse.csr_array]:
    """Return what the supports add to "K" and "C", (3 n, 3 n) over all nodes; a key is absent where nothing is
    added."""
    patches = [surface(made, support.boundary, type(support).__name__) for support in supports]
    return spread_supports(supports, patches, solids, region, made.size)


def spread_supports(
    supports: Sequence[Support],
    patches: Sequence[Surface],
    solids: Sequence[Solid],
    region: NDArray[np.int32],
    n_nodes: int,
) -> dict[Literal["K", "C"], sparse.csr_array]:
    """Return the same as `support_matrices`, on the ``patches`` that belong to the supports."""
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
