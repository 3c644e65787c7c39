"""Whether a material can make a solid of revolution."""

from __future__ import annotations

import math

import numpy as np

from seatfem.structures.errors import ModelError
from seatfem.structures.materials import Solid, stiffness_tensor


def check_revolved(solid: Solid) -> None:
    """Raise `ModelError` unless its stiffness stays the same when it is turned by an eighth or a quarter about z."""
    given = stiffness_tensor(solid.elasticity)
    for angle in (math.pi / 4, math.pi / 2):
        c, s = math.cos(angle), math.sin(angle)
        q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = np.einsum("ai,bj,ijkl,ck,dl->abcd", q, q, given, q, q, optimize=True)
        if (off := np.abs(turned - given).max() / np.abs(given).max()) > 1e-6:
            raise ModelError(
                f"material {solid.name!r}: its stiffness changes by {off:.1%} when it is turned by "
                f"{math.degrees(angle):g} degrees about z; an axisymmetric model needs E_1 = E_2, nu_13 = nu_23, "
                "G_13 = G_23 and G_12 = E_1/(2 (1 + nu_12)) with axis 3 along z: model the body in three dimensions"
            )
