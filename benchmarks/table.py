"""What every benchmark leaves: a table with the machine it was measured on."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

import numba
import numpy as np

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Table:
    """``rows`` of ready-made text under ``columns``; ``notes`` say what is measured and what the aim is."""

    title: str
    notes: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """The table with its notes."""
        lines = ["| " + " | ".join(row) + " |" for row in (self.columns, ("---",) * len(self.columns), *self.rows)]
        return "\n".join([f"## {self.title}", "", *self.notes, "", *lines, ""])


def publish(name: str, table: Table) -> None:
    """Print the table and keep it in results/<name>.json."""
    print(table.markdown())  # noqa: T201
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps({"machine": machine(), **asdict(table)}, indent=1) + "\n", encoding="utf-8")


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine() -> dict[str, str]:
    """Processor, memory in use of it, and versions; no names."""
    about = {"processor": platform.processor() or platform.machine(), "cores": str(cores())}
    info = Path("/proc/cpuinfo")
    if info.exists():
        fields = dict(line.split(":", 1) for line in info.read_text().split("\n\n")[0].splitlines() if ":" in line)
        fields = {key.strip(): value.strip() for key, value in fields.items()}
        flags = fields.get("flags", "").split()
        vectors = next((v for v in ("avx512f", "avx2", "avx", "sse2") if v in flags), "unknown")
        about["processor"] = f"{fields.get('model name')}, {fields.get('cpu MHz')} MHz, {vectors}"
    versions = {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__}
    return about | versions | {"system": f"{platform.system()} {platform.machine()}"}


def best(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest of some runs [s]: what the machine can do when others leave it alone."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)
