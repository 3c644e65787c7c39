"""Models of a seat that can be chosen: level, band, tolerance, mesh; the error that each leaves, and its cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from seatfem.machine.rates import Machine
from seatfem.structures.estimates.costs import (
    PORTS_POWER,
    TOLERANCE_POWER,
    SeatModel,
    coarse_of,
    highest_pole,
    seat_memory,
    seat_model,
    seat_seconds,
)
from seatfem.structures.estimates.mesh_size import ERRORS, mesh_error
from seatfem.structures.kinds.structure import Structure
from seatfem.study.planning.filling import is_given, value_of
from seatfem.study.planning.kept import Fineness
from seatfem.study.planning.options import (
    BAND,
    BANDS,
    MODEL,
    ORDER,
    RING_NUMBERS,
    RINGS,
    SIZE,
    TOLERANCE,
    TOLERANCES,
    Seen,
    fill_seat,
    lowest_band,
    mesh_sizes,
)
from seatfem.study.planning.plan import PlannedLevel
from seatfem.study.planning.sensitivity import Changes
from seatfem.study.scene import method_of

DOUBT: Final = 2.0  # the surrogate's waves, over which the seat's may be stronger
MESH_BAR: Final = 2.0  # the bar that a run states for its mesh, over the error that the mesh has
FEWER_POLES: Final = 0.7  # highest pole of a reduction that is counted on, over the usual one
REDUCTION: Final = 1e-6  # time of a reduction over its band, of a body whose modes cannot be counted yet [s/Hz]


@dataclass(frozen=True)
class SeatOption:
    """One model of the seat.

    Attributes:
        level: of modelling; why: it.
        fineness: of its finite elements; ``None`` for a closed form.
        changes: by key, the relative error left in each measure.
        seconds, memory: predicted [s, bytes].
        poles: of its Green's function, for each ring.
        rings: of the patch; ``None`` where it has no finite elements.
    """

    level: PlannedLevel
    why: str
    fineness: Fineness | None
    changes: Mapping[str, Changes]
    seconds: float = 0.0
    memory: float = 0.0
    poles: float = 0.0
    rings: int | None = None


def seat_options(seen: Seen, without: tuple[PlannedLevel, ...] = ()) -> tuple[SeatOption, ...]:
    """Every level that describes the seat and is not among ``without``; each with every band, tolerance and mesh.

    Of finite elements, each also with every number of rings.
    """
    seat = seen.scene.seat
    if not seat.is_reduced:
        return (SeatOption("closed form", f"seat.{seat.level(0.0).reason}", None, {}),)
    given = seat.level(0.0)
    waves = _drawn(seen, seat, without) if seat.is_drawn else _waves(seen, given.level, given.reason)
    left = _left_by_rings(seen) if seat.is_meshed else {}
    return tuple(divided for option in waves for divided in _divided(option, left))


def _left_by_rings(seen: Seen) -> Mapping[int, Changes]:
    """What the patch leaves in every number of rings that may be taken: one where nothing is felt of it."""
    given = (seen.scene.contact.rings,) if is_given(seen.scene, RINGS) else RING_NUMBERS
    chosen = given if seen.sensitivity.worst(seen.of_rings(1)) > 0 else given[:1]
    return {rings: seen.of_rings(rings) for rings in chosen}


def _divided(option: SeatOption, left: Mapping[int, Changes]) -> Iterator[SeatOption]:
    """With the patch in every number of rings; the end of a rod stays plane, and files of matrices know no patch."""
    if option.fineness is None or not left:
        yield option
        return
    for rings, changes in left.items():
        more = rings**PORTS_POWER
        yield replace(
            option,
            changes={**option.changes, RINGS: changes},
            seconds=option.seconds * more,
            poles=option.poles * rings * more,
            rings=rings,
        )


def _drawn(seen: Seen, seat: Structure, without: tuple[PlannedLevel, ...]) -> Iterator[SeatOption]:
    named = value_of(seen.scene, MODEL)
    if named in ("auto", "spring") and "spring" not in without:
        yield from _spring(seen)
    if named in ("auto", "rod") and "rod" not in without:
        yield from _closed_form(seen, seat)
    if named not in ("spring", "rod"):
        chosen = seat.level(0.0)
        yield from _waves(seen, chosen.level, chosen.reason)
    elif named == "rod":
        seat.level(0.0)  # whether it applies


def _spring(seen: Seen) -> Iterator[SeatOption]:
    """The static compliance, by finite elements; waves are left out."""
    left = {name: DOUBT * value for name, value in seen.sensitivity.spring.items()}
    why = f"a spring in place of waves changes the measures by {seen.sensitivity.worst(left):.1g} at most"
    band = lowest_band(seen)
    for error, mesh in _meshes(seen, band):
        fineness = Fineness(band, _tolerances(seen)[0], error)
        yield _effort(seen, "spring", fineness).option("spring", why, fineness, {MODEL: left, **mesh})


def _closed_form(seen: Seen, seat: Structure) -> Iterator[SeatOption]:
    """A bar as a rod: lateral inertia and the clamped end are left out."""
    form, better = seat.closed_form(), seat.beyond("rod")
    if form is None or better is None:
        return
    inertia, end = seen.sensitivity.between(form, better), seen.per_g(seat.form_error)
    left = {name: value + end[name] for name, value in inertia.items()}
    name = max(seen.sensitivity.asked, key=lambda measure: left[measure])
    why = f"lateral inertia and the clamped end, which a rod leaves out, change {name} by {100 * left[name]:.2g} %"
    yield SeatOption("rod", why, None, {MODEL: left})


def _waves(seen: Seen, level: PlannedLevel, why: str) -> Iterator[SeatOption]:
    """Finite elements, reduced; no band is tried beyond one above which nothing counts."""
    for band in _bands(seen):
        for error, mesh in _meshes(seen, band):
            effort = _effort(seen, level, Fineness(band, _tolerances(seen)[0], error))
            for tolerance in _tolerances(seen):
                reach = band * max(1.0, FEWER_POLES * effort.reach(tolerance))
                left = {BAND: seen.sensitivity.above(reach), TOLERANCE: seen.per_g(tolerance), **mesh}
                yield effort.option(level, why, Fineness(band, tolerance, error), left)
        if seen.sensitivity.worst(seen.sensitivity.above(band)) <= seen.sensitivity.finest:
            return


@dataclass(frozen=True)
class _Effort:
    """Models of a seat and of its coarser one, for one tolerance; ``None`` of matrices whose size is not known yet."""

    rates: Machine
    fineness: Fineness
    model: SeatModel | None
    coarser: SeatModel | None
    static: bool

    def reach(self, tolerance: float) -> float:
        """Highest pole over the band edge."""
        return highest_pole(self.model, tolerance)

    def option(self, level: PlannedLevel, why: str, fineness: Fineness, changes: Mapping[str, Changes]) -> SeatOption:
        """With the cost for the tolerance of ``fineness``."""
        if self.model is None:
            seconds = REDUCTION * fineness.band * fineness.tolerance**TOLERANCE_POWER
            return SeatOption(level, why, fineness, changes, seconds)
        ratio = fineness.tolerance / self.fineness.tolerance
        model = self.model.stricter(ratio)
        parts = [seat_seconds(model, self.rates, static=self.static)]
        if self.coarser is not None:
            parts.append(seat_seconds(self.coarser.stricter(ratio), self.rates, static=self.static))
        seconds = sum(sum(part.values()) for part in parts)
        if not self.model.drawn:
            seconds += REDUCTION * fineness.band
        poles = 0.0 if self.static else model.poles
        return SeatOption(level, why, fineness, changes, seconds, seat_memory(model)[0], poles)


def _effort(seen: Seen, level: PlannedLevel, fineness: Fineness) -> _Effort:
    scene = fill_seat(seen, fineness.band, fineness.tolerance, fineness.mesh)
    method, duration = replace(method_of(scene), level=level), scene.run.duration
    model, coarser = (of(scene.seat, method, duration) for of in (seat_model, coarse_of))
    return _Effort(seen.machine, fineness, model, coarser, level == "spring")


def _bands(seen: Seen) -> tuple[float, ...]:
    if is_given(seen.scene, BAND):
        return (value_of(seen.scene, BAND),)
    return tuple(band for band in BANDS if band >= lowest_band(seen)) or BANDS[-1:]


def _tolerances(seen: Seen) -> tuple[float, ...]:
    return (value_of(seen.scene, TOLERANCE),) if is_given(seen.scene, TOLERANCE) else TOLERANCES


def _meshes(seen: Seen, band: float) -> Iterator[tuple[float, Mapping[str, Changes]]]:
    """Errors of g that meshes are made for, and what they leave in the measures where that is known beforehand."""
    if not seen.scene.seat.is_drawn:
        yield 0.0, {}
        return
    before = None
    for error in ERRORS:
        sizes = mesh_sizes(seen, band, error)
        if sizes != before:
            assert seen.patch is not None
            left = mesh_error(seen.patch, band, sizes, value_of(seen.scene, ORDER))
            yield error, {SIZE: seen.per_g(MESH_BAR * left)}
        before = sizes
