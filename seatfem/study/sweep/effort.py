"""Limits on the computing effort of a study."""

from dataclasses import dataclass
from typing import Final

from seatfem.study.safety import MOST_ROUNDS


@dataclass(frozen=True)
class Effort:
    """Limits on the computing effort of a study.

    Attributes:
        workers: number of processes; ``None``: one per core, as far as the memory allows.
        rounds: most rounds of refinement of each scene.
        limit: wall time of one scene [s].
        retry: whether scenes without results in the journal are tried again.
        cluster: address of a dask scheduler, whose workers replace local processes; "": none.
    """

    workers: int | None = None
    rounds: int = MOST_ROUNDS
    limit: float = 3600.0
    retry: bool = False
    cluster: str = ""


USUAL: Final = Effort()
