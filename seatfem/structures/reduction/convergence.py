"""How a growing space knows that it has arrived: what the last checks say of the vectors still to come."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from seatfem.structures.model import Array

_SINCE: Final = 1.4  # times the change since two thirds of the vectors


@dataclass
class History:
    """Changes of g after the pulse from one check to the next, and what is to be expected of the vectors to come."""

    tolerance: float
    last: Array | None = None
    changes: list[float] = field(default_factory=list)
    first_error: float = np.inf
    seen: list[tuple[int, Array]] = field(default_factory=list)

    def add(self, response: Array, size: int | None = None) -> float:
        """Return the estimated error of ``response``, of ``size`` Krylov vectors, relative to its maximum.

        With d the last change (or half the median of three: changes are uneven) and r the mean ratio of the last
        changes, the changes to come sum to d r/(1 - r). Twice that is stated, and at least 2 d. On rods and blocks the
        true error stayed below, damped or not, mostly within a factor of five; only undamped meshes coarser than the
        waves of the band, which converge slowly to the end, exceeded it (threefold).

        Undamped seats that converge slowly have r near 1, and the sum overestimates ten times. With ``size``, twice
        the sum or 1.4 times the change since two thirds of the vectors is stated, whichever is less; the latter holds
        where the error falls to 0.58 or less over that. Where either ended the growth of 108 reductions to 2, 0.5 and
        0.1 % (nine blocks, plates and bars against all their modes; three bands and durations, two dampings, two
        shifts), the true error was at most 0.98 of it; the sum alone was exceeded twofold there.
        """
        before, self.last = self.last, response
        earlier = None if size is None else self._before(response, size)
        if before is None:
            return np.inf
        self.changes.append(_apart(response, before))
        recent = self.changes[-4:]
        if len(recent) < 2:
            return np.inf
        ratio = float(np.clip((recent[-1] / max(recent[0], 1e-300)) ** (1 / (len(recent) - 1)), 0.0, 0.9))
        summed = 2 * max(recent[-1], float(np.median(recent[-3:])) / 2) * max(1.0, ratio / (1 - ratio))
        if size is None:
            return summed
        return min(2 * summed, np.inf if earlier is None else _SINCE * _apart(response, earlier))

    def _before(self, response: Array, size: int) -> Array | None:
        """Return the response of two thirds of the vectors, or a little less; nothing older is kept."""
        older = [k for k, (n, _) in enumerate(self.seen) if 3 * n <= 2 * size]
        self.seen = [*self.seen[older[-1] if older else 0 :], (size, response)]
        return self.seen[0][1] if older else None

    def fraction(self, error: float) -> float:
        """Return the progress on a logarithmic scale, as convergence is geometric."""
        if not np.isfinite(error):
            return 0.0
        self.first_error = min(self.first_error, max(error, 2 * self.tolerance))
        share = np.log(self.first_error / max(error, self.tolerance)) / np.log(self.first_error / self.tolerance)
        return float(np.clip(share, 0.0, 0.99))


def _apart(response: Array, other: Array) -> float:
    """Return the largest difference, relative to the largest value of the first."""
    return float(np.abs(response - other).max() / np.abs(response).max())
