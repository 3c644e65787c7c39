"""How a struck patch is divided into rings, each with a contact of its own.

A rigid face presses hardest at the rim of the patch, where the pressure goes to infinity like 1/sqrt(distance). The
rings are therefore narrow at both ends of the patch: ring k of p ends where

    (1 - cos(pi k/p))/2

of the area lies behind it. Of a strip these borders, Chebyshev's, give every ring the same force. The compliance of a
rigid face then converges with p^-2, instead of p^-1 with rings of equal width. The shares of the area depend on p
alone, and rings of p are unions of rings of m p.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from impact.greens.base import Array, GreensFunction, GreensFunctionError

CONTACT: Final = "contact"
ARC: Final = "arc"
MOST_RINGS = 16  # most rings of a patch
MOST_PORTS: Final = 4096  # most parts of a patch: their compliances fill 0.13 GB; time and memory allow fewer
MOST_CHOSEN: Final = 256  # most parts the program chooses itself, also in the finer runs behind error bars
OF_TWICE: Final = 4 / 3  # error left by n arcs or rings, over the change from n to 2n (second order)
FEWEST_ARCS: Final = 16  # fewest arcs of a lip from which their convergence can be estimated
ACROSS: Final = (1, 3, 6)  # numbers of rings to choose from across an arc: borders of each are among those of the next
OF_ONE: Final = 1.5
"""Error of one ring across an arc, over the change from one to three, at most 1.45 in five landings; and of one port,
over the change by arcs on a half-space."""
REFERENCE_RINGS = 4  # rings of the patch that one or two rings are compared with
_STRIP = 5.2  # limit of p^2 times the error of p rings over that of one, for a strip, p -> infinity


def ring_borders(rings: int) -> Array:
    """Return the (rings + 1,) share of the patch's area up to each border, from 0 to 1."""
    return np.asarray((1 - np.cos(np.pi * np.arange(rings + 1) / rings)) / 2)


def ring_shares(rings: int) -> Array:
    """Return the (rings,) share of the patch's area that each ring has."""
    return np.diff(ring_borders(rings))


def ring_names(port: str, rings: int) -> tuple[str, ...]:
    """Return the names of the rings' ports: that of the patch where there is one ring."""
    return (port,) if rings == 1 else tuple(f"{port}_{k + 1}" for k in range(rings))


@dataclass(frozen=True)
class Division:
    """Division of a struck patch into equal arcs around it, each in rings across it: its ports, arc by arc.

    Attributes:
        arcs, rings: how many; one of both: the patch as a whole.
    """

    arcs: int = 1
    rings: int = 1

    @property
    def arc_names(self) -> tuple[str, ...]:
        """Return the names of the arcs; that of the patch where there is one."""
        return (CONTACT,) if self.arcs == 1 else tuple(f"{ARC}_{k + 1}" for k in range(self.arcs))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the ports."""
        return _names(self)

    @property
    def count(self) -> int:
        """Return the number of parts."""
        return self.arcs * self.rings

    @property
    def shares(self) -> Array:
        """Return the (arcs rings,) shares of the patch's area."""
        return np.tile(ring_shares(self.rings) / self.arcs, self.arcs)

    @staticmethod
    def from_greens(greens: GreensFunction) -> Division:
        """Return the division that the port names of a Green's function state, as `from_names`."""
        return Division.from_names(greens.ports)

    @staticmethod
    def from_names(names: tuple[str, ...]) -> Division:
        """Return the division that names of ports state; undivided where they name no arcs and rings."""
        first, _, last = names[-1].partition("_")
        arcs = int(last.partition("_")[0]) if first == ARC and last.partition("_")[0].isdecimal() else 1
        division = Division(max(1, min(arcs, len(names))), max(1, len(names) // max(1, arcs)))
        return division if division.names == names else Division()


@cache
def _names(division: Division) -> tuple[str, ...]:
    """Return the ports' names, kept as they are asked for again and again."""
    return tuple(name for arc in division.arc_names for name in ring_names(arc, division.rings))


def divided_less(greens: GreensFunction, less: Division) -> GreensFunction:
    """Return the same patch in fewer parts, divisors of those it has: loads and displacements are means over the area.

    Raises:
        GreensFunctionError: parts that cannot be made of those there are.
    """
    division = Division.from_greens(greens)
    if less == division:
        return greens
    for name, few, many in (("rings", less.rings, division.rings), ("ports", less.arcs, division.arcs)):
        if many % few:
            raise GreensFunctionError(
                f"contact.{name} = {few}: the Green's function has its contact face in {many}; take a divisor of that"
            )
    return greens.combined(_joining(division, less), less.names)


def _joining(there: Division, less: Division) -> Array:
    """Return W (parts of ``there``, parts of ``less``), spreading a load on a part of ``less`` over those within it."""
    arcs = np.repeat(np.eye(less.arcs), there.arcs // less.arcs, axis=0) * less.arcs / there.arcs
    of = np.arange(there.rings) * less.rings // there.rings
    across = np.zeros((there.rings, less.rings))
    across[np.arange(there.rings), of] = ring_shares(there.rings) / ring_shares(less.rings)[of]
    return np.asarray(np.kron(arcs, across))


def division_to_compare(division: Division) -> Division:
    """Return the division whose model is compared with that of ``division``, for its error: twice as many arcs, its own
    where those would be more than `MOST_CHOSEN` parts; of undivided patches `rings_to_compare` rings."""
    if division.arcs > 1:
        twice = Division(2 * division.arcs, division.rings)
        return twice if twice.count <= MOST_CHOSEN else division
    return Division(1, rings_to_compare(division.rings))


def find_fewer_arcs(division: Division) -> Division:
    """Return the division in half as many arcs, or the most whole ones below, which are joined of several of its own:
    33 arcs in 11."""
    fewer = next(each for each in range(division.arcs // 2, 0, -1) if division.arcs % each == 0)
    return Division(fewer, division.rings)


def arc_rings_to_compare(rings: int) -> tuple[int, float]:
    """Return the number of rings across each arc to compare ``rings`` with, more of them or one, and the error of
    ``rings`` over the change between both."""
    if rings == 1:
        return ACROSS[1], OF_ONE
    return (2 * rings, OF_TWICE) if 2 * rings <= MOST_RINGS else (1, left_by(rings))


def parts_joined(greens: GreensFunction, there: Division, less: Division) -> GreensFunction:
    """Return ``greens``, which has other ports first and then the lip parts ``there``, with these merged into ``less``;
    ``greens`` itself where its last ports are no such parts."""
    before = len(greens.ports) - len(there.names)
    if less == there or before < 0 or greens.ports[before:] != there.names:
        return greens
    weights: Array = np.eye(len(greens.ports), before + len(less.names))
    weights[before:, before:] = _joining(there, less)
    return greens.combined(weights, (*greens.ports[:before], *less.names))


def with_fewer_rings(greens: GreensFunction, rings: int) -> GreensFunction:
    """Return `divided_less` with as many arcs as there are."""
    return divided_less(greens, Division(Division.from_greens(greens).arcs, rings))


def join_all_parts(greens: GreensFunction) -> GreensFunction:
    """Return the same patch undivided: it moves as its mean."""
    return divided_less(greens, Division())


def face_compliance(greens: GreensFunction) -> float:
    """Return the static displacement of a rigid face on all of the patch per force [m/N]; ``inf`` of a body that is
    free to move.

    Parts that would need a tensile force are left out.
    """
    compliance = greens.static_compliance()
    division = Division.from_greens(greens)
    parts = division.arcs * division.rings
    if parts == 1 or not np.all(np.isfinite(compliance)):
        return float(compliance[0, 0])
    closed = np.ones(parts, dtype=bool)
    while True:
        forces = np.linalg.solve(compliance[np.ix_(closed, closed)], np.ones(int(closed.sum())))
        if np.all(forces > 0) or closed.sum() == 1:
            return float(1 / forces.sum())
        closed[np.flatnonzero(closed)[forces <= 0]] = False


def rings_to_compare(rings: int) -> int:
    """Return the number of rings of the model that ``rings`` rings are compared with: their own number where they
    converge, from three on."""
    return rings if rings > 2 else REFERENCE_RINGS


def left_by(rings: int) -> float:
    """Return the error of ``rings`` >= 3, over the change from one ring to so many: that of a strip, which converges
    slowest.

    Of a strip the error falls to 0.49, 0.29, 0.079 of that of one ring with 3, 4 and 8; of a disk to 0.19, 0.11, 0.028.
    """
    return 1 / (rings**2 / _STRIP - 1)


def parted(places: Array, weights: Array, borders: Array) -> Array:
    """Return the (p, n) parts of ``weights`` (n,) in the order of ``places`` (n,), between shares ``borders`` (p + 1,)
    of them.

    A point on a border counts to both sides, and so do all points at its place: the parts add up to the weights.
    """
    order = np.argsort(places, kind="stable")
    reach = max(float(np.ptp(places)), np.finfo(float).tiny)
    starts = np.flatnonzero(np.diff(places[order], prepend=-np.inf) > 1e-6 * reach)
    group = np.searchsorted(starts, np.arange(len(places)), side="right") - 1
    total = np.bincount(group, weights[order])
    ends = np.cumsum(total) / total.sum()
    begins = ends - total / total.sum()
    within = np.minimum(ends, borders[1:, None]) - np.maximum(begins, borders[:-1, None])
    parts = np.clip(within / np.maximum(ends - begins, 1e-300), 0.0, 1.0)
    parts = parts / parts.sum(axis=0)
    out = np.empty((len(borders) - 1, len(places)))
    out[:, order] = parts[:, group]
    return np.asarray(out * weights)
