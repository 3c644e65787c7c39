"""Errors of a spring in place of a seat: guessed from its surrogate, or measured on a coarse real seat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.greens.base import GreensFunction
from impact.quantities import percent
from impact.runs.budget import safety, times
from seatfem.structures.cache import Cache
from seatfem.structures.estimates.costs import seat_seconds
from seatfem.structures.estimates.mesh_size import ERRORS
from seatfem.structures.method import Method
from seatfem.study.accuracy.prerun import first_look
from seatfem.study.accuracy.sensitivity import Changes
from seatfem.study.impacts.contact import seat_of
from seatfem.study.planning.costs import finite_elements
from seatfem.study.planning.seen import Seen
from seatfem.study.safety import AIM, DOUBT, DOUBT_OF_ARCS, DOUBT_OF_COARSE, FLOOR_OF_SPRING, LEVEL_SHARE, OVERSTATED
from seatfem.study.scene.measures import short_words

TOLERANCE: Final = 0.02  # of the coarse seat's reduction: looser ones take as long and tell less
PER_FILTER, REED_MODES = 320, 80
"""Of its pre-runs: with 40 and 40 the peak of a thin reed on a plate changed ten times as much as in the run."""
IMPOSSIBLE: Final = (ArithmeticError, OSError, RuntimeError, ValueError)
"""What a seat that cannot be made ends with: the run tells of it, a plan is made by the surrogate."""


@dataclass(frozen=True)
class WithoutWaves:
    """Changes that a spring in place of a seat makes.

    Attributes:
        changes: relative, measure by measure, without any doubt.
        doubt: factor by which they may be larger.
        asked: measures that count.
        measured: whether on a coarse real seat.
    """

    changes: Changes
    doubt: float
    asked: tuple[str, ...]
    measured: bool = False

    @property
    def left(self) -> Mapping[str, float]:
        """Return the changes with their doubt, and no less than a spring can know."""
        return {name: max(change, FLOOR_OF_SPRING) for name, change in times(self.doubt, self.changes).items()}

    def enough(self, target: float) -> bool:
        """Return whether a spring is enough: its bar is within the part of the target that plans aim at."""
        return all(safety(name) * self.left[name] <= AIM * target for name in self.asked)

    @property
    def words(self) -> str:
        """Return the largest change of what is asked for, and how it is known."""
        name = max(self.asked, key=lambda measure: self.changes[measure])
        by = "measured on a coarse mesh of the seat" if self.measured else "estimated"
        words = short_words(name)
        return f"without waves: {percent(self.changes[name])} change of {words} ({by})"


def without_waves(seen: Seen) -> WithoutWaves:
    """Return what statics in place of the waves of a drawn seat change, by its surrogate; where that leaves open
    whether they are enough for the target, by a coarse real seat, if that is cheap."""
    measures, doubt = seen.sensitivity.asked, DOUBT if seen.arcs is None else DOUBT_OF_ARCS
    guess = WithoutWaves(seen.sensitivity.spring, doubt, measures)
    if not _leaves_open(seen, guess):
        return guess
    method = coarse_method(seen)
    if seconds(seen, method) > seen.look:
        return guess
    try:
        seat = seat_of(seen.scene, Cache(None, seen.store), method=method, mesh_error=False)
    except IMPOSSIBLE:
        return guess
    return WithoutWaves(changes_on(seen, seat.greens), DOUBT_OF_COARSE, measures, measured=True)


def coarse_method(seen: Seen) -> Method:
    """Return the coarsest method whose seat shows its waves: up to its first resonances, its face in one ring."""
    coarse = seen.elements(seen.lowest_band, TOLERANCE, ERRORS[0])
    return replace(coarse, level=seen.waves.level, rings=coarse.rings if coarse.in_arcs else 1)


def seconds(seen: Seen, method: Method) -> float:
    """Return the predicted time to make a seat [s]."""
    model = finite_elements(seen.scene, replace(seen.stated, seat=method))
    assert model is not None
    return sum(seat_seconds(model, seen.machine).values())


def changes_on(seen: Seen, seat: GreensFunction) -> Changes:
    """Return what the statics of this seat alone change."""
    bench = seen.sensitivity.bench
    window = first_look(bench.scene, seat, bench.striker, bench.stopper)
    on = replace(bench, seat=seat, window=window)
    return replace(seen.sensitivity, bench=on, per_filter=PER_FILTER, reed_modes=REED_MODES).spring


def _leaves_open(seen: Seen, guess: WithoutWaves) -> bool:
    """Return whether the guess takes more of the target than a level may by itself, and may be too large by what it
    overstates."""
    target = seen.scene.accuracy.target
    largest = max(safety(name) * guess.changes[name] for name in guess.asked)
    return guess.doubt * largest > target / LEVEL_SHARE and largest / OVERSTATED <= AIM * target
