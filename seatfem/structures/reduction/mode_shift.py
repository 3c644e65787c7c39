"""Which eigenvalues round-off cannot tell from zero."""

from __future__ import annotations

from typing import Final

import numpy as np

from seatfem.structures.model import SecondOrderModel

_ZERO: Final = 10.0  # of eps max(K_ii/M_ii); free discs, h/a = 0.1 to 0.01, leave up to 0.02 in their rigid modes


def null_limit(model: SecondOrderModel) -> float:
    """Return w^2 [1/s^2] below which an eigenvalue is zero but for round-off, eps max(K_ii/M_ii) times 10.

    A thin body, its thickness h far below its radius a, has bending modes with w^2 of the order (h/a)^4 of the
    largest K_ii/M_ii: the limit must follow round-off, not the size of the elements.
    """
    return float(_ZERO * np.finfo(float).eps * np.max(model.K.diagonal() / model.M.diagonal()))
