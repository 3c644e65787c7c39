"""Keys that pre-runs choose: the numbers of arcs and rings of a lip, and the bandwidth of a plate that strikes."""

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
from seatfem.structures.kinds.structure import is_curved
from seatfem.structures.rings import (
    ACROSS,
    FEWEST_ARCS,
    MOST_CHOSEN,
    OF_TWICE,
    Division,
    arc_rings_to_compare,
    as_a_whole,
    division_to_compare,
    in_fewer_arcs,
)
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.validity import ONE_PORT, simpler_bodies
from seatfem.study.method import PORTS, REED_BAND, RINGS, RunMethod
from seatfem.study.prerun.bench import MOST as MOST_STEPS
from seatfem.study.prerun.bench import Bench, prepare_bench, relative_changes, surrogate_striker
from seatfem.study.prerun.sensitivity import COARSE, Changes, with_other_modes
from seatfem.study.safety import (
    ACROSS_SHARE,
    AIM,
    ARCS_SHARE,
    DOUBT_OF_ONE_PORT,
    LIP_SHARE,
    MODES_SHARE,
    ONE_PORT_BAR,
    STIFFER,
)
from seatfem.study.scene import Scene
from seatfem.study.scene.life import LifeTable
from seatfem.study.scene.measures import all_measures

MOST_ARCS: Final = 64  # most arcs that a plan chooses


@dataclass(frozen=True)
class Arcs:
    """A method with the lip in arcs.

    Attributes:
        method: method with the numbers of arcs and of rings across them.
        surrogate: seat of the pre-runs, divided in the same way.
        errors: relative error of each measure by the number of arcs.
        across: relative error of each measure by the number of rings; empty under a film, which allows no rings.
    """

    method: RunMethod
    surrogate: Surrogate
    errors: Changes
    across: Changes

    @property
    def total(self) -> Changes:
        """Return the relative errors by arcs and rings together."""
        return total(self.errors, self.across) if self.across else self.errors


def choose_arc_count(
    scene: Scene,
    method: RunMethod,
    surrogate: Surrogate,
    stopper: Body | None,
    progress: Progress,
    upto: int = 2 * FEWEST_ARCS,
) -> Arcs | None:
    """Return the lip in as many arcs as the accuracy needs, or the file states; ``None``: it is struck as a whole.

    ``method``: method that the file states; ``upto``: most arcs compared; if all of them are needed, the comparison is
    repeated with `MOST_ARCS`.
    """
    ports = method.ports
    if ports is None or ports == 1 or surrogate.exact or surrogate.patch is None:
        return None
    stated = PORTS in method.given
    most = ports if stated else min(upto, MOST_CHOSEN // scene.contact.rings)
    lip = scene.geometry.lip(most)
    assert lip is not None
    most = most if stated else lip.whole(most)
    parts = division_to_compare(Division(most, scene.contact.rings))
    finest = method.along(scene.geometry, parts.arcs, parts.rings)
    seat = surrogate_in_arcs(finest, surrogate).greens
    bench, division = prepare_bench(scene, finest.reed, seat, stopper, progress), Division.from_greens(seat)
    dt = bench.affordable(scene.run.filter_width / COARSE)
    cached: dict[int, Mapping[str, float]] = {}

    def measures(arcs: int) -> Mapping[str, float]:
        if arcs not in cached:
            cached[arcs] = bench.divided(Division(arcs, division.rings)).measures(dt=dt)
        return cached[arcs]

    def errors_of(arcs: int) -> Changes:
        """Return the relative errors, as the budget states them: from the change by twice as many arcs, and at least
        the change by the most arcs compared; for these, from the change by half as many."""
        if arcs == division.arcs:
            return times(OF_TWICE - 1, relative_changes(measures(arcs), measures(in_fewer_arcs(division).arcs)))
        by_doubling = times(OF_TWICE, relative_changes(measures(arcs), measures(2 * arcs)))
        return larger(by_doubling, relative_changes(measures(arcs), measures(division.arcs)))

    chosen, aim = most, ARCS_SHARE * scene.accuracy.target
    while not stated and chosen // 2 >= FEWEST_ARCS and lip.whole(chosen // 2) == chosen // 2:
        errors = errors_of(chosen // 2)
        if any(safety(name) * errors[name] > aim for name in scene.accuracy.judged):
            break
        chosen //= 2
    if chosen == most and upto < MOST_ARCS and not stated:
        return choose_arc_count(scene, method, surrogate, stopper, progress, MOST_ARCS)
    arcs = errors_of(chosen)
    chosen_method = method.along(scene.geometry, chosen, scene.contact.rings)
    rings, across = _rings_across(bench, chosen_method, surrogate, dt)
    divided = method.along(scene.geometry, chosen, rings)
    return Arcs(divided, surrogate_in_arcs(divided, surrogate), arcs, across)


def _rings_across(bench: Bench, method: RunMethod, surrogate: Surrogate, dt: float) -> tuple[int, Changes]:
    """Return the number of rings across the arcs of ``method``, stated or with errors below `ACROSS_SHARE` of the
    target, and their relative errors as the budget states them; no errors under a film, which allows no rings.

    ``bench``: pre-runs of the same scene, whose window is reused.
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
        finest = Bench(scene, seat, bench.window, striker, bench.stopper)
        few, many = (finest.divided(Division(arcs, number)).measures(dt=dt) for number in (rings, finer))
        errors[rings] = times(weight, relative_changes(few, many))
        if all(safety(name) * errors[rings][name] <= ACROSS_SHARE * accuracy.target for name in accuracy.judged):
            break
    return max(errors.items())


def choose_more_arcs(scene: Scene, method: RunMethod, surrogate: Surrogate, arcs: Arcs, beside: Changes) -> Arcs:
    """Return twice as many arcs, if the other errors (``beside``) use up half of the target; else the same arcs.

    ``method``: method with the present arcs; ``surrogate``: seat of the pre-runs, undivided.
    """
    target, measures = scene.accuracy.target, scene.accuracy.judged
    others_are_large = any(safety(name) * beside[name] > target / 2 for name in measures)
    arcs_are_few = any(safety(name) * arcs.errors[name] > ARCS_SHARE / 2 * target for name in measures)
    twice, rings = 2 * (method.ports or 1), method.seat.rings or 1
    if not (others_are_large and arcs_are_few) or twice * rings > MOST_CHOSEN:
        return replace(arcs, method=method)
    doubled = method.along(scene.geometry, twice, rings)
    return replace(
        arcs, method=doubled, surrogate=surrogate_in_arcs(doubled, surrogate), errors=times(0.5, arcs.errors)
    )


def errors_of_simpler_models(bench: Bench) -> Mapping[str, Changes]:
    """Return the relative changes by one contact point in place of the arcs, and a beam in place of the plate, by name.

    The largest change at two time steps and on a stiffer seat counts, as one may be small by accident. One contact
    point may be chosen (`one_port_in_place`); the beam is only reported, as its error is known once the plate is
    solved.
    """
    scene, division = bench.scene, Division.from_greens(bench.seat)
    if division.arcs == 1 or bench.striker is None:
        return {}
    bodies = simpler_bodies(scene, striker_of(scene, None, bench.striker), division)
    dt, start = scene.run.filter_width / COARSE, bench.window.start
    longest = min(scene.run.duration - start, MOST_STEPS * dt)  # the beam's contact lasts longer than the plate's
    bench = replace(bench, window=replace(bench.window, duration=longest))
    benches, largest = {name: replace(bench, other=body) for name, body in bodies}, dict[str, Changes]()
    for step, scale in ((2 * dt, 1.0), (dt, 1.0), (dt, STIFFER)):
        seat = bench.seat if scale == 1.0 else bench.seat.scaled(scale)
        own, whole = bench.measures(dt=step, seat=seat), as_a_whole(seat)
        for name, other in benches.items():
            simple = other.measures(dt=step, seat=whole)
            change = relative_changes({m: own[m] for m in own if m in simple}, simple)
            largest[name] = larger(change, largest.get(name, change))
    return largest


def rings_refused(seat: Structure, life: LifeTable | None) -> str:
    """Return in words why the arcs of a lip may not be divided across by the plan; "" if they may."""
    if life is not None and life.contact_criterion:
        return "the life under a sphere's contact (life.contact_criterion) is computed without parts across the lip"
    return "" if seat.traits.has_rings else "the seat has no rings"


def several_needed(scene: Scene) -> str:
    """Return in words why one contact point cannot replace those along the lip; "" if it can."""
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
    """Return the relative errors by one contact point in place of the ``arcs``, or ``None`` if it is not acceptable.

    The error is `DOUBT_OF_ONE_PORT` times the change from the arcs, plus the error of the arcs. It may be `LIP_SHARE`
    of the target and, with the other errors (``beside``), `AIM` times the target.
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


def error_of_one_contact(bench: Bench, method: RunMethod, surrogate: Surrogate) -> Changes | None:
    """Return the relative errors by one contact of a plate that a scene states, or an undivided seat has, in place of
    the segments of a lip; ``None`` if they are not known, or the struck face is no lip.

    ``bench``: pre-runs with one contact; ``surrogate``: seat of the pre-runs, undivided.
    """
    scene, segments = bench.scene, bench.scene.geometry.segments()
    if segments is None or surrogate.patch is None or surrogate.greens.modal is None:
        return None
    reed, seat = (
        replace(each, lip=lip)
        for each, lip in ((method.reed, scene.geometry.on_the_reed(segments)), (method.seat, segments))
    )
    divided = replace(method, reed=reed, seat=seat)
    striker = surrogate_striker(scene.reed, divided.reed, scene.run.duration, scene.seat.face)
    several = Bench(scene, surrogate_in_arcs(divided, surrogate).greens, bench.window, striker, bench.stopper)
    dt = bench.affordable(scene.run.filter_width / COARSE)
    return times(ONE_PORT_BAR, relative_changes(bench.measures(dt=dt), several.measures(dt=dt)))


def surrogate_in_arcs(method: RunMethod, surrogate: Surrogate) -> Surrogate:
    """Return the surrogate of a seat with its lip divided into the arcs of the method."""
    lip, whole, patch = method.seat.lip, surrogate.greens.modal, surrogate.patch
    assert lip is not None
    assert whole is not None
    assert patch is not None
    across = f" of {lip.rings} parts across" if lip.rings > 1 else ""
    words = f"{surrogate.words}, in {lip.arcs} arcs{across}"
    return replace(surrogate, greens=on_its_patch(whole, lip, patch), exact=False, words=words)


LEAST: Final = 1.3  # least factor by which a band is widened at a time ...
MOST_BAND: Final = 3.0  # ... and largest
MARGIN: Final = 1.3  # safety factor on the widening that an error of second order needs
LOOKS: Final = 3  # most bands that are tried


@dataclass(frozen=True)
class PlateBand:
    """A method with the bandwidth of a plate that strikes.

    Attributes:
        method: method with this bandwidth.
        errors: relative error of each measure by mode truncation, as the budget states it.
    """

    method: RunMethod
    errors: Changes


def choose_plate_bandwidth(
    scene: Scene, method: RunMethod, seat: GreensFunction, stopper: Body | None, progress: Progress
) -> PlateBand | None:
    """Return the bandwidth that the accuracy needs, at most the limit of plate theory, or that the file states;
    ``None`` for a striker that is no plate.

    ``seat``: Green's function for the pre-runs, undivided or in the arcs of the method.
    """
    if (reed := scene.reed.thin_plate) is None:
        return None
    stated = REED_BAND in method.given
    aim, most = MODES_SHARE * scene.accuracy.target / SAFETY, reed.widest_band
    for _ in range(LOOKS):
        band = method.reed.bandwidth
        assert band is not None
        errors = _truncation_errors(prepare_bench(scene, method.reed, seat, stopper, progress), band)
        worst = max((errors[name] for name in scene.accuracy.judged), default=0.0)
        if stated or worst <= aim or band >= most * (1 - 1e-9):
            break
        factor = min(max(MARGIN * (worst / aim) ** 0.5, LEAST), MOST_BAND)
        method = method.replaced({REED_BAND: float(f"{min(factor * band, most):.2g}")})
    return PlateBand(method, errors)


def _truncation_errors(bench: Bench, band: float) -> Changes:
    """Return the relative errors by truncation of the plate's modes at its ``band`` [Hz]."""
    dt = bench.affordable(bench.scene.run.filter_width / COARSE)
    own = bench.measures(dt=dt)
    errors: Changes = {}
    striker = striker_of(bench.scene, greens=bench.striker)
    for other, share in with_other_modes(striker, band):
        change = times(share, relative_changes(own, replace(bench, other=other).measures(dt=dt)))
        errors = larger(change, errors or change)
    return errors or dict.fromkeys(own, math.inf)  # no bending mode to leave out: the error is unknown
