"""Tables of measurements: rows on file, tables with the machine they were measured on, and pages that show them."""

from __future__ import annotations

import csv
import gc
import json
import os
import platform
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from functools import _lru_cache_wrapper
from pathlib import Path
from time import process_time
from typing import Any, TypeVar

import numba
import numpy as np

RESULTS = Path(__file__).parent / "results"
KINDS: dict[str, Callable[[str], Any]] = {"int": int, "float": float, "str": str, "bool": lambda text: text == "True"}
Row = TypeVar("Row")


@dataclass(frozen=True)
class Table:
    """``rows`` of ready-made text under ``columns``; ``notes`` say what is measured and what the aim is."""

    title: str
    notes: tuple[str, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """Return the table with its notes."""
        lines = ["| " + " | ".join(row) + " |" for row in (self.columns, ("---",) * len(self.columns), *self.rows)]
        return "\n".join([f"## {self.title}", "", *self.notes, "", *lines, ""])


def publish(name: str, table: Table) -> None:
    """Print the table and keep it in results/<name>.json."""
    print(table.markdown())  # noqa: T201
    path = RESULTS / f"{name}.json"
    path.write_text(json.dumps({"machine": machine(), **asdict(table)}, indent=1) + "\n", encoding="utf-8")


def read_rows(kind: type[Row], path: Path) -> list[Row]:
    """Return the rows of a CSV file as instances of a dataclass of int, float, str and bool; none without the file."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    columns = fields(kind)  # type: ignore[arg-type]
    return [kind(**{each.name: KINDS[str(each.type)](line[each.name]) for each in columns}) for line in lines]


def append_rows(rows: Sequence[Any], path: Path, digits: int = 6) -> None:
    """Append instances of one dataclass to a CSV file, with its header where the file is new."""
    new = not path.is_file()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow([each.name for each in fields(rows[0])])
        writer.writerows([f"{v:.{digits}g}" if isinstance(v, float) else v for v in astuple(row)] for row in rows)


def write_between(page: Path, name: str, content: str) -> None:
    """Replace what is between the marks <!-- name --> and <!-- /name --> of a page."""
    pattern = rf"(?s)(<!-- {name} -->\n).*?(<!-- /{name} -->)"
    text, count = re.subn(pattern, lambda m: f"{m[1]}{content}\n{m[2]}", page.read_text(encoding="utf-8"))
    if count != 1:
        raise ValueError(f"{page.name}: {count} marks <!-- {name} --> ... <!-- /{name} -->, one is needed")
    page.write_text(text, encoding="utf-8")


def machine() -> dict[str, str]:
    """Return processor, cores and versions; no names."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    about = {"processor": platform.processor() or platform.machine(), "cores": str(cores)}
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = dict(line.split(":", 1) for line in info.read_text().split("\n\n")[0].splitlines() if ":" in line)
        lines = {key.strip(): value.strip() for key, value in lines.items()}
        flags = lines.get("flags", "").split()
        vectors = next((v for v in ("avx512f", "avx2", "avx", "sse2") if v in flags), "unknown")
        about["processor"] = f"{lines.get('model name')}, {lines.get('cpu MHz')} MHz, {vectors}"
    versions = {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__}
    return about | versions | {"system": f"{platform.system()} {platform.machine()}"}


def describe_machine(about: dict[str, str]) -> str:
    """Return what `machine` says on one line."""
    return "; ".join(f"{key} {value}" for key, value in about.items())


def forget() -> None:
    """Empty the caches that hold what scenes have computed, as in a process that begins: those that keep a few."""
    for each in gc.get_objects():  # by their type, as isinstance asks dead proxies, too
        if type(each) is _lru_cache_wrapper and each.cache_parameters()["maxsize"] is not None:
            each.cache_clear()


def spent() -> float:
    """Return the processor time of this process and of those that it has waited for [s]."""
    return process_time() + sum(os.times()[2:4])


def timed(work: Callable[[], Row]) -> tuple[Row, float]:
    """Return what a function returns, and the processor time of it and of the processes that it waits for [s]."""
    before = spent()
    found = work()
    return found, spent() - before


def best(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the least processor time of some calls [s]."""
    return min(timed(work)[1] for _ in range(repeats))
