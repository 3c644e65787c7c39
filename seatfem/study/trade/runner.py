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
from seatfem.jobs import journal as lines
from seatfem.jobs.batch import crew
from seatfem.jobs.cluster import Parcel, cluster_crew
from seatfem.jobs.desk import ONE_THREAD, Lost, Program
from seatfem.machine.code import VARIABLE, code_version
from seatfem.study.scene.parcel import packed
from seatfem.study.trade.point import Outcome, Point

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
    journal: Path,
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
    if cluster is not None:
        _carry_out_there(scene, points, journal, time_limit, dict(known or {}), cluster)
    version, on_file = code_version(), read_journal(journal)
    outcomes = dict(known or {})
    for number, point in enumerate(points, start=1):
        key = _key(scene, point, version)
        outcome = on_file.get(key)
        if outcome is None or _may_end_now(outcome, time_limit):
            outcome = _obstacle(point, outcomes, time_limit) or run_point(scene, point, time_limit)
            append(journal, key, point, outcome)
        outcomes[point.name] = outcome
        progress("fidelity ladder", number / len(points))
    return outcomes


def _carry_out_there(
    scene: Path, points: Sequence[Point], journal: Path, limit: float, found: dict[str, Outcome], cluster: str
) -> None:
    """Carry out those of the points that can be tried, and write them to the journal."""
    version, on_file, waiting = code_version(), read_journal(journal), list(points)
    with cluster_crew(cluster, PROGRAM, _packed) as ask:
        while ready := [p for p in waiting if p.after not in {other.name for other in waiting} - {p.name}]:
            waiting = [point for point in waiting if point not in ready]
            pending = []
            for point in ready:
                outcome = on_file.get(_key(scene, point, version))
                if outcome is None or _may_end_now(outcome, limit):
                    outcome = _obstacle(point, found, limit)
                if outcome is not None:
                    found[point.name] = outcome
                else:
                    pending.append(point)
            for number, answer in ask([_job(scene, point, limit) for point in pending], PATIENCE * limit):
                point = pending[number]
                found[point.name] = _outcome(answer, limit)
                append(journal, _key(scene, point, version), point, found[point.name])


def _key(scene: Path, point: Point, version: str) -> str:
    """Return what an outcome depends on: the text of the scene, what the point changes in it, and the code."""
    parts = [version, scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def read_journal(path: Path) -> dict[str, Outcome]:
    """Return outcomes by key. A line that a kill cut short, or that is none of ours, is skipped."""
    return lines.outcomes(path, "key", lambda point, outcome: Outcome(**outcome))


def append(path: Path, key: str, point: Point, outcome: Outcome) -> None:
    """Append one more line, on file at once."""
    lines.append(path, {"key": key, "point": point.name, "outcome": asdict(outcome)})


def _may_end_now(outcome: Outcome, time_limit: float) -> bool:
    """Return whether a point that was stopped may end within the time limit now, and is tried again."""
    return outcome.state == "stopped" and not outcome.processor >= time_limit


def _obstacle(point: Point, found: Mapping[str, Outcome], time_limit: float) -> Outcome | None:
    """Return why a point is not even tried."""
    if point.predicted > TOO_LONG * time_limit:
        return Outcome("stopped", f"not tried: {in_time(point.predicted)} predicted", processor=time_limit)
    before = found.get(point.after)
    if before is None or before.state == "done":
        return None
    return Outcome("stopped", f"not tried: {point.after} {before.state}", processor=before.processor)


def run_point(scene: Path, point: Point, time_limit: float) -> Outcome:
    """Carry out one point, in a process of its own."""
    with crew(PROGRAM, workers=1) as ask:
        [(_, answer)] = ask([_job(scene, point, time_limit)], PATIENCE * time_limit)
    return _outcome(answer, time_limit)


def _job(scene: Path, point: Point, limit: float) -> str:
    return json.dumps({"scene": str(scene.resolve()), "point": asdict(point), "begun": time.time(), "limit": limit})


def _packed(line: str) -> Parcel:
    """Return a job with all files of its scene; clocks of other computers tell nothing of its start."""
    job = json.loads(line)
    place, changed, files = packed(Path(job["scene"]), {})
    point = job["point"] | {"settings": {**changed, **job["point"]["settings"]}}
    return Parcel(json.dumps(job | {"scene": place, "point": point, "begun": math.nan}), files)


def _outcome(answer: str | Lost, limit: float) -> Outcome:
    if isinstance(answer, str):
        return Outcome(**json.loads(answer))
    if answer.hung:
        return Outcome("stopped", f"no end within {in_time(PATIENCE * limit)}", processor=limit)
    if answer.code is not None and answer.code == -getattr(signal, "SIGXCPU", 0) < 0:
        return Outcome("stopped", f"no end within {limit:g} processor seconds", processor=limit)
    return Outcome("failed", answer.in_words())
