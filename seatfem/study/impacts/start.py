"""Check that a striker begins outside what it is to strike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

import impact
from seatfem.study.scene import Scene, SceneError
from seatfem.study.scene.problems import Problem

SLACK: Final = 1e-2  # of the largest deflection of its ports: what modes left out may be off by


def check_start(scene: Scene, striker: impact.Body, contacts: Sequence[impact.Contact]) -> None:
    """Raise `SceneError` for a striker that is bent into what it is to strike, where it is deepest: rigid contact would
    throw it out within one step. What yields, as a spring, may begin compressed."""
    if striker.state is None or striker.greens.modal is None:
        return
    bent = striker.greens.modal.shapes.T @ striker.state.displacement
    rigid = [contact for contact in contacts if isinstance(contact.law, impact.Signorini)]
    starts = [contact.side * float(bent[striker.greens.port_index(contact.striker_port)]) for contact in rigid]
    start, contact = min(zip(starts, rigid, strict=True), key=lambda each: each[0] + each[1].gap, default=(0.0, None))
    if contact is None or contact.gap + start >= -SLACK * float(np.abs(bent).max()):
        return
    seat = contact.side > 0
    key = "contact.gap" if seat else f"stopper.{'lift' if scene.stopper and scene.stopper.lift is not None else 'gap'}"
    words = (
        f"the opening is {1e6 * contact.gap:.4g} um where reed.release bends the reed by {-1e6 * start:.4g} um "
        f"towards the {'seat' if seat else 'stopper'}, so that it would begin inside it: add "
        f"{-1e6 * (contact.gap + start):.4g} um or more to {key}, or release the reed from another shape"
    )
    raise SceneError((Problem(None, 0, key, words, tuple(key.split("."))),))
