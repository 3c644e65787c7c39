"""The loop on drawn scenes: processor time, rounds, targets reached, coverage of the bars.

    python benchmarks/loop_of_scenes.py [--seed N] [--scenes N] [--first N] [--file CSV]
    python benchmarks/loop_of_scenes.py --summary

appends rows to results/loop_of_scenes.csv as scenes end, one for each measure that the target applies to; scenes that
are in the file are not run again. All run in one process, each with an empty store, after one that loads and compiles.
The reference is finer in every key than the loop's result.

The columns ``plan_...`` are of the program before, which chose the keys by predictions, as of commit 8834d30c: both ran
side by side, each with an empty store, and took turns in going first. New rows have none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Final

from coverage_of_scenes import DEAR, LESS_FINE, LONGEST, ROUND_OFF, Head, carry_out, parser_of, stored
from drawn_scenes import draw_scene
from finer_scenes import NoReference, finest_reference
from table import RESULTS, append_rows, read_rows, spent

from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.impacts import bodies
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from seatfem.study.scene import Scene, load_scene

SEED, SCENES = 90417, 200
FILE: Final = RESULTS / "loop_of_scenes.csv"
SECONDS: Final = 60.0  # of ``--max-time``, for either way
WARM: Final = 4  # scene that loads and compiles what is never timed
PER_SCENE: Final = 4 * LONGEST


@dataclass(frozen=True)
class Row(Head):
    """A measure of a scene.

    Attributes:
        target: relative.
        loop_s, plan_s, planning_s: processor time [s] of the loop; of plan and rounds, of the plan alone, before.
        loop_rounds, plan_rounds: number of rounds.
        loop_met, plan_met: whether the target was reached.
        level, plan_level: of the seat.
        measure: by name.
        value, bar, plan_value, plan_bar, true: SI; ``true``: the reference's; nan where it is not known.
        seconds: of processor time, of both ways and the reference [s].
    """

    target: float = math.nan
    loop_s: float = math.nan
    plan_s: float = math.nan
    planning_s: float = math.nan
    loop_rounds: int = 0
    plan_rounds: int = 0
    loop_met: str = ""
    plan_met: str = ""
    level: str = ""
    plan_level: str = ""
    measure: str = ""
    value: float = math.nan
    bar: float = math.nan
    plan_value: float = math.nan
    plan_bar: float = math.nan
    true: float = math.nan
    seconds: float = math.nan


@dataclass(frozen=True)
class Looped:
    """The last round of the loop, and its processor time [s]."""

    done: Round
    seconds: float


def run_loop(scene: Scene, folder: Path) -> Looped:
    start = spent()
    with gmsh_session():
        *_, done = rounds(begin_plan(scene), folder, Stopwatch(), silent, limits=Limits(seconds=SECONDS))
    return Looped(done, spent() - start)


def judge(index: int, seed: int) -> list[Row]:
    """Return the rows of a scene."""
    drawn = draw_scene(index, seed)
    head = Row(seed, index, drawn.seat, drawn.reed, drawn.about, drawn.stated, "judged")

    def work(folder: Path) -> Iterator[Row]:
        scene = load_scene(drawn.write(folder))
        bodies._solved.cache_clear()
        with stored() as own:
            loop = run_loop(scene, own)
        row = replace(
            head,
            target=scene.accuracy.target,
            loop_s=loop.seconds, loop_rounds=loop.done.number, loop_met=str(loop.done.met),
            level=loop.done.plan.level, reason=loop.done.stopped,
        )  # fmt: skip
        if not loop.done.judged:
            yield replace(row, outcome="no landing")
            return
        try:
            _, reference = finest_reference(loop.done, LESS_FINE if loop.seconds > DEAR else 0)
            exact = reference.values
        except NoReference:
            exact = {}
        for name in loop.done.judged:
            value, bar = loop.done.left.values[name], loop.done.left.bar(name)
            yield replace(row, measure=name, value=value, bar=bar, true=exact.get(name, math.nan))

    return carry_out(head, work, PER_SCENE)


def in_words(rows: Sequence[Row]) -> str:
    """Return what a table shows, in lines."""
    judged = [row for row in rows if row.outcome == "judged"]
    scenes = list({row.index: row for row in judged}.values())
    both = [row for row in scenes if math.isfinite(row.plan_s)]
    ratios = sorted(row.loop_s / row.plan_s for row in both)
    if not scenes:
        return "no scenes"

    def within(values: Iterable[tuple[float, float, float]]) -> str:
        known = [(value, bar, true) for value, bar, true in values if math.isfinite(true) and math.isfinite(bar)]
        inside = [abs(value - true) <= bar + ROUND_OFF * abs(value) for value, bar, true in known]
        over = median(bar / max(abs(value - true), ROUND_OFF * abs(value)) for value, bar, true in known)
        return f"{sum(inside)} of {len(inside)} inside, median bar over error {over:.1f}"

    def reached(values: Iterable[tuple[float, float, float]]) -> str:
        shares = [bar <= target * abs(value) for value, bar, target in values]
        return f"{sum(shares) / len(shares):.0%} of the bars within the target"

    lines = [
        f"{len(scenes)} scenes, {len(judged)} measures; {len({row.index for row in rows}) - len(scenes)} others",
        f"loop: {within((row.value, row.bar, row.true) for row in judged)}; "
        f"{reached((row.value, row.bar, row.target) for row in judged)}",
    ]
    if ratios:
        last = ratios[min(len(ratios) - 1, math.ceil(0.95 * len(ratios)) - 1)]
        compared = [row for row in judged if math.isfinite(row.plan_s)]
        lines += [
            f"before: {within((row.plan_value, row.plan_bar, row.true) for row in compared)}; "
            f"{reached((row.plan_value, row.plan_bar, row.target) for row in compared)}",
            f"processor time, loop over plan and rounds: median {median(ratios):.2f}, 95 % {last:.2f}, "
            f"worst {ratios[-1]:.2f}; sums {sum(row.loop_s for row in both):.0f} s "
            f"and {sum(row.plan_s for row in both):.0f} s, of which plans {sum(row.planning_s for row in both):.0f} s",
        ]
    return "\n".join(lines)


def main() -> None:
    asked = parser_of(SEED, SCENES, FILE).parse_args()
    rows = [row for row in read_rows(Row, asked.file) if row.seed == asked.seed]
    known = {row.index for row in rows}
    if not (asked.summary or asked.document):
        judge(WARM, asked.seed)
        for index in range(asked.first, asked.first + asked.scenes):
            if index not in known:
                one = judge(index, asked.seed)
                append_rows(one, asked.file)
                rows += one
                print(index, one[0].seat, one[0].reed, one[0].outcome, one[0].reason[:90], flush=True)  # noqa: T201
    print(in_words(rows))  # noqa: T201


if __name__ == "__main__":
    main()
