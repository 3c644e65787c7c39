"""Jobs carried out by a cluster of dask (distributed): the side of who asks. No file system is shared with it.

The dask worker's side of a cluster: jobs are answered by processes, from files that travel with them.

Loaded by workers of `distributed` and by `seatfem.jobs.cluster`; needs the extra [cluster].
"""

from __future__ import annotations

import json
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit
from uuid import uuid4

from distributed import Worker, WorkerPlugin, get_worker

import seatfem
from impact.files.safe_files import MB, read_bytes
from seatfem.jobs.desk import FILES, Ask, Desk, Lost, Program
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import code_version

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE: Final = 10.0  # longest wait [s] for the scheduler's answer
MOST: Final = 256 * MB  # most bytes of the files of one job


class ClusterError(ValueError):
    """A cluster that cannot be used, or that is gone; the message names its address and what to do."""


@dataclass(frozen=True)
class Parcel:
    """A job for a computer that has no files of this one.

    Attributes:
        line: the job; a file of it is called ``f"{FILES}/{name}"``.
        files: by safe names, "NUMBER/NAME" of letters, digits and ``_.-``, where they are here.
    """

    line: str
    files: Mapping[str, Path] = field(default_factory=dict)


Pack = Callable[[str], Parcel]
"""Function that makes a job of this computer into one for any computer."""


def check_address(address: str) -> None:
    """Raise `ClusterError` if the text is no address of a scheduler."""
    try:
        parts = urlsplit(address)
        good = parts.scheme in ("tcp", "tls") and parts.hostname and parts.port and "@" not in parts.netloc
        good = good and not (parts.path or parts.query or parts.fragment)
    except ValueError:
        good = False
    if not good:
        words = "write the scheduler's address, as tcp://HOST:8786, or tls://HOST:8786 where traffic is encrypted"
        raise ClusterError(f"--cluster {address}: {words}")


@contextmanager
def _client(address: str) -> Iterator[Client]:
    """Yield a client that is connected to the scheduler; raises `ClusterError`."""
    check_address(address)
    if find_spec("distributed") is None:
        raise ClusterError(f"--cluster {address}: needs dask; install with: pip install 'seatfem[cluster]'")
    import dask
    from distributed import Client

    parts = urlsplit(address)
    if parts.scheme == "tls" and not dask.config.get("distributed.comm.tls.client.cert", None):
        keys = "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ...__TLS__CLIENT__CERT and ...__TLS__CLIENT__KEY"
        words = f"no certificate of this client is known; set {keys} (docs/cluster.md)"
        raise ClusterError(f"--cluster {address}: {words}")
    client = Client.__new__(Client)  # in two steps: what cannot connect is closed before it complains of that itself
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": MOST}):
        try:
            socket.create_connection((parts.hostname or "", parts.port or 0), PATIENCE).close()
            client.__init__(address, timeout=PATIENCE, set_as_default=False, name="seatfem")  # type: ignore[misc]
        except (OSError, ValueError, TypeError, RuntimeError) as error:
            client.status = "closed"
            words = f"no scheduler of dask answers there within {PATIENCE:g} s: {_first(error)}"
            remedy = "start one by `dask scheduler` (docs/cluster.md)"
            raise ClusterError(f"--cluster {address}: {words}; {remedy}") from None
        try:
            yield client
        finally:
            with suppress(OSError, RuntimeError):
                client.close(timeout=PATIENCE)


def threads_of(address: str) -> int:
    """Return how many jobs the cluster does at once. Raises `ClusterError`, also without workers, or of another
    version."""
    with _client(address) as client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            words = f"the scheduler has no workers; start one by `dask worker {address}`"
            raise ClusterError(f"--cluster {address}: {words}") from None
        _settle(client, address)
        return sum(client.nthreads().values())


def _settle(client: Client, address: str) -> None:
    """Start desks on all workers, also on those that join later."""
    version = code_version()
    try:
        client.register_plugin(seatfem.jobs.cluster.Desks(version), name=seatfem.jobs.cluster.name_of(version))
    except Exception as error:  # of a worker that has no, or another, seatfem, whatever that raises
        with suppress(Exception):
            client.unregister_worker_plugin(name=seatfem.jobs.cluster.name_of(version))
        reason = f"a worker there has no seatfem, install it: {_first(error)}"
        reason = str(error) if isinstance(error, seatfem.jobs.cluster.OtherVersionError) else reason
        raise ClusterError(f"--cluster {address}: {reason}") from None


@contextmanager
def cluster_crew(address: str, program: Program, pack: Pack) -> Iterator[Ask]:
    """Start `seatfem.jobs.desk.crew` on the threads of the workers of the cluster whose scheduler is at ``address``.

    A worker that is lost costs nothing: dask gives its jobs to others, each up to three times
    (``distributed.scheduler.allowed-failures``); then the job is `Lost`. Each job runs in a process of its own beside
    the worker, which a job that dies or hangs does not take along.

    Raises:
        ClusterError: an address that is none, no answer, workers of another version; while jobs are done, a scheduler
            that goes away, or files of a job that are too large.
    """
    with _client(address) as client:
        _settle(client, address)
        files: dict[Path, Future[bytes]] = {}
        yield lambda jobs, limit: _asked(client, address, program, map(pack, jobs), limit, files)


def _asked(
    client: Client,
    address: str,
    program: Program,
    parcels: Iterator[Parcel],
    limit: float,
    files: dict[Path, Future[bytes]],
) -> Iterator[tuple[int, str | Lost]]:
    from distributed import KilledWorker, as_completed

    words = "the scheduler is gone; run the same command again, it goes on where it was"
    gone = ClusterError(f"--cluster {address}: {words}")
    version, study, begun = code_version(), uuid4().hex, time.monotonic()
    pending: dict[Future[Any], tuple[int, Parcel]] = {}
    coming = as_completed(loop=client.loop)

    def arrived(futures: Sequence[Future[Any]]) -> Iterator[tuple[int, str | Lost]]:
        well = [future for future in futures if future.status == "finished"]
        try:
            answers = dict(zip(well, client.gather(well), strict=True))
        except (OSError, RuntimeError, CancelledError):  # of a client that is closed, too
            raise gone from None
        for future in futures:
            number, parcel = pending.pop(future)
            if future in answers:
                yield number, _at_home(answers[future], parcel)
            elif future.status == "error" and isinstance(problem := future.exception(), KilledWorker):
                many, last = problem.allowed_failures + 1, problem.last_worker
                reason = f"{many} workers were lost that had this job, last {last}"
                yield number, Lost(False, None, reason, time.monotonic() - begun)
            elif future.status == "error":
                raise ClusterError(f"--cluster {address}: {_first(future.exception())}; run it without --cluster")
            else:
                raise gone

    try:
        for number, parcel in enumerate(parcels):
            _check_size(parcel)
            for path in set(parcel.files.values()) - files.keys():
                files[path] = client.submit(bytes, read_bytes(path, MOST, ClusterError))  # once, by its content
            data = {name: files[path] for name, path in parcel.files.items()}
            task = seatfem.jobs.cluster.Task(program, parcel.line, limit, version)
            future = client.submit(
                seatfem.jobs.cluster.carried_out, task, data, key=f"seatfem-{study}-{number}", pure=False
            )
            pending[future] = number, parcel
            coming.add(future)
            if coming.has_ready():
                yield from arrived(coming.next_batch(block=False))
        for batch in coming.batches():
            yield from arrived(batch)
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.cancel(list(pending), force=True)


def _check_size(parcel: Parcel) -> None:
    sizes = {path: path.stat().st_size for path in parcel.files.values()}
    if (size := sum(sizes.values())) > MOST:
        largest = max(sizes, key=lambda path: sizes[path])
        words = f"the files of the scene have {size / MB:.4g} MB together; at most {MOST / MB:g} MB travel to other"
        raise ClusterError(f"{largest}: {words} computers: run it here, or make the file smaller")


def _at_home(answer: str | Lost, parcel: Parcel) -> str | Lost:
    """Return the answer with the names that the files have here."""
    text = answer.log if isinstance(answer, Lost) else answer
    for name in sorted(parcel.files, key=len, reverse=True):
        text = text.replace(f"{FILES}/{name}", json.dumps(str(parcel.files[name]))[1:-1])
    return replace(answer, log=text) if isinstance(answer, Lost) else text


def _first(error: BaseException | None) -> str:
    """Return the first line of an error's message."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


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
