"""Cores and available memory of this computer, and wall time by stage.

The memory limit of a container is that of a control group, which /proc/meminfo does not contain; that of a batch system
or a shell (``ulimit -v``) is that of the process's address space.
"""

import ctypes
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Final

import psutil

if sys.platform != "win32":
    import resource


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compiled_threads() -> int:
    """Return the number of cores that this process may use for compiled code, at most `NUMBA_NUM_THREADS`."""
    stated = os.environ.get("NUMBA_NUM_THREADS", "")
    return max(1, min(cores(), int(stated))) if stated.isdigit() else cores()


def busyness() -> float:
    """Return how many times longer work takes because other programs share the cores, from the load of the last minute;
    at least 1."""
    return max(1.0, psutil.getloadavg()[0] / (os.cpu_count() or 1))


_OPTIONS: Final = ((-3, 4 * 2**20), (-1, 32 * 2**20))
"""Numbers of glibc's options, the sizes from which on memory is a mapping of its own, and the heap's end is returned
[bytes]."""


def return_freed_arrays() -> None:
    """Let memory of large arrays return to the system once they are freed, where the C library is glibc.

    It raises the size of what it returns to 32 MB by itself, and keeps the holes between smaller arrays: half a
    gigabyte in a long run.
    """
    with suppress(AttributeError, OSError, TypeError):
        for option, size in _OPTIONS:
            ctypes.CDLL(None).mallopt(option, size)


ROOT: Final = Path("/")
_LIMITS: Final = {
    "": (("memory.max", "memory.high"), "memory.current", "inactive_file"),  # version 2
    "memory": (("memory.limit_in_bytes",), "memory.usage_in_bytes", "total_inactive_file"),  # version 1
}
"""Files of limits, file of the usage, and the row of memory.stat for cached files, of each controller."""


def available_memory(root: Path = ROOT) -> float:
    """Return the memory available without swapping and within all limits [bytes]; infinite if none is reported.

    ``root``: folder that contains /proc and /sys, in which Linux reports control groups.
    """
    return max(0.0, min(_find_free_memory(), _find_free_addresses(), *_list_group_memory(root)))


def own_memory() -> float:
    """Return the resident memory of this process [bytes]; nan if it is not known."""
    with suppress(OSError, RuntimeError, ValueError, LookupError):
        return float(psutil.Process().memory_info().rss)
    return math.nan


def peak_memory() -> float:
    """Return the largest resident memory of this process so far, on Linux since `forget_peak` [bytes]."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return 1024.0 * int(status.partition("VmHWM:")[2].split()[0])
    except (OSError, IndexError):
        pass
    if sys.platform == "win32":
        return math.nan
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def forget_peak() -> float:
    """Let `peak_memory` begin anew, where Linux allows it, and return the memory that the process holds [bytes]."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return own_memory()


def _find_free_memory() -> float:
    try:
        return float(psutil.virtual_memory().available)
    except (OSError, RuntimeError, ValueError, LookupError):  # no /proc, or one that psutil cannot read
        return math.inf


def _find_free_addresses() -> float:
    """Return RLIMIT_AS minus the mapped memory [bytes]; infinite without a limit."""
    if sys.platform == "win32":
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return math.inf
    return float(limit - psutil.Process().memory_info().vms)


def _list_group_memory(root: Path) -> Iterator[float]:
    """Yield the available memory [bytes] of this process's control group and of its parents, whose limits apply, too.

    A container may name its group as the host does, but see it as the top: groups that do not exist are skipped.
    """
    yield math.inf
    with suppress(OSError, ValueError):
        for line in (root / "proc/self/cgroup").read_text(encoding="utf-8").splitlines():
            controllers, _, name = line.partition(":")[2].partition(":")
            if controllers and "memory" not in controllers.split(","):
                continue
            controller = "memory" if controllers else ""
            top = root / "sys/fs/cgroup" / controller
            inner = PurePosixPath("" if ".." in name.split("/") else name.lstrip("/"))
            yield from (_left(top / group, *_LIMITS[controller]) for group in (inner, *inner.parents))


def _left(group: Path, limits: tuple[str, ...], use: str, cached: str) -> float:
    """Return the group's limit minus its usage [bytes]; memory of cached files is available."""
    limit = min((_number(group / name) for name in limits), default=math.inf)
    if math.isinf(limit):
        return math.inf
    used = _number(group / use)
    return limit - max(0.0, used - _row(group / "memory.stat", cached)) if math.isfinite(used) else limit


def _number(file: Path) -> float:
    """Return the bytes that a file states; infinite for "max", or if there is no such file."""
    with suppress(OSError, ValueError):
        return float(file.read_text(encoding="ascii").strip().replace("max", "inf"))
    return math.inf


def _row(file: Path, name: str) -> float:
    with suppress(OSError, ValueError):
        rows = (line.split() for line in file.read_text(encoding="ascii").splitlines())
        return float(next((row[1] for row in rows if len(row) == 2 and row[0] == name), "0"))
    return 0.0


@dataclass(frozen=True)
class Stopwatch:
    """Wall time by stage [s]: ``with watch("mesh"): ...``; times of stages with the same name are added."""

    stages: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.stages[stage] = self.stages.get(stage, 0.0) + time.perf_counter() - start
