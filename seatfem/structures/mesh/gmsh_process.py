"""Runs gmsh in a process of its own.

gmsh keeps global state, crashes when two threads use it, and can abort its process; a process of its own also keeps
its licence separate. Jobs are sent as JSON lines, results returned as named arrays.
"""

from __future__ import annotations

import json
import signal
import subprocess
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.notices import Progress, SeatfemError, silent
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import end_worker, start_worker, tell_worker
from seatfem.structures.shapes import GeometryError

Arrays = dict[str, NDArray[Any]]

STAGE = "meshing"
EVERY: Final = 0.5  # time between two reports of progress while gmsh says nothing [s]
MESHES: Final = 8  # most results that a session remembers
LARGE: Final = 64e6  # size of a result after which a process is ended, as it holds several times this memory [bytes]
REMEDY = "try another element size, above all a smaller contact_size; or check and heal the CAD"


class MeshingError(SeatfemError, RuntimeError):
    """Error of gmsh: it failed, crashed or cannot be loaded; the message states the place and the remedy."""


class GmshSession:
    """One gmsh process for several jobs, started by the first: ``with GmshSession() as gmsh: gmsh(job)``.

    A job with the same geometry as the previous one does not build it again, and the results of the last ``meshes``
    jobs are remembered, unless they are `LARGE`. The process is killed at the end of the block, on an interrupt, after
    a failed job and after one with a large result; the next job then starts another process.
    """

    def __init__(self, meshes: int = MESHES) -> None:
        self._worker: tuple[subprocess.Popen[str], Path] | None = None
        self._ours = ExitStack()
        self._meshes = meshes
        self._known: OrderedDict[str, Arrays] = OrderedDict()

    def __enter__(self) -> GmshSession:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def __call__(self, job: Mapping[str, Any], progress: Progress = silent, /) -> Arrays:
        """Return the arrays of one job of `seatfem.structures.mesh._gmsh_worker`, or its remembered result.

        Raises `GeometryError` where the geometry is at fault, `MeshingError` where gmsh is.
        """
        if job.get("picture"):
            return self._run(job, progress)
        key = json.dumps([dict(job), _states_of_files(job)], sort_keys=True)
        if key in self._known:
            progress(STAGE, 1.0)
            self._known.move_to_end(key)
        else:
            arrays = self._run(job, progress)
            if sum(array.nbytes for array in arrays.values()) > LARGE:
                self._end()
                return arrays
            self._known[key] = arrays
            if len(self._known) > self._meshes:
                self._known.popitem(last=False)
        return {name: array.copy() for name, array in self._known[key].items()}

    def _run(self, job: Mapping[str, Any], progress: Progress) -> Arrays:
        process, folder = self._started()
        result, log = folder / "arrays.npz", folder / "log.txt"
        try:
            last = _last_message(process, json.dumps(dict(job) | {"arrays": str(result)}), progress)
            if "finished" not in last:
                process.wait()
                _check(process.returncode, last, log.read_text(encoding="utf-8", errors="replace"))
            with np.load(result) as arrays:
                return dict(arrays)
        except BaseException:
            self._end()
            raise

    def _started(self) -> tuple[subprocess.Popen[str], Path]:
        if self._worker is None:
            with ExitStack() as ours:
                folder = ours.enter_context(private_folder("gmsh"))
                process = start_worker("seatfem.structures.mesh._gmsh_worker", log=folder / "log.txt")
                ours.callback(end_worker, process)  # its results have been read
                self._worker, self._ours = (process, folder), ours.pop_all()
        return self._worker

    def _end(self) -> None:
        self._worker = None
        self._ours.close()


_session: ContextVar[GmshSession | None] = ContextVar("session of gmsh", default=None)


@contextmanager
def gmsh_session() -> Iterator[GmshSession]:
    """Yield the session of the enclosing block, as that of a run whose rounds mesh again and again, or a new one."""
    if (enclosing := _session.get()) is not None:
        yield enclosing
        return
    with GmshSession() as session:
        token = _session.set(session)
        try:
            yield session
        finally:
            _session.reset(token)


def run_gmsh(job: Mapping[str, Any], progress: Progress = silent, /) -> Arrays:
    """Run one job, as `GmshSession` does, in the process of the enclosing `gmsh_session`, or one of its own, which an
    interrupt of the caller kills."""
    with gmsh_session() as gmsh:
        return gmsh(job, progress)


def _states_of_files(job: Mapping[str, Any]) -> list[tuple[int, int, int]]:
    """Return number, size and time of the last change of the files that a job reads."""
    paths = [Path(part["path"]) for part in (job, job.get("geometry") or {}) if "path" in part]
    states = [path.stat() for path in paths if path.is_file()]
    return [(state.st_ino, state.st_size, state.st_mtime_ns) for state in states]


def _last_message(process: subprocess.Popen[str], job: str, progress: Progress) -> dict[str, Any]:
    """Send the job, report progress until it is finished or the process ends, and return the last message."""
    last: dict[str, Any] = {"stage": "starting gmsh"}
    done, lines = 0.0, SimpleQueue[str | None]()
    tell_worker(process, job)
    Thread(target=_pass_on, args=(process, lines), daemon=True).start()
    while True:
        try:
            line = lines.get(timeout=EVERY)
        except Empty:
            progress(STAGE, done)  # gmsh says nothing within a step: whoever listens may stop it
            continue
        if line is None:
            return last
        last = json.loads(line)
        if "stage" in last:
            done = last["done"]
            progress(STAGE, done)
        if "finished" in last:
            return last


def _pass_on(process: subprocess.Popen[str], lines: SimpleQueue[str | None]) -> None:
    """Put the messages of a job into ``lines`` up to its last one; ``None`` after them where the process ends."""
    assert process.stdout is not None
    for line in process.stdout:
        lines.put(line)
        if "finished" in json.loads(line):
            return
    lines.put(None)


def _check(code: int, last: Mapping[str, Any], log: str) -> None:
    if "error" in last:
        raise GeometryError(last["error"], last["field"]) if last["kind"] == "geometry" else MeshingError(last["error"])
    if code < 0:
        name = signal.Signals(-code).name
        if name == "SIGALRM":
            raise MeshingError(f"gmsh found no end while {last['stage']}: check and heal the file")
        raise MeshingError(f"gmsh crashed ({name}) while {last['stage']}: {REMEDY}")
    if code > 0:
        ending = log.strip().splitlines()[-1:] or ["no message"]
        raise MeshingError(
            f"the gmsh process failed (exit code {code}) while {last['stage']}, see seatfem doctor: {ending[0]}"
        )
