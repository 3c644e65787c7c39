"""The dask worker's side of a cluster: jobs are answered by processes, from files that travel with them.

Loaded by workers of `distributed` and by `seatfem.jobs.cluster`; needs the extra [cluster].
"""

import json
import re
import threading
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from distributed import Worker, WorkerPlugin, get_worker

from seatfem.jobs.desk import FILES, Desk, Lost, Program
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import code_version

IDLE: Final = 60.0  # time [s] without a job after which a process ends
ENDED: Final = ("cancelled", "released", "forgotten")  # states of a task whose result is not wanted any more
_NAME: Final = re.compile(r"[0-9]{1,4}/[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


class OtherVersionError(RuntimeError):
    """A worker has other sources of the program than the client."""


@dataclass(frozen=True)
class Task:
    """A job with all its data but its files.

    Attributes:
        program: that answers it.
        line: the job; `FILES` in place of the folder of its files.
        limit: seconds of the clock.
        version: of the client's sources.
    """

    program: Program
    line: str
    limit: float
    version: str


def check_version(wanted: str, place: str) -> None:
    """Raise `OtherVersionError` if this computer has another version than the ``wanted`` one."""
    if (own := code_version()) != wanted:
        raise OtherVersionError(
            f"worker {place} has version {own} of seatfem, this computer {wanted}: install the same sources on both, "
            "and start the worker again"
        )


class Desks(WorkerPlugin):
    """The desks of a worker of dask: one for each of its threads that has had a job.

    A process ends with its job where that is cancelled, after `IDLE` seconds without one, and with the worker.
    """

    idempotent = True  # several clients of one version share them

    def __init__(self, version: str) -> None:
        self.version = version

    def setup(self, worker: Worker) -> None:
        """Raise `OtherVersionError` where the sources differ: dask hands that to the client."""
        check_version(self.version, worker.address)
        self.lock = threading.Lock()
        self.free: dict[Desk, threading.Timer] = {}
        self.busy: dict[object, Desk] = {}
        self.ours = ExitStack()
        self.folder = self.ours.enter_context(private_folder("cluster"))
        self.made = 0

    def teardown(self, worker: Worker) -> None:
        """End all desks, and remove their files."""
        if "lock" not in vars(self):  # refused
            return
        with self.lock:
            for desk, timer in self.free.items():
                timer.cancel()
                desk.end()
            for desk in self.busy.values():
                desk.end()
            self.free.clear()
            self.ours.close()

    def transition(self, key: object, start: object, finish: object, **_: object) -> None:
        """End the desk whose task dask has ended; dask calls this as its tasks change."""
        if finish in ENDED and "lock" in vars(self):
            with self.lock:
                if (desk := self.busy.get(key)) is not None:
                    threading.Thread(target=desk.end, daemon=True).start()

    def answer(self, key: object, task: Task, files: Mapping[str, bytes]) -> str | Lost:
        """Return the answer of a free desk of the task's program, or of a new one."""
        with self.lock:
            desk = next((each for each in self.free if each.program == task.program), None)
            if desk is not None:
                self.free.pop(desk).cancel()
            else:
                self.made += 1
                desk = Desk(task.program, self.folder / str(self.made))
            self.busy[key] = desk
        try:
            place = unpacked(files, desk.folder / "files")
            desk.start()
            answer = desk.answer(task.line.replace(FILES, place), task.limit)
            desk.renewed(answer)
            if isinstance(answer, Lost):
                return replace(answer, log=answer.log.replace(place, FILES))
            return answer.replace(place, FILES)
        finally:
            with self.lock:
                del self.busy[key]
                timer = threading.Timer(IDLE, self._retire, [desk])
                timer.daemon = True
                self.free[desk] = timer
                timer.start()

    def _retire(self, desk: Desk) -> None:
        with self.lock:
            if self.free.pop(desk, None) is not None:
                desk.end()


def unpacked(files: Mapping[str, bytes], folder: Path) -> str:
    """Unpack these files alone; return the folder, as JSON has it in strings. Raises `ValueError` for unsafe names."""
    for name in files:
        if not _NAME.fullmatch(name):
            raise ValueError(f"{name!r} must be a number, / and a plain name")
    for old in [path for path in folder.glob("*/*") if path.relative_to(folder).as_posix() not in files]:
        old.unlink()
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_bytes() != data:
            path.write_bytes(data)
    return json.dumps(str(folder.resolve()))[1:-1]


def carried_out(task: Task, files: Mapping[str, bytes]) -> str | Lost:
    """Return the answer to a task; dask calls it, in one of the threads of a worker."""
    worker = get_worker()
    check_version(task.version, worker.address)  # one that joined after the client had asked
    desks = worker.plugins[name_of(task.version)]
    assert isinstance(desks, Desks)
    return desks.answer(worker.get_current_task(), task, files)


def name_of(version: str) -> str:
    """Return the name of the desks among dask's plugins."""
    return f"seatfem {version}"
