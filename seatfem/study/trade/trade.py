"""Measurement of the trade of speed for accuracy: states from coarse to fine, the run's own choice, and a reference.

The states are the rounds of the loop, from its first values to its converged ones; beside them are, on the ladders of
`seatfem.study.ladders.table`, the converged state with one key at its first value, or a rung finer, and all keys a rung
finer, and two. Each outcome is appended to the journal at once as a line of JSON, so that a stopped trade can be
continued.
"""

from __future__ import annotations

import json
import math
import os
import signal
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from impact.files.safe_files import check_writable
from impact.notices import Progress, SeatfemError, silent
from impact.quantities import brief, in_time
from seatfem.jobs import processes
from seatfem.jobs.cluster import cluster_crew
from seatfem.jobs.crew import Lost, crew
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import VARIABLE, code_version
from seatfem.machine.resources import Stopwatch, peak_memory
from seatfem.study.impacts import contact, landings
from seatfem.study.impacts.landings import LANDED, STATUS, has_landed, left_out_in_words
from seatfem.study.impacts.touches import measured
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.ladders.table import LADDERS, described
from seatfem.study.method import FIELDS, MODEL, MODES, PORTS, RunMethod, has_key, is_given, stated_method
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import LEAST, begin_method, begin_plan
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.rounds import rounds_in_temporary_folder, solve
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.measures import FIRST, HARDEST
from seatfem.study.scene.tables import path_from
from seatfem.study.sweep import effects, runner
from seatfem.study.sweep.runner import FAILURES, Outcome
from seatfem.units import write_quantity

TIME_LIMIT: Final = 20.0  # processor time for one point, the start of its process included [s]
PATIENCE: Final = 10.0  # ratio of wall time to that limit after which a point is killed; allows for a busy machine
LONGER: Final = 4.0  # time limit of the loop, of its choice and of finer states, over that of other points
WORKER: Final = "seatfem.study.trade.trade:reply"


def run_points(
    scene: Path,
    points: Sequence[Point],
    journal: Path | None,
    *,
    time_limit: float = TIME_LIMIT,
    cluster: str = "",
    progress: Progress = silent,
) -> dict[str, Outcome]:
    """Return outcomes by point name; new ones are appended to the ``journal`` at once. Those in it are not computed
    again, unless they were stopped at a lower time limit [s].

    A point that hangs, crashes or fails has an outcome, too. ``cluster``: address of a dask scheduler, whose workers
    compute points in parallel.
    """
    keys = {point.name: _key(scene, point) for point in points}
    on_file = runner.read_journal(journal) if journal else {}
    ended = {key: one for key, one in on_file.items() if one.state != "stopped" or processor_of(one) >= time_limit}
    outcomes = {name: ended[key] for name, key in keys.items() if key in ended}
    pending = [point for point in points if point.name not in outcomes]
    hired = crew(WORKER, renew=1) if not cluster else cluster_crew(cluster, WORKER, runner.packed_job, renew=1)
    with hired as ask:
        about = {"path": str(scene.resolve()), "changed": dict(ALL_OPEN), "limit": time_limit}
        jobs = (json.dumps({**about, "point": asdict(point)}) for point in pending)
        for number, answer in ask(jobs, PATIENCE * time_limit):
            name = pending[number].name
            outcomes[name] = _outcome(answer, time_limit)
            if journal is not None:
                runner.append(journal, keys[name], outcomes[name], point=name)
            progress("trade", len(outcomes) / len(points))
    return outcomes


def _key(scene: Path, point: Point) -> str:
    """Return the cache key of an outcome: text of the scene, values of the point, and the code."""
    parts = [code_version(), scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def processor_of(outcome: Outcome) -> float:
    """Return the processor time of an outcome [s]; nan if it is not known."""
    return float(outcome.summary.get(PROCESSOR, math.nan) or 0.0)


def _outcome(answer: str | Lost, limit: float) -> Outcome:
    if isinstance(answer, str):
        return Outcome(**json.loads(answer))
    why = ""
    if answer.hung:
        why = f"no end within {in_time(PATIENCE * limit)}"
    elif answer.code is not None and answer.code == -getattr(signal, "SIGXCPU", 0) < 0:
        why = f"no end within {limit:g} processor seconds"
    return Outcome("stopped", why, summary={PROCESSOR: limit}) if why else Outcome("failed", answer.in_words())


class TradeError(SeatfemError, ValueError):
    """Error of a trade that cannot be measured; the message states reason and remedy."""


@dataclass(frozen=True)
class Trade:
    """Times and errors of a scene at every fidelity.

    Attributes:
        title: title of the scene.
        measures: names of the scene's measures.
        target: required relative error.
        points: all points, the run's own choice and the reference included.
        outcomes: outcomes by name of the point.
        reference: name of the point relative to which errors are computed.
        floor: relative uncertainty of the reference by measure; smaller errors are not significant.
        choosing: wall time of the loop that ends with it [s].
    """

    title: str
    measures: tuple[str, ...]
    target: float
    points: tuple[Point, ...]
    outcomes: Mapping[str, Outcome]
    reference: str
    floor: Mapping[str, float]
    choosing: float = math.nan

    __repr__ = brief

    def done(self) -> tuple[Point, ...]:
        """Return the points that ended."""
        return tuple(point for point in self.points if self.outcomes[point.name].state == "done")

    def left_out_in_words(self) -> str:
        """Return as text how many of the points that ended have no error, since they did not land or were cut off."""
        ended = [self.outcomes[point.name] for point in self.done()]
        statuses = [LANDED if _answers(each, self.measures) else each.summary[STATUS] for each in ended]
        return left_out_in_words(statuses, "points")

    def cost(self, name: str) -> float:
        """Return the processor time of a point [s]; nan if it did not end."""
        outcome = self.outcomes[name]
        return processor_of(outcome) if outcome.state == "done" else math.nan

    def error(self, name: str, measure: str) -> float:
        """Return |value - reference|/|reference| of a point; nan if it did not end or has no value, as without a
        complete landing."""
        outcome, exact = self.outcomes[name], self.outcomes[self.reference].summary
        if outcome.state != "done" or measure not in outcome.summary or not _answers(outcome, [measure]):
            return math.nan
        return _relative(outcome.summary, exact, measure)

    def trusted_error(self, name: str, measure: str = "") -> float:
        """Return the error, at least the floor; without a ``measure`` the largest of these over all measures."""
        if not measure:
            errors = [self.trusted_error(name, each) for each in self.measures]
            return math.nan if any(map(math.isnan, errors)) else max(errors)
        error = self.error(name, measure)
        return error if math.isnan(error) else max(error, self.floor[measure])

    def front(self, measure: str = "") -> tuple[str, ...]:
        """Return the names on the Pareto front, cheapest first; by default by the largest error."""
        names = [point.name for point in self.done()]
        costs, errors = map(self.cost, names), (self.trusted_error(name, measure) for name in names)
        return tuple(names[i] for i in effects.pareto_front(list(costs), list(errors)))

    def excess(self, name: str, error: float | None = None) -> float:
        """Return a point's cost over the least cost for an ``error`` that it meets in all measures, by default its own;
        nan if it misses it."""
        own = self.trusted_error(name)
        error = own if error is None else error
        as_good = [self.cost(each.name) for each in self.done() if self.trusted_error(each.name) <= error]
        return self.cost(name) / min(as_good) if own <= error else math.nan


def measure_trade(
    path: Path | str,
    journal: Path | str,
    *,
    quick: bool = False,
    time_limit: float = TIME_LIMIT,
    cluster: str = "",
    progress: Progress = silent,
) -> Trade:
    """Run the scene at ``path`` at every fidelity; outcomes are stored in ``journal`` and reused from there.

    ``quick``: without the points in which one key is varied. ``cluster``: address of a dask scheduler
    (docs/cluster.md); times are then those of its computers, which should be equal. ``time_limit``: processor time of
    each point [s].

    Raises:
        SceneError: an error of the scene.
        ClusterError: an error of the cluster.
        TradeError: no reference ended within the time allowed.
    """
    path, journal = path_from(path), path_from(journal)
    filed, scene = load_scene(path), load_scene(path, ALL_OPEN)
    check_writable(journal)
    begun, limits = time.perf_counter(), Limits(seconds=LONGER * time_limit)
    methods_of_rounds(scene, Limits(rounds=1))  # may compile, which is none of the time that the loop is given
    *earlier, end = methods_of_rounds(scene, limits)
    choosing = time.perf_counter() - begun
    others = [method for n, method in enumerate(earlier) if method not in (*earlier[:n], end)]
    walk = [Point(f"state {n}", "all keys", each.values) for n, each in enumerate(others, 1)]
    chosen, ends = Plan(scene, end, ()), [Point(OWN_CHOICE, "all keys", end.values)]
    finer = chosen
    for rungs in ("one rung", "two rungs"):
        finer = finer_in_all(finer)
        ends.append(Point(f"all keys {rungs} finer", "all keys", finer.method.values))
    ascending, known = [point.name for point in (*walk, *ends)], [point.values for point in (*walk, ends[0])]
    start = begin_method(scene)
    varied = [] if quick else [point for point in around(chosen, start) if point.values not in known]
    if any(is_given(filed, key) for key in ALL_OPEN):
        ends.append(Point(AS_FILED, "all keys", methods_of_rounds(filed, limits)[-1].values))
    points = [*walk, *varied]
    outcomes = run_points(path, points, journal, time_limit=time_limit, cluster=cluster, progress=progress)
    outcomes |= run_points(path, ends, journal, time_limit=LONGER * time_limit, cluster=cluster, progress=progress)
    judged = tuple(scene.accuracy.judged)
    exact, back = _reference(path, scene.run.duration, judged, outcomes, ascending)
    values, coarser = outcomes[exact].summary, outcomes[back].summary
    floor = {name: _relative(coarser, values, name) / (LEAST - 1) for name in judged}
    title = scene.title or path.stem
    return Trade(title, judged, scene.accuracy.target, (*points, *ends), outcomes, exact, floor, choosing)


def _reference(
    path: Path, duration: float, measures: Sequence[str], outcomes: Mapping[str, Outcome], names: Sequence[str]
) -> tuple[str, str]:
    """Return the names of the finest point that ended and of the one a rung coarser, of ``names`` from coarse to fine.

    Raises `TradeError` if there are no two, or if the measures need a landing that they do not have.
    """
    ended = [name for name in names if outcomes[name].state == "done"]
    if len(ended) < 2:
        missing = "; ".join(f"{name}: {outcomes[name].message}" for name in names if name not in ended)
        raise TradeError(f"{path}: no reference ended ({missing}); give each point more time (--limit)")
    if not all(_answers(outcomes[name], measures) for name in ended[-2:]):
        why = left_out_in_words((outcomes[name].summary[STATUS] for name in ended), "points")
        remedy = f"lengthen run.duration = {write_quantity(duration, 'time')}, or ask for the whole run"
        raise TradeError(f'{path}: no landing to compare: {why}; {remedy} by accuracy.landing = "run"')
    return ended[-1], ended[-2]


def _answers(outcome: Outcome, measures: Sequence[str]) -> bool:
    """Return whether a point has the landings that these measures need."""
    return has_landed(outcome.summary) or not any(name.startswith((HARDEST, FIRST)) for name in measures)


def _relative(values: Mapping[str, Any], exact: Mapping[str, Any], name: str) -> float:
    """Return the relative difference of a value from the exact one."""
    difference = abs(values[name] - exact[name])
    return float(difference / abs(exact[name])) if exact[name] else math.inf if difference else 0.0


ALL_OPEN: Final[Mapping[str, object]] = dict.fromkeys(
    key for key in FIELDS if not key.startswith("reed.") or key == MODES
)
"""Keys that a trade takes out of the scene: those that a run chooses."""
PROCESSOR, MEMORY = "processor_s", "memory_bytes"
"""Keys of the costs: processor time of all threads, mesher included, or the limit if stopped [s]; peak memory of the
process [B]."""
OWN_CHOICE: Final = "the run's own choice"
AS_FILED: Final = "as the file says"


@dataclass(frozen=True)
class Point:
    """A scene at one fidelity.

    Attributes:
        name: name, unique among the points of a trade.
        varied: the key that differs from the converged state, or "all keys".
        values: values of `FIELDS` [SI].
    """

    name: str
    varied: str
    values: Mapping[str, Any] = field(default_factory=dict)


def methods_of_rounds(scene: Scene, limits: Limits) -> list[RunMethod]:
    """Return the method of each round of the loop, from the first values to the converged ones."""
    return [done.plan.method for done in rounds_in_temporary_folder(begin_plan(scene), Stopwatch(), limits)]


def with_all_open(plan: Plan) -> Plan:
    """Return the plan as if the file stated no key."""
    return replace(plan, method=replace(plan.method, given=frozenset()))


def finer_in_all(plan: Plan) -> Plan:
    """Return a plan with every key one rung finer, which divides its error by `LEAST`, as far as there are rungs."""
    finer = with_all_open(plan)
    for ladder in LADDERS:
        finer = replace(finer, method=ladder.refine(finer, LEAST))
    return finer


def around(plan: Plan, start: RunMethod) -> Iterator[Point]:
    """Yield the converged state of a plan with one key at its value of the ``start`` or one rung finer, and with other
    levels of the seat's model."""
    scene, end, free, first = plan.scene, plan.method, with_all_open(plan), start.values
    together = {key for ladder in LADDERS for key in ladder.also}
    for ladder in LADDERS:
        if ladder.key in together or (ladder.key in FIELDS and not has_key(scene, ladder.key)):
            continue
        keys = [key for key in (ladder.key, *ladder.also) if key in FIELDS]
        coarser = end.with_values(scene.geometry, {key: first[key] for key in keys})
        for method in (coarser, ladder.refine(free, LEAST)):
            if method.values != end.values:
                yield _varied(PORTS if ladder.key == ONE_PORT else ladder.key, method)
    if end.ports is None:  # a lip needs its own level
        for other in scene.seat.levels():
            if other.applies and other.level not in (first[MODEL], end.value(MODEL)):
                yield _varied(MODEL, end.replaced({MODEL: other.level}))


def _varied(key: str, method: RunMethod) -> Point:
    return Point(f"{key} {described(key, method.value(key)) if key in FIELDS else 'finer'}", key, method.values)


def carry_out(path: Path, point: Point, limit: float = math.inf, changed: Mapping[str, object] = ALL_OPEN) -> Outcome:
    """Compute seat, contact and measures of a point without error bars, files or pictures; a failure is an `Outcome`.

    It is computed twice where the ``limit`` of processor time allows [s], as the first time loads compiled code.
    ``changed``: keys that are replaced in the scene, or taken out of it (``None``). The summary has the measures [SI]
    by name, the status of the landing, unknowns, step and costs.
    """
    try:
        scene = load_scene(path, changed)
        contact.check_step(scene)
        plan = Plan(scene, stated_method(scene).with_values(scene.geometry, point.values), ())
        wall, processor, summary = _timed(plan)
        if _processor_time() + processor < limit:
            wall, processor, summary = _timed(plan)
    except FAILURES as error:
        return Outcome.from_failure(error)
    return Outcome("done", "", wall, {**summary, PROCESSOR: processor, MEMORY: peak_memory()})


def _timed(plan: Plan) -> tuple[float, float, dict[str, Any]]:
    """Compute a plan once; return wall time and processor time [s], and the summary."""
    wall, processor, scene = time.perf_counter(), _processor_time(), plan.scene
    done = solve(plan, Stopwatch(), mesh_error=False)
    touches = done.touches
    values = measured(touches, scene.run.filter_width, done.stress, scene.accuracy.landing)
    summary = {
        **dict.fromkeys(scene.accuracy.judged, 0.0),  # of a run without contact
        **values,
        landings.STATUS: touches.landings.status,
        "seat_dof": done.seat.about.get("seat_dof", 0),
        "time_step_s": done.result.dt,
    }
    return time.perf_counter() - wall, _processor_time() - processor, summary


def _processor_time() -> float:
    """Return the processor time of all threads of this process and of those it started (the mesher) [s]."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def reply(text: str) -> str:
    """Return the outcome of one job, within its processor time and in a folder without caches."""
    job: dict[str, Any] = json.loads(text)
    processes.limit_process(seconds=math.ceil(job["limit"]))
    with private_folder("point") as folder:
        os.environ[VARIABLE] = str(folder)
        return json.dumps(asdict(carry_out(Path(job["path"]), Point(**job["point"]), job["limit"], job["changed"])))
