"""Threads of compiled code on this computer."""

import numba

from seatfem.machine.resources import cores


def threads() -> int:
    """Return the number of cores that this process may use, at most `NUMBA_NUM_THREADS`."""
    return max(1, int(min(cores(), numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]
