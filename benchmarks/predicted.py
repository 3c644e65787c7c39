"""Predicted against measured cost of every example, at several targets.

    python benchmarks/predicted.py             measures what is not there yet, one process and one empty store for each
    python benchmarks/predicted.py --table     writes docs/predicted.md from what is there

Rows are kept in results/predicted.csv. Each process plans its scene, which is the prediction, and carries the plan out
with one thread. Measured is the processor time of the process and of those it started: on a quiet computer that is the
wall time, which is what is predicted, and unlike it it does not count what other programs do meanwhile.
"""

from __future__ import annotations

import csv
import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from time import perf_counter

from seatfem.machine.rates import Machine
from seatfem.structures.store import VARIABLE
from seatfem.study.method import as_stated
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

HERE = Path(__file__).parent
FILE = HERE / "results" / "predicted.csv"
PAGE = HERE.parent / "docs" / "predicted.md"
EXAMPLES = HERE.parent / "examples"
TARGETS = (0.1, 0.03)
LONGEST = 120.0  # s predicted; longer runs are left out
IN_TIME, IN_MEMORY = 2.0, 1.5
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Row:
    """A run: seconds and bytes."""

    scene: str
    target: float
    level: str
    unknowns: int
    steps: int
    predicted_s: float
    measured_s: float
    wall_s: float
    predicted_bytes: float
    measured_bytes: float

    @property
    def time_ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted_s / self.measured_s

    @property
    def memory_ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted_bytes / self.measured_bytes


def carry_out(name: str, target: float) -> None:
    """In a process of its own: plan, run, and tell in one line of JSON."""
    started = perf_counter()
    scene = load_scene(EXAMPLES / f"{name}.toml")
    scene = scene.model_copy(update={"accuracy": scene.accuracy.model_copy(update={"target": target})})
    plan = plan_scene(scene, Machine())
    if plan.cost.seconds > LONGEST:
        print(json.dumps({"skipped": plan.cost.seconds}))  # noqa: T201
        return
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_scene(as_stated(plan.scene, plan.method), Path(folder))
    row = Row(
        scene=name,
        target=target,
        level=plan.level,
        unknowns=int(str(outcome.summary.get("seat_dof") or 0)),
        steps=round(plan.scene.run.duration / float(str(outcome.summary["time_step_s"]))),
        predicted_s=plan.cost.seconds,
        measured_s=_processor_seconds(),
        wall_s=perf_counter() - started,
        predicted_bytes=plan.cost.memory,
        measured_bytes=_peak_bytes(),
    )
    print(json.dumps(asdict(row)))  # noqa: T201


def _processor_seconds() -> float:
    """Of this process and those it waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def _peak_bytes() -> float:
    """Of this process alone: what resource says may be its parent's."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024.0 * int(status.partition("VmHWM:")[2].split()[0])


def measure(name: str, target: float) -> Row | None:
    """One row, from an empty store; ``None`` for a run that is left out."""
    with tempfile.TemporaryDirectory() as store:
        done = subprocess.run(
            [sys.executable, __file__, "--one", name, str(target)],
            env={**os.environ, **ONE_THREAD, VARIABLE: store},
            capture_output=True,
            text=True,
            check=True,
        )
    data = json.loads(done.stdout.strip().splitlines()[-1])
    return None if "skipped" in data else Row(**data)


def rows() -> list[Row]:
    """What has been measured."""
    if not FILE.is_file():
        return []
    kinds = {field.name: {"str": str, "int": int, "float": float}[str(field.type)] for field in fields(Row)}
    with FILE.open(encoding="utf-8", newline="") as file:
        return [Row(**{key: kinds[key](value) for key, value in row.items()}) for row in csv.DictReader(file)]


def keep(row: Row) -> None:
    """Append."""
    new = not FILE.is_file()
    with FILE.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerow({key: f"{v:.4g}" if isinstance(v, float) else v for key, v in asdict(row).items()})


def write_page(found: list[Row]) -> None:
    """docs/predicted.md."""
    in_time = sum(1 / IN_TIME <= row.time_ratio <= IN_TIME for row in found)
    in_memory = sum(1 / IN_MEMORY <= row.memory_ratio <= IN_MEMORY for row in found)
    lines = [
        "# Predicted and measured cost",
        "",
        f"{len({row.scene for row in found})} of {len(list(EXAMPLES.glob('*.toml')))} files of `examples/`, planned "
        "for several targets and run from an empty store",
        "(`benchmarks/predicted.py`; default rates). Time is predicted for a quiet computer; measured is the processor",
        "time of the run on one thread, which other programs on the computer hardly touch. Memory is the peak of the",
        "process. The last columns are predicted over measured.",
        "",
        f"Within a factor of {IN_TIME:g} in time: {in_time} of {len(found)} runs; within {IN_MEMORY:g} in memory: "
        f"{in_memory} of {len(found)}.",
        "",
        "| scene | target | level | unknowns | steps | predicted (s) | measured (s) | predicted (MB) | measured (MB) "
        "| time | memory |",
        "| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
        *(
            f"| {r.scene.replace('_', ' ')} | {100 * r.target:g} % | {r.level} | {r.unknowns or ''} | {r.steps} "
            f"| {r.predicted_s:.3g} | {r.measured_s:.3g} | {r.predicted_bytes / 1e6:.0f} "
            f"| {r.measured_bytes / 1e6:.0f} | {r.time_ratio:.2f} | {r.memory_ratio:.2f} |"
            for r in found
        ),
        "",
    ]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def main() -> None:
    """Measure what is missing, then write the page."""
    if sys.argv[1:2] == ["--one"]:
        carry_out(sys.argv[2], float(sys.argv[3]))
        return
    there = {(row.scene, row.target) for row in rows()}
    for target in () if "--table" in sys.argv else TARGETS:
        for path in sorted({*EXAMPLES.glob("*.toml")} - {*EXAMPLES.glob("*_study.toml")}):
            if (path.stem, target) in there:
                continue
            row = measure(path.stem, target)
            if row is not None:
                keep(row)
                print(path.stem, target, f"{row.time_ratio:.2f} {row.memory_ratio:.2f}", flush=True)  # noqa: T201
    write_page(rows())


if __name__ == "__main__":
    main()
