"""The error budget of a run: what the neighbours on its ladders change, floors, jumps and the end of the record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final, get_args

import impact
from impact.after.landings import Landing
from impact.after.measures import first_is_cut
from impact.after.stresses import ReedStress
from impact.bodies.time_series import TimeSeriesError
from impact.march.problem import ContactProblem
from impact.notices import Progress, silent
from impact.runs import variations
from seatfem import structures
from seatfem.machine import compiling, resources
from seatfem.study import impacts, safety
from seatfem.study.accuracy.record_end import CLOCK, LastTouch, clock_off, with_end, without_clock
from seatfem.study.impacts import contact
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.landings import Face, Landings
from seatfem.study.impacts.touches import (
    LIP,
    RECORD,
    SOURCES,
    STOPPER,
    STRIKER,
    RunRecord,
    Touches,
    contact_record_of,
    is_time,
    landing_name,
    values_of_record,
)
from seatfem.study.ladders import march, table
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.method import RunMethod
from seatfem.study.scene import Scene, measures

KEYS_NEEDING_END: Final = ("impulse_Ns", "duration_s")
"""Keys of a landing whose values are unknown if the record ends during it."""
KEYS_OF_MEASURES: Final[Mapping[str, tuple[str, ...]]] = {
    measures.FilteredPeak.name: ("filtered_peak_force_N", "excess_peak_force_N"),
    measures.Impulse.name: ("impulse_Ns",),
    measures.ContactDuration.name: ("duration_s",),
}
"""Keys in the record of a landing whose error bar is at least that of the measure."""


def error_budget(
    scene: Scene,
    method: RunMethod,
    seat: structures.method.Solved,
    striker: impact.Body,
    touches: Touches,
    stress: ReedStress | None = None,
    reed: structures.method.Solved | None = None,
    look: impacts.plate_stress.PlateLook | None = None,
    progress: Progress = silent,
    flights: contact.Flights | None = None,
) -> variations.Budget:
    """Return the errors of the measures of a run by source: the run is repeated with each key coarser, or finer, alone.

    The keys, and the neighbours that tell of each, are those of `seatfem.study.ladders.table`; the march repeats the
    run with a step twice and four times as long, and `impact.runs.variations.budget_of` compares. Beside them:

    - time_step: also half the step through the impact that is judged, and, where waves cross a rod within the step,
      one that they do not: all longer ones agree with each other;
    - a floor of each source, which no comparison may go below, and `WITHIN_PARTS` for a plate on a lip in arcs;
    - what the end of the record cuts off, and what measures may jump by within the bar of the impulse.

    ``stress``: the reed's in ``touches``, if wanted; ``look``: at that of a plate in other runs; ``progress``: hears of
    each run; ``flights``: of the striker, where other runs share them.
    """
    result, flights = touches.seat, flights or contact.Flights(striker, scene.run.duration, scene.contact.preload)
    problem, width = problem_of(scene, striker, impact.Body(seat.greens)), scene.run.filter_width
    computed = ComputedRun(scene, method, seat, problem, reed)
    sources, unknown = sources_of(computed)

    blow = contact_record_of(touches, width, stress, scene.accuracy.landing)
    last, like = LastTouch.from_record(blow), touches.landings
    own = RunRecord(blow, like, touches.stopper_force)

    def values_with_clock(record: RunRecord) -> variations.Values:
        return {**values_of_record(record, like), CLOCK: last.time(record.blow)}

    runs, count = 2 + sum(len(term) for terms in sources.values() for term in terms or ()), 0

    def run(varied: ContactProblem, dt: float) -> variations.Values:
        nonlocal count
        count += 1
        progress("error budget", min(count / runs, 1.0))
        return values_with_clock(contact.record_of(scene, varied, dt, flights, like, look=look))

    finer = march.left_by_half_step(computed, touches, look)
    if finer is None:
        finer = variations.times(2.0, variations.changes(values_of_record(own, like), run(problem, result.dt / 2)))
    if shorter := march.step_of_waves(problem, result.dt, scene.run.duration):
        apart = variations.changes(values_of_record(own, like), run(problem, shorter))
        finer = {name: max(value, finer.get(name, 0.0)) for name, value in apart.items()}
    at_once = _at_once(len(result.force) * len(problem.contacts))
    values = values_with_clock(own)
    budget = variations.budget_of(
        run, problem, values, result.dt, sources, filter_width=width, finer=finer, threads=at_once
    )
    budget = _with_end(scene, problem, budget, result.dt, like)
    names = (*SOURCES, *(name for name in (STRIKER, STOPPER, LIP, RECORD) if name in sources))
    known_parts = {str(s): budget.parts[s] for s in names if s in budget.parts}
    floors = {source: least for source, least in safety.FLOORS.items() if sources.get(source)}
    if method.seat.level == "spring":
        floors["model"] = safety.FLOOR_OF_SPRING
    budget = with_floors(variations.Budget(budget.values, known_parts, (*names, *unknown)), floors)
    if scene.reed.thin_plate is not None and computed.division.arcs > 1:
        budget = with_share(budget, "model", safety.WITHIN_PARTS)  # no number of parts makes it smaller
    return with_cut_landings(with_jumps(budget, blow), like, first_is_cut(touches.seat))


def with_cut_landings(budget: variations.Budget, landings: Landings | None, first_cut: bool) -> variations.Budget:
    """Return the budget with unknown duration and impulse of landings that the end of the record cuts, unknown peak of
    one cut shortly after its peak, and unknown duration of a first contact that is cut."""
    if landings is None or not budget.parts:
        return budget
    cut = [
        landing_name(face, number, key)
        for face in get_args(Face)
        for number, landing in enumerate(landings.on(face))
        for key in KEYS_NEEDING_END
        if landing.cut_off
    ]
    for prefix, judged in measures.judged_landings(landings.seat).items():
        if judged.cut_off:
            cut += [prefix + measures.Impulse.name, prefix + measures.ContactDuration.name]
            rises = judged.end - judged.peak_time < judged.duration / 10
            cut += [prefix + measures.FilteredPeak.name] if rises else []
    cut += [measures.ContactDuration.name] if first_cut else []
    source = budget.dominant("impulse")
    unknown = {name: math.inf for name in cut if name in budget.values}
    return replace(budget, parts={**budget.parts, source: {**budget.parts[source], **unknown}})


def with_bars_of_measures(budget: variations.Budget, landings: Sequence[Landing]) -> variations.Budget:
    """Return the budget in which the record of a landing has no smaller parts than measures of that landing.

    Half the step is marched through the judged landing alone, measures jump, and plans know more of them: the record of
    that landing, which the same forces make, knows its numbers no better.
    """
    pairs = (
        (landing_name("seat", landings.index(landing), key), prefix + measure)
        for prefix, landing in measures.judged_landings(landings).items()
        for measure, keys in KEYS_OF_MEASURES.items()
        for key in keys
    )
    same = {name: measure for name, measure in pairs if name in budget.values and measure in budget.values}
    parts = {
        source: {**part, **{name: max(part[name], part[measure]) for name, measure in same.items()}}
        for source, part in budget.parts.items()
    }
    return replace(budget, parts=parts)


def with_floors(budget: variations.Budget, floors: Mapping[str, float]) -> variations.Budget:
    """Return the budget with parts of each source no smaller than its floor in `seatfem.study.safety`, relative to the
    measure; times of landings have none, as a share of the time before them means nothing."""
    raised = {
        source: {
            name: value if is_time(name) else max(value, floors.get(source, 0.0) * abs(budget.values[name]))
            for name, value in part.items()
        }
        for source, part in budget.parts.items()
    }
    return replace(budget, parts=raised)


def with_share(budget: variations.Budget, source: str, share: float) -> variations.Budget:
    """Return the budget with a ``share`` of each value added to a known source, but to times of landings."""
    if source not in budget.parts:
        return budget
    more = {name: 0.0 if is_time(name) else share * abs(value) for name, value in budget.values.items()}
    return replace(budget, parts={**budget.parts, source: variations.total(budget.parts[source], more)})


def _with_end(
    scene: Scene, problem: ContactProblem, budget: variations.Budget, dt: float, like: Landings | None
) -> variations.Budget:
    """Return the budget with the error by the end of the record; where g, or the course of a load or of a base, is
    unknown beyond it, by earlier touches."""
    duration, known = scene.run.duration, min(body.greens.valid_for for body in (problem.striker, *problem.targets))
    off = min(clock_off(budget), duration / 2)
    if off > 0:
        dt = 2 * dt if 4 * dt <= scene.run.filter_width else dt
        longest = max(duration, min(duration + off, known))
        try:
            record = contact.record_of(scene, problem, dt, like=like, duration=longest, stresses=False)
        except TimeSeriesError:  # a course that covers the run, but not this much more
            record = contact.record_of(scene, problem, dt, like=like, stresses=False)
        budget = with_end(budget, record.blow, duration, off)
    return without_clock(budget)


def with_jumps(budget: variations.Budget, blow: measures.ContactRecord) -> variations.Budget:
    """Return the budget with the jumps of measures while the impulse is within its bar, added to its main source."""
    if not budget.parts or not (0 < (share := budget.relative("impulse")) < math.inf):
        return budget
    source, jumps = budget.dominant("impulse"), dict.fromkeys(budget.values, 0.0)
    for name, measure in measures.all_measures().items():
        if name in jumps:
            jumps[name] = measure.jump(blow, share)
        for prefix, landing in measures.judged_landings(blow.landings).items():
            if prefix + name in jumps:
                jumps[prefix + name] = measure.jump_of_landing(blow, landing, share)
    lasting = measures.ContactDuration()
    for number, landing in enumerate(blow.landings):
        if (name := landing_name("seat", number, "duration_s")) in jumps:
            jumps[name] = lasting.jump_of_landing(blow, landing, share)
    return replace(budget, parts={**budget.parts, source: variations.total(budget.parts[source], jumps)})


def _at_once(steps: int) -> int:
    """Return how many runs are marched at once: one a core, if memory holds the histories of so many ``steps``."""
    room = resources.available_memory() / (contact.STEP_BYTES * steps)
    return max(1, int(min(compiling.threads(), room)))


def sources_of(run: ComputedRun) -> tuple[dict[str, variations.Terms | None], tuple[str, ...]]:
    """Return the variations for `error_budget` by source, from the neighbours of a run on each of its ladders; and the
    names of striker's and stopper's errors that are not known."""
    sources: dict[str, variations.Terms | None] = {source: () for source in SOURCES if source != "time_step"}
    unknown = []
    for ladder in table.ladders():
        if not ladder.applies(run):
            continue
        terms, known = ladder.neighbours(run), sources.get(ladder.source, ())
        if terms is None and ladder.part:
            unknown.append(f"{ladder.source}'s {ladder.part}")
            terms = ()
        sources[ladder.source] = None if terms is None or known is None else (*known, *terms)
    return sources, tuple(unknown)
