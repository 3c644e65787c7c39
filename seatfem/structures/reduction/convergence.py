"""How a growing space knows that it has arrived: what the last checks say of the vectors still to come."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from seatfem.structures.model import Array


@dataclass
class History:
    """How g after the pulse changed from one check to the next, and what is to be expected of the vectors to come."""

    tolerance: float
    last: Array | None = None
    changes: list[float] = field(default_factory=list)
    first_error: float = np.inf

    def add(self, response: Array) -> float:
        """Estimated error of ``response`` relative to its maximum.

        With d the last change (or half the median of three: changes are uneven) and r the mean ratio of the last
        changes, the changes to come sum to d r/(1 - r). Twice that is stated, and at least 2 d. On rods and blocks the
        true error stayed below, damped or not, mostly within a factor of five; only undamped meshes coarser than the
        waves of the band, which converge slowly to the end, exceeded it (threefold).
        """
        before, self.last = self.last, response
        if before is None:
            return np.inf
        self.changes.append(float(np.abs(response - before).max() / np.abs(response).max()))
        recent = self.changes[-4:]
        if len(recent) < 2:
            return np.inf
        ratio = float(np.clip((recent[-1] / recent[0]) ** (1 / (len(recent) - 1)), 0.0, 0.9))
        return 2 * max(recent[-1], float(np.median(recent[-3:])) / 2) * max(1.0, ratio / (1 - ratio))

    def fraction(self, error: float) -> float:
        """Progress: on a logarithmic scale, as convergence is geometric."""
        if not np.isfinite(error):
            return 0.0
        self.first_error = min(self.first_error, max(error, 2 * self.tolerance))
        done = np.log(self.first_error / max(error, self.tolerance)) / np.log(self.first_error / self.tolerance)
        return float(np.clip(done, 0.0, 0.99))
