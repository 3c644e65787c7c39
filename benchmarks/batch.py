"""Many scenes side by side against one by one."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np
from scenes import DT, throw
from table import Table, best, cores, publish

import impact
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper
from impact.runs.batch import solve_many

SCENES, STEPS = 1000, 4000
SPAN = STEPS * DT
ROUNDS = 25


def main() -> None:
    """1,000 throws at different speeds."""
    speeds = -np.random.default_rng(0).uniform(0.1, 2.0, SCENES)
    rows = []
    for poles in (10, 50, 400):
        problem = throw(poles)
        solve_many(problem, dt=DT, duration=SPAN, velocities=speeds[:20])
        ContactStepper(prepare(problem, DT, SPAN)).advance(STEPS)
        many, single, bare = np.inf, np.inf, np.inf
        prepared = prepare(problem, DT, SPAN)
        for _ in range(ROUNDS):  # interleaved
            many = min(many, best(lambda p=problem: solve_many(p, dt=DT, duration=SPAN, velocities=speeds), 1))
            single = min(
                single, best(lambda p=problem: solve_many(p, dt=DT, duration=SPAN, velocities=speeds, workers=1), 1)
            )
            start = perf_counter()
            for _ in range(20):
                ContactStepper(prepared).advance(STEPS)
            bare = min(bare, (perf_counter() - start) / 20)
        start = perf_counter()
        for speed in speeds[:10]:
            scene = impact.ContactProblem(replace(problem.striker, velocity=float(speed)), contacts=problem.contacts)
            impact.solve(scene, dt=DT, duration=SPAN)
        full = (perf_counter() - start) / 10
        each = many / SCENES
        rows.append(
            (
                str(poles),
                *(f"{1e6 * t:.0f}" for t in (each, single / SCENES, bare, full)),
                f"{bare / each:.1f}",
                f"{full / each:.0f}",
            )
        )
    notes = (
        f"{SCENES} throws of {STEPS} steps on a modal seat, Hertz law, {cores()} cores; microseconds per scene,",
        f"the shortest of {ROUNDS} interleaved runs. `solve` makes histories and the energy ledger; the bare march is",
        "its compiled loop alone, prepared once, on one core.",
        "Aim: at least 5 times one by one on two cores at up to 50 poles.",
    )
    columns = (
        "poles",
        "side by side",
        "the same, one core",
        "bare march",
        "`solve`",
        "times faster than the bare march",
        "than `solve`",
    )
    publish("batch", Table("Many scenes", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
