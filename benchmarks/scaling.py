"""What a scene costs beside its computation where workers of dask carry it out, and how far a study scales by that.

`python benchmarks/scaling.py` writes results/scaling.json, docs/images/scaling.png and the measured paragraph of
docs/cluster.md. Processor times are measured; they are of the client, of the scheduler and of a worker without the
process that runs the scene. The client and the scheduler are one process each: the busier of both bounds the scenes a
second, whatever the number of workers. Jobs that sleep, of which many fit into a core, show that bound here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

from seatfem.jobs.cluster import Parcel, cluster_crew, threads_of
from seatfem.jobs.desk import Program
from seatfem.jobs.worker import answer_lines

HERE = Path(__file__).parent
STUDY = HERE.parent / "examples" / "tolerance_study.toml"
PICTURE = HERE.parent / "docs" / "images" / "scaling.png"
DOCUMENT = HERE.parent / "docs" / "cluster.md"
MARKS = ("<!-- measured by benchmarks/scaling.py -->\n", "<!-- end of what is measured -->\n")
NAP = 0.05  # s that a job sleeps
ASLEEP = (1, 2, 4, 8, 16, 32)  # workers
IDLE = 5.0  # s of watching processes that have nothing to do
TRIVIAL = 400  # jobs that do nothing
LARGEST = 1000  # workers of the prediction
MINUTE = 60.0  # s: a scene with finite elements


@dataclass(frozen=True)
class Spent:
    """Seconds a job: of the clock for all jobs, and of the processors of client, scheduler, workers and scenes."""

    wall: float
    client: float
    scheduler: float
    worker: float
    scene: float

    @property
    def bound(self) -> float:
        """Of the busier of the two that are one process each."""
        return max(self.client, self.scheduler)


@contextmanager
def cluster(workers: int, threads: int = 1) -> Iterator[tuple[str, list[psutil.Process]]]:
    """Address of a scheduler, and it and its workers, each in a process."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "address.json"
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(HERE), str(HERE.parent)])}

        def started(*words: str) -> psutil.Popen:
            command = [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1", "--no-dashboard"]
            return psutil.Popen(
                command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )

        running = [started("scheduler", "--port", "0", "--scheduler-file", str(place))]
        try:
            while not place.exists() or not place.read_text().rstrip().endswith("}"):
                time.sleep(0.1)
            address = json.loads(place.read_text())["address"]
            running += [started("worker", address, "--no-nanny", "--nthreads", str(threads)) for _ in range(workers)]
            while threads_of(address) < workers * threads:
                time.sleep(0.1)
            yield address, [psutil.Process(each.pid) for each in running]
        finally:
            for each in running:
                each.kill()
                each.wait()


def used(process: psutil.Process, inner: bool = False) -> float:
    """Processor seconds of a process; ``inner``: of those that it has started."""
    times = [each.cpu_times() for each in (process.children(recursive=True) if inner else [process])]
    return sum(each.user + each.system for each in times)


def measured(processes: list[psutil.Process], jobs: int, work: Callable[[], object]) -> Spent:
    """Of some ``work`` of this client, which is so many jobs, without what the processes take when there is none."""

    def all_used() -> list[float]:
        scheduler, *workers = processes
        own, inner = (sum(used(each, which) for each in workers) for which in (False, True))
        return [time.perf_counter(), time.process_time(), used(scheduler), own, inner]

    begun = all_used()
    time.sleep(IDLE)
    before = all_used()
    work()
    after = all_used()
    idle = [(b - a) / (before[0] - begun[0]) for a, b in zip(begun, before, strict=True)]
    wall = after[0] - before[0]
    others = (max(b - a - rate * wall, 0.0) / jobs for a, b, rate in zip(before, after, idle, strict=True))
    return Spent(wall, *list(others)[1:])


def of_jobs(workers: int, threads: int, jobs: int, seconds: float) -> Spent:
    """Of jobs that sleep for so long."""
    program = Program("scaling", ("sleep",))
    with cluster(workers, threads) as (address, processes), cluster_crew(address, program, Parcel) as ask:
        list(ask(["0.3"] * (2 * workers * threads), 60.0))  # the processes are there
        return measured(processes, jobs, lambda: list(ask([str(seconds)] * jobs, 60.0)))


def of_naps() -> dict[int, Spent]:
    """By the number of workers; of each the fastest of three, which other programs have disturbed least."""
    tried = [{count: of_jobs(1, count, 60 * count, NAP) for count in ASLEEP} for _ in range(3)]
    return {count: min((each[count] for each in tried), key=lambda spent: spent.wall) for count in ASLEEP}


def of_scenes() -> tuple[int, tuple[Spent, Spent]]:
    """How many scenes the study has, and theirs by one worker and by two, in turn: of each the faster of three."""
    tried = [(of_study(1), of_study(2)) for _ in range(3)]
    one, two = (min(each, key=lambda found: found[0].wall) for each in zip(*tried, strict=True))
    return one[1], (one[0], two[0])


def of_study(workers: int) -> tuple[Spent, int]:
    """Of the study, each scene with its line in the journal, once the processes are there; and how many scenes."""
    from seatfem.study.sweep.cases import cases_of
    from seatfem.study.sweep.effort import Effort
    from seatfem.study.sweep.runner import Runner, crew_of
    from seatfem.study.sweep.study import load_study

    study = load_study(STUDY)
    cases = cases_of(study)
    with (
        cluster(workers) as (address, processes),
        crew_of(1, address) as ask,
        tempfile.TemporaryDirectory() as folder,
    ):
        first, every = (
            Runner(study, Path(folder) / name, Effort(limit=600.0), lambda _: None)
            for name in ("first.jsonl", "study.jsonl")
        )
        first.carry_out(cases[: 2 * workers], ask)
        return measured(processes, len(cases), lambda: every.carry_out(cases, ask)), len(cases)


def speed(workers: float, scene: float, spent: Spent) -> float:
    """How many times faster than one process without dask, by the bounds of workers, client and scheduler."""
    return scene * min(workers / (scene + spent.worker), 1 / spent.bound)


def main() -> None:
    """All of it, about five minutes."""
    from table import cores, machine

    trivial = of_jobs(1, 1, TRIVIAL, 0.0)
    naps = of_naps()
    count, (one, two) = of_scenes()
    last = naps[ASLEEP[-1]]  # all of them, and client and scheduler, on the cores of one computer, and in one worker
    everything = last.client + last.scheduler + last.worker + last.scene
    bends = {name: scene / one.bound for name, scene in (("study", one.scene), ("minute", MINUTE))}
    results = {
        "machine": machine(),
        "trivial_job_s": vars(trivial),
        "scenes": count,
        "scene_s": {"1 worker": vars(one), "2 workers": vars(two)},
        "asleep": {"job_s": NAP, "speed": {n: 60 * n * NAP / spent.wall for n, spent in naps.items()}},
        "asleep_bound_s": max(last.bound, last.worker, everything / cores()),
        "bend_workers": bends,
        "predicted": {name: {n: speed(n, scene, one) for n in (1, 2, 10, 100, LARGEST)}
                      for name, scene in (("study", one.scene), ("minute", MINUTE))},
    }  # fmt: skip
    text = json.dumps(results, indent=1)
    (HERE / "results" / "scaling.json").write_text(f"{text}\n", encoding="utf-8")
    results = json.loads(text)
    draw(results)
    write(results)


def draw(results: dict) -> None:
    """Speed against workers: predicted for two lengths of a scene, measured with scenes and with jobs that sleep."""
    import numpy as np

    from impact.pictures.drawing import BLUE, GREEN, ORANGE, sheet

    one = Spent(**results["scene_s"]["1 worker"])
    two = Spent(**results["scene_s"]["2 workers"])
    asleep = Spent(0, results["asleep_bound_s"], 0, 0, 0)
    workers = np.geomspace(1, LARGEST, 300)
    with sheet(PICTURE, 5.4, 3.8) as figure:
        axes = figure.subplots()
        for scene, spent, colour, label in (
            (MINUTE, one, GREEN, "scenes of 1 min, predicted"),
            (one.scene, one, BLUE, f"scenes of {one.scene:.2g} s, predicted"),
            (NAP, asleep, ORANGE, f"jobs that sleep for {NAP:g} s, predicted here"),
        ):
            axes.plot(workers, [speed(n, scene, spent) for n in workers], color=colour, label=label)
            if (bend := scene / spent.bound) < LARGEST:
                axes.annotate(
                    f"{bend:.0f} workers", (bend, speed(bend, scene, spent)), (8, -10), textcoords="offset points",
                    fontsize=7.5, color=colour, ha="left",
                )  # fmt: skip
        naps = results["asleep"]["speed"]
        axes.plot(
            [float(n) for n in naps],
            list(naps.values()),
            "s",
            color=ORANGE,
            markersize=4,
            label="jobs that sleep, measured",
        )
        axes.plot([1, 2], [1, one.wall / two.wall], "o", color=BLUE, markersize=5, label="scenes, measured")
        axes.set(xscale="log", yscale="log", xlabel="workers, of one thread each", ylabel="speed, over one worker")
        axes.set_title("A study on a cluster: one client and one scheduler")
        axes.set_xlim(0.9, 1.1 * LARGEST)
        axes.set_ylim(0.8, 1.2 * LARGEST)
        axes.legend(loc="upper left", frameon=False, fontsize=7.5)


def write(results: dict) -> None:
    """The paragraphs of docs/cluster.md."""
    trivial, one = Spent(**results["trivial_job_s"]), Spent(**results["scene_s"]["1 worker"])
    two, bends, naps = Spent(**results["scene_s"]["2 workers"]), results["bend_workers"], results["asleep"]["speed"]
    most, nap, bound = max(naps, key=float), results["asleep"]["job_s"], results["asleep_bound_s"]
    about, (study, minute) = results["machine"], (each[str(LARGEST)] for each in results["predicted"].values())

    def shares(spent: Spent) -> str:
        return ", ".join(f"{1e3 * each:.1f}" for each in (spent.client, spent.scheduler, spent.worker))

    measured_words = (
        f"Measured on {about['processor']}, {about['cores']} cores that other programs shared: a job that does nothing "
        f"takes {shares(trivial)} ms of the processor of client, scheduler and worker, a scene of "
        f"`examples/tolerance_study.toml` ({results['scenes']} scenes of {one.scene:.2f} processor seconds) "
        f"{shares(one)} ms: the client reads it, packs it and writes its line of the journal. So one client and one "
        f"scheduler keep {1 / one.bound:.0f} scenes a second going. By the clock two workers were "
        f"{one.wall / two.wall:.2f} times as fast as one. With jobs that sleep for {nap:g} s {most} workers were "
        f"{naps[most]:.1f} times as fast as one that only sleeps, which is {naps[most] / nap:.0f} jobs a second; "
        f"{nap / bound:.0f} times is the most where all of them, client and scheduler have {about['cores']} cores to "
        "themselves, which they had not."
    )
    predicted_words = (
        f"Predicted, by the busier of client and scheduler: scenes of {one.scene:.2g} s scale to {bends['study']:.0f} "
        f"workers, where the curve bends, scenes of a minute to {bends['minute']:,.0f}. At {LARGEST:,} workers the "
        f"speed is {study:.0f} and {minute:.0f} times that of one. That takes for granted a core for the "
        "client and one for the scheduler; heartbeats are left out, and the start of the processes, which takes some "
        "seconds of each worker once."
    )
    text = "\n\n".join(textwrap.fill(words, 118) for words in (measured_words, predicted_words)) + "\n"
    before, _, rest = DOCUMENT.read_text(encoding="utf-8").partition(MARKS[0])
    after = rest.partition(MARKS[1])[2]
    DOCUMENT.write_text(before + MARKS[0] + text + MARKS[1] + after, encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:] == ["sleep"]:

        def nap(line: str) -> str:
            time.sleep(float(line))
            return line

        answer_lines(nap)
    else:
        main()
