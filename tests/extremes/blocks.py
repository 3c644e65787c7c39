"""Boxes of finite elements, and their static compliance."""

from typing import Any

import numpy as np
import skfem

from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import factorize


def box(size: tuple[float, float, float], cells: tuple[int, int, int], *, hexes: bool) -> Any:
    """Return a box with its underside "fixed", its top "contact", and its four sides."""
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, cells, strict=True)]
    mesh = (skfem.MeshHex if hexes else skfem.MeshTet).init_tensor(*axes)
    edge = [1e-9 * s for s in size]
    return mesh.with_boundaries(
        {
            "fixed": lambda x: x[2] < edge[2], "contact": lambda x: x[2] > size[2] - edge[2],
            "left": lambda x: x[0] < edge[0], "right": lambda x: x[0] > size[0] - edge[0],
            "front": lambda x: x[1] < edge[1], "back": lambda x: x[1] > size[1] - edge[1],
        }
    )  # fmt: skip


def compliance(model: SecondOrderModel) -> float:
    """Return the static displacement of the first port per unit force on it."""
    b = model.port_matrix[:, 0]
    return float(b @ factorize(model.K).solve(b))
