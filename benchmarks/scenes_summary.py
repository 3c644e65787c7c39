"""What the table of `coverage_of_scenes` says: shares inside, how wide the bars are, targets, and what has no row."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from statistics import median
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from coverage_of_scenes import Row

TOLD: Final = 0.5  # of the value: a wider bar is shown as not known
NUMBERED: Final = {
    "impulse_Ns": "impulse", "filtered_peak_force_N": "filtered_peak", "duration_s": "contact_duration",
}  # fmt: skip
"""Keys of numbered landings that are measures."""


def share(rows: Sequence[Row], good: Callable[[Row], bool]) -> float:
    """Of the rows, how many are good; nan of none."""
    return sum(map(good, rows)) / len(rows) if rows else math.nan


def is_inside(row: Row) -> bool:
    """Whether the true error is within the bar."""
    return row.inside == "True"


def is_known(row: Row) -> bool:
    """Whether there is a bar that is told."""
    return row.inside != "" and row.bar <= TOLD * abs(row.value)


def kind_of(row: Row) -> str:
    """What is measured, whatever landing it is asked of."""
    last = row.measure.rpartition(" ")[2].removeprefix("first_").removeprefix("landing_")
    return NUMBERED.get(last, last)


def in_target(row: Row) -> bool:
    """Whether the bar is within the target of the scene."""
    return row.bar <= row.target * abs(row.value)


def width(rows: Sequence[Row]) -> float:
    """Median of the bars over the true errors, of those that have an error; nan of none."""
    ratios = [row.bar / row.true for row in rows if is_known(row) and row.true > 0]
    return median(ratios) if ratios else math.nan


def summary(rows: Sequence[Row]) -> str:
    """Tables in Markdown, and in words what was not judged."""
    judged = [row for row in rows if row.outcome == "judged"]
    asked = [row for row in judged if row.asked]
    wanted = [row for row in judged if row.asked == "measures"]
    scenes = {(row.seed, row.index): row for row in rows}
    ends = Counter(row.outcome for row in scenes.values())
    spent = sum(row.seconds for row in scenes.values())
    lines = [f"{len(scenes)} scenes in {spent / 60:.0f} min: " + ", ".join(f"{n} {end}" for end, n in ends.items()), ""]
    lines += ["| measures | with a bar | inside | median bar/error | bar <= target |", "|---|---|---|---|---|"]
    groups = {"asked for": asked, "all": judged}
    names = dict.fromkeys(kind_of(row) for row in judged)
    groups |= {f"{name}, asked for": [row for row in asked if kind_of(row) == name] for name in names}
    groups |= {f"{name}, all": [row for row in judged if kind_of(row) == name] for name in names}
    for name, group in groups.items():
        known = [row for row in group if is_known(row)]
        if not group:
            continue
        targets = [row for row in group if row in wanted]
        met = f"{share(targets, in_target):.1%} of {len(targets)}" if targets else ""
        inside = f"{sum(map(is_inside, known))} of {len(known)} ({share(known, is_inside):.1%})"
        lines.append(f"| {name} | {len(known)} of {len(group)} | {inside} | {width(known):.2g} | {met} |")
    outside = [row for row in judged if is_known(row) and not is_inside(row)]
    lines += ["", "Outside:" if outside else "None is outside."]
    lines += [
        f"- {row.seed}/{row.index} {row.seat}/{row.level}, {row.reed} ({row.about}): {row.measure}"
        f"{' (asked for)' if row.asked else ''} by {row.true / row.bar if row.bar else math.inf:.2g} bars, "
        f"{row.true / abs(row.value) if row.value else math.inf:.2g} of it"
        for row in outside
    ]
    lines += ["", "Not judged:"]
    lines += [
        f"- {row.seed}/{row.index} {row.seat}, {row.reed} ({row.about}): {row.outcome}, {row.reason}"
        for row in scenes.values()
        if row.outcome != "judged"
    ]
    return "\n".join(lines)
