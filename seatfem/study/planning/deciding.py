"""The cheapest way to meet a target, among all combinations of seat model, time step and number of modes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.runs.variations import safety
from seatfem.machine.resources import available_memory
from seatfem.structures.method import AnyLevel, Method
from seatfem.study.accuracy.sensitivity import Changes, Rung, no_better_than_finer
from seatfem.study.impacts.contact import MAX_STEPS, gas_step
from seatfem.study.impacts.touches import Source
from seatfem.study.ladders import BEHIND, fitted
from seatfem.study.method import MODEL, MODES, REED_BAND, STEP, RunMethod, is_given
from seatfem.study.planning.costs import (
    BUDGET_RUNS,
    ContactModel,
    closed_form,
    contact_model,
    contact_seconds,
    with_striker,
)
from seatfem.study.planning.seat_options import SeatOption, seat_options
from seatfem.study.planning.seen import PlanningContext
from seatfem.study.safety import AIM, ENDLESS, FREE, LONGEST, MEMORY, SIMPLER, SPARE


@dataclass(frozen=True)
class ContactOption:
    """One way to march.

    Attributes:
        dt: time step [s].
        n_modes: of the reed; ``None`` for a rigid mass.
        changes: by key, the relative error left in each measure.
        seconds, per_pole: cost with a seat without poles, and of each of its poles [s].
    """

    dt: float
    n_modes: int | None
    changes: Mapping[str, Changes]
    seconds: float
    per_pole: float


def contact_options(seen: PlanningContext, *, closed: bool) -> tuple[ContactOption, ...]:
    """Return every time step with every number of modes; a key that the file states is a ladder of one.

    ``closed``: the seat is a closed form, whose poles follow from the step.
    """
    return tuple(_option(seen, step, modes, closed) for step in _steps(seen) for modes in _modes(seen))


def _steps(seen: PlanningContext) -> tuple[Rung, ...]:
    stated, duration, sensitivity = seen.stated.time_step, seen.scene.run.duration, seen.sensitivity
    if stated is not None:
        return (Rung(stated, sensitivity.of_stated_step(stated)),)
    stored = [rung for rung in sensitivity.steps if duration <= MAX_STEPS * rung.value]
    if stored and (most := gas_step(seen.scene)) < math.inf:
        finest = min(stored, key=lambda rung: rung.value)
        stored = [rung for rung in stored if rung.value <= most] or [Rung(most, finest.changes)]
    rungs = (Rung(fitted(rung.value, duration), rung.changes) for rung in stored or sensitivity.steps[:1])
    return no_better_than_finer(tuple(rungs))


def _modes(seen: PlanningContext) -> Iterator[Rung | None]:
    stated = seen.stated.reed.n_modes
    if stated is None:
        yield None
    elif is_given(seen.scene, MODES):
        yield Rung(stated, seen.sensitivity.of_modes(stated))
    else:
        yield from no_better_than_finer(seen.sensitivity.modes)


def _option(seen: PlanningContext, step: Rung, modes: Rung | None, closed: bool) -> ContactOption:
    errors = seen.sensitivity.known_to(step.value, step.changes)
    changes = {STEP: errors} if modes is None else {STEP: errors, MODES: modes.changes}
    if seen.band is not None:
        changes[REED_BAND] = seen.band.left
    number = None if modes is None else round(modes.value)
    stated = replace(seen.stated, reed=replace(seen.stated.reed, n_modes=number))
    if closed:
        run = seen.scene.run.duration / step.value
        model = contact_model(run, step.value, closed_form(seen.scene, seen.stated))
        model = with_striker(model, seen.scene, stated, step.value, seen.sensitivity.bench.striker)
        return ContactOption(step.value, number, changes, sum(contact_seconds(model, seen.machine).values()), 0.0)
    bare, one = (_seconds(seen, stated, step.value, poles) for poles in (0.0, 1.0))
    return ContactOption(step.value, number, changes, bare, one - bare)


def _seconds(seen: PlanningContext, method: RunMethod, dt: float, poles: float) -> float:
    model = ContactModel(max(1.0, seen.scene.run.duration / dt), poles, 1.0, poles, BUDGET_RUNS)
    model = with_striker(model, seen.scene, method, dt, seen.sensitivity.bench.striker)
    return sum(contact_seconds(model, seen.machine).values())


@dataclass(frozen=True)
class Decision:
    """Options chosen for one target.

    Attributes:
        seen: the scene.
        seat, contact: what is chosen.
    """

    seen: PlanningContext
    seat: SeatOption
    contact: ContactOption

    @property
    def level(self) -> AnyLevel:
        """Return the level of the seat."""
        return self.seat.method.level

    @property
    def changes(self) -> Mapping[str, Changes]:
        """Return, by key, the relative error that the choice leaves in each measure."""
        return {**self.contact.changes, **self.seat.changes}

    @property
    def shares(self) -> Mapping[Source, Changes]:
        """Return the relative errors by source."""
        parts: dict[Source, Changes] = {}
        for key, errors in self.changes.items():
            before = parts.get(BEHIND[key], {})
            parts[BEHIND[key]] = {name: value + before.get(name, 0.0) for name, value in errors.items()}
        return parts

    @property
    def error(self) -> Mapping[str, float]:
        """Return the predicted bar of each measure, relative, as `seatfem.study.accuracy.error_budget` states it."""
        parts, judged = self.shares.values(), self.seen.scene.accuracy.judged
        return {name: safety(name) * sum(part[name] for part in parts) for name in judged}

    @property
    def method(self) -> RunMethod:
        """Return how the scene is computed."""
        return self.with_seat(self.seat.method)

    def with_seat(self, seat: Method) -> RunMethod:
        """Return the method with another model of the seat than the one chosen."""
        stated = self.seen.stated
        return RunMethod(seat, replace(stated.reed, n_modes=self.contact.n_modes), self.contact.dt)


@dataclass(frozen=True)
class Choices:
    """Everything that can be chosen for a scene.

    Attributes:
        seen: the scene.
        without: levels that are not to be chosen.
    """

    seen: PlanningContext
    without: tuple[str, ...] = ()

    @cached_property
    def seats(self) -> tuple[SeatOption, ...]:
        """Return the models of the seat."""
        return seat_options(self.seen, self.without)

    @cached_property
    def contacts(self) -> tuple[ContactOption, ...]:
        """Return the steps and numbers of reed modes."""
        return contact_options(self.seen, closed=self.seats[0].method.level == "closed form")

    @cached_property
    def _bars(self) -> Array:
        """Return the predicted bars (seats, contacts, measures)."""
        measures = self.seen.scene.accuracy.judged
        seats, contacts = (_left([option.changes for option in part], measures) for part in (self.seats, self.contacts))
        return np.asarray((seats[:, None] + contacts[None]) * [safety(name) for name in measures], dtype=np.float64)

    @cached_property
    def _cost(self) -> Array:
        """Return the cost (seats, contacts) [s]."""
        seconds, poles = (np.array([getattr(o, name) for o in self.seats]) for name in ("seconds", "poles"))
        start, each = (np.array([getattr(o, name) for o in self.contacts]) for name in ("seconds", "per_pole"))
        return np.asarray(seconds[:, None] + start + poles[:, None] * each, dtype=np.float64)

    def cheapest(self, target: float, longest: float = np.inf, memory: float = np.inf) -> Decision:
        """Return the cheapest choice that meets ``target``, or, for a measure that none does, is near the least error.

        A level that misses it by what it leaves out alone is no choice beside one that does not. Statics of the seat
        may cost `SIMPLER` times as much as waves: costs are predicted no better.

        Args:
            longest, memory: what a seat may take [s, bytes]; the cheapest one may take more.
        """
        within = np.array([o.seconds <= longest and o.memory <= memory for o in self.seats])
        if not within.any():
            within[np.argmin([o.seconds for o in self.seats])] = True
        fits = within & self._levels_fit(target)
        within = fits if fits.any() else within
        bars = np.minimum(self._bars[within], ENDLESS)
        least = bars.min(axis=(0, 1))
        aims = np.maximum(AIM * target, np.where(least <= target, np.minimum(target, SPARE * least), SPARE * least))
        used = (bars / aims).max(axis=2)
        cost = self._cost[within] / np.where(self._static[within], SIMPLER, 1.0)[:, None]
        score = np.where(used <= max(1.0, used.min()), cost * (1 + FREE * used), np.inf)
        seat, contact = np.unravel_index(int(np.argmin(score)), score.shape)
        return Decision(self.seen, self.seats[np.flatnonzero(within)[seat]], self.contacts[contact])

    def _levels_fit(self, target: float) -> NDArray[np.bool_]:
        """Return (seats,) whether what the level leaves out alone is within a target."""
        measures = self.seen.scene.accuracy.judged
        errors = _left([{MODEL: o.changes[MODEL]} if MODEL in o.changes else {} for o in self.seats], measures)
        return np.asarray((errors * [safety(name) for name in measures] <= target).all(axis=1))

    @cached_property
    def _static(self) -> NDArray[np.bool_]:
        """Return (seats,) whether waves are left out."""
        return np.array([option.method.static for option in self.seats])

    def within_means(self, wanted: Decision, target: float) -> Decision:
        """Return ``wanted`` if memory and time allow it; else the cheapest that they do for ``target``, or near it."""
        memory = MEMORY * available_memory()
        if wanted.seat.seconds <= LONGEST and wanted.seat.memory <= memory:
            return wanted
        return self.cheapest(target, LONGEST, memory)


def _left(changes: Sequence[Mapping[str, Changes]], measures: Sequence[str]) -> Array:
    """Return the sum over the keys (options, measures)."""
    rows = [[sum(errors[name] for errors in option.values()) for name in measures] for option in changes]
    return np.array(rows, dtype=np.float64).reshape(len(changes), len(measures))
