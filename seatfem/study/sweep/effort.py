"""Limits on what the scenes of a study may take; without what runs them, for a quick start of a command line."""

from __future__ import annotations

from dataclasses import dataclass

from seatfem.study.safety import MOST_ROUNDS


@dataclass(frozen=True)
class Effort:
    """Limits on what a study may take.

    Attributes:
        workers: processes; ``None``: one a core, as far as the memory does.
        rounds: of refinement of each scene, at most.
        limit: seconds of the clock for one scene.
        retry: whether scenes that have no numbers in the journal are tried again.
        cluster: address of a scheduler of dask, whose workers take the place of processes here.
    """

    workers: int | None = None
    rounds: int = MOST_ROUNDS
    limit: float = 3600.0
    retry: bool = False
    cluster: str | None = None


USUAL = Effort()
