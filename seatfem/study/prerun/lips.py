"""Numbers that pre-runs choose: arcs and rings of a lip, and modes of a plate that strikes.

They stand in the method; the scene stays as its file states it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.bodies.body import Body
from impact.greens.base import GreensFunction
from impact.notices import Progress
from impact.runs.variations import SAFETY, larger, safety, times, total
from seatfem.structures.estimates.surrogate import Surrogate, on_its_patch
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.striking import is_curved
from seatfem.structures.rings import (
    ACROSS,
    FEWEST_ARCS,
    MOST_CHOSEN,
    OF_TWICE,
    Division,
    arc_rings_to_compare,
    as_a_whole,
    division_to_compare,
)
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.validity import ONE_PORT, simpler_bodies
from seatfem.study.method import PORTS, REED_BAND, RINGS, RunMethod
from seatfem.study.prerun.bench import MOST as MOST_STEPS
from seatfem.study.prerun.bench import Bench, prepare_bench, relative_changes, surrogate_striker
from seatfem.study.prerun.sensitivity import COARSE, Changes, with_other_modes
from seatfem.study.safety import ACROSS_SHARE, AIM, ARCS_SHARE, DOUBT_OF_ONE_PORT, LIP_SHARE, MODES_SHARE, STIFFER
from seatfem.study.scene import Scene
from seatfem.study.scene.life import LifeTable
from seatfem.study.scene.measures import all_measures

MOST_ARCS: Final = 64  # arcs that are chosen without being asked for


@dataclass(frozen=True)
class Arcs:
    """A method with the lip in arcs.

    Attributes:
        method: with their number, and that of the rings across.
        surrogate: the seat in pre-runs.
        errors: what the arcs leave, relative, measure by measure.
        across: the same of the rings across them; empty where no more can be, under a film.
    """

    method: RunMethod
    surrogate: Surrogate
    errors: Changes
    across: Changes

    @property
    def total(self) -> Changes:
        """Return what arcs and rings leave together."""
        return total(self.errors, self.across) if self.across else self.errors


def choose_arc_count(
    scene: Scene,
    method: RunMethod,
    surrogate: Surrogate,
    stopper: Body | None,
    progress: Progress,
    upto: int = 2 * FEWEST_ARCS,
) -> Arcs | None:
    """Return the lip in as many arcs as the accuracy asks for, or the file states; ``None``: it is struck as a whole.

    ``method``: as the file states it; ``upto``: most that are looked at first, with twice as many beside; where these
    are not too many, up to `MOST_ARCS`.
    """
    usual = method.ports
    if usual is None or usual == 1 or surrogate.exact or surrogate.patch is None:
        return None
    stated = PORTS in method.given
    most = usual if stated else min(upto, MOST_CHOSEN // scene.contact.rings)
    lip = scene.geometry.lip(most)
    assert lip is not None
    most = most if stated else lip.whole(most)
    parts = division_to_compare(Division(most, scene.contact.rings))
    finest = method.along(scene.geometry, parts.arcs, parts.rings)
    seat = surrogate_in_arcs(finest, surrogate).greens
    bench, division = prepare_bench(scene, finest.reed, seat, stopper, progress), Division.from_greens(seat)
    dt = bench.affordable(scene.run.filter_width / COARSE)
    known: dict[int, Mapping[str, float]] = {}

    def measures(arcs: int) -> Mapping[str, float]:
        if arcs not in known:
            known[arcs] = bench.divided(Division(arcs, division.rings)).measures(dt=dt)
        return known[arcs]

    def left_by(arcs: int) -> Changes:
        """Return what twice as many change, as the budget states it, and all that the most looked at do; of the most
        that can be, what half as many change."""
        if arcs == division.arcs:
            return times(OF_TWICE - 1, relative_changes(measures(arcs), measures(arcs // 2)))
        of_twice = times(OF_TWICE, relative_changes(measures(arcs), measures(2 * arcs)))
        return larger(of_twice, relative_changes(measures(arcs), measures(division.arcs)))

    chosen, aim = most, ARCS_SHARE * scene.accuracy.target
    while not stated and chosen // 2 >= FEWEST_ARCS and lip.whole(chosen // 2) == chosen // 2:
        errors = left_by(chosen // 2)
        if any(safety(name) * errors[name] > aim for name in scene.accuracy.judged):
            break
        chosen //= 2
    if chosen == most and upto < MOST_ARCS and not stated:
        return choose_arc_count(scene, method, surrogate, stopper, progress, MOST_ARCS)
    arcs = left_by(chosen)
    few = method.along(scene.geometry, chosen, scene.contact.rings)
    rings, across = _rings_across(bench, few, surrogate, dt)
    divided = method.along(scene.geometry, chosen, rings)
    return Arcs(divided, surrogate_in_arcs(divided, surrogate), arcs, across)


def _rings_across(bench: Bench, method: RunMethod, surrogate: Surrogate, dt: float) -> tuple[int, Changes]:
    """Return how many rings across the arcs of ``method``, as the file states or as few as leave `ACROSS_SHARE` of the
    target, and what they leave, as the budget states it; nothing under a film, which knows no rings.

    ``bench``: of the same scene, whose window serves again.
    """
    scene = bench.scene
    stated, accuracy, face = scene.contact.rings, scene.accuracy, scene.seat.face
    if scene.contact.film is not None:
        return stated, {}
    division = Division(method.ports or 1, stated)
    arcs, errors = scene.geometry.arcs_behind_rings(division), dict[int, Changes]()
    for rings in (stated,) if RINGS in method.given or rings_refused(scene.seat, scene.life) else ACROSS:
        finer, weight = arc_rings_to_compare(rings)
        if division.arcs * rings > MOST_CHOSEN and rings > ACROSS[1] and errors:
            break
        parts = Division(arcs, max(rings, finer))
        divided = method.along(scene.geometry, parts.arcs, parts.rings)
        seat = surrogate_in_arcs(divided, surrogate).greens
        striker = surrogate_striker(scene.reed, divided.reed, scene.run.duration, face)
        every = Bench(scene, seat, bench.window, striker, bench.stopper)
        few, many = (every.divided(Division(arcs, number)).measures(dt=dt) for number in (rings, finer))
        errors[rings] = times(weight, relative_changes(few, many))
        if all(safety(name) * errors[rings][name] <= ACROSS_SHARE * accuracy.target for name in accuracy.judged):
            break
    return max(errors.items())


def choose_more_arcs(scene: Scene, method: RunMethod, surrogate: Surrogate, arcs: Arcs, beside: Changes) -> Arcs:
    """Return twice as many arcs, where what is ``beside`` uses up half of the target: they then may use half as much.

    ``method``: with their number; ``surrogate``: of the whole lip.
    """
    target, measures = scene.accuracy.target, scene.accuracy.judged
    full = any(safety(name) * beside[name] > target / 2 for name in measures)
    few = any(safety(name) * arcs.errors[name] > ARCS_SHARE / 2 * target for name in measures)
    twice, rings = 2 * (method.ports or 1), method.seat.rings or 1
    if not (full and few) or twice * rings > MOST_CHOSEN:
        return replace(arcs, method=method)
    more = method.along(scene.geometry, twice, rings)
    return replace(arcs, method=more, surrogate=surrogate_in_arcs(more, surrogate), errors=times(0.5, arcs.errors))


def errors_of_simpler_models(bench: Bench) -> Mapping[str, Changes]:
    """Return the relative change by one port in place of the arcs, and a beam in place of the plate, by name.

    The largest change counts at two steps, and on a seat that yields less: one may be small by accident. One port may
    be chosen (`one_port_in_place`). A beam is told alone: to know its error the plate must be computed, and that is
    what a plate costs.
    """
    scene, division = bench.scene, Division.from_greens(bench.seat)
    if division.arcs == 1 or bench.striker is None:
        return {}
    bodies = simpler_bodies(scene, striker_of(scene, None, bench.striker), division)
    dt, start = scene.run.filter_width / COARSE, bench.window.start
    longest = min(scene.run.duration - start, MOST_STEPS * dt)  # a beam stays longer than the plate does
    bench = replace(bench, window=replace(bench.window, duration=longest))
    benches, largest = {name: replace(bench, other=body) for name, body in bodies}, dict[str, Changes]()
    for step, yields in ((2 * dt, 1.0), (dt, 1.0), (dt, STIFFER)):
        seat = bench.seat if yields == 1.0 else bench.seat.scaled(yields)
        own, whole = bench.measures(dt=step, seat=seat), as_a_whole(seat)
        for name, other in benches.items():
            simple = other.measures(dt=step, seat=whole)
            change = relative_changes({m: own[m] for m in own if m in simple}, simple)
            largest[name] = larger(change, largest.get(name, change))
    return largest


def rings_refused(seat: Structure, life: LifeTable | None) -> str:
    """Return why the arcs of a lip are not divided across unless the file says so; "" where nothing is against it."""
    if life is not None and life.contact_criterion:
        return "the life under a sphere's contact (life.contact_criterion) is computed without parts across the lip"
    return "" if seat.traits.has_rings else "the seat has no rings"


def several_needed(scene: Scene) -> str:
    """Return why the lip needs several ports whatever one would change; "" where nothing is against one."""
    names, contact = all_measures(), scene.contact
    if along := [name for name in scene.accuracy.measures if names[name].needs_line]:
        return f"{along[0]} needs lip segments"
    if uneven := contact.uneven or ("curvature" if is_curved(scene.reed) else ""):
        return f"a single contact point cannot represent {uneven}"
    if scene.stress is not None or scene.life is not None:
        return "stress under the lip is asked for"
    touches = scene.reed.thin_plate is not None and scene.geometry.lip(1) is not None
    return "" if touches else "this reed cannot touch the lip as a whole"


def one_port_in_place(scene: Scene, arcs: Arcs, simpler: Mapping[str, Changes], beside: Changes) -> Changes | None:
    """Return what one port in place of the ``arcs`` leaves, where it may be taken; ``None`` where it may not.

    That is `DOUBT_OF_ONE_PORT` times what it changes, and what the arcs leave that it is compared with: at most
    `LIP_SHARE` of the target, and with what stands ``beside`` it the part of the target that plans aim at.
    """
    if PORTS in arcs.method.given or ONE_PORT not in simpler or several_needed(scene):
        return None
    change = times(DOUBT_OF_ONE_PORT, simpler[ONE_PORT])
    errors = total(change, {name: arcs.total[name] for name in change})
    target = scene.accuracy.target
    for name in scene.accuracy.judged:
        bar = safety(name) * errors[name]
        if bar > LIP_SHARE * target or bar + safety(name) * beside.get(name, 0.0) > AIM * target:
            return None
    return errors


def surrogate_in_arcs(method: RunMethod, surrogate: Surrogate) -> Surrogate:
    """Return the surrogate of a seat whose lip is in the arcs of the method."""
    lip, whole, patch = method.seat.lip, surrogate.greens.modal, surrogate.patch
    assert lip is not None
    assert whole is not None
    assert patch is not None
    across = f" of {lip.rings} parts across" if lip.rings > 1 else ""
    words = f"{surrogate.words}, in {lip.arcs} arcs{across}"
    return replace(surrogate, greens=on_its_patch(whole, lip, patch), exact=False, words=words)


LEAST: Final = 1.3  # factor by which a band is widened at a time, at least ...
MOST_BAND: Final = 3.0  # ... and at most
MARGIN: Final = 1.3  # on what an error of second order asks for
LOOKS: Final = 3  # bands looked at


@dataclass(frozen=True)
class PlateBand:
    """A method with the band of a plate that strikes.

    Attributes:
        method: with it.
        errors: relative, measure by measure, what its highest modes leave, as the budget states it.
    """

    method: RunMethod
    errors: Changes


def choose_plate_bandwidth(
    scene: Scene, method: RunMethod, seat: GreensFunction, stopper: Body | None, progress: Progress
) -> PlateBand | None:
    """Return the band that the accuracy asks for, or the file states, or the plate's theory ends with; ``None`` for a
    striker that is no plate.

    ``seat``: what stands for it, undivided or in the arcs of the method.
    """
    if (reed := scene.reed.thin_plate) is None:
        return None
    stated = REED_BAND in method.given
    aim, most = MODES_SHARE * scene.accuracy.target / SAFETY, reed.widest_band
    for _ in range(LOOKS):
        band = method.reed.bandwidth
        assert band is not None
        errors = _left(prepare_bench(scene, method.reed, seat, stopper, progress), band)
        worst = max((errors[name] for name in scene.accuracy.judged), default=0.0)
        if stated or worst <= aim or band >= most * (1 - 1e-9):
            break
        factor = min(max(MARGIN * (worst / aim) ** 0.5, LEAST), MOST_BAND)
        method = method.replaced({REED_BAND: float(f"{min(factor * band, most):.2g}")})
    return PlateBand(method, errors)


def _left(bench: Bench, band: float) -> Changes:
    """Return what the highest modes of the plate leave, whose ``band`` is known [Hz]."""
    dt = bench.affordable(bench.scene.run.filter_width / COARSE)
    own = bench.measures(dt=dt)
    errors: Changes = {}
    striker = striker_of(bench.scene, greens=bench.striker)
    for other, share in with_other_modes(striker, band):
        change = times(share, relative_changes(own, replace(bench, other=other).measures(dt=dt)))
        errors = larger(change, errors or change)
    return errors or dict.fromkeys(own, math.inf)  # no mode to leave out: nothing tells what the plate's bending does
