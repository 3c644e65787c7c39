"""What steps of different lengths save in long runs without energies, beside equal steps in the same process."""

from __future__ import annotations

import numpy as np
from table import Table, timed

import impact
from impact import Contact, ContactProblem, ModalGreens, Residual
from impact.march.ladder import LadderMarch, finish_march, march, prepare_levels
from impact.march.prepared import discretise
from impact.march.rows import MarchRun

STEP, TURN, ROUNDS = 20e-9, 20e-3, 3
NOTES = (
    "Reeds of 60 modes in gas, over a turn of 20 ms, above a seat of 300 modes, in one piece and tilted in parts,",
    "without energies. Steps of different lengths relative to equal steps: one thread, interleaved, the smallest of",
    "three runs; bytes are those of the stored forces and gaps.",
)


def body(modes: int, lowest: float, highest: float, size: float, parts: int, soft: float) -> ModalGreens:
    """Return modes with frequencies that grow like squares [Hz], 2 % damping, random shapes and a passive residual."""
    spread = np.linspace(np.sqrt(lowest), np.sqrt(highest), modes) ** 2
    shapes = size * np.random.default_rng(modes).normal(1.0, 0.3, (modes, parts)) * (-1.0) ** np.arange(modes)[:, None]
    rest = Residual.relaxing(soft * np.eye(parts), 2 * np.pi * highest)
    names = tuple(f"part {k + 1}" for k in range(parts))
    return ModalGreens(2 * np.pi * spread, np.full(modes, 0.02), shapes, rest, names)


def valve(parts: int) -> ContactProblem:
    """Return the reed in gas above its seat; of several parts the last one touches 20 um after the first."""
    reed, seat = body(60, 200.0, 4e5, 30.0, parts, 1e-8), impact.Body(body(300, 2e4, 3e6, 8.0, parts, 1e-9))
    gas = impact.Load(reed.shapes.mean(axis=1), lambda t: -5 * np.sin(2 * np.pi * t / TURN))
    striker, opening = impact.Body(reed, loads=(gas,)), np.linspace(1e-4, 1.2e-4, parts)
    contacts = [Contact(seat, port=k, striker_port=k, gap=float(opening[k])) for k in range(parts)]
    return ContactProblem(striker, contacts=contacts)


def in_long_steps(problem: ContactProblem) -> MarchRun:
    """Return the run in steps of different lengths, whatever it takes."""
    one = discretise(problem, STEP, TURN, engine="poles")
    levels = prepare_levels(one)
    return finish_march(LadderMarch(one, levels))


def measure(parts: int) -> tuple[str, ...]:
    problem, runs = valve(parts), dict[str, MarchRun]()
    ways = {"long": lambda: in_long_steps(problem), "equal": lambda: march(problem, STEP, TURN, equal_steps=True)}
    times: dict[str, list[float]] = {way: [] for way in ways}
    for _ in range(ROUNDS):
        for way, run in ways.items():
            runs[way], seconds = timed(run)
            times[way].append(seconds)
    least = {way: min(each) for way, each in times.items()}
    rows, steps = len(runs["long"].rows.ends) - 1, runs["equal"].steps
    impulses = [float(np.diff(run.rows.ends) @ run.rows.force[1:].sum(axis=1)) for run in runs.values()]
    sizes = [run.rows.force.nbytes + run.rows.gap.nbytes for run in runs.values()]
    return (
        f"{parts}", f"{steps}", f"{rows}", f"{least['equal']:.2f}", f"{least['long'] / least['equal']:.2f}",
        f"{sizes[0] / sizes[1]:.3f}", f"{abs(impulses[0] / impulses[1] - 1):.0e}",
    )  # fmt: skip


def long_runs_table() -> Table:
    columns = ("parts", "equal steps", "steps taken", "equal steps [s]", "time over that", "bytes", "impulse apart by")
    return Table("Long runs", NOTES, columns, tuple(measure(parts) for parts in (1, 8, 32)))
