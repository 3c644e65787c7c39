"""Crews: workers on this computer that answer jobs, each within a time limit; one that hangs or crashes fails alone."""

import json
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from select import select
from subprocess import Popen
from typing import Final

from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import end_worker, start_worker, tell_worker

ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Variables of workers, whose results and times must not depend on their number."""
FILES: Final = "@seatfem-files@"
"""Placeholder for the folder of the unpacked files, in a job for another computer and in its answer."""
TICK: Final = 1.0  # time between two questions whether a job is still wanted [s]


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
"""Function of jobs, one text each, and the time limit of one [s], that yields number and answer of each on completion.

`crew` and `seatfem.jobs.cluster.cluster_crew` yield one. Jobs end with the block, or with the iterator.
"""


@contextmanager
def crew(
    function: str, *, workers: int = 1, renew: int = 0, is_wanted: Callable[[], bool] | None = None
) -> Iterator[Ask]:
    """Yield a function `Ask` that distributes jobs to several workers, which serve one batch after the other.

    Jobs start in order. The workers begin with the first job, and temporary files that they leave are removed at the
    end of the block.

    Args:
        function: "module:name" of the function that answers a job.
        workers: number of workers.
        renew: number of answers after which a worker is replaced; 0: never.
        is_wanted: asked every `TICK` seconds whether to go on, for a single worker.
    """
    with private_folder("jobs") as folder:
        log, foremen, is_over = folder / "log.txt", list[Popen[str]](), False

        def foreman() -> Popen[str]:
            if not foremen or foremen[-1].poll() is not None:
                arguments, variables = (function, str(workers), str(renew)), ONE_THREAD | {"TMPDIR": str(folder)}
                foremen.append(start_worker("seatfem.jobs.foreman", *arguments, log=log, environment=variables))
                if is_over:  # another thread asks
                    end_worker(foremen[-1])
            return foremen[-1]

        def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str | Lost]]:
            waiting, begun = enumerate(jobs), dict[int, float]()
            try:
                while True:
                    for number, job in islice(waiting, workers - len(begun)):
                        process = foremen[-1] if begun else foreman()
                        begun[number] = time.monotonic()
                        tell_worker(process, json.dumps([number, job, limit, str(folder / f"{number}.txt")]))
                    if not begun:
                        return
                    assert process.stdout is not None
                    while is_wanted is not None and not select([process.stdout], [], [], TICK)[0]:
                        if not is_wanted():
                            return
                    line = process.stdout.readline()
                    lost = [] if line else [(each, None, False, process.wait()) for each in begun]
                    for number, answer, hung, code in lost or [json.loads(line)]:
                        seconds, own = time.monotonic() - begun.pop(number), folder / f"{number}.txt"
                        text = (own if own.exists() else log).read_text(encoding="utf-8", errors="replace")
                        with suppress(OSError):
                            own.unlink()
                        yield number, Lost(hung, code, text, seconds) if answer is None else answer
            finally:
                if begun:
                    end_worker(process)

        try:
            yield ask
        finally:
            is_over = True
            for process in foremen:
                end_worker(process)
