"""Many jobs carried out by a worker: one that hangs or crashes ends as its own outcome, not the rest's."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import LineWorker


@dataclass(frozen=True)
class Lost:
    """A job without an answer.

    Attributes:
        hung: whether its time was over; else its worker has ended.
        code: exit code of the worker, negative for a signal; None while it hung.
        log: what the worker wrote to its standard error.
        seconds: of the clock.
    """

    hung: bool
    code: int | None
    log: str
    seconds: float


def answers(
    jobs: Sequence[str],
    module: str,
    *arguments: str,
    limit: float,
    renew: int = 1_000_000_000,
    own_session: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Iterator[str | Lost]:
    """The answer to each job, a line, in their order; from a worker of ``module``, which calls `answer_lines`.

    Args:
        jobs: lines.
        module: run as `python -m module arguments`.
        limit: seconds of the clock for one job.
        renew: answers after which another worker takes over.
        own_session, environment: as of `start_worker`; with a session, what a lost job has started ends with it.
    """
    with private_folder(module.rpartition(".")[0].rpartition(".")[2]) as folder, ExitStack() as ours:
        log = folder / "log.txt"
        worker: LineWorker | None = None
        done = 0
        for job in jobs:
            if worker is None:
                started = LineWorker(module, *arguments, log=log, own_session=own_session, environment=environment)
                worker = ours.enter_context(started)
                done = 0
            begun = time.monotonic()
            answer: str | Lost
            try:
                answer = worker.ask(job, limit)
                hung = False
            except TimeoutError:
                answer, hung = "", True
            if not answer:
                code = None if hung else worker.code()
                said = log.read_text(encoding="utf-8", errors="replace")
                answer = Lost(hung, code, said, time.monotonic() - begun)
            done += 1
            if isinstance(answer, Lost) or done >= renew:
                ours.close()
                worker = None
            yield answer
