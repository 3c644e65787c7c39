"""The cheapest model that meets a target: level, rungs of every ladder, and what error they leave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from seatfem.planning.filling import filled
from seatfem.planning.kept import Fineness
from seatfem.planning.ladders import Changes, Ladder, Position, climb, errors, shares
from seatfem.planning.options import (
    MODEL,
    MODES,
    SIZE,
    STEP,
    TOLERANCE,
    Seen,
    fill_seat,
    lowest_band,
    mesh_ladder,
    run_ladders,
    seat_ladders,
)
from seatfem.planning.plan import PlannedLevel
from seatfem.planning.sensitivity import worst
from seatfem.runs.budget import SAFETY, Source
from seatfem.scene import BarSeat, DrawnSeat, ElasticSeat, Scene
from seatfem.scene.imported import Matrices
from seatfem.seats.levels import applicable, choose_level, clamp_error
from seatfem.seats.rods import love_rod, rod_of

OF_LEVEL: Final = 0.125  # part of the target that waves may use up which a spring leaves out
RODS: Final = 0.5  # part of the target that a rod may use up: it has neither mesh nor reduction
DOUBT: Final = 2.0  # the surrogate's waves, over which the seat's may be stronger


@dataclass(frozen=True)
class Decision:
    """What is chosen for one target.

    Attributes:
        seen: what it is chosen from.
        level: of the seat.
        why: it.
        ladders, position: the rung chosen of each ladder.
        fixed: by source, what is left whatever the rungs.
        fineness: of the seat; ``None`` without finite elements.
    """

    seen: Seen
    level: PlannedLevel
    why: str
    ladders: tuple[Ladder, ...]
    position: Position
    fixed: Mapping[Source, Changes]
    fineness: Fineness | None

    @property
    def error(self) -> Mapping[str, float]:
        """Predicted bar of each measure, relative."""
        return errors(self.ladders, self.position, self.fixed)

    @property
    def shares(self) -> Mapping[Source, Changes]:
        """By source."""
        return shares(self.ladders, self.position, self.fixed)

    def ladder(self, key: str) -> Ladder | None:
        """The ladder of a key, where there is one."""
        return next((ladder for ladder in self.ladders if ladder.key == key), None)

    def value(self, key: str) -> float | None:
        """What was chosen of a ladder."""
        ladder = self.ladder(key)
        return None if ladder is None else ladder.values[self.position[key]]

    def changes(self, key: str) -> Changes:
        """What the chosen rung leaves."""
        ladder = self.ladder(key)
        return {} if ladder is None else ladder.changes[self.position[key]]

    def scene(self, fineness: Fineness | None = None) -> Scene:
        """Every open key filled; ``fineness``: of another seat than the one chosen."""
        scene, seat = self.seen.scene, fineness or self.fineness
        if seat is not None:
            scene = fill_seat(self.seen, seat.band, seat.tolerance, seat.mesh)
        values: dict[str, object] = {MODEL: self.level} if isinstance(scene.seat, DrawnSeat) else {}
        if (n := self.value(MODES)) is not None:
            values[MODES] = round(n)
        if (dt := self.value(STEP)) is not None:
            values[STEP] = dt
        return filled(scene, values)


def decide(seen: Seen, target: float, without: tuple[PlannedLevel, ...] = ()) -> Decision:
    """The coarsest rungs that meet ``target``, at the cheapest level that does and is not among ``without``."""
    contact = run_ladders(seen)
    seat = seen.scene.seat
    if not isinstance(seat, ElasticSeat | Matrices):
        return Decision(seen, "closed form", _closed(seen), contact, climb(contact, target, {}), {}, None)
    of_seat = seat_ladders(seen)
    found, why, fixed = _level(seen, target, without, of_seat)
    if found == "rod":
        return Decision(seen, found, why, contact, climb(contact, target, fixed), fixed, None)
    if found == "spring":
        return _at_band(seen, found, why, fixed, target, contact, (), lowest_band(seen))
    band, tolerance = of_seat
    whole = [
        _at_band(seen, found, why, fixed, target, contact, (band.only(rung), tolerance), band.values[rung])
        for rung in range(len(band.values))
    ]
    meet = [decision for decision in whole if worst(decision.error) <= target]
    return min(meet, key=_effort) if meet else min(whole, key=lambda decision: worst(decision.error))


def _at_band(
    seen: Seen,
    level: PlannedLevel,
    why: str,
    fixed: Mapping[Source, Changes],
    target: float,
    contact: tuple[Ladder, ...],
    of_seat: tuple[Ladder, ...],
    band: float,
) -> Decision:
    """The coarsest rungs at one band: of a solid's mesh first, for it costs most."""
    mesh = mesh_ladder(seen, band)
    ladders = (*contact, *mesh, *of_seat) if level in ("axisymmetric", "harmonics") else (*mesh, *of_seat, *contact)
    position = climb(ladders, target, fixed)
    decision = Decision(seen, level, why, ladders, position, fixed, None)
    seat = seen.scene.seat
    assert isinstance(seat, ElasticSeat | Matrices)
    fineness = Fineness(band, decision.value(TOLERANCE) or seat.greens.tolerance, decision.value(SIZE) or 0.0)
    return replace(decision, fineness=fineness)


def _effort(decision: Decision) -> float:
    """Grows as the seat's cost does: elements, times vectors for the band."""
    seat, fineness = decision.scene().seat, decision.fineness
    assert fineness is not None
    size = seat.mesh.size if isinstance(seat, DrawnSeat) else None
    dimension = 2 if decision.level in ("axisymmetric", "harmonics") else 3
    return fineness.band * (size or 1.0 / fineness.band) ** -dimension


def _level(
    seen: Seen, target: float, without: tuple[PlannedLevel, ...], of_seat: tuple[Ladder, ...]
) -> tuple[PlannedLevel, str, Mapping[Source, Changes]]:
    """Level, why, and what it leaves in the measures."""
    seat = seen.scene.seat
    if not isinstance(seat, DrawnSeat):
        return "3d", "as the file has it", {}
    limit = OF_LEVEL * target / SAFETY
    spring = {name: DOUBT * value for name, value in seen.sensitivity.spring.items()}
    if seat.model == "spring":
        return "spring", f"a spring instead of waves changes the measures by {worst(spring):.1g}", {"model": spring}
    if seat.model == "auto" and "spring" not in without and worst(spring) <= limit:
        why = f"waves in the seat change the measures by {worst(spring):.1g} at most: its static compliance is enough"
        return "spring", why, {"model": spring}
    band = of_seat[0].values[of_seat[0].coarsest(limit)]
    banded = fill_seat(seen, band, seat.greens.tolerance, 0.05).seat
    assert isinstance(banded, DrawnSeat)
    rod = _as_rod(seen, banded) if seat.model in ("auto", "rod") and "rod" not in without else None
    if rod is not None and (worst(rod) <= RODS * target / SAFETY or seat.model == "rod"):
        return (
            "rod",
            f"lateral inertia and the clamped end, which a rod leaves out, change {_most(rod)}",
            {"model": rod},
        )
    chosen = choose_level(banded, 0.0)
    left = seen.per_g(chosen.error)
    fixed: Mapping[Source, Changes] = {"model": left} if chosen.error else {}
    words = f"; {_percent(chosen.error)} of g is {_percent(worst(left))} of the measures" if chosen.error else ""
    return chosen.level, chosen.reason + words, fixed


def _as_rod(seen: Seen, seat: DrawnSeat) -> Changes | None:
    """What a rod in place of a bar changes; ``None`` where it does not apply."""
    if not isinstance(seat, BarSeat) or not _applies(seat, "rod"):
        return None
    inertia, end = seen.sensitivity.between(rod_of(seat), love_rod(seat)), seen.per_g(clamp_error(seat))
    return {name: value + end[name] for name, value in inertia.items()}


def _applies(seat: DrawnSeat, level: PlannedLevel) -> bool:
    return any(found.level == level and found.applies for found in applicable(seat))


def _most(changes: Changes) -> str:
    name = max(changes, key=lambda measure: changes[measure])
    return f"{name} by {_percent(changes[name])}"


def _closed(seen: Seen) -> str:
    return f"seat.kind = {seen.scene.seat.kind!r}: nothing to discretise"


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %"
