"""Worker process: `python -m seatfem.jobs.worker MODULE ARGUMENTS` runs a module, and ends with its parent.

Two mechanisms end it. The first works on all systems: only the parent holds the worker's standard input (or the pipe of
`multiprocessing`) open, and a thread of the worker ends the process when that closes. The second is the Linux kernel's
signal at the parent's death (PR_SET_PDEATHSIG), which works even while compiled code blocks Python threads.
"""

import ctypes
import multiprocessing
import os
import queue
import runpy
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Final

from seatfem.jobs.processes import STARTED_BY

ORPHANED: Final = 1  # exit code of a worker whose parent has ended
_PR_SET_PDEATHSIG: Final = 1


def end_with_parent(parent: str = "", take: Callable[[bytes], None] = lambda _: None) -> None:
    """End this process when its parent ends; to be called first by the module that a worker runs.

    ``take`` receives what the parent writes to the standard input. ``parent``: the parent's process id as text
    (`started_by`), for workers of `multiprocessing`, which have no standard input.
    """
    _die_with(parent)
    threading.Thread(target=_watch, args=(take,), name="end with parent", daemon=True).start()


def lines_from_parent() -> Iterator[str]:
    """Yield the lines that the parent writes, after calling `end_with_parent`. They end with the process."""
    received: queue.SimpleQueue[str] = queue.SimpleQueue()
    buffer = bytearray()

    def take(data: bytes) -> None:
        buffer.extend(data)
        *lines, remainder = bytes(buffer).split(b"\n")
        buffer[:] = remainder
        for line in lines:
            received.put(line.decode("utf-8"))

    end_with_parent(take=take)
    return iter(received.get, None)


def answer_lines(reply: Callable[[str], str]) -> None:
    """Serve a `LineWorker`: answer each line of the parent with ``reply`` of it, one line, until the parent ends this.

    Only answers go to the standard output: text that libraries print to descriptor 1 goes to the log.
    """
    lines = lines_from_parent()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    answers.write("ready\n")
    answers.flush()
    for line in lines:
        answers.write(reply(line) + "\n")
        answers.flush()


def _watch(take: Callable[[bytes], None]) -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    else:
        while data := os.read(0, 1 << 16):  # not sys.stdin: its lock would be held when the interpreter ends
            take(data)
    os._exit(ORPHANED)


def _die_with(parent: str) -> None:
    if sys.platform == "linux" and parent == str(os.getppid()):
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


if __name__ == "__main__":
    _die_with(os.environ.get(STARTED_BY, ""))  # before other modules are imported
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
