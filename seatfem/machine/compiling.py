"""Time that compiling takes on a machine where the program runs for the first time."""

from __future__ import annotations

from typing import Final

from impact.march.loop.compiled import on_file
from impact.march.loop.marches import march_many, march_one
from seatfem.machine.rates import Machine

MARCHES: Final = (march_one, march_many)
"""Both with all that they call; a run needs either, the second for its error bars. Other loops take little."""
EACH: Final = 2.7  # time of its compilation over that of the program's start: 15.3 s both, with a start of 2.8 s


def compilation(rates: Machine) -> float:
    """Return the time to compile the marches that are not on file [s]."""
    return EACH * rates.start * sum(not on_file(march) for march in MARCHES)
