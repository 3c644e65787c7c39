"""The predictability horizon of a run: how a small difference between two runs grows from landing to landing.

Each contact converts a difference of position into one of time and velocity, and each flight that into one of position:
after n contacts two runs with almost equal initial states may have nothing in common. The growth is measured by a twin
run, whose gaps are wider by `PERTURBATION` of the largest opening. Unlike a derivative, it includes contacts that
appear or vanish; it starts in one direction, but the direction of fastest growth soon dominates. The perturbation is
far above round-off and far below differences that matter.
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
"""Relative difference of identical runs on other machines or with other orders of summation."""
FELT: Final = 0.1
"""Difference over the largest opening above which a history is unknown, and only statistics remain."""
SMALL: Final = 0.01
"""Difference over the largest opening below which its growth is linear."""


@dataclass(frozen=True)
class Horizon:
    """The growth of a small difference over m landings.

    Attributes:
        growth: (m,) difference in the flight before each landing over that at the start.
        perturbation: initial difference of the twin run, relative to the largest opening.
    """

    growth: Array
    perturbation: float = PERTURBATION

    __repr__ = brief

    @property
    def small(self) -> int:
        """Return the number of landings before which the twin's difference is still below `SMALL`."""
        large = np.flatnonzero(~(self.growth * self.perturbation < SMALL))
        return int(large[0]) if large.size else len(self.growth)

    @property
    def rate(self) -> float:
        """Return the growth from one landing to the next, as geometric mean over small differences; 1 for fewer than
        two of them."""
        if (n := self.small) < 2:
            return 1.0
        return float((self.growth[n - 1] / self.growth[0]) ** (1 / (n - 1)))

    def known(self, difference: float = ROUND_OFF) -> int:
        """Return the number of landings that are known in spite of a relative initial ``difference``; beyond the last
        small difference the mean rate is extrapolated."""
        n = self.small
        beyond = np.arange(1, len(self.growth) - n + 1)
        last = self.growth[n - 1] if n else 1.0
        with np.errstate(over="ignore"):
            growth = np.concatenate([self.growth[:n], last * max(self.rate, 1.0) ** beyond])
        unknown = np.flatnonzero(growth * difference >= FELT)
        return int(unknown[0]) if unknown.size else len(self.growth)


def measure_horizon(
    problem: ContactProblem, *, dt: float, duration: float, perturbation: float = PERTURBATION
) -> Horizon:
    """Run a problem and its twin over ``duration`` [s] with the step ``dt`` [s], and compare them landing by landing.

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
    """Return the problem with wider gaps, and the widening [m]; ``gap``: gaps (n + 1, p) of the run [m].

    Raises:
        ContactError: the bodies never part, so that there is no flight to compare.
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
    """Return the largest difference of the gaps (n + 1, p) of two runs between each landing and the one before, over
    ``shift`` [m].

    ``starts``: (m,) steps at which the landings of the first run begin.
    """
    difference = np.max(np.abs(second - first), axis=1)
    edges = [0, *starts]
    growth = [np.max(difference[begin : end + 1]) / shift for begin, end in pairwise(edges)]
    return np.array(growth, dtype=np.float64)
