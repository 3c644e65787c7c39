"""Histories of a run with steps of different lengths: a row a step, and the same at equal steps for a window."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.march.motion import Discrete
from impact.march.problem import ContactError, ContactProblem
from impact.quantities import brief

MOST_BYTES: Final = 4e9
"""Most memory of one history at equal steps [bytes]."""


@dataclass(frozen=True)
class Rows:
    """Contact forces and gaps of p contacts, a row a step of the march; the first row is the start.

    Attributes:
        dt: fine step [s].
        ends: (N + 1,) number of fine steps from the start to the end of each step, 0 first.
        force: (N + 1, p) force during the step that ends there [N]; first the preload.
        gap: (N + 1, p) gap at the end of each step [m].
        film: (N + 1, p) part of the force by films [N]; (N + 1, 0) without films.
    """

    dt: float
    ends: NDArray[np.int64]
    force: Array
    gap: Array
    film: Array

    __repr__ = brief

    @property
    def is_uniform(self) -> bool:
        """Return whether all steps are fine ones."""
        return int(self.ends[-1]) == len(self.ends) - 1

    @property
    def lengths(self) -> Mapping[int, int]:
        """Return how many steps there are of each length, in fine steps."""
        each, counts = np.unique(np.diff(self.ends), return_counts=True)
        return dict(zip(each.tolist(), counts.tolist(), strict=True))

    def spread_forces(self, rows: Array, start: int = 0, stop: int | None = None) -> Array:
        """Return the (stop - start + 1, ...) values at fine steps from ``start`` to ``stop``, the last one by default,
        of ``rows`` (N + 1, ...) that are constant over each step.

        Raises `ContactError` for a window that takes more than `MOST_BYTES`.
        """
        if self.is_uniform:
            return rows[self._window(start, stop)]
        return np.asarray(rows[np.searchsorted(self.ends, self._steps_of(rows, start, stop))])

    def spread_motions(self, rows: Array, start: int = 0, stop: int | None = None) -> Array:
        """Return the same of ``rows`` known at the end of each step, on the line between them meanwhile."""
        if self.is_uniform:
            return rows[self._window(start, stop)]
        steps = self._steps_of(rows, start, stop)
        after = np.searchsorted(self.ends, steps)
        before = np.maximum(after - 1, 0)
        length = np.maximum(self.ends[after] - self.ends[before], 1)
        share = ((steps - self.ends[before]) / length).reshape(-1, *[1] * (rows.ndim - 1))
        return np.asarray(np.where(share >= 1.0, rows[after], rows[before] + share * (rows[after] - rows[before])))

    def _window(self, start: int, stop: int | None) -> slice:
        last = int(self.ends[-1])
        stop = last if stop is None else stop
        if not 0 <= start <= stop <= last:
            raise ContactError(f"steps {start} to {stop}: give a window within the {last} steps of this run")
        return slice(start, stop + 1)

    def _steps_of(self, rows: Array, start: int, stop: int | None) -> NDArray[np.int64]:
        """Return the fine steps of a window, whose history has yet to be made."""
        window = self._window(start, stop)
        need, last = 8.0 * (window.stop - window.start) * rows[0].size, window.stop - 1
        if need > MOST_BYTES:
            raise ContactError(
                f"steps {start} to {last} of {rows[0].size} contacts take {need / 1e9:.3g} GB a history (limit "
                f"{MOST_BYTES / 1e9:g} GB): ask for a window of fewer steps, or take the rows as they are"
            )
        return np.arange(window.start, window.stop)


@dataclass(frozen=True)
class Marched:
    """A run without energies: its forces and gaps, and what they act on.

    Attributes:
        problem: the contact problem.
        bodies: its discretised bodies, striker first, with the amplitudes of all loads as they were.
        own: (p, p) displacement by a unit force at the end of its own fine step [m/N].
        rows: forces and gaps.
        engine: the history engines in words.
        unsolved: number of steps whose coupled forces were not found to 1e-12.
    """

    problem: ContactProblem
    bodies: tuple[Discrete, ...]
    own: Array
    rows: Rows
    engine: str
    unsolved: int = 0

    __repr__ = brief

    @property
    def dt(self) -> float:
        """Return the fine step [s]."""
        return self.rows.dt

    @property
    def steps(self) -> int:
        """Return the number of fine steps."""
        return int(self.rows.ends[-1])

    @property
    def rest(self) -> Array:
        """Return the (p,) contact forces of the preload [N]."""
        return np.asarray(self.rows.force[0])

    @cached_property
    def force(self) -> Array:
        """Return the (n + 1, p) forces at fine steps [N]; raises as `Rows.spread_forces`."""
        return self.rows.spread_forces(self.rows.force)

    @cached_property
    def gap(self) -> Array:
        """Return the (n + 1, p) gaps at fine steps [m]."""
        return self.rows.spread_motions(self.rows.gap)

    @cached_property
    def film(self) -> Array:
        """Return the (n + 1, p) forces of films at fine steps [N]; (n + 1, 0) without films."""
        return self.rows.spread_forces(self.rows.film)

    @cached_property
    def opening(self) -> Array:
        """Return the (n + 1,) mean gap of the seats at fine steps [m]."""
        return np.asarray(self.gap @ find_seats(self.problem))


def find_seats(problem: ContactProblem) -> Array:
    """Return (p,) weights by which the gaps of the contacts with seats, or with all where there is none, are
    averaged."""
    seats = np.array([contact.side > 0 for contact in problem.contacts])
    seats = seats if np.any(seats) else ~seats
    return np.asarray(seats / np.count_nonzero(seats))
