"""Effect of each open key on the measures, by pre-runs with one quantity changed at a time.

Each result is the relative change of a measure by the comparison that the run's error budget will make, so that a plan
predicts the error bars of the run: longer steps, fewer reed modes, the seat's highest modes left out, and g larger by a
few percent (`seatfem.study.error_budget`). A key is varied until its changes are small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

import impact
from impact.bodies.body import Body
from impact.runs.variations import NARROWER, Values, larger, left_by_step, narrowed, narrower, ringing_on, times
from seatfem.structures.method import at_once, bed
from seatfem.structures.rings import Division, face_compliance
from seatfem.study import safety
from seatfem.study.prerun.bench import Bench, relative_changes

COARSE: Final = 40  # steps per filter width of the pre-runs that compare models
MODES: Final = 40  # reed modes of the pre-runs that compare seats, and the fewest of those that compare steps
FEWEST: Final = 5  # fewest reed modes ...
MOST: Final = 320  # ... and most that are compared
LONGEST: Final = 4  # half the fewest steps per filter width ...
SHORTEST: Final = 640  # ... and the most that are compared
ENOUGH: Final = 10.0  # change by reed modes at which their number is enough to compare steps, over `finest`
ALWAYS: Final = ("impulse", "filtered_peak")  # measures that count for convergence although they are not asked for

Changes = Mapping[str, float]


@dataclass(frozen=True)
class Rung:
    """One value of a key, and the relative change of each measure from the next coarser value."""

    value: float
    changes: Changes


@dataclass(frozen=True)
class Sensitivity:
    """Relative changes of the measures of one scene by each key, computed on demand.

    Attributes:
        bench: pre-runs of the scene.
        asked: measures that count in `worst`; changes are returned for all measures of a pre-run.
        finest: relative change below which a key is not refined further.
        exact: whether the seat of the pre-runs is that of the scene.
        band: frequency up to which the modes of that seat are known [Hz].
        per_filter: steps per filter width of the pre-runs that compare models.
        reed_modes: number of reed modes of the pre-runs that compare seats.
    """

    bench: Bench
    asked: tuple[str, ...]
    finest: float
    exact: bool = False
    band: float = math.inf
    per_filter: int = COARSE
    reed_modes: int = MODES
    _runs: dict[tuple[int, float], Values] = field(default_factory=dict, init=False, repr=False, compare=False)
    _steps: dict[float, Values] = field(default_factory=dict, init=False, repr=False, compare=False)
    _cuts: dict[int, Values] = field(default_factory=dict, init=False, repr=False, compare=False)
    _rungs: dict[int, Changes] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def step(self) -> float:
        """Return the time step of the pre-runs that compare models [s]."""
        return self.bench.affordable(self.bench.scene.run.filter_width / self.per_filter)

    @property
    def n_modes(self) -> int | None:
        """Return the number of reed modes of the pre-runs that compare seats; ``None`` for a rigid mass."""
        if self.bench.scene.reed.slender is None:
            return None
        return self.reed_modes if self._stated_modes is None else min(self.reed_modes, self._stated_modes)

    @property
    def _stated_modes(self) -> int | None:
        """Return the number of modes of the reed that the file states, else ``None``."""
        beam = self.bench.scene.reed.slender
        return None if beam is None or "n_modes" not in beam.model_fields_set else beam.n_modes

    @cached_property
    def step_modes(self) -> int | None:
        """Return the number of reed modes of the pre-runs that compare steps: as in the run, as high modes need short
        steps; if it is open, enough for changes of `ENOUGH` times `finest`."""
        if self.n_modes is None:
            return None
        if self._stated_modes is not None:
            return min(MOST, self._stated_modes)
        enough = (r.value for r in no_better_than_finer(self.modes) if self.worst(r.changes) <= ENOUGH * self.finest)
        return max(MODES, round(next(enough, self.modes[-1].value)))

    @cached_property
    def base(self) -> Values:
        """Return the measures of the reference pre-run."""
        return self.bench.measures(dt=self.step, n_modes=self.n_modes)

    def of_modes(self, n_modes: int) -> Changes:
        """Return the relative errors by a number of reed modes, from other numbers as in the budget."""
        change: Changes = dict.fromkeys(self.base, 0.0)
        for number, weight in other_modes(n_modes):
            change = larger(change, times(weight, self._between_modes(number, n_modes)))
        return change

    @cached_property
    def modes(self) -> tuple[Rung, ...]:
        """Return numbers of reed modes from few to many, until the changes have settled."""
        rungs: list[Rung] = []
        numbers = [max(1, round(FEWEST / safety.FEWER)), FEWEST]
        while numbers[-1] < MOST and not self._settled(rungs):
            numbers.append(min(MOST, round(numbers[-1] * safety.FEWER)))
            half, fewer, n = numbers[-3:]  # two ratios of 1.4 make a factor of two
            change = larger(self._between_modes(fewer, n), times(1 / 2, self._between_modes(half, n)))
            rungs.append(Rung(n, change))
        return tuple(rungs)

    def _between_modes(self, other: int, n_modes: int) -> Changes:
        """Return the larger change by another number of modes on the seat and, unless it is exact, on a stiffer one."""
        seats = [1.0] if self.exact else [1.0, safety.STIFFER]
        change: Changes = dict.fromkeys(self.base, 0.0)
        for factor in seats:
            runs = (self._with_modes(n, factor) for n in (n_modes, other))
            change = larger(change, relative_changes(*runs))
        return times(1.0 if self.exact else safety.REED_MARGIN, change)

    def _with_modes(self, n_modes: int, factor: float) -> Values:
        if (n_modes, factor) not in self._runs:
            seat = self.bench.seat if factor == 1.0 else self.bench.seat.scaled(factor)
            self._runs[n_modes, factor] = self.bench.measures(dt=self.step, n_modes=n_modes, seat=seat)
        return self._runs[n_modes, factor]

    def of_step(self, dt: float) -> Changes:
        """Return the relative errors by a step ``dt``, as in the budget: from steps of 2 ``dt``, 4 ``dt`` and ``dt``/2.

        For a step too short for a pre-run, they are scaled from the shortest affordable one in proportion to ``dt``.
        """
        width, least = self.bench.scene.run.filter_width, self.bench.affordable(dt)
        if least > dt * (1 + 1e-9):
            return times(dt / least, self.of_step(least))
        by_longer = left_by_step(dt, width, lambda other: self._between_steps(dt, other))
        return larger(by_longer, times(2.0, self._between_steps(dt, dt / 2)))

    def of_stated_step(self, dt: float) -> Changes:
        """Return `of_step`, but at least the change by a much shorter step (`MUCH_SHORTER`).

        If waves cross the seat within a step, this step and all longer ones agree with each other and not with the
        truth; this cannot happen if the step resolves all modes of the bodies.
        """
        shorter = self.bench.affordable(dt / safety.MUCH_SHORTER)
        if shorter > dt / 2 or self.bench.resolves(dt, self.step_modes):
            return self.of_step(dt)
        share = dt / (dt - shorter)  # the time integration is of first order
        return larger(self.of_step(dt), times(share, self._between_steps(dt, shorter)))

    def _with_step(self, dt: float) -> Values:
        if dt not in self._steps:
            self._steps[dt] = self.bench.measures(dt=dt, n_modes=self.step_modes)
        return self._steps[dt]

    @cached_property
    def steps(self) -> tuple[Rung, ...]:
        """Return time steps from long to short [s], each half the one before; their changes are at least those from the
        last one."""
        width = self.bench.scene.run.filter_width
        rungs: list[Rung] = []
        parts = LONGEST
        while parts < SHORTEST and not self._settled(rungs):
            parts *= 2
            rungs.append(Rung(width / parts, self.of_step(width / parts)))
        last = self.bench.affordable(rungs[-1].value)
        return tuple(Rung(rung.value, larger(rung.changes, self._between_steps(rung.value, last))) for rung in rungs)

    def _between_steps(self, dt: float, other: float) -> Changes:
        """Return the change from one step to another; zero for steps that a pre-run cannot afford."""
        if not self.bench.affords(min(dt, other)):
            return dict.fromkeys(self.base, 0.0)
        return relative_changes(self._with_step(dt), self._with_step(other))

    def above(self, frequency: float) -> Changes:
        """Return the relative errors by truncating the seat's modes at ``frequency`` [Hz]: the larger change by leaving
        out the modes of the last factor `NARROWER` below it, and those above it.

        They are at least those of higher frequencies, as a small change may be an accident, and zero for a seat without
        modes. Beyond the band of known modes they fall with the square of the frequency: the truncated modes keep their
        static flexibility, and only their inertia is missing.
        """
        if frequency > self.band:
            return times((self.band / frequency) ** 2, self.above(self.band))
        return self._above(math.floor(math.log(frequency, NARROWER)))

    def _above(self, rung: int) -> Changes:
        """Return errors by truncation at the frequency `NARROWER` ** ``rung`` [Hz], at least those at higher ones."""
        if rung not in self._rungs:
            seat = self.bench.seat.modal
            if seat is None or not np.any(seat.omega > 2 * math.pi * NARROWER ** (rung - 1)):
                self._rungs[rung] = dict.fromkeys(self.base, 0.0)
            else:
                own, below = self._up_to(NARROWER**rung), self._up_to(NARROWER ** (rung - 1))
                change = larger(relative_changes(own, below), relative_changes(self.base, own))
                self._rungs[rung] = larger(change, self._above(rung + 1))
        return self._rungs[rung]

    def _up_to(self, frequency: float) -> Values:
        seat = self.bench.seat.modal
        assert seat is not None
        number = int(np.sum(seat.omega <= 2 * math.pi * frequency))
        if number not in self._cuts:
            fewer = seat if number == len(seat.omega) else narrowed(seat, frequency)
            self._cuts[number] = self._with(fewer)
        return self._cuts[number]

    @cached_property
    def of_g(self) -> Changes:
        """Return the relative change of each measure per relative change of g."""
        less, more = (self._with(self.bench.seat.scaled(factor)) for factor in (1 - safety.OFF, 1 + safety.OFF))
        changes = larger(relative_changes(self.base, less), relative_changes(self.base, more))
        return times(1 / safety.OFF, changes)

    @cached_property
    def spring(self) -> Changes:
        """Return the changes by a static seat: a spring or, for a lip in arcs, its static flexibility without waves.

        The change of a contact's duration is at least one time step.
        """
        if Division.from_greens(self.bench.seat).arcs == 1:
            return self.known_to(self.step, self._spring_of(1.0))
        return self.known_to(self.step, relative_changes(self.base, self._with(at_once(self.bench.seat))))

    def known_to(self, dt: float, changes: Changes) -> Changes:
        """Return ``changes`` with those of contact durations at least one step ``dt`` [s].

        A run resolves a duration to whole steps only: of a contact of a few steps, 20 % may not show.
        """
        ends = {name: value for name, value in self.base.items() if name.endswith("contact_duration") and value}
        return {**changes, **{name: max(changes[name], dt / duration) for name, duration in ends.items()}}

    @cached_property
    def guessed(self) -> Changes:
        """Return the changes by a spring whose stiffness is wrong by a factor of two, either way."""
        return larger(self._spring_of(0.5), self._spring_of(2.0))

    def _spring_of(self, factor: float) -> Changes:
        """Return the changes by a spring of ``factor`` times the static stiffness."""
        compliance = face_compliance(self.bench.seat)
        if not (math.isfinite(compliance) and compliance > 0):
            return dict.fromkeys(self.base, math.inf)
        division, stiffness = Division.from_greens(self.bench.seat), factor / compliance
        spring = bed(division, stiffness) if division.arcs > 1 else impact.spring(stiffness=stiffness)
        return relative_changes(self.base, self._with(spring))

    def between(self, one: impact.GreensFunction, other: impact.GreensFunction) -> Changes:
        """Return the changes from one seat to another."""
        return relative_changes(self._with(one), self._with(other))

    def _with(self, seat: impact.GreensFunction) -> Values:
        return self.bench.measures(dt=self.step, n_modes=self.n_modes, seat=seat)

    def worst(self, changes: Changes) -> float:
        """Return the largest change of the measures asked for."""
        return max((changes[name] for name in self.asked), default=0.0)

    def _settled(self, rungs: list[Rung]) -> bool:
        """Return whether the changes of the last two rungs are below `finest`, also those of `ALWAYS`; a single one may
        be small by accident."""
        names = {*self.asked, *ALWAYS}
        return len(rungs) > 1 and all(rung.changes[name] <= self.finest for rung in rungs[-2:] for name in names)


def no_better_than_finer(rungs: tuple[Rung, ...]) -> tuple[Rung, ...]:
    """Return the rungs from coarse to fine, with changes at least those of finer rungs: small ones may be accidents."""
    capped: list[Rung] = []
    for rung in reversed(rungs):
        capped.append(Rung(rung.value, larger(rung.changes, capped[-1].changes)) if capped else rung)
    return tuple(reversed(capped))


def with_other_modes(body: Body, band: float = 0.0) -> Iterator[tuple[Body, float]]:
    """Yield a plate of a ``band`` [Hz] with other modes, and the factor from its change to the truncation error.

    First the highest modes are left out (`OF_MODES`); their effect extrapolates to that of the next ones if many of
    them take part in the contact. In the middle of a disc, or all around a ring, few do: then modes beyond the last are
    added, as one or over octaves (`BEYOND`). A run's time step hides a part of their effect (`HIDDEN`).
    """
    felt, share_beyond = modes_felt(body), safety.ALONE
    for ratio, share in safety.OF_MODES:
        if (fewer := narrower(body, ratio)) is not None:
            share_beyond = safety.HIDDEN if felt < safety.ONE_FELT else 1.0
            yield fewer, share
    for ratio, octaves, most in safety.BEYOND:
        if felt < most and (ringing := ringing_on(body, ratio, band, octaves)) is not None:
            yield ringing, share_beyond


def modes_felt(body: Body) -> float:
    """Return the effective number of a body's highest modes (last ratio of `OF_MODES`) that take part in its contacts.

    It is the participation number (sum c)^2/sum c^2 of their compliances c = |shape|^2/omega^2: n for n equal modes, 1
    if one dominates. A free plate that meets a lip in parts may close them all at once, with their mean: the lesser
    number counts.
    """
    g = body.greens.modal
    if g is None or not np.any(g.omega):
        return 0.0
    top = g.omega > g.omega.max() / safety.OF_MODES[-1][0]
    each = g.shapes[top] / g.omega[top, None]
    yields = np.sum(each**2, axis=1)[None]
    if not np.all(g.omega):
        yields = np.append(yields, np.mean(each, axis=1)[None] ** 2, axis=0)
    squares = np.maximum(np.sum(yields**2, axis=1), np.finfo(float).tiny)
    return float(np.min(yields.sum(axis=1) ** 2 / squares))


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Return the numbers of reed modes to compare ``n_modes`` with, and the factor from each change to its error."""
    less = ((max(1, round(n_modes / safety.FEWER)), 1.0), (max(1, round(n_modes / safety.HALF)), 1 / 2))
    more = ((safety.MANY, 1.0),) if n_modes < safety.FEW else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)
