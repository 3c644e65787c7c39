"""What is seen of a body's stress and motion at a few times."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from impact.greens.base import Array
from seatfem.structures.fields.recovery import StressField, field_of
from seatfem.structures.fields.response import Response
from seatfem.structures.model import SecondOrderModel


def in_frames(field: StressField, force: Array, dt: float, steps: range) -> Array:
    """Return the (F, P, 6) stress at all points of a field [Pa] at the ends of steps that are multiples of the range's
    own step.

    Memory holds the frames, and coordinates of one block of them.

    Args:
        field, force, dt: as in `seatfem.structures.fields.recovery.histories`.
        steps: their numbers, from 0 on.
    """
    assert steps.start % steps.step == 0
    kept: list[Array] = []
    behind = 0
    for part in field.coordinates(force[: steps[-1] + 1], dt, steps.step):
        kept.append(part[max(0, steps.start // steps.step - behind) :])
        behind += len(part)
    return np.asarray(np.tensordot(np.concatenate(kept), field.fields, axes=(1, 2)))


def unknowns_in_frames(model: SecondOrderModel, force: Array, dt: float, steps: range, **of_space: Any) -> Array:
    """Return the (F, n) unknowns of a model at the ends of steps, as `in_frames` gives stress: C of `solid_stress`
    times them is the stress then, by mode acceleration likewise.

    Args:
        model, of_space: as `Response.of` takes them.
        force, dt, steps: as in `in_frames`.
    """
    return response_in_frames(Response.of(model, dt=dt, **of_space), force, dt, steps)


def response_in_frames(response: Response, force: Array, dt: float, steps: range) -> Array:
    """Return (F, n) as `unknowns_in_frames`, of a body that responds."""
    size = len(response.rest)
    rows = -(-size // 6)  # a field has six numbers a point
    alike = sparse.eye_array(6 * rows, size, format="csr")
    field = field_of(response, sparse.csr_array(alike), np.zeros((rows, 1)))
    return in_frames(field, force, dt, steps).reshape(len(steps), -1)[:, :size]
