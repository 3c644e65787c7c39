"""How long a damped kernel remembers: what was forgotten need not be right."""

from __future__ import annotations

import math
from typing import Final

LEFT: Final = 1e-3  # of a motion that counts as forgotten
LOWEST: Final = 0.1  # of the band: the lowest frequency of interest; every reduction finds slower motions first


def memory(damping_ratio: float, bandwidth: float) -> float:
    """Return after how long uniform damping has forgotten the tail of the band, ln(1000)/(zeta 2 pi 0.1 bandwidth) [s].

    A thousandth of the motion at its lowest frequency of interest is left then. Without damping: never, ``inf``.
    """
    if damping_ratio <= 0:
        return math.inf
    return -math.log(LEFT) / (damping_ratio * 2 * math.pi * LOWEST * bandwidth)
