"""Carries out cells in a process of its own: a hang, a crash or a blow-up of memory ends as an outcome, not the run."""

import json
import math
import os
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path

from impact.files.safe_files import check_writable
from impact.notices import Progress, silent
from seatfem.jobs import folders
from seatfem.jobs.cluster import cluster_crew
from seatfem.jobs.crew import Lost, crew
from seatfem.jobs.processes import limit_process
from seatfem.machine.code import code_version, hash_of
from seatfem.structures.cache import VARIABLE
from tests.extremes.battery import battery
from tests.extremes.cell import Cell, Outcome, carry_out
from tests.extremes.random_scenes import random_cells

WORKER = "tests.extremes.runner:reply"
TIME_LIMIT = 600.0  # s for one cell, of the clock: a busy machine is no hang


def run_battery(
    cells: Sequence[Cell],
    log: Path,
    *,
    time_limit: float = TIME_LIMIT,
    cluster: str | None = None,
    workers: int = 1,
    progress: Progress = silent,
) -> dict[str, Outcome]:
    """Return outcomes by cell name. Each is put into ``log`` (JSON lines) at once; what it holds is not computed again.

    Outcomes of another version of the program or of the battery stay in the file and are ignored. A line that a kill
    cut short is skipped. ``cluster``: the address of a scheduler of dask, whose workers find these tests (PYTHONPATH).
    """
    check_writable(log)
    version, ours = battery_version(), revision()
    finished = folders.outcomes(log, "cell", Outcome, version=version)
    todo = [cell.name for cell in cells if cell.name not in finished]
    hired = crew(WORKER, workers=workers) if cluster is None else cluster_crew(cluster, WORKER, lambda job: (job, {}))
    with hired as ask:
        for done, (number, answer) in enumerate(ask(todo, time_limit), start=1):
            name = todo[number]
            outcome = _lost(answer, time_limit) if isinstance(answer, Lost) else Outcome(**json.loads(answer))
            finished[name] = replace(outcome, revision=ours)
            folders.append(log, {"cell": name, "version": version, **asdict(finished[name])})
            progress(f"extremes, {name.partition(' = ')[0]}", done / len(todo))
    return {cell.name: finished[cell.name] for cell in cells if cell.name in finished}


def revision() -> str:
    """Return the revision of the program in git, "+" where files are changed; "" without git."""
    stated = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--exclude=*", "--dirty=+"]
    try:
        return subprocess.run(stated, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def battery_version() -> str:
    """Return the version of the program, of the battery, and of what draws its random scenes."""
    drawn = sorted((Path(__file__).parents[2] / "benchmarks").glob("drawn_*.py"))
    return f"{code_version()} {hash_of([Path(__file__).parent, *drawn])}"


def _lost(job: Lost, time_limit: float) -> Outcome:
    reason = f"no end within {time_limit:g} s" if job.hung else "the process died"
    return Outcome("wrong", math.nan, math.nan, reason, time_limit if job.hung else math.nan)


MOST_RANDOM = 1000  # random scenes, of the long form
MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


def reply(name: str) -> str:
    """Answer the crew: return the outcome of a cell in JSON."""
    return json.dumps(asdict(carry_out(_cells()[name])))


@cache
def _cells() -> dict[str, Cell]:
    """Make the cells of this process once; it stores bodies for itself alone."""
    cells = {cell.name: cell for cell in (*battery(), *random_cells(MOST_RANDOM))}
    limit_process(memory=MEMORY_LIMIT)
    os.environ[VARIABLE] = tempfile.mkdtemp()  # removed with the crew's folder
    return cells
