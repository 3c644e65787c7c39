"""Number of threads that compiled code may use."""

from __future__ import annotations

import numba

from seatfem.machine.rates import cores


def threads() -> int:
    """Return the number of cores that this process may use, at most as many as `NUMBA_NUM_THREADS` allows."""
    return max(1, int(min(cores(), numba.config.NUMBA_NUM_THREADS)))  # type: ignore[attr-defined]
