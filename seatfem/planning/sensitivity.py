"""How much each open key moves the measures: pre-runs with one thing changed at a time.

Each number is the relative change of a measure that the error budget of the run will see, so that a plan predicts the
bar that the run will state: half the step's change from 2 h to h, fewer reed modes by `FEWER`, a band narrower by
`NARROWER`, and g larger by a few percent. The pre-runs of a ladder go on while something is still to be gained.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

import impact
from impact.modal import ModalGreens
from impact.sums import ScaledGreens
from seatfem.planning.prerun import Bench, relative_changes
from seatfem.runs.budget import Values
from seatfem.runs.variations import FEWER, NARROWER, narrowed
from seatfem.scene import Cantilever

COARSE: Final = 40  # steps per filter width of the pre-runs that compare models, not steps
MODES: Final = 40  # reed modes of the pre-runs that compare steps and seats
FEWEST: Final = 5  # reed modes looked at ...
MOST: Final = 320
LONGEST: Final = 4  # steps per filter width looked at ...
SHORTEST: Final = 640
STIFFER: Final = 0.5  # g of the seat that confirms the number of reed modes, over the surrogate's
MARGIN: Final = 1.3  # on what a reed's modes change with a surrogate seat
OFF: Final = 0.02  # relative change of g behind its sensitivity
BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Band edges that are chosen from [Hz]: five a decade, so that different contact scenes share a seat."""

Changes = Mapping[str, float]


@dataclass(frozen=True)
class Rung:
    """One value of a ladder, and the relative change of each measure against the coarser one."""

    value: float
    changes: Changes


@dataclass(frozen=True)
class Sensitivity:
    """Pre-runs of one scene, carried out when asked for.

    Attributes:
        bench: where they run.
        measures: those that count.
        finest: relative change below which no ladder is followed further.
        exact: whether the seat of the bench is the scene's own.
    """

    bench: Bench
    measures: tuple[str, ...]
    finest: float
    exact: bool = False
    _runs: dict[tuple[int, float], Values] = field(default_factory=dict, repr=False, compare=False)

    @property
    def step(self) -> float:
        """[s] of the pre-runs that compare models."""
        return self.bench.affordable(self.bench.scene.run.filter_width / COARSE)

    @property
    def n_modes(self) -> int | None:
        """Reed modes of the pre-runs that compare seats and steps; ``None`` for a rigid mass."""
        reed = self.bench.scene.reed
        if not isinstance(reed, Cantilever):
            return None
        return min(MODES, reed.n_modes) if "n_modes" in reed.model_fields_set else MODES

    @cached_property
    def base(self) -> Values:
        """The measures that all else is compared with."""
        return self.bench.measures(dt=self.step, n_modes=self.n_modes)

    def of_modes(self, n_modes: int) -> Changes:
        """What the reed's modes between ``n_modes``/1.4 and ``n_modes`` change."""
        return self._between_modes(max(1, round(n_modes / FEWER)), n_modes)

    @cached_property
    def modes(self) -> tuple[Rung, ...]:
        """Numbers of reed modes from few to many, up to where they change nothing any more."""
        rungs: list[Rung] = []
        n = FEWEST
        while n < MOST and not _settled(rungs, self.finest):
            few, n = n, min(MOST, round(n * FEWER))
            rungs.append(Rung(n, self._between_modes(few, n)))
        return tuple(rungs)

    def _between_modes(self, few: int, many: int) -> Changes:
        """With the seat, and with one that yields less: whether a mode counts depends on what it meets."""
        seats = [1.0] if self.exact else [1.0, STIFFER]
        found: Changes = dict.fromkeys(self.measures, 0.0)
        for factor in seats:
            one, other = (self._with_modes(n, factor) for n in (many, few))
            found = _larger(found, self._of(one, other))
        margin = 1.0 if self.exact else MARGIN
        return {name: margin * value for name, value in found.items()}

    def _with_modes(self, n_modes: int, factor: float) -> Values:
        if (n_modes, factor) not in self._runs:
            seat = self.bench.seat if factor == 1.0 else ScaledGreens(self.bench.seat, factor)
            self._runs[n_modes, factor] = self.bench.measures(dt=self.step, n_modes=n_modes, seat=seat)
        return self._runs[n_modes, factor]

    def of_step(self, dt: float) -> Changes:
        """What a step of ``dt`` changes against one of 2 ``dt``; where that is too long, ``dt``/2 against ``dt``."""
        width = self.bench.scene.run.filter_width
        longer = 2 * dt if 4 * dt <= width else dt
        one, other = (self.bench.measures(dt=h, n_modes=self.n_modes) for h in (longer / 2, longer))
        return self._of(one, other)

    @cached_property
    def steps(self) -> tuple[Rung, ...]:
        """Time steps from long to short [s], each half as long as the one before.

        Where a pre-run cannot afford the step, the change halves with it: the march is of first order.
        """
        width = self.bench.scene.run.filter_width
        rungs: list[Rung] = []
        parts = LONGEST
        before = self.bench.measures(dt=width / parts, n_modes=self.n_modes)
        while parts < SHORTEST and not _settled(rungs, self.finest):
            parts *= 2
            if self.bench.affords(width / parts):
                here = self.bench.measures(dt=width / parts, n_modes=self.n_modes)
                rungs.append(Rung(width / parts, self._of(here, before)))
                before = here
            else:
                halved = {name: change / 2 for name, change in rungs[-1].changes.items()}
                rungs.append(Rung(width / parts, halved))
        return tuple(rungs)

    @cached_property
    def bands(self) -> tuple[Rung, ...]:
        """Band edges from narrow to wide [Hz]: what a band narrower by 1.6, or everything beyond it, changes."""
        seat = self.bench.seat
        if not isinstance(seat, ModalGreens) or len(seat.omega) == 0:
            return ()
        cut: dict[int, Values] = {}

        def without(band: float) -> Values:
            kept = int(np.sum(seat.omega <= 2 * math.pi * band))
            if kept not in cut:
                less = seat if kept == len(seat.omega) else narrowed(seat, band)
                cut[kept] = self.bench.measures(dt=self.step, n_modes=self.n_modes, seat=less)
            return cut[kept]

        beyond = [_larger(self._of(without(b), without(b / NARROWER)), self._of(self.base, without(b))) for b in BANDS]
        return tuple(Rung(band, changes) for band, changes in zip(BANDS, beyond, strict=True))

    @cached_property
    def of_g(self) -> Changes:
        """Relative change of each measure per relative change of g."""
        runs = [self._of(self.base, self._with(ScaledGreens(self.bench.seat, factor))) for factor in (1 - OFF, 1 + OFF)]
        return {name: change / OFF for name, change in _larger(*runs).items()}

    @cached_property
    def spring(self) -> Changes:
        """What a spring of the same static stiffness changes."""
        compliance = float(self.bench.seat.static_compliance()[0, 0])
        if not (math.isfinite(compliance) and compliance > 0):
            return dict.fromkeys(self.measures, math.inf)
        return self._of(self.base, self._with(impact.spring(stiffness=1 / compliance)))

    def between(self, one: impact.GreensFunction, other: impact.GreensFunction) -> Changes:
        """What one seat in place of another changes."""
        return self._of(self._with(one), self._with(other))

    def _with(self, seat: impact.GreensFunction) -> Values:
        return self.bench.measures(dt=self.step, n_modes=self.n_modes, seat=seat)

    def _of(self, one: Values, other: Values) -> Changes:
        changes = relative_changes(one, other)
        return {name: changes[name] for name in self.measures}


def worst(changes: Changes) -> float:
    """The largest of them."""
    return max(changes.values(), default=0.0)


def _larger(one: Changes, other: Changes) -> Changes:
    return {name: max(one[name], other[name]) for name in one}


def _settled(rungs: list[Rung], finest: float) -> bool:
    """Whether two rungs in a row change less than ``finest``: one may do so by accident."""
    return len(rungs) > 1 and all(worst(rung.changes) <= finest for rung in rungs[-2:])
