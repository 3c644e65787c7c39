"""Modes of plates that the line y = 0 mirrors: each even or odd to the last digit."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.model import DofMap, SecondOrderModel
from seatfem.structures.reduction.modes import Modes

SIGNS: Final = (1.0, 1.0, -1.0)  # of w, a_x and a_y = dw/dy in the image of an even motion
ALMOST: Final = 1e-8  # 1 - |parity|: a mode nearer to even or odd is that but for the solver's error


def with_parity(modes: Modes, model: SecondOrderModel, points: Array) -> Modes:
    """Return the modes without what the solver's error leaves of the other parity, (y + p P y)/2, p = sign of y'M P y.

    P takes a motion to its image. Rigid modes, any mixture of which is one, are first turned into even and odd ones.
    Other modes of both parities, as pairs of equal frequency may be, stay as they are, and so do all on a mesh that is
    not its own image.

    Args:
        modes: of ``model``, a plate's.
        model: three unknowns a node.
        points: (n, 2) of its nodes.
    """
    image = points * (1, -1)
    order, image_order = (np.lexsort(each.T) for each in (points, image))
    dofs = model.dofs
    if not np.array_equal(points[order], image[image_order]) or not isinstance(dofs, DofMap):
        return modes
    node = np.empty_like(order)
    node[order] = image_order
    free = dofs.free

    def image_of(shapes: Array) -> Array:
        full = np.zeros((3 * len(points), shapes.shape[1]))
        full[free] = shapes
        seen = full.reshape(len(points), 3, -1)[node] * np.array(SIGNS)[:, None]
        return np.asarray(seen.reshape(full.shape)[free])

    shapes, rigid = modes.shapes.copy(), modes.omega == 0
    if np.any(rigid):
        _, turns = np.linalg.eigh(shapes[:, rigid].T @ (model.M @ image_of(shapes[:, rigid])))
        shapes[:, rigid] = shapes[:, rigid] @ turns
    seen = image_of(shapes)
    parity = np.sum(shapes * (model.M @ seen), axis=0)
    pure = np.where(np.abs(parity) > 1 - ALMOST, np.sign(parity), 0.0)
    shapes = np.where(pure == 0, shapes, (shapes + pure * seen) / 2)
    return replace(modes, shapes=shapes / np.sqrt(np.sum(shapes * (model.M @ shapes), axis=0)))
