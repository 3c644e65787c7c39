"""Carries out cells in a process of its own: a hang, a crash or a blow-up of memory ends as an outcome, not the run."""

from __future__ import annotations

import json
import math
import multiprocessing as mp
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from multiprocessing.connection import Connection
from pathlib import Path

import impact
import seatfem
from impact.progress import Progress, silent
from seatfem.extremes.battery import battery
from seatfem.extremes.cell import Cell, Outcome, carry_out

TIME_LIMIT = 600.0  # s for one cell, of the clock: a busy machine is no hang
MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


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
    version = code_version()
    log.parent.mkdir(parents=True, exist_ok=True)
    known = _read(log, version)
    todo = [cell for cell in cells if cell.name not in known]
    with log.open("a", encoding="utf-8") as file:
        for done, (name, outcome) in enumerate(_carried_out(todo, time_limit)):
            known[name] = outcome
            line = {"cell": name, "version": version, **asdict(outcome)}
            file.write("\n" + json.dumps(line) if done == 0 and log.stat().st_size else json.dumps(line))
            file.write("\n")
            file.flush()
            progress(f"extremes, {name.partition(' = ')[0]}", (done + 1) / len(todo))
    return {cell.name: known[cell.name] for cell in cells if cell.name in known}


def code_version() -> str:
    """A hash of the sources of both packages."""
    digest = sha256()
    for package in (impact, seatfem):
        folder = Path(str(package.__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _carried_out(cells: Sequence[Cell], time_limit: float) -> Iterator[tuple[str, Outcome]]:
    """Each cell in a worker process, replaced when it hangs or dies."""
    context = mp.get_context("spawn")
    worker: tuple[mp.process.BaseProcess, Connection] | None = None
    try:
        for cell in cells:
            if worker is None:
                worker = _start(context)
            process, pipe = worker
            pipe.send(cell.name)
            outcome = _answer(process, pipe, time_limit)
            if outcome is None:
                alive = process.is_alive()
                _stop(worker)
                worker = None
                reason = f"no end within {time_limit:g} s" if alive else "the process died"
                outcome = Outcome("wrong", math.nan, math.nan, reason, time_limit if alive else math.nan)
            yield cell.name, outcome
    finally:
        if worker is not None:
            _stop(worker)


def _start(context: mp.context.SpawnContext) -> tuple[mp.process.BaseProcess, Connection]:
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    ours.recv()  # started, libraries loaded
    return process, ours


def _answer(process: mp.process.BaseProcess, pipe: Connection, time_limit: float) -> Outcome | None:
    with suppress(EOFError, ConnectionResetError):
        if pipe.poll(time_limit):
            answer: Outcome = pipe.recv()
            return answer
        return None
    process.join(5)
    return None


def _stop(worker: tuple[mp.process.BaseProcess, Connection]) -> None:
    process, pipe = worker
    pipe.close()
    process.kill()
    process.join()


def _work(pipe: Connection) -> None:
    """The worker: cells by name, outcomes back."""
    cells = {cell.name: cell for cell in battery()}
    _limit_memory()
    pipe.send("ready")
    while True:
        try:
            name = pipe.recv()
        except EOFError:
            return
        pipe.send(carry_out(cells[name]))


def _limit_memory() -> None:
    """Where the system can: allocations beyond the limit fail with MemoryError."""
    try:
        import resource  # absent on Windows
    except ImportError:
        return
    mapped = 0
    with suppress(OSError):
        mapped = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY_LIMIT, resource.RLIM_INFINITY))


def _read(log: Path, version: str) -> dict[str, Outcome]:
    found: dict[str, Outcome] = {}
    if not log.exists():
        return found
    for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
        with suppress(ValueError, KeyError, TypeError, AttributeError, RecursionError):
            entry = json.loads(line)
            name = entry.pop("cell")
            if entry.pop("version") == version:
                found[name] = Outcome(**entry)
    return found
