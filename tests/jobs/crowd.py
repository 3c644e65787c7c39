"""A scheduler of dask and workers on this computer, each a process with a folder of its own for everything."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType

ROOT = Path(__file__).parents[2]
BLIND = """import os, sys
def audit(event, args, hidden=os.path.realpath(os.environ["HIDDEN"])):
    if event == "open" and isinstance(args[0], str) and os.path.realpath(args[0]).startswith(hidden):
        raise PermissionError(f"{args[0]}: of another computer")
sys.addaudithook(audit)
"""
"""What keeps a process, and those that it starts, from the client's files, as if it were another computer."""


class Crowd:
    """Ended by ``with``. ``losses``: workers that a job may lose before dask gives it up, beyond the first."""

    def __init__(self, folder: Path, hidden: Path, losses: int = 1) -> None:
        self.folder, self.hidden, self.losses = folder, hidden, losses
        self.workers: list[subprocess.Popen[bytes]] = []
        (folder / "blind").mkdir(parents=True)
        (folder / "blind" / "sitecustomize.py").write_text(BLIND, encoding="utf-8")
        place = folder / "address.json"
        self.scheduler = self._started("scheduler", "--port", "0", "--scheduler-file", str(place))
        end = time.monotonic() + 60
        while not place.exists() or not (text := place.read_text(encoding="utf-8")).rstrip().endswith("}"):
            assert time.monotonic() < end, (folder / "scheduler" / "log.txt").read_text()
            time.sleep(0.05)
        self.address = text.partition('"address": "')[2].partition('"')[0]

    def __enter__(self) -> Crowd:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def hire(self) -> None:
        """Start one more worker, of one thread."""
        name = f"worker{len(self.workers)}"
        self.workers.append(self._started("worker", self.address, "--no-nanny", "--nthreads", "1", place=name))

    def _started(self, what: str, *words: str, place: str = "") -> subprocess.Popen[bytes]:
        own = self.folder / (place or what)
        own.mkdir()
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join([str(self.folder / "blind"), str(ROOT)]),
            "HIDDEN": str(self.hidden),
            "SEATFEM_STORE": str(own / "store"),
            "TMPDIR": str(own),
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(self.losses),
        }
        command = [sys.executable, "-m", "dask", what, *words, "--host", "127.0.0.1", "--no-dashboard"]
        with (own / "log.txt").open("wb") as log:
            return subprocess.Popen(command, cwd=own, env=environment, stdout=log, stderr=log)
