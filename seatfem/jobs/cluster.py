"""Jobs on a cluster of dask (distributed) that shares no file system with the client: both sides of the exchange.

The client sends each job with its files to a dask worker, whose plugin `Desks` has the job answered by a process.
`distributed` imports this module on both sides; it needs the extra [cluster].
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

PATIENCE: Final = 10.0  # longest wait for the scheduler's answer [s]
MOST: Final = 256 * MB  # largest total size of the files of one job [bytes]


class ClusterError(ValueError):
    """Error of a cluster that cannot be used or is gone; the message names its address and a remedy."""


@dataclass(frozen=True)
class Parcel:
    """Job for a computer without access to the client's files.

    Attributes:
        line: text of the job, in which its files are named ``f"{FILES}/{name}"``.
        files: paths on the client by names "NUMBER/NAME", made of letters, digits and ``_.-``.
    """

    line: str
    files: Mapping[str, Path] = field(default_factory=dict)


Pack = Callable[[str], Parcel]
"""Function that converts a job of this computer into one for any computer."""


def check_address(address: str) -> None:
    """Raise `ClusterError` if the text is not the address of a scheduler."""
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
    """Yield a client that is connected to the scheduler; raise `ClusterError` if that fails."""
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
    client = Client.__new__(Client)  # built in two steps, to close a client that cannot connect before it logs that
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
    """Return the number of jobs that the cluster runs at once. Raises `ClusterError` if it cannot be reached, has no
    workers, or has workers of another version."""
    with _client(address) as client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            words = f"the scheduler has no workers; start one by `dask worker {address}`"
            raise ClusterError(f"--cluster {address}: {words}") from None
        _settle(client, address)
        return sum(client.nthreads().values())


def _settle(client: Client, address: str) -> None:
    """Register the plugin `Desks` on all workers, including those that join later."""
    version = code_version()
    try:
        client.register_plugin(seatfem.jobs.cluster.Desks(version), name=seatfem.jobs.cluster.name_of(version))
    except Exception as error:  # a worker without seatfem, or with another one, may raise any error
        with suppress(Exception):
            client.unregister_worker_plugin(name=seatfem.jobs.cluster.name_of(version))
        reason = f"a worker there has no seatfem, install it: {_first(error)}"
        reason = str(error) if isinstance(error, seatfem.jobs.cluster.OtherVersionError) else reason
        raise ClusterError(f"--cluster {address}: {reason}") from None


@contextmanager
def cluster_crew(address: str, program: Program, pack: Pack) -> Iterator[Ask]:
    """Yield a function like that of `desk.crew`, run on the threads of the workers of the scheduler at ``address``.

    If a worker is lost, dask gives its jobs to others, each job up to three times
    (``distributed.scheduler.allowed-failures``); then the job is `Lost`. Each job runs in a separate process beside the
    worker, which survives a job that crashes or hangs.

    Raises:
        ClusterError: an invalid address, no answer, workers of another version; later, a scheduler that is gone, or
            files of a job that are too large.
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
    lost_error = ClusterError(f"--cluster {address}: {words}")
    version, study, start = code_version(), uuid4().hex, time.monotonic()
    pending: dict[Future[Any], tuple[int, Parcel]] = {}
    completed = as_completed(loop=client.loop)

    def arrived(futures: Sequence[Future[Any]]) -> Iterator[tuple[int, str | Lost]]:
        finished = [future for future in futures if future.status == "finished"]
        try:
            answers = dict(zip(finished, client.gather(finished), strict=True))
        except (OSError, RuntimeError, CancelledError):  # also raised by a client that is closed
            raise lost_error from None
        for future in futures:
            number, parcel = pending.pop(future)
            if future in answers:
                yield number, _at_home(answers[future], parcel)
            elif future.status == "error" and isinstance(problem := future.exception(), KilledWorker):
                many, last = problem.allowed_failures + 1, problem.last_worker
                reason = f"{many} workers were lost that had this job, last {last}"
                yield number, Lost(False, None, reason, time.monotonic() - start)
            elif future.status == "error":
                raise ClusterError(f"--cluster {address}: {_first(future.exception())}; run it without --cluster")
            else:
                raise lost_error

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
            completed.add(future)
            if completed.has_ready():
                yield from arrived(completed.next_batch(block=False))
        for batch in completed.batches():
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
    """Return the answer with the client's paths in place of the names of the files."""
    text = answer.log if isinstance(answer, Lost) else answer
    for name in sorted(parcel.files, key=len, reverse=True):
        text = text.replace(f"{FILES}/{name}", json.dumps(str(parcel.files[name]))[1:-1])
    return replace(answer, log=text) if isinstance(answer, Lost) else text


def _first(error: BaseException | None) -> str:
    """Return the first line of an error's message."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


IDLE: Final = 60.0  # time without a job after which a process ends [s]
ENDED: Final = ("cancelled", "released", "forgotten")  # states of a task whose result is no longer wanted
_NAME: Final = re.compile(r"[0-9]{1,4}/[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


class OtherVersionError(RuntimeError):
    """Error of a worker whose sources of the program differ from the client's."""


@dataclass(frozen=True)
class Task:
    """Job with all its data except its files.

    Attributes:
        program: program that answers it.
        line: text of the job, with `FILES` in place of the folder of its files.
        limit: longest wall time [s].
        version: version of the client's sources.
    """

    program: Program
    line: str
    limit: float
    version: str


def check_version(wanted: str, place: str) -> None:
    """Raise `OtherVersionError` if the version on this computer differs from the ``wanted`` one."""
    if (ours := code_version()) != wanted:
        raise OtherVersionError(
            f"worker {place} has version {ours} of seatfem, this computer {wanted}: install the same sources on both, "
            "and start the worker again"
        )


class Desks(WorkerPlugin):
    """Plugin of a dask worker with one desk for each of its threads that has had a job.

    A process ends when its job is cancelled, after `IDLE` seconds without a job, and with the worker.
    """

    idempotent = True  # several clients of one version share it

    def __init__(self, version: str) -> None:
        self.version = version

    def setup(self, worker: Worker) -> None:
        """Raise `OtherVersionError` if the sources differ: dask passes it to the client."""
        check_version(self.version, worker.address)
        self.lock = threading.Lock()
        self.free: dict[Desk, threading.Timer] = {}
        self.busy: dict[object, Desk] = {}
        self.ours = ExitStack()
        self.folder = self.ours.enter_context(private_folder("cluster"))
        self.made = 0

    def teardown(self, worker: Worker) -> None:
        """End all desks and remove their files."""
        if "lock" not in vars(self):  # setup raised an error
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
        """End the desk of a task that dask has ended; dask calls this at each change of a task's state."""
        if finish in ENDED and "lock" in vars(self):
            with self.lock:
                if (desk := self.busy.get(key)) is not None:
                    threading.Thread(target=desk.end, daemon=True).start()

    def answer(self, key: object, task: Task, files: Mapping[str, bytes]) -> str | Lost:
        """Return the answer of a free desk for the task's program, or of a new desk."""
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
    """Write only these files into ``folder``; return its path as in a JSON string. Raises `ValueError` if unsafe."""
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
    """Return the answer to a task; dask calls it in one of the threads of a worker."""
    worker = get_worker()
    check_version(task.version, worker.address)  # a worker that joined after the client's check
    desks = worker.plugins[name_of(task.version)]
    assert isinstance(desks, Desks)
    return desks.answer(worker.get_current_task(), task, files)


def name_of(version: str) -> str:
    """Return the name of the plugin for this version."""
    return f"seatfem {version}"
