"""How long a history can be known: how a difference between two runs grows from landing to landing.

Each touch turns a difference of place into one of time and speed, and each flight that into one of place: after n
touches two runs that began alike may have nothing in common. A twin run, whose gaps are wider by `PERTURBATION` of the
largest opening, measures the growth. It takes another march and no derivative of one, so that touches that come or go
are in it; it tells the growth in the one direction that it began in, which that of the fastest growth soon dominates.
The perturbation is far above round-off and far below what is felt, so that the growth is that of small differences.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from impact.after.measures import contact_groups
from impact.greens.base import Array
from impact.march.problem import ContactError, ContactProblem
from impact.quantities import brief
from impact.runs.solver import solve

PERTURBATION: Final = 1e-9
"""Widening of the twin's gaps, relative to the largest opening of the run."""
ROUND_OFF: Final = 1e-12
"""Relative difference of runs that no computation keeps apart: other machines, other orders of summation."""
FELT: Final = 0.1
"""Share of the largest opening: a difference above it leaves nothing of a history but statistics."""
SMALL: Final = 0.01
"""Share of the largest opening: a difference below it grows as an infinitesimal one does."""


@dataclass(frozen=True)
class Horizon:
    """The growth of a difference.

    Attributes:
        growth: (m,) a difference in the flight before each landing over that at the start.
        perturbation: of the twin that it was measured by, relative to the largest opening.
    """

    growth: Array
    perturbation: float = PERTURBATION

    __repr__ = brief

    @property
    def small(self) -> int:
        """Return before how many landings the twin's difference is still a small one."""
        large = np.flatnonzero(~(self.growth * self.perturbation < SMALL))
        return int(large[0]) if large.size else len(self.growth)

    @property
    def rate(self) -> float:
        """Return the growth from one landing to the next, the geometric mean over small differences; 1 where fewer than
        two landings tell."""
        if (n := self.small) < 2:
            return 1.0
        return float((self.growth[n - 1] / self.growth[0]) ** (1 / (n - 1)))

    def known(self, difference: float = ROUND_OFF) -> int:
        """Return how many landings a relative ``difference`` at the start leaves known, those after the last small
        difference by the mean rate."""
        n = self.small
        beyond = np.arange(1, len(self.growth) - n + 1)
        last = self.growth[n - 1] if n else 1.0
        with np.errstate(over="ignore"):
            growth = np.concatenate([self.growth[:n], last * max(self.rate, 1.0) ** beyond])
        felt = np.flatnonzero(growth * difference >= FELT)
        return int(felt[0]) if felt.size else len(self.growth)


def measure_horizon(
    problem: ContactProblem, *, dt: float, duration: float, perturbation: float = PERTURBATION
) -> Horizon:
    """March a problem and its twin over ``duration`` [s] with the step ``dt`` [s], and compare them touch by touch.

    A landing here is the start of a contact group (`measures.contact_groups`) of any contact. Raises as `impact.solve`,
    and `ContactError` for bodies that never part.
    """
    first = solve(problem, dt=dt, duration=duration)
    gap = np.asarray(first.gap).reshape(len(first.time), -1)
    contacts = [None] if gap.shape[1] == 1 else list(range(gap.shape[1]))
    starts = sorted({round(start / dt) for contact in contacts for start, _ in contact_groups(first, contact=contact)})
    twin, shift = twin_of(problem, gap, perturbation)
    other = np.asarray(solve(twin, dt=dt, duration=duration).gap).reshape(gap.shape)
    return Horizon(growth_of_difference(gap, other, starts, shift), perturbation)


def twin_of(problem: ContactProblem, gap: Array, perturbation: float) -> tuple[ContactProblem, float]:
    """Return a problem with wider gaps, and by how much [m]; ``gap``: openings (n + 1, p) of the run [m].

    Raises:
        ContactError: bodies that never part, whose history has no flight to compare.
    """
    largest = float(np.max(gap))
    if not largest > 0 or not math.isfinite(largest):
        raise ContactError("the bodies never part: a history without a flight has no horizon; let them part")
    shift = perturbation * largest
    return with_wider_gaps(problem, shift), shift


def with_wider_gaps(problem: ContactProblem, shift: float) -> ContactProblem:
    """Return a problem whose gaps are all wider by ``shift`` [m]."""
    contacts = [replace(contact, gap=contact.gap + shift) for contact in problem.contacts]
    return ContactProblem(problem.striker, contacts=contacts, preload=problem.preload)


def growth_of_difference(first: Array, second: Array, starts: Sequence[int], shift: float) -> Array:
    """Return the largest difference of the openings (n + 1, p) of two runs between each landing and the one before,
    over ``shift`` [m].

    ``starts``: (m,) steps at which the landings of the first run begin.
    """
    apart = np.max(np.abs(second - first), axis=1)
    edges = [0, *starts]
    growth = [np.max(apart[begin : end + 1]) / shift for begin, end in pairwise(edges)]
    return np.array(growth, dtype=np.float64)
