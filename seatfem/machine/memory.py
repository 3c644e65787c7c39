"""Memory that a computation may take here: the least of what the machine has left and what its limits leave.

A container's limit is that of a control group, which /proc/meminfo does not know; a batch system's or a shell's
(``ulimit -v``) is that of the process's address space.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Final

import psutil

if sys.platform != "win32":
    import resource

ROOT: Final = Path("/")
_LIMITS: Final = {
    "": (("memory.max", "memory.high"), "memory.current", "inactive_file"),  # version 2
    "memory": (("memory.limit_in_bytes",), "memory.usage_in_bytes", "total_inactive_file"),  # version 1
}
"""By controller: files of limits, file of the use, and the row of memory.stat for files that are only cached."""


def available_memory(root: Path = ROOT) -> float:
    """Return the bytes that can be had without swapping and within all limits; infinite where none are reported.

    ``root``: of the files /proc and /sys in which Linux tells about control groups.
    """
    return max(0.0, min(_of_the_machine(), _of_the_address_space(), *_of_control_groups(root)))


def peak_memory() -> float:
    """Return the largest resident memory of this process so far [bytes]; on Linux from /proc: this program's own."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return 1024.0 * int(status.partition("VmHWM:")[2].split()[0])
    except (OSError, IndexError):
        pass
    if sys.platform == "win32":
        return math.nan
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def _of_the_machine() -> float:
    try:
        return float(psutil.virtual_memory().available)
    except (OSError, RuntimeError, ValueError, LookupError):  # no /proc, or one that psutil cannot read
        return math.inf


def _of_the_address_space() -> float:
    """Return RLIMIT_AS less what is mapped [bytes]; infinite where there is no limit."""
    if sys.platform == "win32":
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return math.inf
    return float(limit - psutil.Process().memory_info().vms)


def _of_control_groups(root: Path) -> Iterator[float]:
    """Yield what each group of this process leaves [bytes]: its own, and those around it, whose limits hold too.

    A container may name its group as the host does and see it mounted as the top: groups that are not there are passed.
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
    """Return the group's limit less its use [bytes]; files that are only cached are given back when needed."""
    limit = min((_number(group / name) for name in limits), default=math.inf)
    if math.isinf(limit):
        return math.inf
    used = _number(group / use)
    return limit - max(0.0, used - _row(group / "memory.stat", cached)) if math.isfinite(used) else limit


def _number(file: Path) -> float:
    """Return the bytes that a file states; infinite for "max", or where it is not there."""
    with suppress(OSError, ValueError):
        return float(file.read_text(encoding="ascii").strip().replace("max", "inf"))
    return math.inf


def _row(file: Path, name: str) -> float:
    with suppress(OSError, ValueError):
        rows = (line.split() for line in file.read_text(encoding="ascii").splitlines())
        return float(next((row[1] for row in rows if len(row) == 2 and row[0] == name), "0"))
    return 0.0
