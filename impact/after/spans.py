"""The times of a run cut at its start, at its first touch and at the start of a landing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array

ON_A_STEP = 1e-6  # of a step: a landing that begins so little before a time begins at it


@dataclass(frozen=True)
class Spans:
    """Spans of time whose largest values are looked for, each after one cut up to the next, with that.

    ``touch``: number of the recorded time at which the first contact begins; -1 under a preload, inf without contact.
    ``landing``: likewise of a landing; inf where none is stated.
    """

    touch: float
    landing: float = np.inf

    @classmethod
    def of_run(cls, force: Array, dt: float, since: float | None = None) -> Spans:
        """Return the spans of a run with contact forces (n + 1, ...) at the step ``dt``, a landing ``since`` that time
        [s]."""
        return cls(first_touch(force), np.inf if since is None else float(np.floor(since / dt + ON_A_STEP)))

    @property
    def cuts(self) -> Array:
        """Return the (c,) numbers of the times that are the last ones of their spans, rising."""
        return np.unique([0.0, self.touch, self.landing])

    @property
    def count(self) -> int:
        """Return the number of spans."""
        return len(self.cuts) + 1

    @property
    def start(self) -> slice:
        """Return the span that holds t = 0, and nothing else of a record."""
        number = self._span(0.0)
        return slice(number, number + 1)

    def until(self, cut: float) -> slice:
        """Return the spans up to a cut, ``touch`` or ``landing``."""
        return slice(self._span(cut) + 1)

    def after(self, cut: float) -> slice:
        """Return the spans after a cut, ``touch`` or ``landing``."""
        return slice(self._span(cut) + 1, None)

    def of_times(self, times: NDArray[np.int64]) -> NDArray[np.intp]:
        """Return the (m,) numbers of the span that holds each of m recorded times, given by their numbers."""
        return np.searchsorted(self.cuts, times)

    def _span(self, time: float) -> int:
        return int(np.searchsorted(self.cuts, time))


def first_touch(force: Array) -> float:
    """Return the number of the time from which on contact bends the reed, inf without; ``force[m]`` acts from m - 1
    on."""
    touching = np.flatnonzero(force if force.ndim == 1 else np.any(force, axis=1))
    return float(touching[0]) - 1 if touching.size else np.inf
