"""Processes that end with their parent, within limits of memory, time and file size, and that signals can end."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Final

STARTED_BY: Final = "SEATFEM_STARTED_BY"


def start_worker(
    module: str,
    *arguments: str,
    log: Path,
    answers: bool = False,
    environment: Mapping[str, str] | None = None,
    own_session: bool = False,
) -> subprocess.Popen[str]:
    """Start ``python -P -m module arguments`` with this package; the module calls `end_with_parent` first of all.

    Modules come from the interpreter's paths, this package's folder and PYTHONPATH, never from the current folder,
    which may hold a foreign gmsh.py. Keep the standard input open while the worker is needed. Its standard error goes
    to ``log``; its standard output is discarded, or with ``answers`` a pipe. ``environment``: additional variables.
    ``own_session``: it and its descendants form one process group, which `end_worker` ends.
    """
    paths = [str(Path(__file__).resolve().parents[2]), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    variables = {"PYTHONPATH": os.pathsep.join(filter(None, paths)), STARTED_BY: started_by()}  # "": current folder
    with log.open("wb") as errors:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "seatfem.jobs.worker", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE if answers else subprocess.DEVNULL,
            stderr=errors,
            text=True,
            env=dict(os.environ) | variables | dict(environment or {}),
            start_new_session=own_session,
        )


def end_worker(process: subprocess.Popen[str]) -> None:
    """End a worker and, if it has its own session, all processes that it started."""
    if process.poll() is None:
        with suppress(ProcessLookupError, PermissionError, AttributeError):
            if os.getpgid(process.pid) == process.pid:
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
    with suppress(BrokenPipeError), process:  # closes its pipes and waits
        pass


def started_by() -> str:
    """Return the id of this process, by which a worker recognises its parent.

    It is "" outside the main thread, because Linux takes the end of the starting thread for the parent's end.
    """
    return str(os.getpid()) if threading.current_thread() is threading.main_thread() else ""


class LineWorker:
    """Worker whose module calls `answer_lines`, so that it answers each line with one line; ``with`` ends it."""

    def __init__(
        self,
        module: str,
        *arguments: str,
        log: Path,
        own_session: bool = False,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._process = start_worker(
            module, *arguments, log=log, answers=True, environment=environment, own_session=own_session
        )
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        try:
            if not self._answer(None):  # it ended before it was ready: each later answer is "", too
                self._answers.put("")
        except BaseException:
            self.end()
            raise

    def __enter__(self) -> LineWorker:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def ask(self, line: str, timeout: float) -> str:
        """Return the answer to a line; "" if the worker has ended. Raises `TimeoutError` after ``timeout`` seconds."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(line + "\n")
            self._process.stdin.flush()
        return self._answer(timeout)

    def code(self) -> int | None:
        """Return the exit code, negative for a signal; ``None`` while it runs, after waiting 1 s for its end."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        return self._process.returncode

    def end(self) -> None:
        """End the worker at once."""
        end_worker(self._process)

    def _answer(self, timeout: float | None) -> str:
        try:
            return self._answers.get(timeout=timeout)
        except queue.Empty:
            raise TimeoutError(f"no answer within {timeout:g} s") from None

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with suppress(ValueError, OSError):  # closed by `end`
            for line in self._process.stdout:
                self._answers.put(line)
        self._answers.put("")


def limit_process(*, memory: int | None = None, seconds: int | None = None, file_size: int | None = None) -> None:
    """Limit the resources of the rest of this process; without effect on systems without such limits.

    Args:
        memory: address space beyond the present one [bytes]; more raises `MemoryError`.
        seconds: processor time [s]; more ends the process (SIGXCPU).
        file_size: size of any one file [bytes]; a longer write raises `OSError`.
    """
    try:
        import resource  # absent on Windows
    except ImportError:
        return
    mapped = 0
    with suppress(OSError):
        mapped = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    bounds = (
        (resource.RLIMIT_AS, None if memory is None else mapped + memory),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_FSIZE, file_size),
        (resource.RLIMIT_CORE, 0),  # no core dumps
    )
    for kind, limit in bounds:
        if limit is not None:
            with suppress(OSError, ValueError):
                resource.setrlimit(kind, (limit, resource.RLIM_INFINITY))
    if file_size is not None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)


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
