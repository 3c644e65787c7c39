"""The cheapest way to meet a target, among all combinations of seat model, time step and number of reed modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.runs.budget import safety
from seatfem.study.impacts.budget import Source
from seatfem.study.planning.contact_options import ContactOption, contact_options
from seatfem.study.planning.filling import filled
from seatfem.study.planning.kept import Fineness
from seatfem.study.planning.options import BEHIND, MODEL, MODES, RINGS, STEP, Seen, fill_seat
from seatfem.study.planning.plan import PlannedLevel
from seatfem.study.planning.seat_options import SeatOption, seat_options
from seatfem.study.planning.sensitivity import Changes
from seatfem.study.scene import Scene

AIM: Final = 0.8  # part of the target that a plan may use up: predictions are not exact, a second round costs more
SPARE: Final = 1.3  # where the target is out of reach: the least error, times this, is aimed at
ENDLESS: Final = 1e9  # bar in place of an infinite one, of a measure that a model makes vanish: they can be compared
FREE: Final = 0.1  # part of the cost that may be spent on an error of nothing instead of all that is allowed


@dataclass(frozen=True)
class Decision:
    """What is chosen for one target.

    Attributes:
        seen: the scene.
        seat, contact: what is chosen.
    """

    seen: Seen
    seat: SeatOption
    contact: ContactOption

    @property
    def level(self) -> PlannedLevel:
        """Of the seat."""
        return self.seat.level

    @property
    def changes(self) -> Mapping[str, Changes]:
        """By key, the relative error that the choice leaves in each measure."""
        return {**self.contact.changes, **self.seat.changes}

    @property
    def shares(self) -> Mapping[Source, Changes]:
        """By source."""
        parts: dict[Source, Changes] = {}
        for key, left in self.changes.items():
            before = parts.get(BEHIND[key], {})
            parts[BEHIND[key]] = {name: value + before.get(name, 0.0) for name, value in left.items()}
        return parts

    @property
    def error(self) -> Mapping[str, float]:
        """Predicted bar of each measure, relative, as `seatfem.study.impacts.variations` will state it."""
        parts, asked = self.shares.values(), self.seen.scene.accuracy.measures
        return {name: safety(name) * sum(part[name] for part in parts) for name in asked}

    def scene(self, fineness: Fineness | None = None) -> Scene:
        """Every open key filled; ``fineness``: of another seat than the one chosen."""
        scene, fine = self.seen.scene, fineness or self.seat.fineness
        if fine is not None:
            scene = fill_seat(self.seen, fine.band, fine.tolerance, fine.mesh)
        values: dict[str, object] = {STEP: self.contact.dt}
        if scene.seat.is_drawn:
            values[MODEL] = self.level
        if self.seat.rings is not None:
            values[RINGS] = self.seat.rings
        if self.contact.n_modes is not None:
            values[MODES] = self.contact.n_modes
        return filled(scene, values)


@dataclass(frozen=True)
class Choices:
    """All that can be chosen for a scene.

    Attributes:
        seen: the scene.
        without: levels that are not to be chosen.
    """

    seen: Seen
    without: tuple[PlannedLevel, ...] = ()

    @cached_property
    def seats(self) -> tuple[SeatOption, ...]:
        """Models of the seat."""
        return seat_options(self.seen, self.without)

    @cached_property
    def contacts(self) -> tuple[ContactOption, ...]:
        """Steps and reed modes."""
        return contact_options(self.seen, closed=self.seats[0].level == "closed form")

    @cached_property
    def _bars(self) -> Array:
        """(seats, contacts, measures) predicted."""
        measures = self.seen.scene.accuracy.measures
        seats, contacts = (_left([option.changes for option in part], measures) for part in (self.seats, self.contacts))
        return np.asarray((seats[:, None] + contacts[None]) * [safety(name) for name in measures], dtype=np.float64)

    @cached_property
    def _cost(self) -> Array:
        """(seats, contacts) [s]."""
        seconds, poles = (np.array([getattr(o, name) for o in self.seats]) for name in ("seconds", "poles"))
        start, each = (np.array([getattr(o, name) for o in self.contacts]) for name in ("seconds", "per_pole"))
        return np.asarray(seconds[:, None] + start + poles[:, None] * each, dtype=np.float64)

    def cheapest(self, target: float, longest: float = np.inf, memory: float = np.inf) -> Decision:
        """The least cost that meets ``target``, or comes close to the least error of a measure for which nothing does.

        Args:
            longest, memory: what a seat may take [s, bytes]; the cheapest one may take more.
        """
        within = np.array([o.seconds <= longest and o.memory <= memory for o in self.seats])
        if not within.any():
            within[np.argmin([o.seconds for o in self.seats])] = True
        bars = np.minimum(self._bars[within], ENDLESS)
        least = bars.min(axis=(0, 1))
        aims = np.maximum(AIM * target, np.where(least <= target, np.minimum(target, SPARE * least), SPARE * least))
        used = (bars / aims).max(axis=2)
        score = np.where(used <= max(1.0, used.min()), self._cost[within] * (1 + FREE * used), np.inf)
        seat, contact = np.unravel_index(int(np.argmin(score)), score.shape)
        return Decision(self.seen, self.seats[np.flatnonzero(within)[seat]], self.contacts[contact])


def _left(changes: Sequence[Mapping[str, Changes]], measures: Sequence[str]) -> Array:
    """(options, measures) sum over the keys."""
    rows = [[sum(left[name] for left in option.values()) for name in measures] for option in changes]
    return np.array(rows, dtype=np.float64).reshape(len(changes), len(measures))
