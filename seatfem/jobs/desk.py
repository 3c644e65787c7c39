"""Desks, at which one worker process answers jobs one by one: a job that hangs or crashes fails alone."""

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
"""Variables of a process whose results and times must not depend on the number of parallel processes."""
FILES: Final = "@seatfem-files@"
"""Placeholder for the folder of the unpacked files, in a job for another computer and in its answer."""


@dataclass(frozen=True)
class Lost:
    """Job without an answer.

    Attributes:
        hung: whether its time limit was exceeded; otherwise its worker has ended.
        code: exit code of the worker, negative for a signal; ``None`` if it hung, or if its computer was lost.
        log: standard error of the worker.
        seconds: wall time [s].
    """

    hung: bool
    code: int | None
    log: str
    seconds: float

    def in_words(self) -> str:
        """Return how the worker ended, and the last line of its log."""
        lines = self.log.strip().splitlines() or ["no message"]
        cause = "with its computer" if self.code is None else f"exit code {self.code}"
        if self.code is not None and -self.code in set(signal.Signals):
            cause = f"signal {signal.Signals(-self.code).name}"
        return f"the process died ({cause}): {lines[-1]}"


Ask = Callable[[Iterable[str], float], Iterator[tuple[int, str | Lost]]]
"""Function of jobs, one line each, and the time limit of one [s], that yields number and answer of each on completion.

`seatfem.jobs.desk.crew` and `seatfem.jobs.cluster.cluster_crew` yield one; at the end of the block all jobs end.
"""


@dataclass(frozen=True)
class Program:
    """Program that workers run: `python -m module arguments`, which calls `answer_lines`.

    Attributes:
        renew: number of answers after which the worker is replaced.
        own_session, environment: as in `start_worker`; with a session, processes started by a lost job end with it.
        folder_in: variables that are set to a folder of the desk, which is emptied for each worker.
    """

    module: str
    arguments: tuple[str, ...] = ()
    renew: int = NEVER
    own_session: bool = False
    environment: Mapping[str, str] = field(default_factory=dict)
    folder_in: tuple[str, ...] = ()


@dataclass(eq=False)
class Desk:
    """One worker at a time, with its log and its files in the folder of the desk."""

    program: Program
    folder: Path
    worker: LineWorker | None = None
    done: int = 0

    def start(self) -> None:
        """Start a worker if none is running."""
        if self.worker is None:
            program, own_folder = self.program, self.folder / "own"
            shutil.rmtree(own_folder, ignore_errors=True)
            own_folder.mkdir(parents=True)
            environment = {**program.environment, **dict.fromkeys(program.folder_in, str(own_folder))}
            self.worker = LineWorker(
                program.module, *program.arguments, log=self.folder / "log.txt", own_session=program.own_session,
                environment=environment,
            )  # fmt: skip
            self.done = 0

    def answer(self, job: str, limit: float) -> str | Lost:
        """Return the answer of the running worker to a job."""
        assert self.worker is not None
        worker, start, hung = self.worker, time.monotonic(), False
        try:
            answer = worker.ask(job, limit)
        except TimeoutError:
            answer, hung = "", True
        self.done += 1
        if answer:
            return answer
        code = None if hung else worker.code()
        log = (self.folder / "log.txt").read_text(encoding="utf-8", errors="replace")
        return Lost(hung, code, log, time.monotonic() - start)

    def renewed(self, answer: str | Lost) -> None:
        """End the worker, for `start` to replace it, if it has lost its job or answered as often as `Program.renew`."""
        if isinstance(answer, Lost) or self.done >= self.program.renew:
            self.end()

    def end(self) -> None:
        """End the worker at once."""
        worker, self.worker = self.worker, None
        if worker is not None:
            worker.end()


@contextmanager
def crew(program: Program, *, workers: int) -> Iterator[Ask]:
    """Yield a function `Ask` that distributes jobs to several workers, which serve one batch after the other.

    Jobs start in order, and answers are yielded on completion. Each worker starts when it is needed, in the caller's
    thread.
    """
    purpose = program.module.rpartition(".")[0].rpartition(".")[2]
    with private_folder(purpose) as folder, ThreadPoolExecutor(max(workers, 1)) as threads, ExitStack() as stack:
        desks = [Desk(program, folder / str(number)) for number in range(workers)]
        for desk in desks:
            stack.callback(desk.end)

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
