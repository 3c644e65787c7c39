"""The loop against the plan with its rounds, on drawn scenes: processor time, targets reached, coverage of the bars.

    python benchmarks/loop_of_scenes.py [--seed N] [--scenes N] [--first N] [--file CSV]
    python benchmarks/loop_of_scenes.py --summary

appends rows to results/loop_of_scenes.csv as scenes end, one for each measure that the target applies to; scenes that
are in the file are not run again. Both ways run in one process, each with an empty store, after one scene that loads
and compiles; they take turns in going first. The reference is finer in every key than the loop's result.
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
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.rounds import Limits, Round, rounds
from seatfem.study.scene import Scene, load_scene

SEED, SCENES = 90417, 200
FILE: Final = RESULTS / "loop_of_scenes.csv"
SECONDS: Final = 60.0  # of ``--max-time``, for either way
WARM: Final = 4  # scene that loads and compiles what is never timed
PER_SCENE: Final = 4 * LONGEST


@dataclass(frozen=True)
class Row(Head):
    """A measure of a scene, by both ways.

    Attributes:
        target: relative.
        loop_s, plan_s, planning_s: processor time [s] of the loop, of plan and rounds, of the plan alone.
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
class Way:
    """What one way came to: its last round, and its processor times [s]."""

    done: Round
    seconds: float
    planning: float = 0.0


def run_loop(scene: Scene, folder: Path) -> Way:
    start = spent()
    with gmsh_session():
        *_, done = rounds(begin_plan(scene), folder, Stopwatch(), silent, limits=Limits(rounds=9, seconds=SECONDS))
    return Way(done, spent() - start)


def run_plan(scene: Scene, folder: Path) -> Way:
    start = spent()
    plan = plan_scene(scene)
    planning = spent() - start
    *_, done = rounds(plan, folder, Stopwatch(), silent, limits=Limits(seconds=SECONDS))
    return Way(done, spent() - start, planning)


def judge(index: int, seed: int) -> list[Row]:
    """Return the rows of a scene."""
    drawn = draw_scene(index, seed)
    head = Row(seed, index, drawn.seat, drawn.reed, drawn.about, drawn.stated, "judged")

    def work(folder: Path) -> Iterator[Row]:
        scene = load_scene(drawn.write(folder))
        ways = {}
        for run in (run_loop, run_plan) if index % 2 else (run_plan, run_loop):
            bodies._solved.cache_clear()
            with stored() as own:
                ways[run] = run(scene, own)
        loop, plan = ways[run_loop], ways[run_plan]
        row = replace(
            head,
            target=scene.accuracy.target,
            loop_s=loop.seconds, plan_s=plan.seconds, planning_s=plan.planning,
            loop_rounds=loop.done.number, plan_rounds=plan.done.number,
            loop_met=str(loop.done.met), plan_met=str(plan.done.met),
            level=loop.done.plan.level, plan_level=plan.done.plan.level, reason=loop.done.stopped,
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
            left, beside = loop.done.left, plan.done.left
            yield replace(
                row, measure=name, value=left.values[name], bar=left.bar(name),
                plan_value=beside.values.get(name, math.nan),
                plan_bar=beside.bar(name) if name in beside.values else math.nan,
                true=exact.get(name, math.nan),
            )  # fmt: skip

    return carry_out(head, work, PER_SCENE)


def in_words(rows: Sequence[Row]) -> str:
    """Return what a table shows, in lines."""
    judged = [row for row in rows if row.outcome == "judged"]
    scenes = list({row.index: row for row in judged}.values())
    ratios = sorted(row.loop_s / row.plan_s for row in scenes)
    if not ratios:
        return "no scenes"

    def within(values: Iterable[tuple[float, float, float]]) -> str:
        known = [(value, bar, true) for value, bar, true in values if math.isfinite(true) and math.isfinite(bar)]
        inside = [abs(value - true) <= bar + ROUND_OFF * abs(value) for value, bar, true in known]
        over = median(bar / max(abs(value - true), ROUND_OFF * abs(value)) for value, bar, true in known)
        return f"{sum(inside)} of {len(inside)} inside, median bar over error {over:.1f}"

    def reached(values: Iterable[tuple[float, float, float]]) -> str:
        shares = [bar <= target * abs(value) for value, bar, target in values]
        return f"{sum(shares) / len(shares):.0%} of the bars within the target"

    last = ratios[min(len(ratios) - 1, math.ceil(0.95 * len(ratios)) - 1)]
    return "\n".join(
        (
            f"{len(scenes)} scenes, {len(judged)} measures; {len({row.index for row in rows}) - len(scenes)} others",
            f"processor time, loop over plan and rounds: median {median(ratios):.2f}, 95 % {last:.2f}, "
            f"worst {ratios[-1]:.2f}; sums {sum(row.loop_s for row in scenes):.0f} s "
            f"and {sum(row.plan_s for row in scenes):.0f} s, "
            f"of which plans {sum(row.planning_s for row in scenes):.0f} s",
            f"loop: {within((row.value, row.bar, row.true) for row in judged)}; "
            f"{reached((row.value, row.bar, row.target) for row in judged)}",
            f"plan: {within((row.plan_value, row.plan_bar, row.true) for row in judged)}; "
            f"{reached((row.plan_value, row.plan_bar, row.target) for row in judged)}",
        )
    )


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
