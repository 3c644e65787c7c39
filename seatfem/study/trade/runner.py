"""Runner of points, each in a process of its own: on one thread, with an empty store, within a time limit.

Outcomes are on file at once, one JSON line each: a ladder that was stopped goes on where it was.
"""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Final

from impact.progress import Progress, silent
from impact.quantities import in_time
from seatfem.jobs.batch import crew
from seatfem.jobs.cluster import cluster_crew
from seatfem.jobs.desk import ONE_THREAD, Lost, Program
from seatfem.machine.code import VARIABLE, code_version
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.sweep.runner import append, packed_job, read_journal
from seatfem.study.trade.point import PROCESSOR, Point

TIME_LIMIT: Final = 20.0  # processor s for one point, the start of its process included
PATIENCE: Final = 10.0  # s of the clock for each of them: for what hangs, and for machines that are busy otherwise
TOO_LONG: Final = 2.0  # predicted time over the limit from which a point is not tried: predictions are that good
PROGRAM: Final = Program(
    "seatfem.study.trade.point", renew=1, own_session=True, environment=ONE_THREAD, folder_in=(VARIABLE, "TMPDIR")
)
"""One thread, so that processor time is work; nothing computed before is at hand; what a point leaves goes with it."""


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
    """Return outcomes by point name. Those in the ``journal`` are not computed again; each new one goes there at once.

    A point that hangs, crashes or fails ends as an outcome. ``known``: outcomes of other points, for `Point.after`.
    ``cluster``: the address of a scheduler of dask, whose workers carry out side by side what waits for no other point.
    """
    outcomes, on_file, waiting = dict(known or {}), read_journal(journal) if journal else {}, list(points)
    keys, ended = {point.name: _key(scene, point) for point in points}, 0

    def end(point: Point, outcome: Outcome, *, new: bool = True) -> None:
        nonlocal ended
        if new and journal is not None:
            append(journal, keys[point.name], outcome, point=point.name)
        outcomes[point.name], ended = outcome, ended + 1
        progress("fidelity ladder", ended / len(points))

    with crew(PROGRAM, workers=1) if cluster is None else cluster_crew(cluster, PROGRAM, packed_job) as ask:
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
    """Return what an outcome depends on: the text of the scene, what the point changes in it, and the code."""
    parts = [code_version(), scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def _may_end_now(outcome: Outcome, time_limit: float) -> bool:
    """Return whether a point that was stopped may end within the time limit now, and is tried again."""
    return outcome.state == "stopped" and not processor_of(outcome) >= time_limit


def _obstacle(point: Point, found: Mapping[str, Outcome], time_limit: float) -> Outcome | None:
    """Return why a point is not even tried."""
    if point.predicted > TOO_LONG * time_limit:
        return _stopped(f"not tried: {in_time(point.predicted)} predicted", time_limit)
    before = found.get(point.after)
    if before is None or before.state == "done":
        return None
    return _stopped(f"not tried: {point.after} {before.state}", processor_of(before))


def _stopped(message: str, processor: float) -> Outcome:
    return Outcome("stopped", message, summary={PROCESSOR: processor})


def processor_of(outcome: Outcome) -> float:
    """Return its processor time [s]; nan where it is not known."""
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
