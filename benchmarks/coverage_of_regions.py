"""Are whole regions of contact right, by another program? The drawn landings of `drawn_regions`, by both.

    python benchmarks/coverage_of_regions.py [--first N] [--scenes N]
    python benchmarks/coverage_of_regions.py --document

appends rows to results/coverage_of_regions.csv as scenes end, one for each measure, or one that says why a scene has
none; scenes that are in the file are not run again. ``--document`` writes the table into docs/coverage.md. The product
runs as a user would run it; `points` computes the reference on ever finer grids until the last step changes impulse and
peak by less than `SURE`. What that step changes is its doubt.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
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
SURE: Final = 0.01
LAST_FREE, LAST_HELD = 3, 2  # numbers of the finest grids: held plates have more modes
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


def judge(index: int) -> list[Row]:
    """Return the rows of one scene."""
    drawn = draw_region(index)
    start = monotonic()
    fine, coarse = references(drawn)
    head = Row(SEED, index, drawn.kind, reference_seconds=monotonic() - start)
    start = monotonic()
    summary, reason = run_scene(drawn)
    head = replace(head, seconds=monotonic() - start)
    if summary is None:
        return [replace(head, outcome="failed", reason=reason)]
    head = replace(head, met=str(summary["accuracy_met"]), rounds=int(summary["accuracy_rounds"]))
    return list(_compared(head, summary, fine, coarse))


def references(drawn: RegionLanding) -> tuple[Measured, Measured]:
    """Return the measures on the finest grid that is needed, or that is left, and on the one before."""
    last = LAST_FREE if isinstance(drawn.outline, Ring) else LAST_HELD
    fine = _measured(drawn, GRIDS[0])
    for grid in GRIDS[1 : last + 1]:
        fine, coarse = _measured(drawn, grid), fine
        if all(abs(getattr(coarse, name) / getattr(fine, name) - 1) < SURE for name in NARROW):
            break
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


def _compared(head: Row, summary: Mapping[str, float], fine: Measured, coarse: Measured) -> Iterator[Row]:
    for measure, key in KEYS.items():
        value, bar = summary.get(key), summary.get(f"error_bar_{key}")
        reference = getattr(fine, measure)
        doubt = abs(reference - getattr(coarse, measure))
        row = replace(head, measure=measure, reference=reference, doubt=doubt)
        if value is not None:
            row = replace(row, value=value)
            if bar is not None:
                row = replace(row, bar=bar, inside=str(row.error <= bar))
        yield row


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
    others = [row for row in rows if row.outcome != "judged"]
    scenes = {row.index for row in rows}
    missed = {row.index for row in judged if row.met != "True"}
    failed = "".join(f", {len({row.index for row in others})} without a result" for _ in others[:1])
    lines = [
        "", f"{len(scenes)} scenes: {len(scenes) - len(missed) - len(others)} reached their target, "
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
    parser.add_argument("--document", action="store_true", help="run nothing, write the page")
    asked = parser.parse_args()
    there = {row.index for row in read_rows(Row, FILE)}
    for index in range(asked.first, asked.first + (0 if asked.document else asked.scenes)):
        if index not in there:
            rows = judge(index)
            append_rows(rows, FILE)
            print(line(rows), flush=True)  # noqa: T201
    table = summary_of(read_rows(Row, FILE))
    print(table)  # noqa: T201
    if asked.document:
        write_between(PAGE, "coverage_of_regions", table)


if __name__ == "__main__":
    main()
