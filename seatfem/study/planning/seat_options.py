"""The ladder of a seat: every model of it that can be chosen, the error that each leaves, and its cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.greens.base import GreensFunction
from impact.quantities import percent
from impact.runs.variations import safety, times
from seatfem.machine.resources import Machine
from seatfem.structures.cache import Cache
from seatfem.structures.estimates.costs import (
    PORTS_POWER,
    TOLERANCE_POWER,
    SeatModel,
    highest_pole,
    seat_memory,
    seat_seconds,
)
from seatfem.structures.estimates.surrogate import ERRORS, mesh_error
from seatfem.structures.method import MOST_MODES, Method
from seatfem.study.accuracy.part_errors import other_modes
from seatfem.study.accuracy.prerun import locate_contact_window
from seatfem.study.accuracy.sensitivity import Changes
from seatfem.study.impacts.contact import seat_of
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.ladders import RING_NUMBERS
from seatfem.study.method import BAND, MODEL, PORTS, RINGS, SEAT_MODES, SIZE, TOLERANCE, is_given
from seatfem.study.planning.costs import coarser_elements, finite_elements
from seatfem.study.planning.seen import PlanningContext
from seatfem.study.safety import (
    AIM,
    DOUBT,
    DOUBT_OF_ARCS,
    DOUBT_OF_COARSE,
    FEWER_POLES,
    FLOOR_OF_SPRING,
    LEVEL_SHARE,
    MESH_BAR,
    MESH_BAR_OF_ARCS,
    OVERSTATED,
)
from seatfem.study.scene.measures import short_words

COARSE_TOLERANCE: Final = 0.02  # of the coarse seat's reduction: looser ones take as long and tell less
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


def without_waves(seen: PlanningContext) -> WithoutWaves:
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


def coarse_method(seen: PlanningContext) -> Method:
    """Return the coarsest method whose seat shows its waves: up to its first resonances, its face in one ring."""
    coarse = seen.elements(seen.lowest_band, COARSE_TOLERANCE, ERRORS[0])
    return replace(coarse, level=seen.waves.level, rings=coarse.rings if coarse.in_arcs else 1)


def seconds(seen: PlanningContext, method: Method) -> float:
    """Return the predicted time to make a seat [s]."""
    model = finite_elements(seen.scene, replace(seen.stated, seat=method))
    assert model is not None
    return sum(seat_seconds(model, seen.machine).values())


def changes_on(seen: PlanningContext, seat: GreensFunction) -> Changes:
    """Return what the statics of this seat alone change."""
    bench = seen.sensitivity.bench
    window = locate_contact_window(bench.scene, seat, bench.striker, bench.stopper)
    on = replace(bench, seat=seat, window=window)
    return replace(seen.sensitivity, bench=on, per_filter=PER_FILTER, reed_modes=REED_MODES).spring


def _leaves_open(seen: PlanningContext, guess: WithoutWaves) -> bool:
    """Return whether the guess takes more of the target than a level may by itself, and may be too large by what it
    overstates."""
    target = seen.scene.accuracy.target
    largest = max(safety(name) * guess.changes[name] for name in guess.asked)
    return guess.doubt * largest > target / LEVEL_SHARE and largest / OVERSTATED <= AIM * target


COARSEST_OF_ARCS: Final = 0.1  # error of g by a mesh for a lip in arcs: coarser ones cost a round more than they save
REDUCTION: Final = 1e-6  # time of a reduction over its band, of a body whose modes cannot be counted yet [s/Hz]

CHEAPER: Final = "; seat.model = 'spring' would be enough, but would need a finer mesh or shorter steps"


@dataclass(frozen=True)
class SeatOption:
    """One model of the seat.

    Attributes:
        method: how it is computed; why: its level.
        changes: by key, the relative error left in each measure.
        seconds, memory: predicted [s, bytes].
        poles: of its Green's function, for each ring.
        mesh: error of g that its mesh is made for, 0 for a mesh that is there; ``None`` without finite elements.
    """

    method: Method
    why: str
    changes: Mapping[str, Changes]
    seconds: float = 0.0
    memory: float = 0.0
    poles: float = 0.0
    mesh: float | None = None


def seat_options(seen: PlanningContext, without: tuple[str, ...] = ()) -> tuple[SeatOption, ...]:
    """Return every level that describes the seat, but those ``without``; each with every band, tolerance and mesh.

    Of finite elements, each also with every number of rings.
    """
    if not seen.reduced:
        return (SeatOption(seen.stated.seat, f"seat.{seen.scene.seat.level(0.0).reason}", _left_by_modes(seen)),)
    waves = _levels(seen, without) if seen.drawn else _waves(seen, seen.stated.seat, seen.scene.seat.level(0.0).reason)
    if seen.arcs is not None:
        parts = {PORTS: seen.arcs.left} | ({RINGS: seen.arcs.across} if seen.arcs.across else {})
        return tuple(replace(option, changes={**option.changes, **parts}) for option in waves)
    errors = _left_by_rings(seen) if seen.patch is not None else {}
    if seen.one_port is not None:
        waves = (replace(option, changes={**option.changes, ONE_PORT: seen.one_port}) for option in waves)
    return tuple(divided for option in waves for divided in _divided(option, errors))


def _left_by_modes(seen: PlanningContext) -> Mapping[str, Changes]:
    """Return what other numbers of modes of a seat that is a beam change, as the budget states it."""
    seat, n_modes = seen.scene.seat, seen.stated.seat.n_modes
    if n_modes is None:
        return {}
    own, errors = seat.body(None, n_modes).greens, dict.fromkeys(seen.sensitivity.base, 0.0)
    for number, weight in other_modes(n_modes):
        change = seen.sensitivity.between(own, seat.body(None, number).greens)
        errors = {name: max(value, weight * change[name]) for name, value in errors.items()}
    return {SEAT_MODES: errors}


def _left_by_rings(seen: PlanningContext) -> Mapping[int, Changes]:
    """Return what the patch leaves in every number of rings that may be taken: one where its rings do not matter."""
    stated = is_given(seen.scene, RINGS) or seen.one_port is not None  # arcs, which it stands for, have no more
    numbers = (seen.stated.seat.rings or 1,) if stated else RING_NUMBERS
    chosen = numbers if seen.sensitivity.worst(seen.of_rings(1)) > 0 else numbers[:1]
    return {rings: seen.of_rings(rings) for rings in chosen}


def _divided(option: SeatOption, left: Mapping[int, Changes]) -> Iterator[SeatOption]:
    """Yield the option with the patch in every number of rings; a rod's end stays plane, matrices know no patch."""
    if option.mesh is None or not left:
        yield option
        return
    for rings, changes in left.items():
        more = rings**PORTS_POWER
        yield SeatOption(
            replace(option.method, rings=rings),
            option.why,
            {**option.changes, RINGS: changes},
            option.seconds * more,
            option.memory,
            option.poles * rings * more,
            option.mesh,
        )


def _levels(seen: PlanningContext, without: tuple[str, ...]) -> Iterator[SeatOption]:
    """Yield a stated level alone; else a spring, a closed form that neglects something, waves by finite elements."""
    stated, waves = seen.stated.seat, seen.waves
    level = stated.level if is_given(seen.scene, MODEL) else None
    why = waves.reason
    if level in (None, "spring") and "spring" not in without:
        spring = without_waves(seen)
        yield from _spring(seen, replace(stated, level="spring"), spring)
        why = f"{why}; {spring.words}{CHEAPER if spring.enough(seen.scene.accuracy.target) else ''}"
    if level in (None, "rod") and "rod" not in without:
        yield from _rod(seen, replace(stated, level="rod"))
    if level not in ("spring", "rod"):
        yield from _waves(seen, replace(stated, level=waves.level), why)


def _spring(seen: PlanningContext, seat: Method, found: WithoutWaves) -> Iterator[SeatOption]:
    """Yield the static compliance, by finite elements; waves are left out."""
    for error, mesh in _meshes(seen, seen.lowest_band):
        elements = _elements(seen, seat, seen.lowest_band, error)
        yield elements.option(found.words, seen.tolerances[0], {MODEL: found.left, **mesh})


def _rod(seen: PlanningContext, method: Method) -> Iterator[SeatOption]:
    """Yield a bar as a rod: lateral inertia and the clamped end are left out."""
    seat = seen.scene.seat.drawn
    if seat is None or (form := seat.closed_form()) is None or (better := seat.beyond("rod")) is None:
        return
    inertia, end = seen.sensitivity.between(form, better), seen.per_g(seat.form_error)
    errors = {name: value + end[name] for name, value in inertia.items()}
    name = max(seen.sensitivity.asked, key=lambda measure: errors[measure])
    words = short_words(name)
    why = f"a rod, without lateral inertia and the clamped end, is off by {percent(errors[name])} in {words}"
    yield SeatOption(method, why, {MODEL: errors})


def _waves(seen: PlanningContext, seat: Method, why: str) -> Iterator[SeatOption]:
    """Yield finite elements, reduced; no band is tried beyond one above which nothing counts, or modes are too many."""
    for band in seen.bands:
        for error, mesh in _meshes(seen, band):
            elements = _elements(seen, seat, band, error)
            if band > seen.bands[0] and elements.too_many_modes:
                return
            for tolerance in seen.tolerances:
                reach = band * max(1.0, FEWER_POLES * highest_pole(elements.model, tolerance))
                errors = {BAND: seen.sensitivity.above(reach), TOLERANCE: seen.per_g(tolerance), **mesh}
                yield elements.option(why, tolerance, errors)
        if seen.sensitivity.worst(seen.sensitivity.above(band)) <= seen.sensitivity.finest:
            return


def _meshes(seen: PlanningContext, band: float) -> Iterator[tuple[float, Mapping[str, Changes]]]:
    """Yield the errors of g that meshes are made for, and what they leave in the measures, if known beforehand."""
    if not seen.drawn:
        yield 0.0, {}
        return
    before = None
    for error in ERRORS:
        if seen.arcs is not None and error > COARSEST_OF_ARCS:
            continue
        sizes = seen.sizes(band, error)
        if sizes != before:
            assert seen.patch is not None
            of_mesh = mesh_error(seen.patch, band, sizes, seen.stated.seat.order)
            yield error, {SIZE: seen.per_g((MESH_BAR if seen.arcs is None else MESH_BAR_OF_ARCS) * of_mesh)}
        before = sizes


@dataclass(frozen=True)
class _Elements:
    """Models of a seat and of its coarser one, for the tolerance of ``method``; ``None`` of matrices whose size is not
    known yet."""

    rates: Machine
    method: Method
    error: float
    model: SeatModel | None
    coarser: SeatModel | None

    @property
    def too_many_modes(self) -> bool:
        """Return whether the modes of a body in space, struck in arcs, would be too many to look for."""
        model = self.model
        return model is not None and not model.section and model.kept is not None and model.kept > MOST_MODES

    def option(self, why: str, tolerance: float, changes: Mapping[str, Changes]) -> SeatOption:
        """Return the option with the cost for a tolerance."""
        method, band = replace(self.method, tolerance=tolerance), self.method.bandwidth or 0.0
        if self.model is None:
            seconds = REDUCTION * band * tolerance**TOLERANCE_POWER
            return SeatOption(method, why, changes, seconds, mesh=self.error)
        ratio, static = tolerance / self.method.tolerance, method.static
        model = self.model.stricter(ratio)
        models = [model] if self.coarser is None else [model, self.coarser.stricter(ratio)]
        seconds = sum(sum(seat_seconds(each, self.rates, static=static).values()) for each in models)
        if not model.drawn:
            seconds += REDUCTION * band
        poles = 0.0 if static else model.poles
        return SeatOption(method, why, changes, seconds, seat_memory(model)[0], poles, self.error)


def _elements(seen: PlanningContext, seat: Method, band: float, error: float) -> _Elements:
    method = replace(seen.elements(band, seen.tolerances[0], error), level=seat.level)
    run = replace(seen.stated, seat=method)
    models = finite_elements(seen.scene, run), coarser_elements(seen.scene, run)
    return _Elements(seen.machine, method, error, *models)
