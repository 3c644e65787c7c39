"""Carries out points, each in a process of its own: on one thread, with an empty store, within a time limit.

Outcomes are on file at once, one JSON line each: a ladder that was stopped goes on where it was.
"""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Final

from impact.progress import Progress, silent
from seatfem.jobs import journal as lines
from seatfem.jobs.batch import answers
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import VARIABLE, code_version
from seatfem.study.trade.point import Outcome, Point

TIME_LIMIT: Final = 20.0  # processor s for one point, the start of its process included
PATIENCE: Final = 10.0  # s of the clock for each of them: for what hangs, and for machines that are busy otherwise
TOO_LONG: Final = 2.0  # predicted time over the limit from which a point is not tried: predictions are that good
_THREADS: Final = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def run_points(
    scene: Path,
    points: Sequence[Point],
    journal: Path,
    *,
    time_limit: float = TIME_LIMIT,
    known: Mapping[str, Outcome] | None = None,
    progress: Progress = silent,
) -> dict[str, Outcome]:
    """Outcomes by point name. Those in the ``journal`` are not computed again; each new one goes there at once.

    A point that hangs, crashes or fails ends as an outcome. ``known``: outcomes of other points, for `Point.after`.
    """
    version, on_file = code_version(), read_journal(journal)
    found = dict(known or {})
    for number, point in enumerate(points, start=1):
        key = _key(scene, point, version)
        outcome = on_file.get(key)
        if outcome is None or _may_end_now(outcome, time_limit):
            outcome = _obstacle(point, found, time_limit) or run_point(scene, point, time_limit)
            append(journal, key, point, outcome)
        found[point.name] = outcome
        progress("fidelity ladder", number / len(points))
    return found


def _key(scene: Path, point: Point, version: str) -> str:
    """What an outcome depends on: the text of the scene, what the point changes in it, and the code."""
    parts = [version, scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def read_journal(path: Path) -> dict[str, Outcome]:
    """Outcomes by key. A line that a kill cut short, or that is none of ours, is skipped."""
    return lines.outcomes(path, "key", lambda point, outcome: Outcome(**outcome))


def append(path: Path, key: str, point: Point, outcome: Outcome) -> None:
    """One more line, on file at once."""
    lines.append(path, {"key": key, "point": point.name, "outcome": asdict(outcome)})


def _may_end_now(outcome: Outcome, time_limit: float) -> bool:
    """A point that was stopped is tried again where it is given more time."""
    return outcome.state == "stopped" and not outcome.processor >= time_limit


def _obstacle(point: Point, found: Mapping[str, Outcome], time_limit: float) -> Outcome | None:
    """Why a point is not even tried."""
    if point.predicted > TOO_LONG * time_limit:
        return Outcome("stopped", f"not tried: {point.predicted:.3g} s predicted", processor=time_limit)
    before = found.get(point.after)
    if before is None or before.state == "done":
        return None
    return Outcome("stopped", f"not tried: {point.after} {before.state}", processor=before.processor)


def run_point(scene: Path, point: Point, time_limit: float) -> Outcome:
    """One point, in a process of its own."""
    patience = PATIENCE * time_limit
    task = {"scene": str(scene.resolve()), "point": asdict(point), "begun": time.time(), "limit": time_limit}
    with private_folder("trade") as folder:
        # one thread, so that processor time is work; nothing computed before is at hand; what it leaves goes with it
        environment = dict.fromkeys(_THREADS, "1") | {VARIABLE: str(folder / "store"), "TMPDIR": str(folder)}
        module, jobs = "seatfem.study.trade.point", [json.dumps(task)]
        [answer] = answers(jobs, module, limit=patience, own_session=True, environment=environment)
    if isinstance(answer, str):
        return Outcome(**json.loads(answer))
    if answer.hung:
        return Outcome("stopped", f"no end within {patience:g} s", processor=time_limit)
    if answer.code == -getattr(signal, "SIGXCPU", 0) < 0:
        return Outcome("stopped", f"no end within {time_limit:g} processor seconds", processor=time_limit)
    told = answer.log.strip().splitlines() or ["no message"]
    return Outcome("failed", f"the process died (exit code {answer.code}): {told[-1]}")
