"""Predicted against measured cost of every example, and of scenes drawn at random.

    python benchmarks/predicted.py             measures what is not there yet
    python benchmarks/predicted.py --table     writes docs/predicted.md from what is there

Each row is `seatfem plan SCENE` and then `seatfem run SCENE`, as a user types them: two processes, each with an empty
store and one thread of linear algebra. Rows are kept in results/predicted.csv and results/predicted_drawn.csv. Measured
is the time that the run of an example takes from start to end of its process, so nothing else may run on the computer;
of a drawn scene, the processor time of all its processes.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Final

from drawn_scenes import draw_scene
from table import RESULTS, append_rows, read_rows

from seatfem.structures.cache import VARIABLE
from seatfem.study.scene import load_scene

ROOT: Final = Path(__file__).parents[1]
FILE: Final = RESULTS / "predicted.csv"
DRAWN_FILE: Final = RESULTS / "predicted_drawn.csv"
DRAWN: Final = 30
SEED: Final = 31  # of no other script
PAGE: Final = ROOT / "docs" / "predicted.md"
EXAMPLES: Final = ROOT / "examples"
TARGET: Final = 0.1
LONGEST: Final = 300  # s for a run
SHOWN: Final = 2  # rows of the page at either end
IN_TIME: Final = 2.0
IN_MEMORY: Final = 1.5
ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Row:
    """A run: seconds and bytes. ``rounds``: that its target took; the plan predicts the first."""

    scene: str
    target: float
    level: str
    unknowns: int
    steps: int
    rounds: int
    predicted_s: float
    measured_s: float
    predicted_bytes: float
    measured_bytes: float

    @property
    def time_ratio(self) -> float:
        """Return the predicted over the measured time."""
        return self.predicted_s / self.measured_s

    @property
    def memory_ratio(self) -> float:
        """Return the predicted over the measured memory."""
        return self.predicted_bytes / self.measured_bytes


def seatfem(*words: str) -> str:
    """Run a command from an empty store and return what it prints."""
    with tempfile.TemporaryDirectory() as store:
        environment = {**os.environ, **ONE_THREAD, VARIABLE: store}
        command = [sys.executable, "-m", "seatfem", *words]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LONGEST)
    if done.returncode > 1:  # 1: the target was missed
        raise SystemExit(f"{' '.join(words)}: {done.stderr}")
    return done.stdout


def processor_seconds() -> float:
    """Return the processor time of all processes that have ended below this one [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(path: Path, name: str, *options: str, clock: Callable[[], float] = perf_counter) -> Row:
    """Plan and run a scene; ``clock``: what its time is read from."""
    words = (str(path), *options)
    plan = json.loads(seatfem("plan", *words, "--json"))
    with tempfile.TemporaryDirectory() as folder:
        start = clock()
        seatfem("run", *words, "--quiet", "--output", folder)
        seconds = clock() - start
        summary = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))
    return Row(
        scene=name,
        target=plan["target"],
        level=plan["level"],
        unknowns=int(summary.get("seat_dof") or 0),
        steps=round(load_scene(path).run.duration / summary["time_step_s"]),
        rounds=int(summary["accuracy_rounds"]),
        predicted_s=plan["time_s"],
        measured_s=seconds,
        predicted_bytes=plan["memory_bytes"],
        measured_bytes=summary["peak_memory_bytes"],
    )


def measure_drawn() -> None:
    """Measure drawn scenes in their order until there are enough; those that are refused or take too long are told."""
    rows = {row.scene for row in read_rows(Row, DRAWN_FILE)}
    for index in range(2 * DRAWN):
        scene = draw_scene(index, SEED)
        name = f"{SEED}-{index} {scene.seat} {scene.reed}"
        if name in rows or len(rows) >= DRAWN:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                row = measure(scene.write(Path(folder)), name, clock=processor_seconds)
            except (SystemExit, subprocess.TimeoutExpired) as problem:
                print(name, str(problem)[-200:], flush=True)  # noqa: T201
                continue
        append_rows([row], DRAWN_FILE, digits=4)
        rows.add(name)
        print(name, f"{row.time_ratio:.2f} {row.memory_ratio:.2f}", flush=True)  # noqa: T201


def within(measured: Sequence[Row]) -> str:
    """Return how many rows are within the factors, in words."""
    in_time = sum(1 / IN_TIME <= row.time_ratio <= IN_TIME for row in measured)
    in_memory = sum(1 / IN_MEMORY <= row.memory_ratio <= IN_MEMORY for row in measured)
    count = len(measured)
    return f"within a factor of {IN_TIME:g} in time {in_time} of {count}, within {IN_MEMORY:g} in memory {in_memory}"


def table_of(measured: Sequence[Row]) -> list[str]:
    """Return the lines of a table of the scenes whose time was predicted lowest and highest, and of the median."""
    by_ratio = sorted(measured, key=lambda row: row.time_ratio)
    shown = [*by_ratio[:SHOWN], by_ratio[len(by_ratio) // 2], *by_ratio[-SHOWN:]]
    return [
        "| scene | rounds | predicted (s) | measured (s) | predicted (MB) | measured (MB) | time | memory |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
        *(
            f"| {r.scene.replace('_', ' ')} | {r.rounds} | {r.predicted_s:.3g} | {r.measured_s:.3g} "
            f"| {r.predicted_bytes / 1e6:.0f} | {r.measured_bytes / 1e6:.0f} | {r.time_ratio:.2f} "
            f"| {r.memory_ratio:.2f} |"
            for r in shown
        ),
        "",
    ]


def counts(measured: Sequence[Row]) -> list[str]:
    """Return how many predictions hold, as lines of the page."""
    once = [row for row in measured if row.rounds == 1]
    return [f"Of runs that took one round: {within(once)}. Of all: {within(measured)}.", ""]


def write_page(measured: Sequence[Row], drawn: Sequence[Row]) -> None:
    """Write docs/predicted.md, with the scenes whose time or memory was predicted worst and best."""
    scenes, examples = {row.scene for row in measured}, {path.stem for path in scene_files()}
    left_out = ", ".join(sorted(examples - scenes)).replace("_", " ") or "none"
    lines = [
        "# Predicted and measured cost",
        "",
        f"{len(scenes)} of {len(examples)} scenes of `examples/`: `seatfem plan SCENE`, then `seatfem run SCENE`, for",
        f"{100 * TARGET:g} %, each a process with an empty store and one thread of linear algebra,",
        "beside one other program on two cores (`benchmarks/predicted.py`). Measured is the whole run, start and",
        "pictures included; a plan predicts the first round.",
        f"Left out, as newer or longer than {LONGEST} s: {left_out}.",
        "",
        *counts(measured),
        f"The {SHOWN} scenes whose time was predicted lowest and highest, and the median; last, predicted over",
        "measured. All scenes: `benchmarks/results/predicted.csv`.",
        "",
        *table_of(measured),
        "## Drawn scenes",
        "",
        f"{len(drawn)} scenes drawn at random (`benchmarks/drawn_scenes.py`, seed {SEED}), CAD and mesh files among",
        "them, each for its own target; measured is the processor time of all processes of the run.",
        "",
        *counts(drawn),
        *table_of(drawn),
    ]
    PAGE.write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")


def scene_files() -> list[Path]:
    """Return the examples that are scenes."""
    return sorted({*EXAMPLES.glob("*.toml")} - {*EXAMPLES.glob("*_study.toml")})


def main() -> None:
    """Measure what is missing, then write the page."""
    there = {row.scene for row in read_rows(Row, FILE)}
    for path in () if "--table" in sys.argv else scene_files():
        if path.stem in there:
            continue
        try:
            append_rows([row := measure(path, path.stem, "--set", f"accuracy.target={TARGET}")], FILE, digits=4)
        except subprocess.TimeoutExpired as problem:
            print(path.stem, problem, flush=True)  # noqa: T201
        else:
            print(path.stem, f"{row.time_ratio:.2f} {row.memory_ratio:.2f}", flush=True)  # noqa: T201
    if "--table" not in sys.argv:
        measure_drawn()
    write_page(read_rows(Row, FILE), read_rows(Row, DRAWN_FILE))


if __name__ == "__main__":
    main()
