"""Compiled code on this computer: time of the first compilation, and number of threads."""

from typing import Final

import numba

from impact.march.loop.compiled import on_file
from impact.march.loop.marches import march_many, march_one
from seatfem.machine import rates
from seatfem.machine.resources import cores

MARCHES: Final = (march_one, march_many)
"""Compiled time integrations of one contact, for runs, and of many, for error bars. Other loops take little time."""
EACH: Final = 1.9  # time to compile one of them over that of the start: both took 10.7 s with a start of 2.8 s


def compilation() -> float:
    """Return the time to compile the time integrations that are not in the cache of compiled code [s]."""
    return EACH * rates.START * sum(not on_file(march) for march in MARCHES)


def threads() -> int:
    """Return the number of cores that this process may use, at most `NUMBA_NUM_THREADS`."""
    return max(1, int(min(cores(), numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]
