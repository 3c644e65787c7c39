"""The battery's process: cells by name on standard input, their outcomes on standard output, as JSON lines.

Started by `tests.extremes.runner` only.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from seatfem.jobs.worker import lines_from_parent
from tests.extremes.battery import battery
from tests.extremes.cell import carry_out

MEMORY_LIMIT = 6 << 30  # bytes of address space beyond what the libraries map


def main() -> None:
    """Carry out cells until the parent ends, or ends this process."""
    names = lines_from_parent()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print leads to the log
    cells = {cell.name: cell for cell in battery()}
    _limit_memory()
    answers.write("ready\n")
    answers.flush()
    for name in names:
        answers.write(json.dumps(asdict(carry_out(cells[name]))) + "\n")
        answers.flush()


def _limit_memory() -> None:
    """Where the system can: allocations beyond the limit fail with MemoryError."""
    try:
        import resource  # absent on Windows
    except ImportError:
        return
    mapped = 0
    with suppress(OSError):
        mapped = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + MEMORY_LIMIT, resource.RLIM_INFINITY))


if __name__ == "__main__":
    main()
