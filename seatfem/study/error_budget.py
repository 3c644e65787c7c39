"""Error budget of a run: changes by coarser or finer keys, floors, jumps of measures and the end of the record.

Numerical errors of one bounce shift the time of the next. A record that ends in a contact, or shortly before or after
one, then contains too much or too little of it, and coarser runs, whose contact may lie beyond the end altogether, do
not reveal this error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from impact.after.histories import UNKNOWN_STRESS, ReedStress, closed_steps
from impact.after.landings import JUMP, Landing
from impact.after.measures import first_is_cut
from impact.bodies.time_series import TimeSeriesError
from impact.greens.base import Array
from impact.march.problem import ContactProblem
from impact.runs.variations import SAFETY, Budget, Terms, Values, budget_of, changes, combined, larger, times, total
from seatfem.machine import resources
from seatfem.study.impacts import contact, plate_stress
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.landings import Landings
from seatfem.study.impacts.touches import (
    LIP,
    OF_A_LANDING,
    RECORD,
    SOURCES,
    STOPPER,
    STRIKER,
    RunRecord,
    Touches,
    contact_record_of,
    is_time,
    landing_name,
    lifts_of,
    stress_since,
    values_of_record,
)
from seatfem.study.ladders import march, table
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.method import STEP
from seatfem.study.scene import measures
from seatfem.study.scene.measures import ContactRecord, values_of

CLOCK: Final = "last touch"
"""Name of a further measure in a budget: the time at which the last complete contact has half its impulse
[s].
"""

OF_TOUCH: Final = 1e-3  # least error of a touch, in steps: that of a straight flight is round-off of the gap
FAINT: Final = 0.2  # least impulse of a contact that counts, over the largest
FLOORS: Final = dict.fromkeys(("mesh", "reduction", "patch", RECORD), 1e-5)
"""Least relative errors by source: the square of 0.3 %, the error of g in the band at best. A measure may be stationary
in g, such as the plateau of a rod's force on a stiff seat, ``rho c A v``: a coarser run then shows no change, and only
the second order remains."""
FLOOR_OF_SPRING: Final = 2e-3
"""Floor for a spring in place of waves: the square of some 4 %, the error of their effect in an estimate or an initial
velocity. Waves returning during a clamped reed's landing changed its impulse by 0.3 % where both showed nothing."""
WITHIN_PARTS: Final = 4e-3
"""Relative error of a lip in arcs that does not depend on their number, as each arc has one pressure and mean motion.
Weighting the rim of the land differently moved an impulse by 0.2 to 0.5 % (benchmarks/points: pressures at points)."""


def impulse_of_last_touch(record: ContactRecord) -> float:
    """Return the impulse from the start of a run to the middle of its last complete contact or, without any, of the one
    that the end cuts [N s]; 0 without contact. Contacts with less than `FAINT` of the largest impulse are ignored."""
    force, running = _solid_force(record), _impulse(record)
    touches = closed_steps(force)
    borne = np.diff(running[touches.astype(np.int64)])[:, 0] if len(touches) else np.zeros(0)
    touches = touches[borne > FAINT * borne.max(initial=0.0)]
    whole = touches[touches[:, 1] < len(force)]
    ends = (whole if len(whole) else touches)[-1:]
    return float(running[ends].mean()) if len(ends) else 0.0


def time_of_impulse(impulse: float, record: ContactRecord) -> float:
    """Return the time [s] at which a run has transferred an impulse [N s]; its end, if it never does."""
    running = _impulse(record)
    return record.dt * float(np.interp(impulse, running, np.arange(len(running)))) if impulse > 0 else 0.0


def _without_clock(values: Values) -> Mapping[str, float]:
    return {name: value for name, value in values.items() if name != CLOCK}


def _solid_force(record: ContactRecord) -> Array:
    """Return the (n,) contact force without that of the film [N]."""
    return np.asarray(record.force - record.film)[1:]


def _impulse(record: ContactRecord) -> Array:
    """Return the (n + 1,) impulse of the contact force, without the film, up to each step [N s]."""
    return np.concatenate([[0.0], record.dt * np.cumsum(_solid_force(record))])


MEASURE_OF_KEY: Final[Mapping[str, str]] = {
    **dict.fromkeys(("filtered_peak_force_N", "excess_peak_force_N"), measures.FilteredPeak.name),
    **{"impulse_Ns": measures.Impulse.name, "duration_s": measures.ContactDuration.name},
}
"""Keys in the record of a landing whose error bar is at least that of a measure."""


def error_budget(
    computed: ComputedRun,
    touches: Touches,
    stress: ReedStress = UNKNOWN_STRESS,
    look: plate_stress.PlateLook | None = None,
    flights: contact.Flights | None = None,
) -> Budget:
    """Return the errors of the measures of a run by source: the run is repeated with each key coarser, or finer, alone.

    The keys and their values in these runs are those of `seatfem.study.ladders.table`; further runs have time steps
    twice and four times as long, and `impact.runs.variations.budget_of` compares. In addition:

    - time_step: half the step through the judged impact and, where waves cross a rod within one step, a step that
      resolves them, as all longer ones agree with each other; a step for times that are known to whole steps only;
    - a floor of each source, and `WITHIN_PARTS` for a plate on a lip in arcs;
    - errors by the end of the record, and jumps of measures while the impulse varies within its error bar.

    ``touches``: contact history of the ``computed`` run; ``stress``: the reed's stress in it, if wanted; ``look``: how
    other runs evaluate a plate's stress; ``flights``: the striker's motion without contact, if other runs share it.
    """
    scene, method, greens, striker = computed.scene, computed.method, computed.seat.greens, computed.striker
    result, flights = touches.seat, flights or contact.Flights(striker, scene.run.duration, scene.contact.preload)
    progress = computed.progress
    computed, terms, unknown = varied_problems(computed, flights)
    problem, width = computed.problem, scene.run.filter_width

    choice = scene.accuracy.landing
    blow = stated = contact_record_of(touches, width, stress, choice)
    if stress.is_known and look is None:  # compared as other runs evaluate it, on a coarse grid
        since = stress_since(touches, choice)
        coarse = Strike(scene.geometry, striker, greens, touches).largest_stress(coarsely=True, since=since)
        blow = contact_record_of(touches, width, coarse, choice)
    last, like = impulse_of_last_touch(blow), touches.landings
    ports = lifts_of(scene.geometry, touches, greens) if scene.driven_by else ()
    run_of_wings = touches.opening, result.dt, scene.run.duration, ports
    others = contact.other_values(scene.driven_by, touches.strains, *run_of_wings)
    own = RunRecord(blow, like, touches.stopper_force, others)

    def values_with_clock(record: RunRecord) -> Values:
        return {**values_of_record(record, like), CLOCK: time_of_impulse(last, record.blow)}

    runs, count = 2 + sum(len(term) for each in terms.values() for term in each), 0

    def run(varied: ContactProblem, dt: float) -> Values:
        nonlocal count
        count += 1
        progress("error budget", min(count / runs, 1.0))
        return values_with_clock(contact.record_of(scene, varied, dt, flights, like, look=look))

    known, half = values_of_record(own, like), march.left_by_half_step(computed, touches, look)
    if half is None:
        half = times(2.0, changes(known, run(problem, result.dt / 2)))
    finer = [half, times(result.dt, unresolved_steps(touches.landings, blow))]
    if shorter := march.step_of_waves(problem, result.dt, scene.run.duration):
        finer.append(changes(known, run(problem, shorter)))
    histories = contact.STEP_BYTES * len(result.rows.ends) * len(problem.contacts)  # of a run [bytes]
    threads = max(1, int(min(resources.compiled_threads(), resources.available_memory() / histories)))
    values = values_with_clock(own)
    budget = budget_of(run, problem, values, result.dt, terms, filter_width=width, finer=finer, threads=threads)
    budget = with_end(computed, sum_by_source(budget, terms), result.dt, like)
    if blow is not stated:
        budget = replace(budget, values=values_of_record(replace(own, blow=stated), like))
    varied = {table.source_of(key) for key, each in terms.items() if each}
    floors: dict[str, float] = {source: least for source, least in FLOORS.items() if source in varied}
    if method.seat.level == "spring":
        floors["model"] = FLOOR_OF_SPRING
    in_parts = method.reed.lip is not None and computed.division.arcs > 1
    shares = {"model": WITHIN_PARTS} if in_parts else {}  # an error that more arcs do not reduce
    budget = with_floors(replace(budget, sources=(*budget.sources, *unknown)), floors, shares)
    budget = with_cut_landings(with_jumps(budget, blow), like, first_is_cut(touches.seat))
    return with_bars_of_measures(budget, like.seat)


def values_with_landings(landings: Landings) -> Iterator[tuple[str, str, Landing]]:
    """Yield the name of each value of a landing, its key in the landing's record, and the landing; measures of the
    judged landings are among them, after the values in the records."""
    for place, all_there in landings.places.items():
        for number, landing in enumerate(all_there):
            yield from ((landing_name(place, number, key), key, landing) for key in OF_A_LANDING.values())
    for prefix, landing in measures.judged_landings(landings.seat).items():
        yield from ((prefix + measure, key, landing) for key, measure in MEASURE_OF_KEY.items())


def unresolved_steps(landings: Landings, blow: ContactRecord) -> Values:
    """Return the least errors of the times of contacts, in steps: one where a time is known to whole steps only."""
    first, duration = measures.ContactDuration.landing_of(blow), measures.ContactDuration.name
    resolved = {"time_s": OF_TOUCH, "duration_s": JUMP}
    least = {duration: 1.0 if first is None or not first.is_resolved else JUMP} if np.any(_solid_force(blow)) else {}
    of_landings = (each for each in values_with_landings(landings) if each[1] in resolved)
    return least | {name: resolved[key] if landing.is_resolved else 1.0 for name, key, landing in of_landings}


def with_cut_landings(budget: Budget, landings: Landings, first_cut: bool) -> Budget:
    """Return the budget with infinite errors of what the end of the record cuts: duration and impulse of landings, the
    peak of one cut shortly after it, and the duration of a first contact."""
    cut = {measures.ContactDuration.name} if first_cut else set[str]()
    for name, key, landing in values_with_landings(landings):
        rises = "peak" in key and landing.end - landing.peak_time < landing.duration / 10
        if landing.cut_off and (rises or key in ("impulse_Ns", "duration_s")):
            cut.add(name)
    source = budget.dominant("impulse")
    unknown = dict.fromkeys(cut & budget.values.keys(), math.inf)
    return replace(budget, parts={**budget.parts, source: {**budget.parts[source], **unknown}})


def with_bars_of_measures(budget: Budget, landings: Sequence[Landing]) -> Budget:
    """Return the budget with errors in the record of a judged landing at least as large as those of its measures.

    The errors of measures include half the time step and jumps; the numbers in the record come from the same forces and
    are no more accurate.
    """
    parts = {source: dict(part) for source, part in budget.parts.items()}
    for prefix, landing in measures.judged_landings(landings).items():
        for key, measure in MEASURE_OF_KEY.items():
            name = landing_name("seat", landings.index(landing), key)
            if {name, prefix + measure} <= budget.values.keys():
                for part in parts.values():
                    part[name] = max(part[name], part[prefix + measure])
    return replace(budget, parts=parts)


def with_floors(budget: Budget, floors: Mapping[str, float], shares: Mapping[str, float]) -> Budget:
    """Return the budget with errors of each source at least its floor, and larger by its share, both relative to the
    value; times of landings have neither."""

    def raised(source: str, name: str, value: float) -> float:
        size = 0.0 if is_time(name) else abs(budget.values[name])
        return max(value, floors.get(source, 0.0) * size) + shares.get(source, 0.0) * size

    parts = {key: {name: raised(key, name, each) for name, each in part.items()} for key, part in budget.parts.items()}
    return replace(budget, parts=parts)


def with_end(computed: ComputedRun, budget: Budget, dt: float, like: Landings) -> Budget:
    """Return the budget, without `CLOCK`, with the change if the record ended earlier or later by the error bar of the
    last contact's time. It is added to the source that shifts this contact most.

    The record is of a longer run or, where the Green's function, a load or a base motion is unknown beyond the end, of
    the run itself.
    """
    scene, problem, duration = computed.scene, computed.problem, computed.scene.run.duration
    known = min(body.greens.valid_for for body in (problem.striker, *problem.targets))
    shifts = {source: part.get(CLOCK, 0.0) for source, part in budget.parts.items()}
    off = min(SAFETY * sum(shifts.values()), duration / 2)
    parts = {source: _without_clock(part) for source, part in budget.parts.items()}
    if off > 0:
        dt = 2 * dt if 4 * dt <= scene.run.filter_width else dt
        try:
            run = contact.marched(problem, dt, max(duration, min(duration + off, known)))
        except TimeSeriesError:  # a load or base motion ends before the longer run
            run = contact.marched(problem, dt, duration)

        def blow_until(time: float) -> ContactRecord:
            part = run.until(min(run.steps, max(1, round(time / dt))))
            return contact.record_of_march(scene, part, like, stresses=False).blow

        at_end, source = blow_until(duration), max(shifts, key=lambda each: shifts[each])
        cut: Values = dict.fromkeys(parts[source], 0.0)
        for by in (-off, off):
            other = values_of(blow_until(duration + by), at_end.landings)
            cut = larger(cut, {**cut, **changes(values_of(at_end, at_end.landings), other)})
        parts[source] = total(parts[source], cut)
    return replace(budget, values=_without_clock(budget.values), parts=parts)


def with_jumps(budget: Budget, blow: measures.ContactRecord) -> Budget:
    """Return the budget with jumps of measures within the error bar of the impulse, added to its main source."""
    if not budget.parts or not (0 < (share := budget.relative("impulse")) < math.inf):
        return budget
    source, jumps = budget.dominant("impulse"), dict.fromkeys(budget.values, 0.0)
    for name, measure in measures.all_measures().items():
        if name in jumps:
            jumps[name] = measure.jump(blow, share)
        for prefix, landing in measures.judged_landings(blow.landings).items():
            if prefix + name in jumps:
                jumps[prefix + name] = measure.estimate_landing_jump(blow, landing, share)
    duration = measures.ContactDuration()
    for number, landing in enumerate(blow.landings):
        if (name := landing_name("seat", number, "duration_s")) in jumps:
            jumps[name] = duration.estimate_landing_jump(blow, landing, share)
    return replace(budget, parts={**budget.parts, source: total(budget.parts[source], jumps)})


def varied_problems(
    run: ComputedRun, flights: contact.Flights
) -> tuple[ComputedRun, dict[str, Terms], tuple[str, ...]]:
    """Return a run, its varied problems by key, from coarser and finer values, and the names of the striker's and
    stopper's errors that cannot be estimated; they are found once for all runs that share ``flights``."""
    if not flights.varied:
        terms, unknown = dict[str, Terms](), list[str]()
        for ladder in table.LADDERS:
            if ladder.key != STEP and ladder.applies(run):
                varied = ladder.neighbours(run)
                if ladder.part and not all(varied):
                    unknown.append(f"{ladder.source}'s {ladder.part}")
                    varied = ()
                terms[ladder.key] = varied
        flights.varied.append((run, terms, tuple(unknown)))
    known: tuple[ComputedRun, dict[str, Terms], tuple[str, ...]] = flights.varied[0]
    return known


def sum_by_source(budget: Budget, terms: Mapping[str, Terms]) -> Budget:
    """Return a budget by key as one by source, with the errors by key beside; a source is unknown if one of its keys
    is."""
    of_step = budget.parts["time_step"]
    asked = {table.source_of(key) for key in terms}
    sources = [*SOURCES, *(source for source in (STRIKER, STOPPER, LIP, RECORD) if source in asked)]
    parts: dict[str, Values] = {}
    for source in sources:
        keys = [key for key in terms if table.source_of(key) == source]
        if all(key in budget.parts for key in keys):
            parts[source] = of_step if source == "time_step" else dict.fromkeys(budget.values, 0.0)
            for key in keys:
                parts[source] = combined(parts[source], budget.parts[key])
    by_key = {key: _without_clock(part) for key, part in budget.parts.items() if key in terms}
    return replace(budget, parts=parts, sources=tuple(sources), by_key={**by_key, STEP: _without_clock(of_step)})
