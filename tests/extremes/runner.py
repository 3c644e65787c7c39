"""Carries out cells in a process of its own: a hang, a crash or a blow-up of memory ends as an outcome, not the run."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict
from pathlib import Path

from impact.files.atomic import check_writable
from impact.progress import Progress, silent
from seatfem.jobs.folders import private_folder
from seatfem.jobs.journal import append, entries
from seatfem.jobs.processes import LineWorker
from seatfem.machine.code import code_version
from tests.extremes.cell import Cell, Outcome

TIME_LIMIT = 600.0  # s for one cell, of the clock: a busy machine is no hang


def run_battery(
    cells: Sequence[Cell],
    log: Path,
    *,
    time_limit: float = TIME_LIMIT,
    progress: Progress = silent,
) -> dict[str, Outcome]:
    """Outcomes by cell name. Each is appended to ``log`` (JSON lines) at once; what it holds is not computed again.

    Outcomes of another code version stay in the file and are ignored. A line that a kill cut short is skipped.
    """
    check_writable(log)
    version = code_version()
    known = _read(log, version)
    todo = [cell for cell in cells if cell.name not in known]
    for done, (name, outcome) in enumerate(_carried_out(todo, time_limit), start=1):
        known[name] = outcome
        append(log, {"cell": name, "version": version, **asdict(outcome)})
        progress(f"extremes, {name.partition(' = ')[0]}", done / len(todo))
    return {cell.name: known[cell.name] for cell in cells if cell.name in known}


def _carried_out(cells: Sequence[Cell], time_limit: float) -> Iterator[tuple[str, Outcome]]:
    """Each cell in a worker process, replaced when it hangs or dies."""
    with private_folder("extremes") as folder, ExitStack() as ours:
        worker: LineWorker | None = None
        for cell in cells:
            if worker is None:
                worker = LineWorker("tests.extremes.worker", log=folder / "log.txt")
                ours.callback(worker.end)
            try:
                answer = worker.ask(cell.name, time_limit)
                outcome = Outcome(**json.loads(answer)) if answer else _wrong("the process died", math.nan)
            except TimeoutError:
                answer, outcome = "", _wrong(f"no end within {time_limit:g} s", time_limit)
            if not answer:
                ours.close()
                worker = None
            yield cell.name, outcome


def _wrong(reason: str, seconds: float) -> Outcome:
    return Outcome("wrong", math.nan, math.nan, reason, seconds)


def _read(log: Path, version: str) -> dict[str, Outcome]:
    found: dict[str, Outcome] = {}
    for entry in entries(log):
        with suppress(KeyError, TypeError, AttributeError):
            name = entry.pop("cell")
            if entry.pop("version") == version:
                found[name] = Outcome(**entry)
    return found
