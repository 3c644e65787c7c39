"""Ladders of values from coarse to fine, and the coarsest rungs that together meet a target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from seatfem.runs.budget import SAFETY, Source

SHARES: Final[Mapping[Source, float]] = {"mesh": 0.2, "reduction": 0.2, "time_step": 0.35, "model": 0.25}
"""Parts of the target that the sources of error may use up at first."""

Changes = Mapping[str, float]


@dataclass(frozen=True)
class Ladder:
    """Values of one key from coarse to fine.

    Attributes:
        key: dotted, as in the scene.
        source: of the error.
        values: coarse to fine.
        changes: what each leaves in the measures, relative; the same length.
    """

    key: str
    source: Source
    values: tuple[float, ...]
    changes: tuple[Changes, ...]

    @staticmethod
    def steady(key: str, source: Source, values: tuple[float, ...], changes: tuple[Changes, ...]) -> Ladder:
        """A rung counts as no better than any finer one: a small change may be an accident."""
        found: list[Changes] = []
        for here in reversed(changes):
            found.append(here if not found else {name: max(v, found[-1][name]) for name, v in here.items()})
        return Ladder(key, source, values, tuple(reversed(found)))

    def only(self, rung: int) -> Ladder:
        """The ladder of one rung."""
        return Ladder(self.key, self.source, self.values[rung : rung + 1], self.changes[rung : rung + 1])

    def coarsest(self, limit: float) -> int:
        """Number of the coarsest rung that changes every measure by at most ``limit``; else of the finest."""
        for number, changes in enumerate(self.changes):
            if max(changes.values(), default=0.0) <= limit:
                return number
        return len(self.values) - 1


Position = Mapping[str, int]


def climb(ladders: tuple[Ladder, ...], target: float, fixed: Mapping[Source, Changes]) -> Position:
    """The rungs, by key, that meet the target: each within its share, then finer or coarser as the sum needs or allows.

    ``ladders``: those that cost most first. ``fixed``: what is left whatever is chosen.
    """
    present = {ladder.source for ladder in ladders} | set(fixed)
    whole = sum(SHARES[source] for source in present) or 1.0
    several = {source: sum(ladder.source == source for ladder in ladders) for source in present}
    position: Position = {
        ladder.key: ladder.coarsest(target / SAFETY * SHARES[ladder.source] / whole / several[ladder.source])
        for ladder in ladders
    }
    position = _refined(ladders, position, target, fixed)
    for ladder in ladders:
        while position[ladder.key] > 0:
            coarser = {**position, ladder.key: position[ladder.key] - 1}
            if _worst(ladders, coarser, fixed) > target:
                break
            position = coarser
    return position


def _refined(
    ladders: tuple[Ladder, ...], position: Position, target: float, fixed: Mapping[Source, Changes]
) -> Position:
    """Where one source needs more than its share, others get less: the step that gains most, until all is met."""
    while (now := _worst(ladders, position, fixed)) > target:
        finer = [
            {**position, ladder.key: position[ladder.key] + 1}
            for ladder in ladders
            if position[ladder.key] + 1 < len(ladder.values)
        ]
        best = min(finer, key=lambda other: _worst(ladders, other, fixed), default=position)
        if _worst(ladders, best, fixed) >= now:
            break
        position = best
    return position


def _worst(ladders: tuple[Ladder, ...], position: Position, fixed: Mapping[Source, Changes]) -> float:
    return max(errors(ladders, position, fixed).values(), default=0.0)


def shares(ladders: tuple[Ladder, ...], position: Position, fixed: Mapping[Source, Changes]) -> dict[Source, Changes]:
    """By source, the relative error left in each measure."""
    parts: dict[Source, Changes] = {source: dict(changes) for source, changes in fixed.items()}
    for ladder in ladders:
        here, before = ladder.changes[position[ladder.key]], parts.get(ladder.source, {})
        parts[ladder.source] = {name: value + before.get(name, 0.0) for name, value in here.items()}
    return parts


def errors(ladders: tuple[Ladder, ...], position: Position, fixed: Mapping[Source, Changes]) -> dict[str, float]:
    """Predicted bar of each measure, relative, as `seatfem.runs.budget` will state it."""
    parts = shares(ladders, position, fixed)
    names = dict.fromkeys(name for part in parts.values() for name in part)
    return {name: SAFETY * sum(part.get(name, 0.0) for part in parts.values()) for name in names}
