"""The steps of a run, each a whole number of fine steps, and histories at fine steps, of a window or the whole run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.march.problem import ContactError
from impact.quantities import brief, in_units

MOST_BYTES: Final = 4e9
"""Most memory of one history at equal steps [bytes]."""


LAST: Final = -1
"""Stands for the last fine step of a run."""


@dataclass(frozen=True)
class TimeGrid:
    """Steps of a run, each a whole number of fine ones.

    Attributes:
        dt: fine step [s].
        ends: (N + 1,) number of fine steps from the start of the run to the end of each step; the first is 0.
    """

    dt: float
    ends: NDArray[np.int64]

    __repr__ = brief

    @staticmethod
    def from_equal_steps(dt: float, steps: int) -> TimeGrid:
        """Return ``steps`` steps of ``dt`` [s]."""
        return TimeGrid(dt, np.arange(steps + 1))

    @property
    def time(self) -> Array:
        """Return the (N + 1,) times at the ends of the steps [s]."""
        return np.asarray(self.dt * self.ends, dtype=np.float64)

    @property
    def spans(self) -> Array:
        """Return the (N,) lengths of the steps [s]."""
        return np.asarray(self.dt * np.diff(self.ends), dtype=np.float64)

    @property
    def is_uniform(self) -> bool:
        """Return whether all steps are fine ones."""
        return int(self.ends[-1]) == len(self.ends) - 1

    @property
    def levels(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the (J,) different lengths of steps [fine steps], and the (N,) index of each step's length."""
        lengths, levels = np.unique(np.diff(self.ends), return_inverse=True)
        return lengths, levels.astype(np.int64)

    @property
    def lengths(self) -> Mapping[int, int]:
        """Return the number of steps by their length [fine steps]."""
        lengths, counts = np.unique(np.diff(self.ends), return_counts=True)
        return dict(zip(lengths.tolist(), counts.tolist(), strict=True))

    def until(self, step: int) -> TimeGrid:
        """Return the grid up to a fine ``step``, which cuts the step that contains it."""
        rows = int(np.searchsorted(self.ends, step))
        return TimeGrid(self.dt, np.append(self.ends[:rows], step))

    def cut(self, start: int, stop: int) -> tuple[slice, Array]:
        """Return the rows of the steps that lie, at least in part, between two fine steps, and the (m + 1,) times [s]
        that bound these steps or their parts."""
        first, last = int(np.searchsorted(self.ends, start, side="right")), int(np.searchsorted(self.ends, stop))
        edges = np.clip(self.ends[first - 1 : last + 1], start, stop)
        return slice(first, last + 1), np.asarray(self.dt * edges, dtype=np.float64)

    def merge_ends(self, other: TimeGrid) -> NDArray[np.int64]:
        """Return the sorted ends of the steps of this grid and of another one, without duplicates."""
        return np.union1d(self.ends, other.ends)

    def describe(self) -> str:
        """Return the number of steps of each length as text."""
        each = [f"{count} of {in_units(length * self.dt, 's', 3)}" for length, count in sorted(self.lengths.items())]
        return f"{len(self.ends) - 1} steps: {', '.join(each)}"

    def spread_forces(self, rows: Array, start: int = 0, stop: int = LAST) -> Array:
        """Return the (stop - start + 1, ...) values at fine steps from ``start`` to ``stop``, by default `LAST`,
        of ``rows`` (N + 1, ...) that are constant over each step.

        Raises `ContactError` for a window that takes more than `MOST_BYTES`.
        """
        if self.is_uniform:
            return rows[self._window(start, stop)]
        return np.asarray(rows[self._rows_of(self._checked_window(rows, start, stop))])

    def find_forces(self, rows: Array, steps: NDArray[np.int64]) -> Array:
        """Return the (m, ...) values at the fine ``steps`` (m,) of ``rows`` (N + 1, ...) that are constant over each
        step."""
        return np.asarray(rows[np.searchsorted(self.ends, steps)])

    def spread_motions(self, rows: Array, start: int = 0, stop: int = LAST) -> Array:
        """Return the values at fine steps, as `spread_forces` does, of ``rows`` known at the ends of the steps and
        interpolated linearly between them."""
        if self.is_uniform:
            return rows[self._window(start, stop)]
        window = self._checked_window(rows, start, stop)
        steps = np.arange(window.start, window.stop)
        if rows.ndim == 1:
            return np.asarray(np.interp(steps, self.ends, rows))
        return self._interpolate_rows(rows, steps, self._rows_of(window))

    def find_motions(self, rows: Array, steps: NDArray[np.int64]) -> Array:
        """Return the (m, ...) values after the fine ``steps`` (m,) of ``rows`` (N + 1, ...) known at the ends of the
        steps and interpolated linearly between them."""
        return self._interpolate_rows(rows, steps, np.searchsorted(self.ends, steps))

    def _interpolate_rows(self, rows: Array, steps: NDArray[np.int64], after: NDArray[np.int64]) -> Array:
        """Return the interpolated values of ``rows`` after the fine ``steps``, which lie in the steps that end at the
        rows ``after``."""
        before = np.maximum(after - 1, 0)
        length = np.maximum(self.ends[after] - self.ends[before], 1)
        share = ((steps - self.ends[before]) / length).reshape(-1, *[1] * (rows.ndim - 1))
        return np.asarray(np.where(share >= 1.0, rows[after], rows[before] + share * (rows[after] - rows[before])))

    def _window(self, start: int, stop: int) -> slice:
        last = int(self.ends[-1])
        stop = last if stop == LAST else stop
        if not 0 <= start <= stop <= last:
            raise ContactError(f"steps {start} to {stop}: give a window within the {last} steps of this run")
        return slice(start, stop + 1)

    def _checked_window(self, rows: Array, start: int, stop: int) -> slice:
        """Return the fine steps of a window; raises `ContactError` if its history takes more than `MOST_BYTES`."""
        window = self._window(start, stop)
        need, last = 8.0 * (window.stop - window.start) * rows[0].size, window.stop - 1
        if need > MOST_BYTES:
            raise ContactError(
                f"steps {start} to {last} of {rows[0].size} contacts take {need / 1e9:.3g} GB a history (limit "
                f"{MOST_BYTES / 1e9:g} GB): ask for a window of fewer steps, or take the rows as they are"
            )
        return window

    def _rows_of(self, window: slice) -> NDArray[np.int64]:
        """Return the rows of the steps in which the fine steps of a window lie."""
        first, last = np.searchsorted(self.ends, [window.start, window.stop - 1])
        edges = np.clip(self.ends[first : last + 1] + 1, window.start, window.stop)
        return np.repeat(np.arange(first, last + 1), np.diff(edges, prepend=window.start))


class AtEqualSteps:
    """Forces and gaps at fine steps, computed from the ``rows`` of a run; they raise as `TimeGrid.spread_forces`."""

    rows: Any

    @property
    def dt(self) -> float:
        """Return the fine step [s]."""
        return float(self.rows.dt)

    @cached_property
    def force(self) -> Array:
        """Return the contact force [N], >= 0 except for the tension of a film."""
        return np.asarray(self.rows.spread_forces(self.rows.force))

    @property
    def gap(self) -> Array:
        """Return the gap [m]."""
        return np.asarray(self.rows.spread_motions(self.rows.gap))


BLOCK: Final = 4096  # number of steps of a block


def blocks(steps: int, size: int = BLOCK) -> Iterator[slice]:
    """Return the slices of a run's steps, block by block."""
    return (slice(first, min(first + size, steps)) for first in range(0, steps, size))


FOLLOW: Final = 32  # steps over which a load that depends on the opening is constant, with the value at their middle


def extrapolate_openings(opening: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the steps after which loads are updated, and the openings [m] by which `impact.ContactStepper` updates
    them: the ``opening`` (n + 1,) extrapolated to the middle of the next `FOLLOW` steps."""
    first = np.arange(0, len(opening) - 1, FOLLOW)
    now, before = opening[first], opening[np.maximum(first - 1, 0)]
    return first, np.asarray(now + FOLLOW / 2 * (now - before))
