"""The cheapest way to meet a target of accuracy, by combinations of seat model, time step and number of modes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.runs.variations import safety
from seatfem.machine.resources import available_memory
from seatfem.structures.method import AnyLevel, Method
from seatfem.study.impacts.touches import Source
from seatfem.study.ladders.ladder import Option
from seatfem.study.ladders.table import ladders, source_of
from seatfem.study.method import MODEL, RunMethod
from seatfem.study.planning import costs
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.sensitivity import Changes
from seatfem.study.safety import AIM, ENDLESS, FREE, LONGEST, MEMORY, SIMPLER, SPARE


def options(context: PlanningContext, *, of_seat: bool) -> tuple[Option, ...]:
    """Return all options for the seat, or for the time integration: combinations of the values of their keys.

    A key that the file states has one value.
    """
    combinations = [Option(context.stated)]
    for ladder in ladders():
        if ladder.of_seat == of_seat:
            combinations = [longer for combination in combinations for longer in ladder.extend(context, combination)]
    return tuple(combinations)


def _priced(context: PlanningContext, option: Option, *, closed: bool) -> Option:
    """Return an option of the time integration with its cost: for a seat without poles, and for each pole of the seat.

    ``closed``: whether the seat is a closed form, whose number of poles follows from the step.
    """
    dt, scene = option.method.time_step or 0.0, context.scene
    if closed:
        duration, striker = scene.run.duration, context.sensitivity.bench.striker
        model = costs.contact_model(duration / dt, dt, costs.closed_form(scene.seat, context.stated.seat))
        model = costs.with_striker(model, scene.reed, option.method, dt, duration, striker)
        return replace(option, seconds=option.seconds + sum(costs.contact_seconds(model).values()))
    bare, one = (_seconds(context, option.method, dt, poles) for poles in (0.0, 1.0))
    return replace(option, seconds=option.seconds + bare, per_pole=one - bare)


def _seconds(context: PlanningContext, method: RunMethod, dt: float, poles: float) -> float:
    reed, duration = context.scene.reed, context.scene.run.duration
    model = costs.ContactModel(max(1.0, duration / dt), poles, 1.0, poles, costs.BUDGET_RUNS)
    model = costs.with_striker(model, reed, method, dt, duration, context.sensitivity.bench.striker)
    return sum(costs.contact_seconds(model).values())


@dataclass(frozen=True)
class Decision:
    """Options chosen for one target.

    Attributes:
        context: knowledge about the scene.
        seat, contact: options for the seat and for the time integration.
    """

    context: PlanningContext
    seat: Option
    contact: Option

    @property
    def level(self) -> AnyLevel:
        """Return the level of the seat."""
        return self.seat.seat.level

    @property
    def changes(self) -> Mapping[str, Changes]:
        """Return, by key, the relative error of each measure by the chosen value."""
        return {**self.contact.changes, **self.seat.changes}

    @property
    def shares(self) -> Mapping[Source, Changes]:
        """Return, by source of error, the relative error of each measure."""
        parts: dict[Source, Changes] = {}
        for key, errors in self.changes.items():
            source = source_of(key)
            before = parts.get(source, {})
            parts[source] = {name: value + before.get(name, 0.0) for name, value in errors.items()}
        return parts

    @property
    def error(self) -> Mapping[str, float]:
        """Return the predicted relative error bar of each judged measure, as the run's error budget would state it."""
        parts, judged = self.shares.values(), self.context.scene.accuracy.judged
        return {name: safety(name) * sum(part[name] for part in parts) for name in judged}

    @property
    def method(self) -> RunMethod:
        """Return how the scene is computed."""
        return self.with_seat(self.seat.seat)

    def with_seat(self, seat: Method) -> RunMethod:
        """Return the method with ``seat`` in place of the chosen method of the seat."""
        return replace(self.contact.method, seat=seat)


@dataclass(frozen=True)
class Choices:
    """All options for a scene.

    Attributes:
        context: knowledge about the scene.
    """

    context: PlanningContext

    @cached_property
    def seats(self) -> tuple[Option, ...]:
        """Return the options for the seat."""
        return options(self.context, of_seat=True)

    @cached_property
    def contacts(self) -> tuple[Option, ...]:
        """Return the options for the time integration, with their costs."""
        closed = self.seats[0].seat.level == "closed form"
        return tuple(_priced(self.context, way, closed=closed) for way in options(self.context, of_seat=False))

    @cached_property
    def _bars(self) -> Array:
        """Return the predicted relative error bars (seats, contacts, measures)."""
        measures = self.context.scene.accuracy.judged
        seats, contacts = (
            _errors([option.changes for option in part], measures) for part in (self.seats, self.contacts)
        )
        return np.asarray((seats[:, None] + contacts[None]) * [safety(name) for name in measures], dtype=np.float64)

    @cached_property
    def _cost(self) -> Array:
        """Return the predicted times (seats, contacts) [s]."""
        seconds, poles = (np.array([getattr(o, name) for o in self.seats]) for name in ("seconds", "poles"))
        start, each = (np.array([getattr(o, name) for o in self.contacts]) for name in ("seconds", "per_pole"))
        return np.asarray(seconds[:, None] + start + poles[:, None] * each, dtype=np.float64)

    def cheapest(self, target: float, longest: float = np.inf, memory: float = np.inf) -> Decision:
        """Return the cheapest combination that meets ``target``; a measure that none meets has nearly its least error.

        Levels of the seat whose own error misses the target count only if all do. A static seat may cost `SIMPLER`
        times as much as one with waves, as predicted costs are no more accurate.

        Args:
            longest, memory: limits of a seat [s, bytes]; if none is within them, the fastest one is taken.
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
        less = np.array([SIMPLER if option.seat.static else 1.0 for option in self.seats])
        cost = self._cost[within] / less[within, None]
        score = np.where(used <= max(1.0, used.min()), cost * (1 + FREE * used), np.inf)
        seat, contact = np.unravel_index(int(np.argmin(score)), score.shape)
        return Decision(self.context, self.seats[np.flatnonzero(within)[seat]], self.contacts[contact])

    def _levels_fit(self, target: float) -> NDArray[np.bool_]:
        """Return a (seats,) mask: whether the error by the seat's level alone is within the target."""
        measures = self.context.scene.accuracy.judged
        errors = _errors([{MODEL: o.changes[MODEL]} if MODEL in o.changes else {} for o in self.seats], measures)
        return np.asarray((errors * [safety(name) for name in measures] <= target).all(axis=1))

    def within_means(self, wanted: Decision, target: float) -> Decision:
        """Return ``wanted`` if memory and time allow its seat; else the cheapest combination within these limits."""
        memory = MEMORY * available_memory()
        if wanted.seat.seconds <= LONGEST and wanted.seat.memory <= memory:
            return wanted
        return self.cheapest(target, LONGEST, memory)


def _errors(changes: Sequence[Mapping[str, Changes]], measures: Sequence[str]) -> Array:
    """Return the (options, measures) errors, summed over the keys."""
    rows = [[sum(errors[name] for errors in option.values()) for name in measures] for option in changes]
    return np.array(rows, dtype=np.float64).reshape(len(changes), len(measures))
