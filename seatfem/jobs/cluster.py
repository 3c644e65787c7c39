"""Jobs on a cluster of dask (distributed) that shares no file system with the client; it needs the extra [cluster].

The client sends each job with its files to a dask worker, whose thread has it answered by a crew of one process.
"""

from __future__ import annotations

import atexit
import json
import re
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from impact.files.safe_files import MB, read_bytes
from impact.notices import SeatfemError
from seatfem.jobs.crew import FILES, Ask, Lost, crew
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import code_version

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE: Final = 10.0  # longest wait for the scheduler's answer [s]
MOST: Final = 256 * MB  # largest size of a file of a job [bytes]
_ADDRESS: Final = re.compile(r"(?:tcp|tls)://(\[[0-9A-Fa-f:.]+\]|[\w.-]+):(\d{1,5})")


class ClusterError(SeatfemError, ValueError):
    """Error of a cluster that cannot be used or is gone; the message names its address and a remedy."""


@contextmanager
def _client(address: str) -> Iterator[Client]:
    """Yield a client of a cluster that has workers. Raises `ClusterError`."""
    host_and_port = _ADDRESS.fullmatch(address)
    if host_and_port is None or int(host_and_port[2]) > 65535:
        words = "write the scheduler's address, as tcp://HOST:8786, or tls://HOST:8786 where traffic is encrypted"
        raise ClusterError(f"--cluster {address}: {words}")
    if find_spec("distributed") is None:
        raise ClusterError(f"--cluster {address}: needs dask; install with: pip install 'seatfem[cluster]'")
    import dask
    from distributed import Client

    client = Client.__new__(Client)  # built in two steps, to close a client that cannot connect before it logs that
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": 2 * MOST}):
        try:
            socket.create_connection((host_and_port[1].strip("[]"), int(host_and_port[2])), PATIENCE).close()
            client.__init__(address, timeout=PATIENCE, set_as_default=False, name="seatfem")  # type: ignore[misc]
        except (MemoryError, OSError, ValueError, TypeError, RuntimeError) as error:
            client.status = "closed"
            words = f"no scheduler of dask answers there within {PATIENCE:g} s: {error}"
            remedy = "start one by `dask scheduler`; for tls:// name your certificates (docs/cluster.md)"
            raise ClusterError(f"--cluster {address}: {words}; {remedy}") from None
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            words = f"no workers are there; start one by `dask worker {address}`"
            raise ClusterError(f"--cluster {address}: {words}") from None
        else:
            yield client
        finally:
            with suppress(OSError, RuntimeError):
                client.close(timeout=PATIENCE)


def threads_of(address: str) -> int:
    """Return the number of jobs that the cluster runs at once. Raises `ClusterError` as `cluster_crew`."""
    with _client(address) as client:
        return sum(client.nthreads().values())


@contextmanager
def cluster_crew(
    address: str, function: str, pack: Callable[[str], tuple[str, Mapping[str, Path]]], *, renew: int = 0
) -> Iterator[Ask]:
    """Yield a function like that of `crew`, run on the threads of the workers of the scheduler at ``address``.

    ``pack`` converts a job into one for any computer, in which files are named ``f"{FILES}/{name}"``, and returns it
    with their paths by names "NUMBER/NAME". A job with which ``distributed.scheduler.allowed-failures`` + 1 workers are
    lost is `Lost`. Raises `ClusterError`: an invalid address, no answer, no workers; later, workers of another version,
    a scheduler that is gone, or a file that is too large.
    """
    with _client(address) as client:
        from distributed import KilledWorker, as_completed

        sent: dict[Path, Future[bytes]] = {}

        def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str | Lost]]:
            start, completed = time.monotonic(), as_completed(loop=client.loop)
            begun: dict[Future[str | Lost], tuple[int, Mapping[str, Path]]] = {}

            def receive_answer(future: Future[str | Lost]) -> tuple[int, str | Lost]:
                number, files = begun.pop(future)
                try:
                    answer = future.result()
                except KilledWorker as error:
                    log = f"workers were lost that had this job, the last one {error.last_worker}"
                    return number, Lost(False, None, log, time.monotonic() - start)
                except Exception as error:
                    if future.status == "error":
                        raise ClusterError(f"--cluster {address}: {error}; or run it without --cluster") from None
                    words = "the scheduler is gone; run the same command again, it goes on where it was"
                    raise ClusterError(f"--cluster {address}: {words}") from None
                if isinstance(answer, str):
                    for name in sorted(files, key=len, reverse=True):
                        answer = answer.replace(f"{FILES}/{name}", json.dumps(str(files[name]))[1:-1])
                return number, answer

            try:
                for number, (job, files) in enumerate(map(pack, jobs)):
                    for path in set(files.values()) - sent.keys():
                        sent[path] = client.submit(bytes, read_bytes(path, MOST, ClusterError))  # once, by its content
                    data = {name: sent[path] for name, path in files.items()}
                    future = client.submit(carried_out, function, renew, job, limit, code_version(), data, pure=False)
                    begun[future] = number, files
                    completed.add(future)
                    while completed.has_ready():
                        yield receive_answer(next(completed))
                yield from map(receive_answer, completed)
            finally:
                with suppress(Exception):  # the scheduler may be gone
                    client.cancel(list(begun), force=True)

        yield ask


def carried_out(
    function: str, renew: int, job: str, limit: float, version: str, files: Mapping[str, bytes]
) -> str | Lost:
    """Return the answer to a job, "" if it is cancelled; called in a thread of a worker of dask."""
    from distributed import get_worker

    if (ours := code_version()) != version:
        words = f"worker {get_worker().address} has version {ours} of seatfem, this computer {version}"
        raise RuntimeError(f"{words}: install the same sources on both, and start the worker again")
    with private_folder("cluster") as folder:
        place = json.dumps(str(folder.resolve()))[1:-1]
        for name, data in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data)
        for _, answer in _crew_of(threading.get_ident(), function, renew)([job.replace(FILES, place)], limit):
            return answer.replace(place, FILES) if isinstance(answer, str) else answer
    return ""


@cache
def _crew_of(thread: int, function: str, renew: int) -> Ask:
    """Return the crew of one process of this thread, which lasts as long as the worker of dask."""
    from distributed import get_worker

    ours, worker = ExitStack(), get_worker()
    tasks = worker.state.tasks
    atexit.register(ours.close)
    hired = crew(function, renew=renew, is_wanted=lambda: tasks[worker.get_current_task()].state == "executing")
    return ours.enter_context(hired)
