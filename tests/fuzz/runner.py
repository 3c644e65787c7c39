"""Carries out cases in forked processes under limits: what hangs or crashes ends as a verdict, not the run."""

from __future__ import annotations

import faulthandler
import multiprocessing as mp
import os
import resource
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Final

from seatfem.jobs.journal import append, entries
from seatfem.jobs.processes import started_by
from seatfem.jobs.worker import end_with_parent

from .trial import Case, Verdict, carry_out

MEMORY: Final = 4 << 30  # bytes of address space beyond what the libraries map
FILE_SIZE: Final = 256 << 20  # bytes of one file
TIME: Final = 150.0  # s of a case; gmsh may try to read a file for 100 s
CASES_A_PROCESS: Final = 300


@dataclass
class Worker:
    """A process that carries out cases."""

    process: BaseProcess
    pipe: Connection
    trace: Path
    done: int = 0


def run_cases(
    cases: Sequence[Case], corpus: Path, folder: Path, log: Path, tell: Callable[[str], None], limit: float = TIME
) -> dict[str, Verdict]:
    """Verdicts by the name of the case; each is appended to ``log`` at once, and what that holds is not done again."""
    known = read_log(log)
    todo = [case for case in cases if case.name not in known]
    start = time.monotonic()
    for number, (case, verdict) in enumerate(_carried_out(todo, corpus, folder, limit), start=1):
        known[case.name] = verdict
        append(log, {"case": case.name, **asdict(verdict)})
        if number % 250 == 0 or number == len(todo):
            tell(f"{number} of {len(todo)} cases, {time.monotonic() - start:.0f} s")
    return {case.name: known[case.name] for case in cases}


def read_log(log: Path) -> dict[str, Verdict]:
    """What an earlier run wrote; a line cut short is skipped."""
    found: dict[str, Verdict] = {}
    for entry in entries(log):
        with suppress(KeyError, TypeError):
            name = entry.pop("case")
            found[name] = Verdict(**entry)
    return found


def _carried_out(cases: Sequence[Case], corpus: Path, folder: Path, limit: float) -> Iterator[tuple[Case, Verdict]]:
    worker: Worker | None = None
    try:
        for case in cases:
            if worker is None:
                worker = _start(corpus, folder, limit)
            worker.pipe.send(case)
            start = time.perf_counter()
            verdict = _answer(worker, limit)
            if verdict is None:
                verdict = _failed(worker, time.perf_counter() - start)
            worker.done += 1
            if verdict.word in ("hang", "crash") or worker.done >= CASES_A_PROCESS:
                _stop(worker)
                worker = None
            yield case, verdict
    finally:
        if worker is not None:
            _stop(worker)


def _start(corpus: Path, folder: Path, limit: float) -> Worker:
    context = mp.get_context("fork")
    ours, theirs = context.Pipe()
    folder.mkdir(parents=True, exist_ok=True)
    trace = folder / "trace.txt"
    process = context.Process(target=_work, args=(theirs, ours, corpus, folder, trace, limit, started_by()))
    process.start()
    theirs.close()
    return Worker(process, ours, trace)


def _answer(worker: Worker, limit: float) -> Verdict | None:
    with suppress(EOFError, ConnectionResetError):
        if worker.pipe.poll(limit):
            answer: Verdict = worker.pipe.recv()
            return answer
    return None


def _failed(worker: Worker, seconds: float) -> Verdict:
    """The case that ended its process, or did not end."""
    worker.process.join(1.0)
    code = worker.process.exitcode
    said = worker.trace.read_text(encoding="utf-8", errors="replace")[:1100] if worker.trace.exists() else ""
    return Verdict("hang" if code is None else "crash", code or 0, said, round(seconds, 3))


def _stop(worker: Worker) -> None:
    """The process and its children, which are a group of their own."""
    worker.pipe.close()
    worker.process.join(0.2)
    with suppress(ProcessLookupError, PermissionError):
        if worker.process.pid is not None and os.getpgid(worker.process.pid) == worker.process.pid:
            os.killpg(worker.process.pid, signal.SIGKILL)
    worker.process.join()


def _work(
    pipe: Connection, other: Connection, corpus: Path, folder: Path, trace: Path, limit: float, parent: str
) -> None:
    end_with_parent(parent)
    other.close()
    os.setsid()
    os.chdir(folder)
    _limit()
    with trace.open("w", encoding="utf-8") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        faulthandler.enable(file)
        while True:
            try:
                case = pipe.recv()
            except EOFError:
                return
            file.seek(0)
            file.truncate()
            faulthandler.dump_traceback_later(0.9 * limit, file=file)
            verdict = carry_out(case, corpus, folder / "case")
            faulthandler.cancel_dump_traceback_later()
            pipe.send(verdict)


def _limit() -> None:
    mapped = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_SIZE, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
