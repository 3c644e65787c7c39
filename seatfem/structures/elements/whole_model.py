"""The second-order model of a body from the matrices of its regions: damping and supports, in every model alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from scipy import sparse

from seatfem.structures.damping import Damping
from seatfem.structures.materials import Solid
from seatfem.structures.model import Array, DofMap, Port, SecondOrderModel

Matrices = Callable[[Array], tuple[sparse.csr_array, sparse.csr_array]]
"""(K, M) of a body, each region's stiffness and density times its row of the argument (regions, 2)."""


def whole_model(
    matrices: Matrices,
    solids: Sequence[Solid],
    rayleigh: tuple[float, float] | None,
    supports: Mapping[Literal["K", "C"], sparse.csr_array],
    ports: Mapping[str, Port],
    dofs: DofMap,
    copies: int = 1,
) -> SecondOrderModel:
    """Return M, K, C = sum of alpha_r M_r + beta_r K_r and H = sum of eta_r K_r over the regions r, and what supports
    add.

    Args:
        matrices: of the body, in its unknowns.
        solids: of the regions.
        rayleigh: (alpha [1/s], beta [s]) of all regions, on top of their own.
        supports: what they add to K and C, in the unknowns; a key is absent where nothing is added.
        copies: how often the body is repeated: all matrices are times as large.
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
    known = Damping.of_regions(pairs, losses, H, springs=springs, dashpots=dashpots)
    return SecondOrderModel(M, C, K, ports, dofs, H, known)
