"""What the table of `coverage_of_scenes` says: shares inside, how wide the bars are, targets, and what has no row."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Final

from table import write_between

if TYPE_CHECKING:
    from coverage_of_scenes import Row

WIDEST: Final = 0.5  # of the value: a wider bar is shown as not known
NUMBERED: Final = {
    "impulse_Ns": "impulse", "filtered_peak_force_N": "filtered_peak", "duration_s": "contact_duration",
}  # fmt: skip
"""Keys of numbered landings that are measures."""


def share(rows: Sequence[Row], good: Callable[[Row], bool]) -> float:
    """Return the share of the rows that are good; nan of none."""
    return sum(map(good, rows)) / len(rows) if rows else math.nan


def is_inside(row: Row) -> bool:
    """Return whether the true error is within the bar."""
    return row.inside == "True"


def is_known(row: Row) -> bool:
    """Return whether there is a bar that a run shows."""
    return row.inside != "" and row.bar <= WIDEST * abs(row.value)


def kind_of(row: Row) -> str:
    """Return what is measured, whatever landing it is asked of."""
    last = row.measure.rpartition(" ")[2].removeprefix("first_").removeprefix("landing_")
    return NUMBERED.get(last, last)


def in_target(row: Row) -> bool:
    """Return whether the bar is within the target of the scene."""
    return row.bar <= row.target * abs(row.value)


def width(rows: Sequence[Row]) -> float:
    """Return the median of the bars over the true errors, of those that have an error; nan of none."""
    ratios = [row.bar / row.true for row in rows if is_known(row) and row.true > 0]
    return median(ratios) if ratios else math.nan


def table(rows: Sequence[Row]) -> list[str]:
    """Return a table in Markdown, of measures asked for and of all: with a bar, inside, how wide, within the target."""
    judged = [row for row in rows if row.outcome == "judged"]
    lines = [
        "| measures | with a bar | inside | median of bar over error | bar within the target |",
        "|---|---|---|---|---|",
    ]
    for wanted, words in ((True, "asked for"), (False, "all")):
        chosen = [row for row in judged if row.asked or not wanted]
        groups = {words: chosen, f"{words}, all left open": [row for row in chosen if not row.stated]}
        for seed in sorted({row.seed for row in chosen}, reverse=True):
            groups[f"{words}, seed {seed}"] = [row for row in chosen if row.seed == seed]
        for name in sorted({kind_of(row) for row in chosen if wanted}):
            groups[f"{name.replace('_', ' ')}, {words}"] = [row for row in chosen if kind_of(row) == name]
        for name, group in groups.items():
            known = [row for row in group if is_known(row)]
            targets = [row for row in group if row.asked == "measures"] if wanted else []
            met = f"{share(targets, in_target):.1%} of {len(targets)}" if targets else ""
            inside = f"{share(known, is_inside):.1%} of {len(known)}" if known else ""
            lines.append(f"| {name} | {len(known)} of {len(group)} | {inside} | {width(known):.2g} | {met} |")
    return lines


def ends(rows: Sequence[Row]) -> str:
    """Return how the scenes ended, in words."""
    scenes = {(row.seed, row.index): row for row in rows}
    counts = Counter(row.outcome for row in scenes.values())
    return f"{len(scenes)} scenes: {', '.join(f'{number} {outcome}' for outcome, number in counts.most_common())}."


def outside(rows: Sequence[Row]) -> list[str]:
    """Return what is outside its bar, row by row."""
    return [
        f"- {row.seed}/{row.index} {row.seat}/{row.level}, {row.reed} ({row.about}): {row.measure}"
        f"{' (asked for)' if row.asked else ''} by {row.true / row.bar if row.bar else math.inf:.2g} bars, "
        f"{row.true / abs(row.value) if row.value else math.inf:.2g} of it"
        for row in rows
        if row.outcome == "judged" and is_known(row) and not is_inside(row)
    ]


def unjudged(rows: Sequence[Row]) -> list[str]:
    """Return the scenes that were not judged, and why."""
    return [
        f"- {row.seed}/{row.index} {row.seat}, {row.reed} ({row.about}): {row.outcome}, {row.reason}"
        for row in rows
        if row.outcome != "judged"
    ]


def summary(rows: Sequence[Row]) -> str:
    """Return all of it."""
    spent = sum({(row.seed, row.index): row.seconds for row in rows}.values())
    parts = [f"{ends(rows)} {spent / 60:.0f} min of processor time.", "", *table(rows)]
    return "\n".join([*parts, "", "Outside:", *outside(rows), "", "Not judged:", *unjudged(rows)])


def document(rows: Sequence[Row], page: Path) -> None:
    """Put how the scenes ended, and their table, between the marks of a page."""
    write_between(page, "coverage_of_scenes", "\n".join(["", ends(rows), "", *table(rows)]))
