"""Places between layers that grow away from the contact patch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def graded(length: float, fine: float, coarse: float, grading: float) -> Floats:
    """Places from 0 to ``length``: spacing ``fine`` at 0, growing by ``grading`` per unit distance up to ``coarse``."""
    places = [0.0]
    while places[-1] < length * (1 - 1e-9):
        places.append(places[-1] + min(coarse, fine + grading * max(0.0, places[-1] - fine)))
    if len(places) > 2 and length - places[-2] < (places[-1] - length):
        places.pop()
    return np.asarray(places) * (length / places[-1])
