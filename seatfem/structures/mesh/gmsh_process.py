"""Runs gmsh in a process of its own.

gmsh keeps global state, crashes when two threads use it, and can abort its process; a process of its own also keeps
its licence separate. Jobs are sent as JSON lines, results returned as named arrays.
"""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Mapping
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from impact.notices import Progress, silent
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import end_worker, start_worker, tell_worker
from seatfem.structures.shapes import GeometryError

Arrays = dict[str, NDArray[Any]]

STAGE = "meshing"
REMEDY = "try another element size, above all a smaller contact_size; or check and heal the CAD"


class MeshingError(RuntimeError):
    """Error of gmsh: it failed, crashed or cannot be loaded; the message states the place and the remedy."""


class Gmsh(Protocol):
    """Carries out one job of `seatfem.structures.mesh._gmsh_worker` and returns its arrays.

    Raises `GeometryError` where the geometry is at fault, `MeshingError` where gmsh is.
    """

    def __call__(self, job: Mapping[str, Any], progress: Progress = ..., /) -> Arrays: ...


class GmshSession:
    """One gmsh process for several jobs, started by the first: ``with GmshSession() as gmsh: gmsh(job)``.

    A job with the same geometry as the previous one does not build it again. The process is killed at the end of the
    block, on an interrupt, and after a failed job; the next job then starts another process.
    """

    def __init__(self) -> None:
        self._worker: tuple[subprocess.Popen[str], Path] | None = None
        self._ours = ExitStack()

    def __enter__(self) -> GmshSession:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def __call__(self, job: Mapping[str, Any], progress: Progress = silent, /) -> Arrays:
        """Run the job as `Gmsh` says."""
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


def run_gmsh(job: Mapping[str, Any], progress: Progress = silent, /) -> Arrays:
    """Run one job, as in `Gmsh`, in a process of its own; interrupting the caller kills the process."""
    with GmshSession() as gmsh:
        return gmsh(job, progress)


def remembered_gmsh(job: Mapping[str, Any], progress: Progress = silent, /) -> Arrays:
    """Run one job as `run_gmsh`, with the results cached in this process; used for coarse meshes."""
    return dict(_remembered(json.dumps(dict(job), sort_keys=True)))


@lru_cache(maxsize=8)
def _remembered(job: str) -> Arrays:
    return run_gmsh(json.loads(job))


def _last_message(process: subprocess.Popen[str], job: str, progress: Progress) -> dict[str, Any]:
    """Send the job, report progress until it is finished or the process ends, and return the last message."""
    last: dict[str, Any] = {"stage": "starting gmsh"}
    assert process.stdout is not None
    tell_worker(process, job)
    for line in process.stdout:
        last = json.loads(line)
        if "stage" in last:
            progress(STAGE, last["done"])
        if "finished" in last:
            break
    return last


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
