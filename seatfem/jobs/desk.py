"""Jobs and those who do them, wherever they are: one that hangs or crashes ends as its own failure."""

import shutil
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import LineWorker

NEVER: Final = 1_000_000_000
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Variables of a process whose numbers, and times, are not to depend on how many run beside it."""
FILES: Final = "@seatfem-files@"
"""Folder of the unpacked files, in a job for another computer and in its answer."""


@dataclass(frozen=True)
class Lost:
    """A job without an answer.

    Attributes:
        hung: whether its time was over; else its worker has ended.
        code: exit code of the worker, negative for a signal; None while it hung, or where its computer is gone with it.
        log: what the worker wrote to its standard error.
        seconds: of the clock.
    """

    hung: bool
    code: int | None
    log: str
    seconds: float

    def in_words(self) -> str:
        """Return how a worker ended, and its last words."""
        lines = self.log.strip().splitlines() or ["no message"]
        by = "with its computer" if self.code is None else f"exit code {self.code}"
        if self.code is not None and -self.code in set(signal.Signals):
            by = f"signal {signal.Signals(-self.code).name}"
        return f"the process died ({by}): {lines[-1]}"


Ask = Callable[[Iterable[str], float], Iterator[tuple[int, str | Lost]]]
"""Of jobs, a line each, and the limit of time for one [s]: the number and the answer of each, as they come.

`seatfem.jobs.desk.crew` and `seatfem.jobs.cluster.cluster_crew` give one; where they end, all jobs do.
"""


@dataclass(frozen=True)
class Program:
    """Program that workers run: `python -m module arguments`, which calls `answer_lines`.

    Attributes:
        renew: answers after which another worker takes over.
        own_session, environment: as of `start_worker`; with a session, what a lost job has started ends with it.
        folder_in: variables that hold a folder of the desk's own, which is emptied with each worker.
    """

    module: str
    arguments: tuple[str, ...] = ()
    renew: int = NEVER
    own_session: bool = False
    environment: Mapping[str, str] = field(default_factory=dict)
    folder_in: tuple[str, ...] = ()


@dataclass(eq=False)
class Desk:
    """A worker, one at a time, with its log and its files in a folder that is the desk's."""

    program: Program
    folder: Path
    worker: LineWorker | None = None
    done: int = 0

    def start(self) -> None:
        """Start a worker, where there is none."""
        if self.worker is None:
            program, own = self.program, self.folder / "own"
            shutil.rmtree(own, ignore_errors=True)
            own.mkdir(parents=True)
            environment = {**program.environment, **dict.fromkeys(program.folder_in, str(own))}
            self.worker = LineWorker(
                program.module, *program.arguments, log=self.folder / "log.txt", own_session=program.own_session,
                environment=environment,
            )  # fmt: skip
            self.done = 0

    def answer(self, job: str, limit: float) -> str | Lost:
        """Return the answer of the worker, which has to be running."""
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
        log = (self.folder / "log.txt").read_text(encoding="utf-8", errors="replace")
        return Lost(hung, code, log, time.monotonic() - begun)

    def renewed(self, answer: str | Lost) -> None:
        """Start another worker where this one has lost its job, or has answered often enough."""
        if isinstance(answer, Lost) or self.done >= self.program.renew:
            self.end()

    def end(self) -> None:
        """End the worker at once."""
        worker, self.worker = self.worker, None
        if worker is not None:
            worker.end()


@contextmanager
def crew(program: Program, *, workers: int) -> Iterator[Ask]:
    """Start several workers, which stay from one batch of jobs to the next.

    The jobs of a batch are begun in their order, and their answers come as they are there. Each worker starts when it
    is needed, by the thread that asks.
    """
    purpose = program.module.rpartition(".")[0].rpartition(".")[2]
    with private_folder(purpose) as folder, ThreadPoolExecutor(max(workers, 1)) as threads, ExitStack() as ours:
        desks = [Desk(program, folder / str(number)) for number in range(workers)]
        for desk in desks:
            ours.callback(desk.end)

        def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str | Lost]]:
            waiting, pending = iter(enumerate(jobs)), dict[Future[str | Lost], tuple[Desk, int]]()

            def hand_out(desk: Desk) -> None:
                for number, job in waiting:
                    desk.start()
                    pending[threads.submit(desk.answer, job, limit)] = desk, number
                    return

            for desk in desks:
                hand_out(desk)
            while pending:
                ended, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in ended:
                    desk, number = pending.pop(future)
                    answer = future.result()
                    desk.renewed(answer)
                    yield number, answer
                    hand_out(desk)

        yield ask
