"""The cheapest way to meet a target, among all combinations of seat model, time step and number of reed modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.runs.budget import safety
from seatfem.machine.memory import available_memory
from seatfem.structures.method import AnyLevel, Method
from seatfem.study.accuracy.sensitivity import Changes
from seatfem.study.impacts.measures import Source
from seatfem.study.ladders import BEHIND
from seatfem.study.method import MODEL, RunMethod
from seatfem.study.planning.seat_options import SeatOption, seat_options
from seatfem.study.planning.seen import Seen
from seatfem.study.planning.steps import ContactOption, contact_options
from seatfem.study.safety import AIM, ENDLESS, FREE, LONGEST, MEMORY, SIMPLER, SPARE


@dataclass(frozen=True)
class Decision:
    """Options chosen for one target.

    Attributes:
        seen: the scene.
        seat, contact: what is chosen.
    """

    seen: Seen
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

    seen: Seen
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
