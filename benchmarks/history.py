"""How fast the main parts are, commit by commit: each against a fixed kernel of NumPy measured side by side with it.

    make history

Processor time of one thread, the least of some rounds; a line of results/history.jsonl a run, and all of them in
docs/images/history.png. It judges nothing.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import scipy
from coverage_of_scenes import stored
from scipy import sparse
from speed import SLEEVE, block
from table import RESULTS, machine, timed

import impact
from impact.notices import silent
from impact.pictures.drawing import COLOURS, sheet
from impact.runs.batch import solve_many
from seatfem.machine.resources import Stopwatch
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.structures.reduction.factorization import factorize
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.rounds import rounds
from seatfem.study.scene import Scene, load_scene

ROUNDS = 6
DT = 1e-6
SHIFT = 2 * np.pi * 2e5
FILE = RESULTS / "history.jsonl"
PICTURE = Path(__file__).parents[1] / "docs" / "images" / "history.png"

Work = Callable[[], object]


def modal_seat(modes: int, ports: int = 1) -> impact.ModalGreens:
    """Return random modes between 1 kHz and 80 kHz, 1 % damping, with a passive exponential residual."""
    rng = np.random.default_rng(modes)
    omega = np.sort(rng.uniform(6e3, 5e5, modes))
    residual = impact.Residual.exponential(1e-8 * np.eye(ports), 1e-3 * np.eye(ports))
    names = tuple(str(k) for k in range(ports))
    return impact.ModalGreens(omega, np.full(modes, 0.01), rng.normal(size=(modes, ports)), residual, names)


def throw(poles: int, ports: int = 1) -> impact.ContactProblem:
    """Return a rigid mass that meets a modal seat at some ports, with ``poles`` poles in all."""
    seat = impact.Body(modal_seat(poles - 1 - ports, ports))
    contacts = [impact.Contact(seat, port=k, gap=1e-4, law=impact.Hertz(stiffness=1e9)) for k in range(ports)]
    return impact.ContactProblem(impact.rigid_mass(mass=0.01, velocity=-1.0), contacts=contacts)


def reference() -> Work:
    """Products of matrices, Fourier transforms and sums beyond all caches, about a third of the time each."""
    rng = np.random.default_rng(0)
    a, wave, long = rng.normal(size=(700, 700)), rng.normal(size=2**19), rng.normal(size=2**22)
    return lambda: (a @ a, np.fft.rfft(wave), np.cumsum(long))


def run_first_round(scene: Scene) -> None:
    """Run the first round of a scene, with an empty store."""
    with stored() as folder, gmsh_session():
        next(rounds(begin_plan(scene), folder, Stopwatch(), silent))


def parts() -> dict[str, Work]:
    """What is measured, by name."""
    cells = 10
    model = block(cells)
    matrix = sparse.csr_matrix(model.K + SHIFT**2 * model.M)
    alone, lip = impact.prepare(throw(100), DT, 0.4), impact.prepare(throw(200, 64), DT, 2e-3)
    speeds = -np.random.default_rng(0).uniform(0.1, 2.0, 320)
    scene = load_scene(SLEEVE)
    return {
        "assembly, 13,000 unknowns": lambda: block(cells),
        "factorization of these": lambda: factorize(matrix, backend="pardiso"),
        "march, 100 poles, 400,000 steps": lambda: impact.ContactStepper(alone).advance(alone.steps),
        "march, 64 ports, 200 poles, 2,000 steps": lambda: impact.ContactStepper(lip).advance(lip.steps),
        "320 scenes side by side, 50 poles, 4,000 steps": lambda: solve_many(
            throw(50), dt=DT, duration=4000 * DT, velocities=speeds, workers=1
        ),
        "first round of the PEEK sleeve": lambda: run_first_round(scene),
    }


def measured() -> dict[str, object]:
    """One line: the reference in seconds, and the parts over it."""
    yardstick, least = reference(), np.inf
    works = parts()
    for work in (yardstick, *works.values()):  # loaded, compiled
        work()
    took = dict.fromkeys(works, np.inf)
    for _ in range(ROUNDS):
        for part, work in works.items():
            least, took[part] = min(least, timed(yardstick)[1]), min(took[part], timed(work)[1])
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": _commit(),
        "machine": machine() | {"scipy": scipy.__version__},
        "reference_s": round(least, 5),
        "ratios": {part: round(seconds / least, 4) for part, seconds in took.items()},
    }


def _commit() -> str:
    """Short, with a + where files differ from it; "" outside a repository."""
    told = ("git", "describe", "--always", "--dirty=+", "--exclude=*")
    try:
        done = subprocess.run(told, check=True, capture_output=True, text=True, cwd=Path(__file__).parent)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()


def describe_history(lines: list[dict]) -> str:  # type: ignore[type-arg]
    """The last line, each part beside what it was the time before."""
    last, before = lines[-1], lines[-2]["ratios"] if len(lines) > 1 else {}
    rows = [f"{last['commit']}: {1e3 * last['reference_s']:.1f} ms for the reference kernel; times it"]
    for part, ratio in last["ratios"].items():
        change = f"  {ratio / before[part] - 1:+.0%}" if part in before else ""
        rows.append(f"  {part:48}{ratio:8.3f}{change}")
    return "\n".join(rows)


def picture(lines: list[dict]) -> None:  # type: ignore[type-arg]
    """Every part over what it was in its first line."""
    with sheet(PICTURE, 7.6, 3.4) as figure:
        axes = figure.subplots()
        for name, colour in zip(lines[-1]["ratios"], COLOURS, strict=True):
            there = [(number, line["ratios"][name]) for number, line in enumerate(lines) if name in line["ratios"]]
            numbers, ratios = np.array(there).T
            axes.plot(numbers, ratios / ratios[0], "o-", markersize=3, color=colour, label=name)
        axes.set_ylim(bottom=0)
        axes.set_xticks(range(len(lines)), [line["commit"] for line in lines], rotation=60, ha="right", fontsize=6)
        axes.set(xlabel="commit", ylabel="time over that of the first run [-]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        figure.suptitle("Processor time of the main parts, over that of a kernel of NumPy beside them", fontsize=9.5)


def main() -> None:
    """One more line on file, and the picture."""
    line = measured()
    with FILE.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
    lines = [json.loads(each) for each in FILE.read_text(encoding="utf-8").splitlines()]
    picture(lines)
    sys.stdout.write(describe_history(lines) + "\n")


if __name__ == "__main__":
    main()
