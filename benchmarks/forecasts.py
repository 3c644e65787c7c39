"""Does the time that is expected of a run's further rounds hold? Scenes drawn from all of the scene language.

    python benchmarks/forecasts.py [--seed N] [--scenes N] [--first N]
    python benchmarks/forecasts.py --document

appends a row to results/forecasts.csv for each round but the last: the further rounds and the wall time that were
expected after it, of the next one and of all, and those that were needed. ``--document`` writes the shares within a
factor of two into docs/coverage.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from coverage_of_scenes import PAGE, REFUSALS, TooLong, limited, stored
from drawn_scenes import draw_scene
from table import RESULTS, append_rows, read_rows, write_between

from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.forecast import forecast
from seatfem.study.runs.next_round import expect_time, next_plan
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import NO_LIMITS, rounds
from seatfem.study.scene import load_scene

SEED, SCENES = 50131, 60
FILE: Final = RESULTS / "forecasts.csv"
LONGEST: Final = 120.0  # s of processor time of a scene
SHORT: Final = 2.0  # s of wall time below which no forecast is judged: nobody plans for it


@dataclass(frozen=True)
class Row:
    """What was expected after a round of a scene, and what was needed: wall times [s], numbers of further rounds."""

    seed: int
    index: int
    about: str
    round: int
    met: bool
    rounds: int
    rounds_needed: int
    next: float
    next_needed: float
    all: float
    all_needed: float


def judge(index: int, seed: int) -> list[Row]:
    """Return the rows of one scene; none of one that ends with its first round, is refused or takes too long."""
    drawn = draw_scene(index, seed)
    ended: list[tuple[float, Round]] = []
    try:
        with stored() as folder, limited(LONGEST), gmsh_session():
            for each in rounds(begin_plan(load_scene(drawn.write(folder))), folder, Stopwatch(), silent):
                ended.append((time.perf_counter(), each))
    except (TooLong, *REFUSALS):
        return []
    by_number = {each.number: (when, each) for when, each in ended}  # the last one is yielded again with its reason
    last = max(by_number)
    lines = []
    for number, (when, done) in sorted(by_number.items()):
        further, _ = next_plan(done, NO_LIMITS, np.inf) if number < last else (None, "")
        if further is None:
            continue
        expected, needed = forecast(done), by_number[last][0] - when
        lines.append(
            Row(seed, index, f"{drawn.seat} {drawn.reed}", number, by_number[last][1].met is True, expected.rounds,
                last - number, expect_time(done, further), by_number[number + 1][0] - when, expected.seconds, needed)
        )  # fmt: skip
    return lines


def share(rows: Sequence[Row], of: str) -> str:
    """Return the share of forecasts, of those above `SHORT`, that hold within a factor of two, and their median."""
    pairs = [(getattr(row, of), getattr(row, f"{of}_needed")) for row in rows]
    ratios = np.array([a / b for a, b in pairs if max(a, b) > SHORT])
    within = np.count_nonzero(np.abs(np.log2(ratios)) <= 1)
    low, median, high = np.quantile(ratios, [0.05, 0.5, 0.95])
    return f"{within} of {len(ratios)} | {median:.2f} | {low:.2f} to {high:.2f}"


def summary(rows: Sequence[Row]) -> str:
    """Return the table of the page."""
    first = [row for row in rows if row.round == 1]
    lines = {"the next round": (rows, "next"), "all that is left, after the first round": (first, "all"),
             "all that is left, after any round": (rows, "all")}  # fmt: skip
    head = "| expected wall time of | within a factor of 2 | median of expected over needed | 90 % of them |"
    return "\n".join([head, "|---|---|---|---|", *(f"| {name} | {share(*of)} |" for name, of in lines.items())])


def main() -> None:
    """Run what is missing of a seed, and tell what the table holds."""
    parser = argparse.ArgumentParser()
    for name, default in {"seed": SEED, "first": 0, "scenes": SCENES}.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--file", type=Path, default=FILE)
    parser.add_argument("--document", action="store_true", help="run nothing, write the page")
    asked = parser.parse_args()
    for index in range(asked.first, asked.first + (0 if asked.document else asked.scenes)):
        lines = judge(index, asked.seed)
        for line in lines:
            append_rows([line], asked.file)
            print(line, flush=True)  # noqa: T201
    table = summary([row for row in read_rows(Row, asked.file) if row.seed == asked.seed])
    print(table)  # noqa: T201
    if asked.document:
        write_between(PAGE, "forecasts", table)


if __name__ == "__main__":
    main()
