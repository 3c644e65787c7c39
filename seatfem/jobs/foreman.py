"""Foreman of a crew: `python -m seatfem.jobs.foreman MODULE:FUNCTION WORKERS RENEW` hands jobs to a pool of pebble.

It is a process of its own, started and ended by `seatfem.jobs.crew`: its workers begin with neither the user's script
nor the modules in the current folder, whatever program uses them. It reads lines of JSON [number, job, time limit, log]
and answers each, on completion, by [number, answer or null, whether the limit was exceeded, exit code or null].
"""

import json
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import TextIO

from pebble import ProcessPool

from impact.names import import_now
from seatfem.jobs.processes import ORPHANED, answers_to_parent, die_with_parent, lines_from_parent


def begin(function: str) -> None:
    """Begin a worker: it ends with the foreman, and has loaded the module of the function before its first job."""
    die_with_parent()
    threading.Thread(target=_end_with_foreman, daemon=True).start()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # pebble's handler would wait for compiled code
    import_now(function.partition(":")[0])


def _end_with_foreman() -> None:
    if (foreman := multiprocessing.parent_process()) is not None:
        foreman.join()
        os._exit(ORPHANED)


def answered(function: str, job: str, log: str) -> str:
    """Return a worker's answer to a job, during which it prints to ``log``; an error ends the worker."""
    with Path(log).open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    module, _, name = function.partition(":")
    try:
        return str(getattr(import_now(module), name)(job))
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)


def tell(answers: TextIO, number: int, future: Future[str]) -> None:
    """Tell the outcome of a job."""
    error = future.exception()
    answer, hung = None if error else future.result(), isinstance(error, TimeoutError)
    line = json.dumps([number, answer, hung, None if hung else getattr(error, "exitcode", 1)])
    answers.write(line + "\n")  # at once: several threads do
    answers.flush()


def main(function: str, workers: int, renew: int) -> None:
    """Serve until the parent ends this process."""
    answers, pool = answers_to_parent(), None
    for line in lines_from_parent():
        number, job, limit, log = json.loads(line)
        if pool is not None and not pool.active:  # it breaks if a worker ends that has no job
            pool.join()
            pool = None
        pool = pool or ProcessPool(workers, renew, begin, (function,), multiprocessing.get_context("spawn"))
        future = pool.schedule(answered, (function, job, log), timeout=limit)
        future.add_done_callback(partial(tell, answers, number))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
