"""Many jobs carried out by workers: one that hangs or crashes ends as its own outcome, not the rest's."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

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
    with crew(module, *arguments, workers=1, renew=renew, own_session=own_session, environment=environment) as ask:
        yield from (answer for _, answer in ask(jobs, limit))


Ask = Callable[[Sequence[str], float], Iterator[tuple[int, "str | Lost"]]]
"""Of jobs and the limit of time for one: the number and the answer of each, as they come."""


@contextmanager
def crew(
    module: str,
    *arguments: str,
    workers: int,
    renew: int = 1_000_000_000,
    own_session: bool = False,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Ask]:
    """Several workers, which stay from one batch of jobs to the next; arguments as of `answers`.

    The jobs of a batch are begun in their order, and their answers come as they are there. Each worker starts when it
    is needed, by the thread that asks.
    """
    purpose = module.rpartition(".")[0].rpartition(".")[2]
    with private_folder(purpose) as folder, ThreadPoolExecutor(max(workers, 1)) as threads, ExitStack() as ours:
        desks = [_Desk(folder / f"log{number}.txt") for number in range(workers)]
        for desk in desks:
            ours.callback(desk.end)

        def ask(jobs: Sequence[str], limit: float) -> Iterator[tuple[int, str | Lost]]:
            waiting, asked = iter(enumerate(jobs)), dict[Future[str | Lost], tuple[_Desk, int]]()

            def hand_out(desk: _Desk) -> None:
                for number, job in waiting:
                    if desk.worker is None:
                        desk.worker = LineWorker(
                            module, *arguments, log=desk.log, own_session=own_session, environment=environment
                        )
                        desk.done = 0
                    asked[threads.submit(desk.answer, job, limit)] = desk, number
                    return

            for desk in desks:
                hand_out(desk)
            while asked:
                ended, _ = wait(asked, return_when=FIRST_COMPLETED)
                for future in ended:
                    desk, number = asked.pop(future)
                    answer = future.result()
                    if isinstance(answer, Lost) or desk.done >= renew:
                        desk.end()
                    yield number, answer
                    hand_out(desk)

        yield ask


@dataclass
class _Desk:
    """A worker, one at a time, with its log."""

    log: Path
    worker: LineWorker | None = field(default=None)
    done: int = 0

    def answer(self, job: str, limit: float) -> str | Lost:
        """Of the worker, which is there."""
        assert self.worker is not None
        worker, begun, hung = self.worker, time.monotonic(), False
        try:
            answer = worker.ask(job, limit)
        except TimeoutError:
            answer, hung = "", True
        self.done += 1
        if answer:
            return answer
        code = None if hung else worker.code()
        return Lost(hung, code, self.log.read_text(encoding="utf-8", errors="replace"), time.monotonic() - begun)

    def end(self) -> None:
        """The worker, whatever it does."""
        if self.worker is not None:
            self.worker.end()
            self.worker = None
