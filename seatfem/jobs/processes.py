"""Workers: processes that end with the one that started them, however that ends.

Two ways at once. The first works everywhere: a worker's standard input (or `multiprocessing`'s own pipe) is held open
by its parent alone, and a thread of the worker ends it when that closes. The second is the Linux kernel's: it kills the
worker with its parent (PR_SET_PDEATHSIG), in the midst of compiled code too that keeps threads from running.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

STARTED_BY: Final = "SEATFEM_STARTED_BY"
ORPHANED: Final = 1  # exit code of a worker whose parent has ended
_PR_SET_PDEATHSIG: Final = 1


def start_worker(
    module: str,
    *arguments: str,
    log: Path,
    answers: bool = False,
    environment: Mapping[str, str] | None = None,
    own_session: bool = False,
) -> subprocess.Popen[str]:
    """Start ``python -m module arguments`` with this very package; the module calls `end_with_parent` first of all.

    Keep the standard input open while the worker is wanted. Its standard error goes to ``log``, its standard output
    nowhere, or with ``answers`` to a pipe. ``environment``: variables besides the caller's. ``own_session``: it and all
    that it starts are one process group, which `end_group` ends.
    """
    paths = [str(Path(__file__).resolve().parents[2]), os.environ.get("PYTHONPATH", "")]
    own = {"PYTHONPATH": os.pathsep.join(filter(None, paths)), STARTED_BY: started_by()}
    with log.open("wb") as errors:
        return subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE if answers else subprocess.DEVNULL,
            stderr=errors,
            text=True,
            env=dict(os.environ) | own | dict(environment or {}),
            start_new_session=own_session,
        )


def end_group(process: subprocess.Popen[str]) -> None:
    """Nothing is left of a worker with a session of its own, nor of what it has started."""
    if process.poll() is None:
        with suppress(ProcessLookupError, PermissionError, AttributeError):
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
    with suppress(BrokenPipeError), process:  # closes its pipes, waits
        pass


def started_by() -> str:
    """What `end_with_parent` wants to know of the parent.

    "" where the main thread does not start the worker: Linux takes the end of the starting thread for the parent's.
    """
    return str(os.getpid()) if threading.current_thread() is threading.main_thread() else ""


def end_with_parent(parent: str | None = None, take: Callable[[bytes], None] = lambda _: None) -> None:
    """Called by a worker: from now on it ends when its parent does.

    ``parent``: what `started_by` said there; default: `start_worker` has passed it on. ``take`` receives what the parent
    writes to the standard input; workers of `multiprocessing` have none.
    """
    given = os.environ.get(STARTED_BY, "") if parent is None else parent
    if sys.platform == "linux" and given == str(os.getppid()):
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    threading.Thread(target=_watch, args=(take,), name="end with parent", daemon=True).start()


def lines_from_parent() -> Iterator[str]:
    """As `end_with_parent`; the lines that the parent writes, as they come. Does not end before the process."""
    found: queue.SimpleQueue[str] = queue.SimpleQueue()
    begun = bytearray()

    def take(data: bytes) -> None:
        begun.extend(data)
        *lines, rest = bytes(begun).split(b"\n")
        begun[:] = rest
        for line in lines:
            found.put(line.decode("utf-8"))

    end_with_parent(take=take)
    while True:
        yield found.get()


def _watch(take: Callable[[bytes], None]) -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    else:
        while data := os.read(0, 1 << 16):  # not sys.stdin: its lock would be held when the interpreter ends
            take(data)
    os._exit(ORPHANED)
