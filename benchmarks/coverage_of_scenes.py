"""Do the error bars cover the true errors? Whole scenes over all of the scene language, finer in every key.

    python benchmarks/coverage_of_scenes.py [--seed N] [--scenes N] [--first N] [--longest SECONDS] [--file CSV]
    python benchmarks/coverage_of_scenes.py --summary | --document

appends rows to results/coverage_of_scenes.csv as scenes end, one for each measure, or one that says why a scene has
none; scenes that are in the file are not run again. ``--summary`` tells what the file holds and runs nothing,
``--document`` writes its table into docs/coverage.md, too, and counts by kind into the package (`checked_scenes`).
The scenes of seed 58213 in it were run with ``--longest 60``. The reference of a run is
`finer_scenes.finest_reference`: finer in every key.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import signal
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeVar
from unittest.mock import patch

from checked_scenes import write_checked_scenes
from drawn_scenes import DrawnScene, draw_scene
from finer_scenes import REFUSALS, NoReference, Reference, describe, finer_round, finest_reference, largest_stresses
from scenes_summary import document, summary
from table import RESULTS, append_rows, read_rows, spent

from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.structures.cache import VARIABLE
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from seatfem.study.scene import load_scene

SEED, SCENES = 77143, 150
FILE: Final = RESULTS / "coverage_of_scenes.csv"
PAGE: Final = Path(__file__).parents[1] / "docs" / "coverage.md"
RUN_SECONDS: Final = 180.0  # for the rounds of a run, as of ``--max-time``; other work may share the cores
LONGEST = 150.0  # s of processor time for a scene and its reference
DEAR, LESS_FINE = 20.0, 2  # s of it that a run has taken, from which on references begin with this rung
LEFT_OUT: Final = re.compile(r"first_landing_|seat \d+ (filtered|impulse|duration|restitution)|\w+ ([1-9]|\d\d) ")
"""What is no row of its own unless asked for: values of the first landing on the seat that are measures, and those of
later ones."""
ROUND_OFF: Final = 1e-9  # relative: what a true error may be without any source


@dataclass(frozen=True)
class Head:
    """A scene as it was drawn, and how it ended.

    ``outcome``: "judged", "no landing", "never opened", "no value", "refused", "no reference", "stopped" or "failed",
    with the ``reason``; of a judged one it may be why no further round followed.
    """

    seed: int
    index: int
    seat: str
    reed: str
    about: str
    stated: bool
    outcome: str
    reason: str = ""


Ended = TypeVar("Ended", bound=Head)


@dataclass(frozen=True)
class Row(Head):
    """One measure of a scene, or why a scene has none.

    Attributes:
        status: of the landings of the run.
        level, target, met, rounds, rung: of the run, and which of the references was computed.
        measure: by name.
        asked: "measures" of [accuracy], "table" of its own, or "" where nobody asked for it.
        value, bar, true: SI; ``bar`` is nan where it is not known.
        inside: whether the true error is within the bar; "" where that is not known.
        seconds: of processor time, of the scene and its reference.
    """

    status: str = ""
    level: str = ""
    target: float = math.nan
    met: str = ""
    rounds: int = 0
    rung: int = -1
    measure: str = ""
    asked: str = ""
    value: float = math.nan
    bar: float = math.nan
    true: float = math.nan
    inside: str = ""
    seconds: float = math.nan


class TooLong(BaseException):
    """A scene has taken longer than it may; nothing that runs catches it."""


def judge(index: int, seed: int, longest: float = LONGEST) -> list[Row]:
    """Return the rows of one scene: run by the loop, and compared with its reference."""
    drawn = draw_scene(index, seed)
    head = Row(seed, index, drawn.seat, drawn.reed, drawn.about, drawn.stated, "judged")
    return carry_out(head, lambda folder: _judged(head, drawn, folder), longest)


def carry_out(head: Ended, work: Callable[[Path], Iterable[Ended]], longest: float) -> list[Ended]:
    """Return the rows that ``work`` yields within seconds of processor time, or one that says why there are none."""
    start = spent()
    try:
        with stored() as folder, limited(longest), gmsh_session():
            rows = list(work(folder))
    except TooLong:
        rows = [replace(head, outcome="stopped", reason=f"more than {longest:g} s of processor time")]
    except NoReference as problem:
        rows = [replace(head, outcome="no reference", reason=str(problem))]
    except REFUSALS as problem:
        rows = [replace(head, outcome="refused", reason=describe(problem))]
    except Exception as problem:  # what is no refusal in words is a defect, and a row of the table
        rows = [replace(head, outcome="failed", reason=describe(problem))]
    return [replace(row, seconds=spent() - start) for row in rows]


def _judged(head: Row, drawn: DrawnScene, folder: Path) -> Iterator[Row]:
    start, scene = spent(), load_scene(drawn.write(folder))
    *_, done = rounds(begin_plan(scene), folder, Stopwatch(), silent, limits=Limits(seconds=RUN_SECONDS))
    assert done.touches.landings is not None
    status = done.touches.landings.status
    head = replace(head, level=done.plan.level, target=scene.accuracy.target, rounds=done.number, status=status)
    if not done.landed:
        yield replace(head, outcome=status, reason="there is nothing to judge")
        return
    rung, reference = finest_reference(done, LESS_FINE if spent() - start > DEAR else 0)
    head = replace(head, met=str(done.met), rung=rung, reason=done.stopped)
    for name, value in done.budget.values.items():
        if name in done.judged or not LEFT_OUT.match(name):
            asked = "measures" if name in done.judged else ""
            row, exact = replace(head, measure=name, asked=asked), reference.values.get(name, math.inf)
            yield compare(row, value, done.budget.bar(name), exact)
    for name, (value, bar, exact) in _stresses(done, reference).items():
        yield compare(replace(head, measure=name, asked="table"), value, bar, exact)


def compare(head: Row, value: float, bar: float, exact: float) -> Row:
    """Return the row of a measure with its true error."""
    true = abs(value - exact)  # infinite of a landing that the reference has not
    known = math.isfinite(bar)
    inside = str(true <= bar + ROUND_OFF * abs(value)) if known else ""
    return replace(head, value=value, bar=bar if known else math.nan, true=true, inside=inside)


def _stresses(done: Round, reference: Reference) -> Mapping[str, tuple[float, float, float]]:
    """Value, bar and reference of the largest stresses that [stress] and [life] ask for, where they have bars."""
    scene = done.plan.scene
    if scene.stress is None and (not scene.assessments or scene.reed.thin_plate is None):
        return {}
    (values, bars), (exact, _) = largest_stresses(done), largest_stresses(finer_round(done, reference), bare=True)
    return {
        name: (value, bars[name], exact[name])
        for name, value in values.items()
        if not math.isnan(bars[name]) and name not in done.budget.values
    }


@contextmanager
def stored() -> Iterator[Path]:
    """A folder for one scene, and in it a store of its own."""
    with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {VARIABLE: f"{folder}/store"}):
        yield Path(folder)


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """`TooLong` after so many seconds of processor time: other programs do not count."""

    def stop(signum: int, frame: object) -> None:
        raise TooLong

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def line(rows: Sequence[Row]) -> str:
    """A scene for the log."""
    one = rows[0]
    head = f"{one.index:3d} {one.seat}/{one.level} {one.reed} ({one.about}) "
    if one.outcome != "judged":
        return f"{head}{one.outcome}: {one.reason}; {one.seconds:.0f} s"
    parts = []
    for row in rows:
        scale = abs(row.value) or 1.0
        mark = {"True": "", "False": " OUT", "": " ?"}[row.inside] + "*" * bool(row.asked)
        parts.append(f"{row.measure} {row.true / scale:.1e}/{row.bar / scale:.1e}{mark}")
    tail = f"target {one.target:.2g} met {one.met} {one.rounds}, rung {one.rung}: "
    return f"{head}{tail}{', '.join(parts)}; {one.seconds:.0f} s"


def main() -> None:
    """Run what is missing of a seed, and tell what the table holds."""
    parser = argparse.ArgumentParser()
    defaults: dict[str, Any] = {"seed": SEED, "first": 0, "scenes": SCENES, "longest": LONGEST, "file": FILE}
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--summary", action="store_true", help="run nothing")
    parser.add_argument("--document", action="store_true", help="run nothing, write the page, too")
    asked = parser.parse_args()
    indices = range(asked.first, asked.first + (0 if asked.summary or asked.document else asked.scenes))
    cover(asked.file, asked.seed, indices, lambda index: judge(index, asked.seed, asked.longest))
    rows = sorted(read_rows(Row, asked.file), key=lambda row: (row.seed, row.index))
    print(summary(rows))  # noqa: T201
    if asked.document:
        document(rows, PAGE)
        write_checked_scenes()


def cover(path: Path, seed: int, indices: Sequence[int], judge: Callable[[int], list[Row]]) -> list[Row]:
    """Judge the scenes of a seed that are not in a table, and return all rows of the seed."""
    there = {(row.seed, row.index) for row in read_rows(Row, path)}
    for index in indices:
        if (seed, index) not in there:
            rows = judge(index)
            append_rows(rows, path)
            print(line(rows), flush=True)  # noqa: T201
    return sorted((row for row in read_rows(Row, path) if row.seed == seed), key=lambda row: row.index)


if __name__ == "__main__":
    main()
