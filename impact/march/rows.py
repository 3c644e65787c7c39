"""Histories of a run without energies: a row a step, and the same at fine steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.march.motion import Discrete
from impact.march.problem import ContactProblem
from impact.quantities import brief


@dataclass(frozen=True)
class Rows(TimeGrid):
    """Contact forces and gaps of p contacts, a row a step of the march; the first row is the start.

    Attributes:
        force: (N + 1, p) force during the step that ends there [N]; first the preload.
        gap: (N + 1, p) gap at the end of each step [m].
        film: (N + 1, p) part of the force by films [N]; (N + 1, 0) without films.
    """

    force: Array
    gap: Array
    film: Array

    __repr__ = brief


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
        return self.rows.spread_motions(self.rows.gap @ find_seats(self.problem))

    def force_on(self, contacts: slice) -> Array:
        """Return the (n + 1,) sum of the forces of some contacts at fine steps [N]."""
        return self.rows.spread_forces(self.rows.force[:, contacts].sum(axis=1))


def find_seats(problem: ContactProblem) -> Array:
    """Return (p,) weights by which the gaps of the contacts with seats, or with all where there is none, are
    averaged."""
    seats = np.array([contact.side > 0 for contact in problem.contacts])
    seats = seats if np.any(seats) else ~seats
    return np.asarray(seats / np.count_nonzero(seats))
