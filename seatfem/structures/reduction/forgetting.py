"""How long a reduced function must be right, and how long it is."""

from __future__ import annotations

import math
from typing import Final

LEFT: Final = 1e-3  # of a motion that counts as forgotten
LOWEST: Final = 0.1  # of the band: the lowest frequency of interest; slower motions are the first that any road finds


def memory(damping_ratio: float, bandwidth: float) -> float:
    """After how long uniform damping has forgotten the tail of the band, ln(1000)/(zeta 2 pi 0.1 bandwidth) [s].

    A thousandth is left of its lowest frequency of interest then. Without damping: never.
    """
    if damping_ratio <= 0:
        return math.inf
    return -math.log(LEFT) / (damping_ratio * 2 * math.pi * LOWEST * bandwidth)


def valid_for(method: str, damping_ratio: float, bandwidth: float, duration: float) -> float:
    """Until when g is known that ``method`` has found for ``duration`` [s].

    Modes are modes at any time. Krylov's and Lanczos' pairs are no modes of the body near the band's edge: they are
    fitted to the duration, and beyond it their phases are anybody's, unless damping has forgotten all of them by then.
    """
    if method == "modes" or duration >= memory(damping_ratio, bandwidth):
        return math.inf
    return duration
