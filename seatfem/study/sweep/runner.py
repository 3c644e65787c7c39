"""Workers of a study: the run of one scene, the journal of all, and the limits on the computing effort."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Final, Literal, get_args

from impact.files.safe_files import check_writable
from impact.notices import Progress, SeatfemError, silent
from impact.quantities import in_time
from seatfem.jobs import folders
from seatfem.jobs import folders as lines
from seatfem.jobs.cluster import cluster_crew, threads_of
from seatfem.jobs.crew import Ask, Lost, crew
from seatfem.jobs.folders import claimed
from seatfem.machine.resources import Stopwatch
from seatfem.structures import cache
from seatfem.study.runs import converge, next_round, pipeline
from seatfem.study.runs import rounds as rounds_of
from seatfem.study.runs.next_round import Limits
from seatfem.study.scene import load as scene_reader
from seatfem.study.scene.files import packed
from seatfem.study.sweep import cases as study_cases
from seatfem.study.sweep.cases import Case, chosen
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.study import Study

State = Literal["done", "missed", "stopped", "failed"]
Changes = Mapping[str, Any]
Scalar = float | int | bool | str | None
NOTES: Final = "notes"
"""Key of summary.json with the limitations of its results, a sentence each."""
FAILURES: Final = (ArithmeticError, AssertionError, LookupError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors that count as failure of a scene."""


@dataclass(frozen=True)
class Outcome:
    """Results of a scene, or the reason why it has none.

    Attributes:
        state: "done"; "missed": done, but above the target of accuracy; "stopped" at the time limit; "failed".
        message: reason of another state than "done".
        wall: wall time [s].
        summary: scalar values of summary.json, and its notes as one text.
        start: initial settings for later scenes (`seatfem.study.sweep.cases`), if requested.
    """

    state: State
    message: str = ""
    wall: float = math.nan
    summary: Mapping[str, Scalar] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = self.state in get_args(State) and isinstance(self.message, str) and isinstance(self.wall, int | float)
        maps = isinstance(self.summary, Mapping) and isinstance(self.start, Mapping)
        sound = not self.start or isinstance(self.start.get("work"), int | float) if maps else False
        if not (known and sound and all(map(_is_scalar, self.summary.values()))):
            raise TypeError("no outcome of a scene")  # a damaged journal

    @property
    def has_numbers(self) -> bool:
        """Return whether the scene has results."""
        return self.state in ("done", "missed")

    @staticmethod
    def from_failure(error: Exception, **others: Any) -> Outcome:
        """Return the outcome of a scene that raised one of `FAILURES`."""
        return Outcome("failed", f"{type(error).__name__}: {error}", **others)


def carry_out(
    path: Path,
    changed: Changes,
    rounds: int,
    start: Mapping[str, Any],
    *,
    leads: bool = False,
    once: bool = False,
    carried: bool = False,
    stress: bool = True,
) -> Outcome:
    """Run the scene at ``path`` with some keys changed, in a temporary folder; failures are outcomes.

    Args:
        path, changed, rounds: the scene, its changed keys, and the largest number of refinement rounds.
        start: initial settings from another scene, or empty; if the scene fails or misses its target with them, it is
            run again without them.
        leads: whether the outcome is to contain a ``start`` for other scenes.
        once: whether to run once with the settings of ``start``, without refinement.
        carried: whether to run so without error bars, as those of other scenes are carried over to it; a scene that
            fails so is run in full.
        stress: whether to compute the reed's largest stresses if the scene does not need them.
    """
    clock = time.perf_counter()

    def tried(rounds: int, start: Mapping[str, Any]) -> Outcome:
        limits = next_round.Limits(rounds, steady=True, stress=stress)
        try:
            return _carried_out(path, changed, limits, start, leads=leads)
        except FAILURES as error:
            return Outcome.from_failure(error)

    if carried:
        with suppress(*FAILURES):
            return replace(_run_without_bars(path, changed, start, stress=stress), wall=time.perf_counter() - clock)
    outcome = tried(1 if once and start else rounds, start)
    if start and outcome.state != "done" and not once:
        outcome = tried(rounds, {})
    return replace(outcome, wall=time.perf_counter() - clock)


def _run_without_bars(path: Path, changed: Changes, start: Mapping[str, Any], *, stress: bool) -> Outcome:
    """Return the outcome of a scene by the settings of ``start``, without error bars and spring baseline. Raises
    `StudyError` if they do not suit it."""
    plan = study_cases.begun(scene_reader.load_scene(path, changed), start)
    if plan is None:
        raise StudyError("start: of another kind of scene; run it in full")
    watch = Stopwatch()
    with folders.private_folder("sweep") as folder:
        done = rounds_of.solve(plan, watch, cache=cache.Cache(folder / rounds_of.SEAT_FILE))
        done = rounds_of.with_stress(done, next_round.Limits(stress=stress), watch)
        numbers = pipeline.summarise_own_run(done)
    return Outcome("done", "", 0.0, {key: _scalar(value) for key, value in numbers.items() if _is_scalar(value)})


def _carried_out(
    path: Path, changed: Changes, limits: next_round.Limits, start: Mapping[str, Any], *, leads: bool
) -> Outcome:
    scene = scene_reader.load_scene(path, changed)
    with folders.private_folder("sweep") as folder:
        plan = study_cases.begun(scene, start)
        if plan is None:
            scene = scene_reader.load_scene(path, {**changed, **start.get("seat", {})})
            plan = converge.begin_plan(scene)
        result = pipeline.run_scene(scene, folder, limits=limits, pictures=False, plan=plan, histories=False)
    summary = {key: _scalar(value) for key, value in result.summary.items() if _is_scalar(value)}
    notes = result.summary[NOTES]
    summary[NOTES] = " | ".join(map(str, notes)) if isinstance(notes, list) else ""
    assert result.plan is not None
    serves = result.met is True or summary.get("landing_status") == "cut off"  # another plan would not change this
    next_start = study_cases.start_of(result.plan) if leads and serves else {}
    missed = result.met is False
    return Outcome("missed" if missed else "done", result.messages[0] if missed else "", 0.0, summary, next_start)


def _is_scalar(value: object) -> bool:
    return value is None or isinstance(value, str | Real)


def _scalar(value: object) -> Scalar:
    if value is None or isinstance(value, bool | str):
        return value
    return int(value) if isinstance(value, Integral) else float(value)  # type: ignore[arg-type]


JOURNAL: Final = "study.jsonl"
STAGE: Final = "scenes"
TRIES: Final = 2  # runs of a scene whose process dies, as one that the system has killed for its memory
SIDE_BY_SIDE: Final = 64  # largest number of scenes per job integrated in parallel: four times the lanes
RENEW: Final = 500  # scenes after which a worker is replaced, for memory that libraries leak
WORKER: Final = "seatfem.study.sweep.side_by_side:reply"


class StudyError(SeatfemError, ValueError):
    """Error of a study that cannot be run; the message states reason and remedy."""


def check_effort(effort: Effort) -> int | None:
    """Return the number of workers; None if it is to be chosen.

    Raises:
        StudyError: options out of range.
        ClusterError: no answer at the address of a cluster, or workers of another version.
    """
    workers, limit = effort.workers, effort.limit
    Limits(effort.rounds)
    if workers is not None and not (isinstance(workers, int) and workers >= 1):
        raise StudyError(f"--workers = {workers!r} must be a whole number, at least 1")
    if not (limit > 0 and math.isfinite(limit)):
        raise StudyError(f"--limit = {in_time(limit)} must be positive and finite")
    if not effort.cluster:
        return workers
    if workers is not None:
        raise StudyError(f"--workers = {workers} are processes of this computer; leave it out beside --cluster")
    return threads_of(effort.cluster)


@contextmanager
def folder_of_ours(folder: Path) -> Iterator[Path]:
    """Yield the path of the journal in a folder that is locked against other studies meanwhile.

    Raises `OutputError` if the folder cannot be written to, `StudyError` if another study uses it.
    """
    journal = folder / JOURNAL
    check_writable(journal)
    with claimed(folder / f".{JOURNAL}.lock", 0.0) as is_free:
        if not is_free:
            raise StudyError(f"{folder}: another sweep is at work there; wait for it, or choose another --output")
        if journal.is_symlink():
            raise StudyError(f"{journal}: is a link; remove it, or choose another --output")
        yield journal


@dataclass
class Runner:
    """Runner of the scenes of a study by workers; each outcome is written to the journal at once.

    Attributes:
        study: the study.
        journal: path of the journal.
        effort: rounds and time limit of each scene; a stopped scene in the journal is tried again with more time, all
            without results with ``retry``.
        heard: function that is called with each new outcome after it is written; its errors end the study.
        known: outcomes by the keys of cases, from the journal and since.
    """

    study: Study
    journal: Path
    effort: Effort
    heard: Callable[[Outcome], None]
    known: dict[str, Outcome] = field(init=False)
    is_headed: bool = False

    def __post_init__(self) -> None:
        on_file, effort = read_journal(self.journal), self.effort
        retried = {key for key, each in on_file.items() if not each.has_numbers and effort.retry}
        stopped = {key for key, each in on_file.items() if each.state == "stopped" and each.wall < effort.limit}
        self.known = {key: each for key, each in on_file.items() if key not in retried | stopped}

    def pending(self, cases: Sequence[Case]) -> list[Case]:
        """Return the cases without a valid outcome in the journal, without repetitions."""
        return [case for key, case in {case.key: case for case in cases}.items() if key not in self.known]

    def carry_out(self, cases: Sequence[Case], ask: Ask, progress: Progress = silent) -> dict[str, Outcome]:
        """Return the outcomes of cases by their keys; those in the journal are not computed again.

        ``ask``: workers by `crew_of`.
        """
        wanted, pending = {case.key: case for case in cases}, self.pending(cases)
        for outcome in [each for key in wanted if (each := self.known.get(key)) and each.has_numbers][:1]:
            self.heard(outcome)
        if pending and not self.is_headed:
            lines.append(self.journal, {"study": self.study.model_dump(mode="json", by_alias=True)})
            self.is_headed = True
        ended = len(wanted) - len(pending)
        progress(STAGE, ended / len(wanted))
        for beside, guides in sorted({_turn(case) for case in pending}):
            now = [case for case in pending if _turn(case) == (beside, guides)]
            size = SIDE_BY_SIDE if beside else 1
            waiting = [now[first : first + size] for first in range(0, len(now), size)]
            for attempt in range(1, TRIES + 1):
                died, jobs = [], [self._job(bundle, wanted) for bundle in waiting]
                for number, answer in ask(jobs, self.effort.limit * max(map(len, waiting), default=1)):
                    if isinstance(answer, Lost) and not answer.hung and attempt < TRIES:
                        died.append(waiting[number])
                        continue
                    for case, outcome in zip(waiting[number], self._outcomes(answer, waiting[number]), strict=True):
                        append(self.journal, case.key, outcome, changed=case.changed)
                        self.known[case.key] = outcome
                        self.heard(outcome)
                    ended += len(waiting[number])
                    progress(STAGE, ended / len(wanted))
                waiting = died
        return {key: self.known[key] for key in wanted}

    def _job(self, bundle: Sequence[Case], wanted: Mapping[str, Case]) -> str:
        """Return a job for the worker, with the start from those of the first scenes with the seat that met their
        target."""
        case = bundle[0]
        guides = [self.known[key] for key in case.guides if key in self.known]
        start = chosen([each.start for each in guides if each.start])
        scene, rounds = str(self.study.scene), self.effort.rounds
        job = {"path": scene, "changed": case.changed, "rounds": rounds, "start": start}
        if case.way != "beside":
            ways = {"leads": case.leads, "once": case.way == "sample", "carried": case.way == "carried"}
            return json.dumps(job | ways | {"stress": case.stress})
        others = [each.changed for each in bundle]
        return json.dumps(job | {"changed": wanted[case.guides[0]].changed, "others": others, "needs": case.needs})

    def _outcomes(self, answer: str | Lost, bundle: Sequence[Case]) -> list[Outcome]:
        """Return the outcomes of one scene, or of several side by side."""
        if isinstance(answer, str):
            entries = json.loads(answer)
            return [Outcome(**each) for each in (entries if isinstance(entries, list) else [entries])]
        lost = Outcome("failed", answer.in_words(), answer.seconds)
        if answer.hung:
            lost = Outcome("stopped", f"no end within {in_time(self.effort.limit)} (--limit)", self.effort.limit)
        return [lost] * len(bundle)


def _turn(case: Case) -> tuple[bool, int]:
    """Return the turn of a case: cases of one turn may run at the same time, the lowest turn first."""
    return case.way == "beside", len(case.guides)


def crew_of(workers: int, cluster: str = "") -> AbstractContextManager[Ask]:
    """Start ``workers`` for calls of `Runner.carry_out`; or use those of the cluster at an address."""
    if not cluster:
        return crew(WORKER, workers=workers, renew=RENEW)
    return cluster_crew(cluster, WORKER, packed_job, renew=RENEW)


def packed_job(text: str) -> tuple[str, dict[str, Path]]:
    """Return a job with all files of its scene."""
    job = json.loads(text)
    place, changed, files = packed(Path(job["path"]), job["changed"])
    return json.dumps(job | {"path": place, "changed": changed}), files


def read_journal(path: Path) -> dict[str, Outcome]:
    """Return outcomes by key. A line that is truncated, or not of a study, is skipped."""
    return lines.outcomes(path, "key", lambda outcome, **_: Outcome(**outcome))


def append(path: Path, key: str, outcome: Outcome, **about: object) -> None:
    """Append one line at once; ``about``: description of the scene for readers."""
    lines.append(path, {"key": key, **about, "outcome": asdict(outcome)})
