"""Time of `seatfem plan` for every example: fresh processes, empty stores, one thread, all byte code kept."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from table import Table, publish

from seatfem.structures.store import VARIABLE

EXAMPLES = Path(__file__).parent.parent / "examples"
RUNS = 5
AIM = 2.0  # s of wall time
IMPORTS = "import seatfem.faces.cli, seatfem.study.scene, seatfem.study.planning.planner, seatfem.faces.plan_view"

_KERNEL = "impact.march.replay import resting, translate; translate(1.0, resting(0.0, 0.0), *numpy.zeros((3, 1)))"
COMPILED = f"{IMPORTS}; import numpy; from {_KERNEL}"


@dataclass(frozen=True)
class Spent:
    """Seconds of one process: on the clock, and of the processor."""

    wall: float
    cpu: float


def main() -> None:
    """The best of some runs, each with a store of its own; the first, which fills the caches, does not count."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        environment |= dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        environment["PYTHONPYCACHEPREFIX"] = folder
        imports, compiled = (best(["-c", code], environment).cpu for code in (IMPORTS, COMPILED))
        scenes = {path.stem: best(["-m", "seatfem", "plan", str(path)], environment) for path in scene_files()}
    rows = [
        (name, *(f"{s:.2f}" for s in (spent.wall, spent.cpu, imports, compiled - imports, spent.cpu - compiled)))
        for name, spent in scenes.items()
    ]
    worst = max(scenes.values(), key=lambda spent: spent.wall)
    notes = (
        f"Best of {RUNS} runs of `seatfem plan`, each in a fresh process with an empty store.",
        "Imports: the program and its libraries. Compiled code: numba up to its first cached function.",
        f"The slowest takes {worst.wall:.2f} s (aim: below {AIM:g} s).",
    )
    columns = ("scene", "wall [s]", "processor [s]", "of which imports [s]", "compiled code [s]", "the plan [s]")
    publish("plan_time", Table("Planning", notes, columns, tuple(rows)))


def scene_files() -> list[Path]:
    """All examples that are scenes."""
    return sorted({*EXAMPLES.glob("*.toml")} - {*EXAMPLES.glob("*_study.toml")})


def best(arguments: list[str], environment: dict[str, str]) -> Spent:
    """The shortest times of some fresh interpreters."""
    spent = [once(arguments, environment) for _ in range(RUNS + 1)][1:]
    return Spent(min(s.wall for s in spent), min(s.cpu for s in spent))


def once(arguments: list[str], environment: dict[str, str]) -> Spent:
    """One fresh interpreter with an empty store."""
    with tempfile.TemporaryDirectory() as store:
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
        command = [sys.executable, *arguments]
        subprocess.run(command, env=environment | {VARIABLE: store}, stdout=subprocess.DEVNULL, check=True)
        wall, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


if __name__ == "__main__":
    main()
