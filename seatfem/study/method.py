"""How a scene is computed: what a plan chooses and a run carries out. The scene itself is what is asked."""

from __future__ import annotations

from dataclasses import dataclass

from seatfem.structures.method import Method


@dataclass(frozen=True)
class RunMethod:
    """How one impact is computed.

    Attributes:
        seat, reed: the struck body and the striker.
        time_step: [s]; ``None``: from the highest rates of both bodies and the filter.
    """

    seat: Method
    reed: Method
    time_step: float | None = None
