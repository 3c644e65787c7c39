"""Are whole regions of contact right, by another program? Landings in both programs' words.

    python benchmarks/coverage_of_regions.py drawn|lands|valves [--first N] [--scenes N] [--again] [--document]

``drawn``: the landings of `drawn_regions`, at random. ``lands``: each land by itself, of `valves.lands`. ``valves``:
valves with the contact not stated and stated by hand, of `valves.valves`. A scene gives rows, one for each measure of
each of its parts, with the reason where there is no value, and is not run again, unless ``--again``: then the product
runs and references stay, which do not depend on it. ``--document`` runs nothing and writes the table into its page. The
product runs as a user would run it. `points` computes the reference on two grids, of free plates on ever finer ones
until impulse and peak change by less than `SURE`; what the last step changes is its doubt.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from statistics import median
from time import monotonic
from typing import Any, Final

from drawn_regions import SCENES, SEED, STEEL, RegionLanding, draw_region
from points.outlines import Ring
from points.region_landing import GRIDS, Fineness, march_region, measure_region
from table import RESULTS, append_rows, read_rows, write_between
from valves import NOT_STATED, by_lands, lands, valves

from seatfem.machine.resources import busyness
from seatfem.structures.cache import VARIABLE

DOCS: Final = Path(__file__).parents[1] / "docs"
RUN_SECONDS: Final = 120  # as of ``--max-time``, longer on a busy machine
LONGEST: Final = 600.0  # s for a run in all, longer on a busy machine
SURE: Final = 0.015
MOST_POINTS: Final = 600  # of grids beyond the second, of free plates: held ones have more modes
KEYS: Final[Mapping[str, str]] = {
    "impulse": "impulse_Ns", "filtered_peak": "filtered_peak_force_N",
    "closing_speed": "landing_closing_speed_m_per_s", "line_force": "line_force_peak_N_per_m",
}  # fmt: skip
"""In summary.json, by measure; of the whole run, but for the closing speed of the hardest landing."""
LAND_KEYS: Final[Mapping[str, str]] = {
    "first touch": "time_s", "after the first": "after_first_s", "peak": "filtered_peak_force_N",
    "impulse": "impulse_Ns", "share": "impulse_share",
}  # fmt: skip
LANDING_KEYS: Final[Mapping[str, str]] = {
    "impulse": "impulse_Ns",
    "peak": "filtered_peak_force_N",
    "duration": "duration_s",
}
UNITS: Final[Mapping[str, tuple[float, str]]] = {
    "first touch": (1e6, "us"), "after the first": (1e6, "us"), "duration": (1e6, "us"), "peak": (1, "N"),
    "impulse": (1e6, "uN s"), "share": (1, ""),
}  # fmt: skip
NARROW: Final[Mapping[str, float]] = {"impulse": 0.05, "filtered_peak": 0.10, "peak": 0.10}
"""Widest bars, over their values, of runs that say that they reached their target."""

Number = tuple[str, str]
"""A part of a scene, as one of its lands, and the measure."""
Numbers = Mapping[Number, float]
Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Row:
    """One measure of a part of a scene.

    Attributes:
        outcome: "judged", or "failed" with the ``reason``.
        met: whether the run says that it reached its target.
        value, bar: of the product; the bar is nan where it is not known.
        reference, doubt: of the other program.
        inside: whether the value is within its bar of the reference; "" without a bar.
        seconds, reference_seconds: of the wall, for the run and for the grids.
    """

    seed: int
    index: int
    kind: str
    part: str = ""
    outcome: str = "judged"
    reason: str = ""
    met: str = ""
    rounds: int = 0
    measure: str = ""
    value: float = math.nan
    bar: float = math.nan
    reference: float = math.nan
    doubt: float = math.nan
    inside: str = ""
    seconds: float = math.nan
    reference_seconds: float = math.nan

    @property
    def error(self) -> float:
        """Return how far the value is off the reference."""
        return abs(self.value - self.reference)

    @property
    def is_in_doubt(self) -> bool:
        """Return whether the bar misses the reference by no more than that is unsure of."""
        return self.inside == "False" and self.error <= self.bar + self.doubt

    @property
    def is_narrow(self) -> bool:
        """Return whether the run missed its target, or the bar is narrow."""
        return self.met != "True" or self.bar <= NARROW[self.measure] * abs(self.value)


@dataclass(frozen=True)
class Case:
    """A scene by both programs.

    Attributes:
        text: of scene.toml.
        options: of the run that gives the numbers of each part, by parts.
        references: numbers on the finest grid, and on the one before.
        read: record of summary.json and key in it of a number.
    """

    kind: str
    text: str
    options: Mapping[str, tuple[str, ...]]
    references: Callable[[], tuple[Numbers, Numbers]]
    read: Callable[[Summary, str, str], tuple[Summary, str]]


@dataclass(frozen=True)
class Kinds:
    """Scenes of one kind: how each is found by its number, how many there are, their page and their table in it."""

    case: Callable[[int], Case]
    count: int
    page: Path
    table: Callable[[Sequence[Row]], str]
    seed: int = 0


def drawn_case(index: int) -> Case:
    """Return a landing drawn at random, without parts."""
    drawn = draw_region(index)
    return Case(
        drawn.kind, drawn.text, {"": ()}, lambda: references(drawn), lambda summary, _, name: (summary, KEYS[name])
    )


def references(drawn: RegionLanding) -> tuple[Numbers, Numbers]:
    """Return the measures on the finest grid that is needed, or that is left, and on the one before."""
    held, number = not isinstance(drawn.outline, Ring), len(drawn.region.lands)
    fine, coarse = _measured(drawn, GRIDS[1]), _measured(drawn, GRIDS[0])
    for grid in GRIDS[2:]:
        sure = all(abs(coarse["", name] / fine["", name] - 1) < SURE for name in ("impulse", "filtered_peak"))
        if sure or held or number * grid.around * grid.across > MOST_POINTS:
            break
        fine, coarse = _measured(drawn, grid), fine
    return fine, coarse


def _measured(drawn: RegionLanding, grid: Fineness) -> Numbers:
    marched, cells = march_region(drawn.outline, STEEL, drawn.thickness, drawn.region, drawn.fall, grid)
    measured = measure_region(marched, cells, drawn.fall, grid.dt)
    return {("", name): getattr(measured, name) for name in KEYS}


def lands_case(index: int) -> Case:
    """Return a seat with several lands, which are its parts."""
    name, (landing, names) = list(lands().items())[index]

    def read(summary: Summary, land: str, measure: str) -> tuple[Summary, str]:
        return next(each for each in summary["lands"] if each["land"] == land), LAND_KEYS[measure]

    both = partial(map, partial(by_lands, landing, names), (GRIDS[1], GRIDS[0]))
    return Case(name, landing.text, dict.fromkeys(names, ()), lambda: tuple(both()), read)


def valve_case(index: int) -> Case:
    """Return a valve, whose parts are the ways in which its contact is stated."""
    name, valve = list(valves().items())[index]
    options = {NOT_STATED: ()}
    if valve.stated:
        options["stated"] = tuple(word for pair in valve.stated.items() for word in ("--set", "=".join(pair)))

    def both() -> Iterator[Numbers]:
        for grid, neglected in ((GRIDS[valve.grid], 0.0), (GRIDS[valve.grid - 1], valve.neglected)):
            numbers = {measure: (1 - neglected) * value for measure, value in valve.reference(grid).items()}
            yield {(part, measure): value for part in options for measure, value in numbers.items()}

    def read(summary: Summary, _: str, measure: str) -> tuple[Summary, str]:
        body, key = "stopper" if measure.startswith("stopper") else "seat", LANDING_KEYS[measure.split()[-1]]
        on_it = [each for each in summary["landings"] if each["body"] == body]
        return max(on_it, key=lambda each: each["excess_peak_force_N"] or 0.0, default={}), key

    return Case(name, valve.text, options, lambda: tuple(both()), read)


def judge(kinds: Kinds, index: int, before: Sequence[Row]) -> list[Row]:
    """Return the rows of one scene, with the references of the rows ``before`` where those have them."""
    case, start = kinds.case(index), monotonic()
    kept = [row for row in before if row.measure]
    if not kept:
        fine, coarse = case.references()
        head = Row(kinds.seed, index, case.kind, reference_seconds=monotonic() - start)
        kept = [
            replace(head, part=part, measure=name, reference=value, doubt=abs(value - coarse[part, name]))
            for (part, name), value in fine.items()
        ]
    run = cache(partial(run_scene, case.text))
    return [_compared(replace(row, value=math.nan, bar=math.nan, inside=""), case, run) for row in kept]


def _compared(row: Row, case: Case, run: Callable[[tuple[str, ...]], tuple[Summary | None, str, float]]) -> Row:
    """Return a row with the value, and with the bar where it is known."""
    summary, reason, seconds = run(case.options[row.part])
    if summary is None:
        return replace(row, outcome="failed", reason=reason, seconds=seconds)
    met, rounds = str(summary["accuracy_met"]), int(summary["accuracy_rounds"])
    row = replace(row, outcome="judged", reason="", met=met, rounds=rounds, seconds=seconds)
    record, key = case.read(summary, row.part, row.measure)
    value, bar = record.get(key), record.get(f"error_bar_{key}")
    if value is None:
        return row
    row = replace(row, value=value)
    return row if bar is None else replace(row, bar=bar, inside=str(row.error <= bar))


def run_scene(text: str, options: tuple[str, ...]) -> tuple[Summary | None, str, float]:
    """Return the summary of a run, or ``None`` and the last words of one that has none; and its wall time [s]."""
    with tempfile.TemporaryDirectory() as folder:
        scene, out, start = Path(folder) / "scene.toml", Path(folder) / "out", monotonic()
        scene.write_text(text, encoding="utf-8")
        command = [str(Path(sys.executable).with_name("seatfem")), "run", str(scene), "-o", str(out), "--no-pictures"]
        busy = busyness()
        command += ["--max-time", str(RUN_SECONDS * busy), *options]
        environment = {**os.environ, VARIABLE: f"{folder}/store"}
        try:
            done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=LONGEST * busy)
        except subprocess.TimeoutExpired:
            return None, f"more than {LONGEST * busy:g} s", monotonic() - start
        path, seconds = out / "summary.json", monotonic() - start
        if not path.is_file():
            return None, " ".join((done.stderr or done.stdout).split())[-300:].replace(folder, ""), seconds
        return json.loads(path.read_text(encoding="utf-8")), "", seconds


def line(rows: Sequence[Row]) -> str:
    """Return a scene for the log."""
    one = rows[0]
    parts = (
        f"{row.part} {row.measure} {row.value:.4g} +- {row.bar:.2g}, {row.reference:.4g} +- {row.doubt:.2g}"
        f"{'' if row.met == 'True' else f' missed {row.reason}'}{ {'True': '', 'False': ' OUT', '': ' ?'}[row.inside] }"
        for row in rows
    )
    return f"{one.index:2d} {one.kind}: {'; '.join(parts)}; {one.seconds:.0f} + {one.reference_seconds:.0f} s"


def table_of_drawn(rows: Sequence[Row]) -> str:
    """Return the table of all scenes."""
    judged = [row for row in rows if row.outcome == "judged"]
    unknown = {row.index for row in rows if row.outcome != "judged"}
    scenes = {row.index for row in rows}
    missed = {row.index for row in judged if row.met != "True"}
    failed = f", {len(unknown)} had no result" if unknown else ""
    lines = [
        "", f"{len(scenes)} scenes: {len(scenes) - len(missed) - len(unknown)} reached their target, "
        f"{len(missed)} missed it and said so{failed}.", "",
        "| measure | inside | error | bar | bar over error | doubt | narrow, or missed |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for measure in (*KEYS, "all"):
        some = [row for row in judged if measure in (row.measure, "all")]
        barred = [row for row in some if row.inside]
        if not barred:
            continue
        inside = sum(row.inside == "True" for row in barred)
        ratio = median(row.bar / max(row.error, 1e-9 * abs(row.value)) for row in barred)
        error, bar, doubt = (
            median(getattr(row, name) / abs(row.reference) for row in barred) for name in ("error", "bar", "doubt")
        )
        asked = [row for row in barred if row.measure in NARROW]
        narrow = sum(row.is_narrow for row in asked)
        ends = f"{narrow} of {len(asked)}" if asked else ""
        lines.append(
            f"| {measure.replace('_', ' ')} | {inside} of {len(barred)} | {error:.1%} | {bar:.1%} | {ratio:.2g} | "
            f"{doubt:.1%} | {ends} |"
        )
    return "\n".join(lines)


def table_of_lands(rows: Sequence[Row]) -> str:
    """Return the table of all numbers of all lands."""
    lines = ["", "| scene | land | number | seatfem | other program | inside |", "|---|---|---|---|---|---|"]
    for row in rows:
        ends = "yes" if row.inside == "True" else "no" if row.inside else "no bar"
        lines.append(
            f"| {row.kind} | {row.part} | {row.measure} | {_told(row, row.value, row.bar)} | "
            f"{_told(row, row.reference, row.doubt)} | {ends} |"
        )
    return "\n".join([*lines, "", f"{_inside(rows)} hold the other program's value."])


def table_of_valves(rows: Sequence[Row]) -> str:
    """Return a line for each valve, and whether both ways to state the contact agree."""
    computed = f"{len({row.index for row in rows})} of {KINDS['valves'].count} valves are computed."
    lines = ["", computed, "", "| valve | other program | not stated | stated |", "|---|---|---|---|"]
    pairs = agree = 0
    for index in sorted({row.index for row in rows}):
        of_it = [row for row in rows if row.index == index]
        ways = {part: [row for row in of_it if row.part == part] for part in dict.fromkeys(row.part for row in of_it)}
        first = ways[NOT_STATED]
        cells = [of_it[0].kind, "; ".join(f"{row.measure} {_told(row, row.reference, row.doubt)}" for row in first)]
        for part in (NOT_STATED, "stated"):
            told = "; ".join(
                _told(row, row.value, row.bar)
                + (" (in doubt)" if row.is_in_doubt else " **out**" if row.inside == "False" else "")
                for row in ways.get(part, [])
            )
            missed = part in ways and ways[part][0].met != "True"
            cells.append(told + (" (missed)" if missed else ""))
        for one, other in zip(first, ways.get("stated", []), strict=False):
            pairs += 1
            agree += abs(one.value - other.value) <= one.bar + other.bar
        lines.append(f"| {' | '.join(cells)} |")
    asked = [row for row in rows if row.measure in NARROW and row.inside]
    narrow = sum(row.is_narrow for row in asked)
    words = (
        f"{_inside(rows)} hold the reference, {sum(row.is_in_doubt for row in rows)} more as far as that is sure; "
        f"{agree} of {pairs} numbers are the same within both bars whether or not "
    )
    words += f"the contact is stated; {narrow} of {len(asked)} bars of impulse and peak are narrow, or the run missed."
    return "\n".join([*lines, "", words] if rows else lines[:2])


def _told(row: Row, value: float, bar: float) -> str:
    """Return a number of a row and its bar in the unit of its measure."""
    factor, unit = UNITS[row.measure.removeprefix("stopper ")]
    return f"{factor * value:.4g} ± {factor * bar:.2g} {unit}"


def _inside(rows: Sequence[Row]) -> str:
    barred = [row for row in rows if row.inside]
    return f"{sum(row.inside == 'True' for row in barred)} of {len(barred)} bars"


KINDS: Final[Mapping[str, Kinds]] = {
    "drawn": Kinds(drawn_case, SCENES, DOCS / "coverage.md", table_of_drawn, SEED),
    "lands": Kinds(lands_case, 4, DOCS / "lands.md", table_of_lands),
    "valves": Kinds(valve_case, 13, DOCS / "coverage.md", table_of_valves),
}
MARKS: Final[Mapping[str, str]] = {
    "drawn": "coverage_of_regions", "lands": "coverage_of_lands", "valves": "coverage_of_valves",
}  # fmt: skip
"""Of the tables in their pages, and names of the files of rows."""


def rows_of(name: str) -> list[Row]:
    """Return the rows on file of the scenes of a kind."""
    return read_rows(Row, RESULTS / f"{MARKS[name]}.csv")


def main() -> None:
    """Run what is missing, and tell what the table holds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("kinds", choices=KINDS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scenes", type=int)
    parser.add_argument("--again", action="store_true", help="run the product where the table has the scene, too")
    parser.add_argument("--document", action="store_true", help="run nothing, write the page")
    asked = parser.parse_args()
    kinds, file = KINDS[asked.kinds], RESULTS / f"{MARKS[asked.kinds]}.csv"
    last = kinds.count if asked.scenes is None else asked.first + asked.scenes
    for index in () if asked.document else range(asked.first, last):
        before = [row for row in rows_of(asked.kinds) if row.index == index]
        if asked.again or not before:
            rows = judge(kinds, index, before)
            others = [row for row in rows_of(asked.kinds) if row.index != index]
            file.unlink(missing_ok=True)
            append_rows(sorted([*others, *rows], key=lambda row: row.index), file)
            print(line(rows), flush=True)  # noqa: T201
    table = kinds.table(rows_of(asked.kinds))
    print(table)  # noqa: T201
    if asked.document:
        write_between(kinds.page, MARKS[asked.kinds], table)


if __name__ == "__main__":
    main()
