"""Other numbers of a body's own modes, and the share of what each changes that is left in a run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impact.bodies.body import Body
from impact.runs.variations import narrower, ringing_on
from seatfem.study.safety import BEYOND, FEW, FEWER, HALF, MANY, OF_MODES, UNEVEN


def with_other_modes(body: Body) -> Iterator[tuple[Body, float]]:
    """Yield a plate with other modes than its own, and the share of what each changes that is left in a run.

    First without its highest modes, as `OF_MODES` says. These tell how the next ones go on if the modes that the
    contact feels lie evenly. A ring all around feels few, those that are alike there: where it yields more beyond the
    last mode than by the highest ones, over `UNEVEN`, all that lies beyond may be one mode, at each of `BEYOND`; where
    none can be left out, this alone tells, and counts twice.
    """
    modal = body.greens.modal
    beyond, with_highest = (0.0 if modal is None else float(np.trace(modal.residual.static()))), 0.0
    for ratio, share in OF_MODES:
        if (fewer := narrower(body, ratio)) is not None and fewer.greens.modal is not None:
            with_highest = float(np.trace(fewer.greens.modal.residual.static()))
            yield fewer, share
    if beyond > UNEVEN * (with_highest - beyond):
        for ratio in BEYOND:
            if (ringing := ringing_on(body, ratio)) is not None:
                yield ringing, 1.0 if with_highest else 2.0


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Return the numbers of reed modes to compare ``n_modes`` with, and how much of each change is left in it."""
    less = ((max(1, round(n_modes / FEWER)), 1.0), (max(1, round(n_modes / HALF)), 1 / 2))
    more = ((MANY, 1.0),) if n_modes < FEW else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)
