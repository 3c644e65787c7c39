"""Runs gmsh in a process of its own.

gmsh keeps global state, crashes when two threads use it, and can abort the process it lives in; apart from that
its licence stays apart too. Job in: JSON. Result out: named arrays.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.progress import Progress, silent
from seatfem.geometry import GeometryError

Arrays = dict[str, NDArray[Any]]

STAGE = "meshing"
REMEDY = "try another element size, above all a smaller contact_size; or check and heal the CAD"


class MeshingError(RuntimeError):
    """gmsh failed, crashed, or cannot be loaded; the message says where and how to mend it."""


def run_gmsh(job: Mapping[str, Any], progress: Progress = silent) -> Arrays:
    """Carry out one job of `seatfem.mesh._gmsh_worker` and return its arrays.

    Interrupting the caller kills the gmsh process. Raises `GeometryError` where the geometry is at fault,
    `MeshingError` where gmsh is.
    """
    with tempfile.TemporaryDirectory(prefix="seatfem-") as folder:
        job_file, result, log = (Path(folder) / name for name in ("job.json", "arrays.npz", "log.txt"))
        job_file.write_text(json.dumps(dict(job) | {"arrays": str(result)}), encoding="utf-8")
        command = [sys.executable, "-m", "seatfem.mesh._gmsh_worker", str(job_file)]
        with (
            log.open("wb") as stderr,
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True, env=_environment()) as process,
        ):
            try:
                last = _listen(process, progress)
            except BaseException:
                process.kill()
                raise
        _check(process.returncode, last, log.read_text(encoding="utf-8", errors="replace"))
        with np.load(result) as arrays:
            return dict(arrays)


def _environment() -> dict[str, str]:
    """The caller's, with this very package first on the path."""
    paths = [str(Path(__file__).resolve().parents[2]), os.environ.get("PYTHONPATH", "")]
    return dict(os.environ) | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


def _listen(process: subprocess.Popen[str], progress: Progress) -> dict[str, Any]:
    """Pass progress on until the process ends; the last message tells where it was."""
    last: dict[str, Any] = {"stage": "starting gmsh"}
    assert process.stdout is not None
    for line in process.stdout:
        last = json.loads(line)
        if "stage" in last:
            progress(STAGE, last["done"])
    process.wait()
    return last


def _check(code: int, last: Mapping[str, Any], log: str) -> None:
    if "error" in last:
        raise (GeometryError if last["kind"] == "geometry" else MeshingError)(last["error"])
    if code < 0:
        name = signal.Signals(-code).name
        if name == "SIGALRM":
            raise MeshingError(f"gmsh found no end while {last['stage']}: check and heal the file")
        raise MeshingError(f"gmsh crashed ({name}) while {last['stage']}: {REMEDY}")
    if code > 0:
        ending = log.strip().splitlines()[-1:] or ["no message"]
        raise MeshingError(f"the gmsh process failed (exit code {code}) while {last['stage']}: {ending[0]}")
