"""Are whole regions of contact right, by another program? The drawn landings of `drawn_regions`, by both.

    python benchmarks/coverage_of_regions.py [--first N] [--scenes N] [--again]
    python benchmarks/coverage_of_regions.py --document

puts rows into results/coverage_of_regions.csv as scenes end, one for each measure, with the reason where there is no
value; scenes that are there are not run again, unless ``--again``: then the product runs and references stay, which do
not depend on it. ``--document`` writes the table into docs/coverage.md. The product runs as a user would run it.
`points` computes the reference on two grids, of free plates on ever finer ones until impulse and peak change by less
than `SURE`; what the last step changes is its doubt.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import monotonic
from typing import Final

from drawn_regions import SCENES, SEED, STEEL, RegionLanding, draw_region
from points.outlines import Ring
from points.region_landing import GRIDS, Fineness, Measured, march_region, measure_region
from table import RESULTS, append_rows, read_rows, write_between

from seatfem.structures.cache import VARIABLE

FILE: Final = RESULTS / "coverage_of_regions.csv"
PAGE: Final = Path(__file__).parents[1] / "docs" / "coverage.md"
RUN_SECONDS: Final = 120  # as of ``--max-time``
LONGEST: Final = 600.0  # s for a run in all
SURE: Final = 0.015
MOST_POINTS: Final = 600  # of grids beyond the second, of free plates: held ones have more modes
KEYS: Final[Mapping[str, str]] = {
    "impulse": "impulse_Ns", "filtered_peak": "filtered_peak_force_N",
    "closing_speed": "landing_closing_speed_m_per_s", "line_force": "line_force_peak_N_per_m",
}  # fmt: skip
"""In summary.json, by measure; of the whole run, but for the closing speed of the hardest landing."""
NARROW: Final[Mapping[str, float]] = {"impulse": 0.05, "filtered_peak": 0.10}
"""Widest bars, over their values, of runs that say that they reached their target."""


@dataclass(frozen=True)
class Row:
    """One measure of a scene.

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


def judge(index: int, before: Sequence[Row]) -> list[Row]:
    """Return the rows of one scene, with the references of the rows ``before`` where those have them."""
    drawn = draw_region(index)
    head = Row(SEED, index, drawn.kind)
    kept = {row.measure: row for row in before if row.measure}
    if not kept:
        start = monotonic()
        fine, coarse = references(drawn)
        kept = {
            name: replace(
                head, measure=name, reference=getattr(fine, name), reference_seconds=monotonic() - start,
                doubt=abs(getattr(fine, name) - getattr(coarse, name)),
            )
            for name in KEYS
        }  # fmt: skip
    start = monotonic()
    summary, reason = run_scene(drawn)
    ended = {"seconds": monotonic() - start, "value": math.nan, "bar": math.nan, "inside": ""}
    if summary is None:
        return [replace(row, outcome="failed", reason=reason, **ended) for row in kept.values()]
    ended |= {"outcome": "judged", "reason": "", "met": str(summary["accuracy_met"])}
    ended["rounds"] = int(summary["accuracy_rounds"])
    return [_compared(replace(row, **ended), summary) for row in kept.values()]


def references(drawn: RegionLanding) -> tuple[Measured, Measured]:
    """Return the measures on the finest grid that is needed, or that is left, and on the one before."""
    held, lands = not isinstance(drawn.outline, Ring), len(drawn.region.lands)
    fine, coarse = _measured(drawn, GRIDS[1]), _measured(drawn, GRIDS[0])
    for grid in GRIDS[2:]:
        sure = all(abs(getattr(coarse, name) / getattr(fine, name) - 1) < SURE for name in NARROW)
        if sure or held or lands * grid.around * grid.across > MOST_POINTS:
            break
        fine, coarse = _measured(drawn, grid), fine
    return fine, coarse


def _measured(drawn: RegionLanding, grid: Fineness) -> Measured:
    marched, cells = march_region(drawn.outline, STEEL, drawn.thickness, drawn.region, drawn.fall, grid)
    return measure_region(marched, cells, drawn.fall, grid.dt)


def run_scene(drawn: RegionLanding) -> tuple[dict[str, float] | None, str]:
    """Return the summary of a run, or ``None`` and the last words of one that has none."""
    with tempfile.TemporaryDirectory() as folder:
        scene, out = Path(folder) / "scene.toml", Path(folder) / "out"
        scene.write_text(drawn.text, encoding="utf-8")
        command = [str(Path(sys.executable).with_name("seatfem")), "run", str(scene), "-o", str(out), "--no-pictures"]
        command += ["--max-time", str(RUN_SECONDS)]
        environment = {**os.environ, VARIABLE: f"{folder}/store"}
        try:
            done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=LONGEST)
        except subprocess.TimeoutExpired:
            return None, f"more than {LONGEST:g} s"
        path = out / "summary.json"
        if not path.is_file():
            return None, " ".join((done.stderr or done.stdout).split())[-300:].replace(folder, "")
        return json.loads(path.read_text(encoding="utf-8")), ""


def _compared(row: Row, summary: Mapping[str, float]) -> Row:
    """Return a row with the value, and with the bar where it is known."""
    key = KEYS[row.measure]
    value, bar = summary.get(key), summary.get(f"error_bar_{key}")
    if value is None:
        return row
    row = replace(row, value=value)
    return row if bar is None else replace(row, bar=bar, inside=str(row.error <= bar))


def line(rows: Sequence[Row]) -> str:
    """Return a scene for the log."""
    one = rows[0]
    head = f"{one.index:2d} {one.kind}: "
    if one.outcome != "judged":
        return f"{head}{one.outcome}: {one.reason}; {one.seconds:.0f} s"
    parts = (
        f"{row.measure} {row.value:.4g} +- {row.bar:.2g}, {row.reference:.4g} +- {row.doubt:.2g}"
        + {"True": "", "False": " OUT", "": " ?"}[row.inside]
        for row in rows
    )
    return f"{head}met {one.met} in {one.rounds}: {'; '.join(parts)}; {one.seconds:.0f} + {one.reference_seconds:.0f} s"


def summary_of(rows: Sequence[Row]) -> str:
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
        narrow = sum(row.met != "True" or row.bar <= NARROW[row.measure] * abs(row.value) for row in asked)
        ends = f"{narrow} of {len(asked)}" if asked else ""
        lines.append(
            f"| {measure.replace('_', ' ')} | {inside} of {len(barred)} | {error:.1%} | {bar:.1%} | {ratio:.2g} | "
            f"{doubt:.1%} | {ends} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run what is missing, and tell what the table holds."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("--again", action="store_true", help="run the product where the table has the scene, too")
    parser.add_argument("--document", action="store_true", help="run nothing, write the page")
    asked = parser.parse_args()
    for index in range(asked.first, asked.first + (0 if asked.document else asked.scenes)):
        before = [row for row in read_rows(Row, FILE) if row.index == index]
        if asked.again or not before:
            rows = judge(index, before)
            others = [row for row in read_rows(Row, FILE) if row.index != index]
            FILE.unlink(missing_ok=True)
            append_rows(sorted([*others, *rows], key=lambda row: row.index), FILE)
            print(line(rows), flush=True)  # noqa: T201
    table = summary_of(read_rows(Row, FILE))
    print(table)  # noqa: T201
    if asked.document:
        write_between(PAGE, "coverage_of_regions", table)


if __name__ == "__main__":
    main()
