"""Whole runs of scenes, long ones above all, beside the same runs by an earlier commit, and beside their forecasts.

Each run is a process of its own, as a user starts it, with an empty store, warm caches of compiled code and one thread
of linear algebra; those of the two commits take turns.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Final

from table import Table

from seatfem.structures.cache import VARIABLE

ROOT: Final = Path(__file__).parents[1]
BEFORE: Final = "30cd7360"
"""The last commit that marches and keeps every run in equal steps."""
ROUNDS: Final = 2
ONE_THREAD: Final = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
ONE_CONTACT: Final = (
    *("--set", "reed.contact_radius=5.5 mm", "--set", "reed.contact_width=1 mm"),
    *("--set", "reed.greens.bandwidth=30 kHz", "--set", "accuracy.target=5 %"),
)
"""Options by which the suction flapper meets its seat all at once, as the earlier commit can compute it."""
SCENES: Final[tuple[tuple[str, str, tuple[str, ...], bool], ...]] = (  # name, file, options, whether run before, too
    ("ball on a seat, 0.2 ms", "examples/ball_on_seat.toml", (), True),
    ("compressor cycle of 6 modes, 20 ms", "examples/compressor_cycle.toml", ("--set", "reed.n_modes=6"), True),
    ("suction flapper, one contact, 20 ms", "examples/suction_flapper.toml", ONE_CONTACT, True),
    ("suction valve, 20 ms", "examples/suction_valve.toml", (), True),
    ("flapper on a sleeve, 1.2 ms", "examples/flapper_on_peek_sleeve.toml", (), True),
    ("life of a flapper, 3 ms", "examples/life_of_a_flapper.toml", (), True),
    ("valve on cast iron, 20 ms", "examples/valve_on_cast_iron.toml", (), True),
    ("tilted landing, 0.08 ms", "examples/tilted_landing.toml", (), False),
    ("demo, 20 ms", "examples/flapper_on_peek_sleeve.toml", ("--set", "run.duration=20 ms"), True),
    ("tilted valve, 20 ms", "benchmarks/long_scenes/tilted_suction_valve.toml", (), False),
)
NOTES: Final = (
    f"Whole runs with all files and pictures, relative to commit {BEFORE}, which takes and stores equal steps (there",
    "the tilted valve runs out of memory, at 24 GB). Processor time of all threads, the smaller of two runs; memory of",
    "the program itself, of the earlier commit without files and pictures. *Forecast*: the estimate of `seatfem plan`",
    "over time and memory of the run. Scenes after an interrupt (Ctrl-C) are left out.",
)

COLUMNS: Final = (
    "scene", "processor time [s]", "over before", "time over before", "memory [GB]", "over before",
    "result.h5 [MB]", "over before", "forecast of time", "forecast of memory",
)  # fmt: skip


@dataclass(frozen=True)
class Spent:
    """What a run took: processor time and time [s], memory and result.h5 [bytes]; its forecasts [s, bytes]."""

    processor: float
    wall: float
    memory: float
    stored: float
    forecast: tuple[float, float]


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """Yield the folder of a commit's files."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "before"
        subprocess.run(["git", "worktree", "add", "--detach", place, commit], cwd=ROOT, check=True, capture_output=True)
        try:
            yield place
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", place], cwd=ROOT, check=True)


def run(program: Path, scene: str, options: tuple[str, ...]) -> Spent:
    """Run a scene by the ``program`` in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        env = {**os.environ, **ONE_THREAD, VARIABLE: f"{folder}/store", "PYTHONPATH": str(program)}
        command = [sys.executable, "-m", "seatfem", "run", str(ROOT / scene), *options, "--output", f"{folder}/out"]
        start, before = perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall = perf_counter() - start
        if done.returncode > 1:  # 1: the target was missed
            raise SystemExit(f"{scene}: {done.stderr}")
        summary = json.loads((place / "out" / "summary.json").read_text(encoding="utf-8"))
        plan = subprocess.run(
            [*command[:3], "plan", *command[4:-2], "--json"],
            cwd=folder, env=env | {VARIABLE: f"{folder}/empty"}, capture_output=True, check=False,
        )  # fmt: skip
        forecast = json.loads(plan.stdout)
        return Spent(
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            wall,
            float(summary["peak_memory_bytes"]),
            (place / "out" / "result.h5").stat().st_size,
            (float(forecast["time_s"]), float(forecast["memory_bytes"])),
        )


def whole_runs_table() -> Table:
    rows = []
    with checked_out(BEFORE) as before:
        for name, scene, options, compared in SCENES:
            ways = {"now": ROOT, **({"before": before} if compared else {})}
            try:
                turns = [{way: run(place, scene, options) for way, place in ways.items()} for _ in range(ROUNDS)]
            except KeyboardInterrupt:
                break
            now, then = ([turn[way] for turn in turns if way in turn] for way in ("now", "before"))

            def ratio(field: str, now: list[Spent] = now, then: list[Spent] = then) -> str:
                least = [min(getattr(spent, field) for spent in spents) for spents in (now, then) if spents]
                return f"{least[0] / least[1]:.2f}" if then else ""

            shortest = min(now, key=lambda spent: spent.wall)
            rows.append(
                (
                    name, f"{min(spent.processor for spent in now):.3g}", ratio("processor"), ratio("wall"),
                    f"{shortest.memory / 1e9:.2f}", ratio("memory"), f"{shortest.stored / 1e6:.3g}", ratio("stored"),
                    f"{shortest.forecast[0] / shortest.wall:.2f}", f"{shortest.forecast[1] / shortest.memory:.2f}",
                )
            )  # fmt: skip
            print(*rows[-1], sep=" | ", flush=True)  # noqa: T201
    return Table("Whole runs", NOTES, COLUMNS, tuple(rows))
