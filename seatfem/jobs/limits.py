"""Bounds on what a process may take, where the system has them: a worker that exceeds one fails alone."""

from __future__ import annotations

import signal
from contextlib import suppress
from pathlib import Path


def limit_process(*, memory: int | None = None, seconds: int | None = None, file_size: int | None = None) -> None:
    """Bound what the rest of this process takes; without effect where the system has no such limits.

    Args:
        memory: bytes of address space beyond what is mapped already; more raises `MemoryError`.
        seconds: of the processor; more ends the process (SIGXCPU).
        file_size: bytes of any one file; a longer write raises `OSError`.
    """
    try:
        import resource  # absent on Windows
    except ImportError:
        return
    mapped = 0
    with suppress(OSError):
        mapped = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    bounds = (
        (resource.RLIMIT_AS, None if memory is None else mapped + memory),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_FSIZE, file_size),
        (resource.RLIMIT_CORE, 0),  # no picture of the memory on the disk
    )
    for kind, most in bounds:
        if most is not None:
            with suppress(OSError, ValueError):
                resource.setrlimit(kind, (most, resource.RLIM_INFINITY))
    if file_size is not None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
