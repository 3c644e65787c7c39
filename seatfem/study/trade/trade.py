"""Measurement of the trade of speed for accuracy: points from coarse to fine, the planner's choice, and a reference.

Each outcome is appended to the journal at once as a line of JSON, so that a stopped trade can be continued.
"""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from impact.files.safe_files import check_writable
from impact.notices import Progress, silent
from impact.quantities import brief, in_time
from seatfem.jobs.cluster import cluster_crew
from seatfem.jobs.crew import Lost, crew
from seatfem.machine.code import code_version
from seatfem.study.impacts.landings import LANDED, STATUS, has_landed, left_out_in_words
from seatfem.study.ladders.ladder import RATIO
from seatfem.study.method import FIELDS, is_given
from seatfem.study.plan import Plan
from seatfem.study.runs.forecast import converge
from seatfem.study.runs.next_round import Limits
from seatfem.study.scene import load_scene
from seatfem.study.scene.measures import FIRST, HARDEST
from seatfem.study.sweep import effects, runner
from seatfem.study.sweep.runner import Outcome
from seatfem.study.trade.rungs import ALL_OPEN, BY_HAND, PROCESSOR, Point, Rungs, stated_choices
from seatfem.units import write_quantity

TIME_LIMIT: Final = 20.0  # processor time for one point, the start of its process included [s]
PATIENCE: Final = 10.0  # ratio of wall time to that limit after which a point is killed; allows for a busy machine
TOO_LONG: Final = 2.0  # ratio of predicted time to the limit above which a point is not tried; predictions are rough
WORKER: Final = "seatfem.study.trade.rungs:reply"


def run_points(
    scene: Path,
    points: Sequence[Point],
    journal: Path | None,
    *,
    time_limit: float = TIME_LIMIT,
    known: Mapping[str, Outcome] | None = None,
    cluster: str | None = None,
    progress: Progress = silent,
) -> dict[str, Outcome]:
    """Return outcomes by point name. Those in the ``journal`` are not computed again; new ones are appended at once.

    A point that hangs, crashes or fails has an outcome, too. ``known``: outcomes of other points, for `Point.after`.
    ``cluster``: address of a dask scheduler, whose workers compute independent points in parallel.
    """
    outcomes, on_file, waiting = dict(known or {}), runner.read_journal(journal) if journal else {}, list(points)
    keys, ended = {point.name: _key(scene, point) for point in points}, 0

    def end(point: Point, outcome: Outcome, *, new: bool = True) -> None:
        nonlocal ended
        if new and journal is not None:
            runner.append(journal, keys[point.name], outcome, point=point.name)
        outcomes[point.name], ended = outcome, ended + 1
        progress("fidelity ladder", ended / len(points))

    hired = crew(WORKER, renew=1) if cluster is None else cluster_crew(cluster, WORKER, runner.packed_job, renew=1)
    with hired as ask:
        while waiting:
            names = {point.name for point in waiting}
            ready = [point for point in waiting if point.after not in names - {point.name}]
            waiting = [point for point in waiting if point not in ready]
            pending = []
            for point in ready:
                outcome = on_file.get(keys[point.name])
                if outcome is not None and not _may_end_now(outcome, time_limit):
                    end(point, outcome, new=False)
                elif (obstacle := _obstacle(point, outcomes, time_limit)) is not None:
                    end(point, obstacle)
                else:
                    pending.append(point)
            for number, answer in ask((_job(scene, point, time_limit) for point in pending), PATIENCE * time_limit):
                end(pending[number], _outcome(answer, time_limit))
    return outcomes


def _key(scene: Path, point: Point) -> str:
    """Return the cache key of an outcome: text of the scene, settings of the point, and the code."""
    parts = [code_version(), scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def _may_end_now(outcome: Outcome, time_limit: float) -> bool:
    """Return whether a point was stopped at a lower time limit than this one, so that it is tried again."""
    return outcome.state == "stopped" and not processor_of(outcome) >= time_limit


def _obstacle(point: Point, outcomes: Mapping[str, Outcome], time_limit: float) -> Outcome | None:
    """Return the outcome of a point that is not tried, with the reason; ``None`` if it is to be tried."""
    if point.predicted > TOO_LONG * time_limit:
        return _stopped(f"not tried: {in_time(point.predicted)} predicted", time_limit)
    before = outcomes.get(point.after)
    if before is None or before.state == "done":
        return None
    return _stopped(f"not tried: {point.after} {before.state}", processor_of(before))


def _stopped(message: str, processor: float) -> Outcome:
    return Outcome("stopped", message, summary={PROCESSOR: processor})


def processor_of(outcome: Outcome) -> float:
    """Return the processor time of an outcome [s]; nan if it is not known."""
    return float(outcome.summary.get(PROCESSOR, math.nan) or 0.0)


def _job(scene: Path, point: Point, limit: float) -> str:
    fields = asdict(point)
    job = {"path": str(scene.resolve()), "changed": fields.pop("settings"), "point": fields}
    return json.dumps(job | {"begun": time.time(), "limit": limit})


def _outcome(answer: str | Lost, limit: float) -> Outcome:
    if isinstance(answer, str):
        return Outcome(**json.loads(answer))
    if answer.hung:
        return _stopped(f"no end within {in_time(PATIENCE * limit)}", limit)
    if answer.code is not None and answer.code == -getattr(signal, "SIGXCPU", 0) < 0:
        return _stopped(f"no end within {limit:g} processor seconds", limit)
    return Outcome("failed", answer.in_words())


PLANNED: Final = "planner's choice"
AS_FILED: Final = "as the file says"
LONGER: Final = 4.0  # time limit of the reference and the planner's choice, over that of other points
FINEST: Final = 3  # most refinements of mesh and band together beyond the centre
GROWTH: Final = {True: RATIO**4, False: RATIO**3}  # factor on the time by one refinement; true: in three dimensions


class TradeError(ValueError):
    """Error of a trade that cannot be measured; the message states reason and remedy."""


@dataclass(frozen=True)
class Trade:
    """Times and errors of a scene at every fidelity.

    Attributes:
        title: title of the scene.
        measures: names of the scene's measures.
        target: required relative error.
        points: all points, the planner's choice included.
        outcomes: outcomes by name of the point, the reference included.
        reference: name of the point relative to which errors are computed.
        floor: relative uncertainty of the reference by measure; smaller errors are not significant.
        planning: time of the planner [s].
    """

    title: str
    measures: tuple[str, ...]
    target: float
    points: tuple[Point, ...]
    outcomes: Mapping[str, Outcome]
    reference: str
    floor: Mapping[str, float]
    planning: float = math.nan

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

    def trusted_error(self, name: str, measure: str | None = None) -> float:
        """Return the error, at least the floor; without a ``measure`` the largest of these over all measures."""
        if measure is None:
            errors = [self.trusted_error(name, each) for each in self.measures]
            return math.nan if any(map(math.isnan, errors)) else max(errors)
        error = self.error(name, measure)
        return error if math.isnan(error) else max(error, self.floor[measure])

    def contenders(self, *, guesses: bool = False) -> tuple[str, ...]:
        """Return the names of the points with error bars; ``guesses``: also those by hand.

        The error of a stiffness estimated by hand is known only after the reference has run.
        """
        return tuple(point.name for point in self.points if guesses or point.varied != BY_HAND)

    def front(self, measure: str | None = None) -> tuple[str, ...]:
        """Return the Pareto front of the contenders, cheapest first; by default by the largest error."""
        names, (costs, errors) = self.contenders(), self._places(self.contenders(), measure)
        return tuple(names[i] for i in effects.pareto_front(costs, errors))

    def excess(self, name: str, measure: str | None = None, *, guesses: bool = False) -> float:
        """Return a point's cost over the least cost for an equal or smaller error; by default of the largest error."""
        others = self._places(self.contenders(guesses=guesses), measure)
        return cost_excess(self.cost(name), self.trusted_error(name, measure), *others)

    def _places(self, names: Sequence[str], measure: str | None) -> tuple[list[float], list[float]]:
        return [self.cost(name) for name in names], [self.trusted_error(name, measure) for name in names]

    def excess_at_target(self, name: str) -> float:
        """Return a point's cost over the least cost that meets the target in all measures; nan if it misses it."""
        if not self.trusted_error(name) <= self.target:
            return math.nan
        meeting = [self.cost(n) for n in self.contenders() if self.trusted_error(n) <= self.target]
        return self.cost(name) / min(meeting, default=self.cost(name))


def measure_trade(
    path: Path,
    journal: Path,
    *,
    quick: bool = False,
    time_limit: float = TIME_LIMIT,
    cluster: str | None = None,
    progress: Progress = silent,
) -> Trade:
    """Run the scene at ``path`` at every fidelity; outcomes are stored in ``journal`` and reused from there.

    ``cluster``: address of a dask scheduler (docs/cluster.md); times are then those of its computers, which should be
    equal. ``time_limit``: processor time of each point [s].

    Raises:
        SceneError: an error of the scene.
        ClusterError: an error of the cluster.
        TradeError: no reference ended within the time allowed.
    """
    scene = load_scene(path)
    check_writable(journal)
    begun = time.perf_counter()
    limits = Limits(seconds=LONGER * time_limit)
    planned = [_planned(PLANNED, converge(load_scene(path, ALL_OPEN), limits=limits).plan)]
    if any(is_given(scene, key) for key in FIELDS):
        planned.append(_planned(AS_FILED, converge(scene, limits=limits).plan))
    planning = time.perf_counter() - begun
    rings = max(int(str(point.settings.get("contact.rings") or 1)) for point in planned)
    rungs = Rungs(scene, rings)
    points, runs = rungs.points(quick=quick), _Runs(path, rungs, journal, time_limit, cluster)
    if cluster is None and not journal.exists():
        # one run of each family first, so that compiled code is cached before times are measured
        first = {point.family: replace(point, after="") for point in reversed(points) if point.varied == "diagonal"}
        run_points(path, tuple(first.values()), None, time_limit=LONGER * time_limit)
    runs.carry_out(points, progress=progress)
    runs.check_landed([point.name for point in points])
    runs.carry_out(planned, LONGER)
    finer = runs.finer(1 if quick else FINEST)
    exact, back = runs.reference(len(finer), lambda _, done: progress("reference", done))
    judged, values, others = tuple(scene.accuracy.judged), runs.found[exact].summary, runs.found[back].summary
    floor = {name: _relative(others, values, name) / (RATIO - 1) for name in judged}
    title = scene.title or path.stem
    return Trade(title, judged, scene.accuracy.target, (*points, *finer, *planned), runs.found, exact, floor, planning)


@dataclass
class _Runs:
    """Runs of the points of one scene; ``found``: their outcomes by name."""

    path: Path
    rungs: Rungs
    journal: Path
    limit: float
    cluster: str | None = None
    found: dict[str, Outcome] = field(default_factory=dict)

    def carry_out(self, points: Sequence[Point], longer: float = 1.0, progress: Progress = silent) -> None:
        """Compute further points, each within ``longer`` times the time limit."""
        limit = longer * self.limit
        self.found = run_points(
            self.path, points, self.journal, time_limit=limit, known=self.found, cluster=self.cluster, progress=progress
        )

    def check_landed(self, names: Sequence[str]) -> None:
        """Raise `TradeError` if the measures need a landing, and none of these points that ended has one."""
        ended = [each for name in names if (each := self.found.get(name)) is not None and each.state == "done"]
        scene = self.rungs.scene
        if ended and not any(_answers(each, scene.accuracy.judged) for each in ended):
            why = left_out_in_words((each.summary[STATUS] for each in ended), "points")
            remedy = f"lengthen run.duration = {write_quantity(scene.run.duration, 'time')}, or ask for the whole run"
            raise TradeError(f'{self.path}: no landing to compare: {why}; {remedy} by accuracy.landing = "run"')

    def seconds(self, top: int, notches: int) -> float:
        """Return the predicted time [s] of a mesh refined ``notches`` times from the rung ``top``; inf if unknown."""
        last = self.found.get(self.rungs.finer(top).name) if self.rungs.drawn else None
        if last is None or last.state != "done":
            return math.inf
        return processor_of(last) * GROWTH[self.rungs.is_solid] ** notches

    def finer(self, most: int) -> list[Point]:
        """Run and return points finer than the centre in all keys, while predicted to end in half the time limit."""
        added: list[Point] = []
        while len(added) < most and self.seconds(len(added), 1) <= self.limit / 2:
            added.append(self.rungs.finer(len(added) + 1))
            self.carry_out(added[-1:])
        return added

    def reference(self, top: int, progress: Progress) -> tuple[str, str]:
        """Return the names of the finest point that ends in time, and of one coarser by one step in all keys.

        The finest is finer than the rung ``top``. Refinements by 3 and 2 are tried only where predicted to take at most
        half of `LONGER` time limits.
        """
        notches = [n for n in (3, 2) if self.seconds(top, n) <= LONGER * self.limit / 2]
        tried = []
        for fineness in [top + n for n in (*notches, 1.0, 0.5)] if self.rungs.drawn else [float(FINEST)]:
            pair = [self.rungs.reference(fineness, coarser=coarser) for coarser in (False, True)]
            self.carry_out(pair, LONGER, progress)
            exact, back = (point.name for point in pair)
            if failed := [name for name in (exact, back) if self.found[name].state != "done"]:
                tried += [f"{name}: {self.found[name].message}" for name in failed]
                continue
            self.check_landed([exact])
            self.check_landed([back])
            return exact, back
        raise TradeError(f"{self.path}: no reference ended ({'; '.join(tried)}); give each point more time (--limit)")


def _planned(name: str, plan: Plan) -> Point:
    """Return the point with the choices of the loop for a scene."""
    settings = {**ALL_OPEN, **stated_choices(plan)}
    family = "as given" if plan.level == "closed form" else plan.level
    return Point(name, family, "planned", settings)


def _answers(outcome: Outcome, measures: Sequence[str]) -> bool:
    """Return whether a point has the landings that these measures need."""
    return has_landed(outcome.summary) or not any(name.startswith((HARDEST, FIRST)) for name in measures)


def _relative(values: Mapping[str, Any], exact: Mapping[str, Any], name: str) -> float:
    """Return the relative difference of a value from the exact one."""
    difference = abs(values[name] - exact[name])
    return float(difference / abs(exact[name])) if exact[name] else math.inf if difference else 0.0


def cost_excess(cost: float, error: float, costs: Sequence[float], errors: Sequence[float]) -> float:
    """Return ``cost`` over the least cost among the points with errors up to ``error``; 1 on the front or before it.

    It is nan if the cost or error is not finite.
    """
    as_good = [c for c, e in zip(costs, errors, strict=True) if math.isfinite(c) and e <= error]
    if not math.isfinite(cost) or not math.isfinite(error):
        return math.nan
    return max(1.0, cost / min(as_good)) if as_good else 1.0
