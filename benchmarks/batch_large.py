"""Ten thousand scenes on a known seat: what the march side by side takes, and what bounds it."""

from __future__ import annotations

from time import perf_counter, process_time

import numpy as np
from scenes import DT, throw
from table import Table, cores, publish

import impact
from impact.runs.batch import solve_many

SCENES, STEPS, POLES, ROUNDS = 10_000, 20_000, 100, 2
AIM = 15.0  # s
FLOPS, BYTES = 11, 32  # of one pole over one step: five multiply-adds and a sum; two numbers read and two written


def main() -> None:
    """With one thread and with all cores; then the same scenes without contact."""
    span, speeds = STEPS * DT, -np.random.default_rng(0).uniform(0.1, 2.0, SCENES)
    problem = throw(POLES)
    apart = impact.ContactProblem(problem.striker, problem.target, law=problem.contacts[0].law, gap=1.0)
    ways = {"one thread": (problem, 1, "auto"), f"{cores()} threads": (problem, cores(), "auto")}
    ways["one thread, no contact"] = (apart, 1, "passive")
    took = dict.fromkeys(ways, (np.inf, np.inf))
    solve_many(problem, dt=DT, duration=span, velocities=speeds[:20])
    for _ in range(ROUNDS):  # interleaved
        for name, (each, workers, rule) in ways.items():
            start, busy = perf_counter(), process_time()
            solve_many(each, dt=DT, duration=span, velocities=speeds, workers=workers, rule=rule)
            took[name] = min(took[name], (process_time() - busy, perf_counter() - start))
    count, rows = SCENES * STEPS * POLES, []
    for name, (busy, wall) in took.items():
        rates = (f"{each * count / busy / 1e9:.0f}" for each in (FLOPS, BYTES))
        rows.append((name, f"{wall:.1f}", f"{busy:.1f}", f"{1e9 * busy / count:.2f}", *rates))
    notes = (
        f"{SCENES} throws of {STEPS} steps on a modal seat, {POLES} poles in all, Hertz law; measures alone, the least",
        f"of {ROUNDS} interleaved runs. Aim: {AIM:g} s on two cores, 1.5 ns of a core per pole and step.",
        f"Each pole and step has {FLOPS} operations, and reads 16 and writes 16 bytes of the nearest cache: at one",
        "store of 64 bytes a cycle and 2.6 GHz that takes 0.10 ns at least. Without contact the recursion is left.",
    )
    columns = (
        "run on",
        "wall [s]",
        "processor [s]",
        "ns of a core per pole and step",
        "Gflop/s",
        "cache, GB/s",
    )
    publish("batch_large", Table("Ten thousand scenes", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
