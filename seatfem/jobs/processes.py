"""Processes that end with their parent, within limits of memory and time, and that signals can end.

Two mechanisms end a process with its parent. The first works on all systems: only the parent holds a pipe open, and a
thread of the process ends it when that closes. The second is the Linux kernel's signal at the parent's death
(PR_SET_PDEATHSIG), which works even while compiled code blocks Python threads.
"""

from __future__ import annotations

import ctypes
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType, MappingProxyType
from typing import Final, TextIO

ORPHANED: Final = 1  # exit code of a process whose parent has ended
_PR_SET_PDEATHSIG: Final = 1


def start_worker(
    module: str, *arguments: str, log: Path, environment: Mapping[str, str] = MappingProxyType({})
) -> subprocess.Popen[str]:
    """Start ``python -P -m module arguments`` with this package; the module calls `lines_from_parent` first of all.

    Modules come from the interpreter's paths, this package's folder and PYTHONPATH, never from the current folder,
    which may hold a foreign gmsh.py. The worker's input and output are pipes: keep the input open while it is needed.
    Its standard error goes to ``log``. ``environment``: additional variables.
    """
    paths = [str(Path(__file__).resolve().parents[2]), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    variables = {"PYTHONPATH": os.pathsep.join(filter(None, paths)), **environment}  # "": the current folder
    with log.open("wb") as errors:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=os.environ | variables,
        )


def end_worker(process: subprocess.Popen[str]) -> None:
    """Kill a worker, close its pipes and wait for its end."""
    process.kill()
    with suppress(BrokenPipeError), without_pipe_signal(), process:
        pass


@contextmanager
def without_pipe_signal() -> Iterator[None]:
    """Let a write to a process that has ended raise `BrokenPipeError` in this thread, whatever SIGPIPE would do.

    Python ignores that signal; `gmsh.initialize` restores its default action, which ends the program.
    """
    if not hasattr(signal, "SIGPIPE"):  # Windows
        yield
        return
    earlier = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        yield
    finally:
        if signal.SIGPIPE in signal.sigpending() and signal.SIGPIPE not in earlier:
            signal.sigwait({signal.SIGPIPE})
        signal.pthread_sigmask(signal.SIG_SETMASK, earlier)


def tell_worker(process: subprocess.Popen[str], line: str) -> None:
    """Send a line to a worker; if it has ended, the end of its answers tells."""
    assert process.stdin is not None
    with suppress(BrokenPipeError), without_pipe_signal():
        process.stdin.write(line + "\n")
        process.stdin.flush()


def answer_of(process: subprocess.Popen[str], seconds: float) -> str:
    """Return the next line of a worker; "" if it has ended. Raises `TimeoutError` after having killed it for its
    silence."""
    assert process.stdout is not None
    end, late = time.monotonic() + seconds, threading.Timer(seconds, process.kill)
    late.start()
    try:
        answer = process.stdout.readline()
    finally:
        late.cancel()
    if not answer and time.monotonic() >= end:
        raise TimeoutError(f"no answer within {seconds:g} s")
    return answer


def lines_from_parent() -> Iterator[str]:
    """Yield the lines that the parent writes to the standard input; this process ends when that closes."""
    received: queue.SimpleQueue[str] = queue.SimpleQueue()

    def listen() -> None:
        with open(0, encoding="utf-8", closefd=False) as lines:  # not sys.stdin: it is locked meanwhile
            for line in lines:
                received.put(line)
        os._exit(ORPHANED)

    threading.Thread(target=listen, name="end with parent", daemon=True).start()
    return iter(received.get, None)


def answers_to_parent() -> TextIO:
    """Return the standard output, for answers alone: text that libraries print to descriptor 1 goes to the log."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return answers


def die_with_parent() -> None:
    """Let the kernel end this process, and the program that may replace it, at the end of the thread that started it;
    without effect on other systems than Linux."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def limit_process(*, memory: int = 0, seconds: int = 0) -> None:
    """Limit the resources of the rest of this process; without effect on systems without such limits.

    Args:
        memory: address space beyond the present one [bytes]; more raises `MemoryError`; 0: no limit.
        seconds: processor time [s]; more ends the process (SIGXCPU); 0: no limit.
    """
    try:
        import resource  # absent on Windows
    except ImportError:
        return
    mapped = 0
    with suppress(OSError):
        mapped = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    bounds = {resource.RLIMIT_CORE: 0}  # no core dumps
    if memory:
        bounds[resource.RLIMIT_AS] = mapped + memory
    if seconds:
        bounds[resource.RLIMIT_CPU] = seconds
    for kind, limit in bounds.items():
        with suppress(OSError, ValueError):
            resource.setrlimit(kind, (limit, resource.RLIM_INFINITY))


ASKED: Final = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class Terminated(KeyboardInterrupt):
    """Request by the signal ``number`` that the process should end."""

    def __init__(self, number: int) -> None:
        super().__init__(f"asked to end by {signal.Signals(number).name}")
        self.number = number


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Within the block the first SIGTERM or SIGHUP raises `Terminated`; later ones are ignored while it cleans up.

    Signals that are ignored (``nohup``) or handled by a caller are unchanged, as are all outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [number for number in ASKED if signal.getsignal(number) is signal.SIG_DFL]

    def end(number: int, frame: FrameType | None) -> None:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise Terminated(number)

    for number in numbers:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def exit_code(stopped: KeyboardInterrupt) -> int:
    """Return 128 + the number of the signal, as shells do: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP."""
    return 128 + (stopped.number if isinstance(stopped, Terminated) else signal.SIGINT)
