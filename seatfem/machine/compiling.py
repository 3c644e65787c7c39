"""Compiled code on this machine: the time that compiling takes at first, and the threads that it may use."""

from typing import Final

import numba

from impact.march.loop.compiled import on_file
from impact.march.loop.marches import march_many, march_one
from seatfem.machine.resources import Machine, cores

MARCHES: Final = (march_one, march_many)
"""Compiled marches, of one and of many contacts: a run needs one, error bars the second. Other loops take little."""
EACH: Final = 1.9  # time to compile one of them over that of the start: 10.7 s both, with a start of 2.8 s


def compilation(rates: Machine) -> float:
    """Return the time to compile the marches that are not on file [s]."""
    return EACH * rates.start * sum(not on_file(march) for march in MARCHES)


def threads() -> int:
    """Return the number of cores that this process may use, at most as many as `NUMBA_NUM_THREADS` allows."""
    return max(1, int(min(cores(), numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]
