"""The map: sweeps over decades, sweeps over levels, and the covering arrays, coloured by verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from impact.pictures.drawing import sheet
from tests.extremes.cell import Cell, Outcome, Verdict
from tests.extremes.table import MEANING, TOGETHER, VERDICTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: dict[Verdict, str] = {
    "right": "#2f6fad", "advised": "#9cc3e6", "barred": "#7a5ea8", "warned": "#e3b23c", "refused": "#c4c8cc",
    "slow": "#d9742b", "wrong": "#c0392b",
}  # fmt: skip
PER_ROW = 40  # cells of the covering arrays
ROW = 0.185  # inch
Rows = list[tuple[str, list[Cell]]]


def draw_map(cells: Sequence[Cell], outcomes: Mapping[str, Outcome], path: Path) -> None:
    """Draw three panels under one legend; panels without cells are left out.

    Raises:
        PictureError: matplotlib is missing.
    """
    by_axis: dict[str, list[Cell]] = {}
    for cell in cells:
        if cell.name in outcomes:
            by_axis.setdefault(cell.axis, []).append(cell)
    together = {axis: by_axis.pop(axis, []) for axis in TOGETHER}
    decades = [(axis, row) for axis, row in by_axis.items() if _spacing(row) >= 0.4]
    levels = [(axis, row) for axis, row in by_axis.items() if _spacing(row) < 0.4]
    pairs = [
        (TOGETHER[axis] if i == 0 else "", row[i : i + PER_ROW])
        for axis, row in together.items()
        for i in range(0, len(row), PER_ROW)
    ]
    panels = [(rows, draw) for rows, draw in ((decades, _decades), (levels, _levels), (pairs, _pairs)) if rows]
    heights = [len(rows) + 2.5 for rows, _ in panels]
    with sheet(path, 9.0, ROW * sum(heights) + 0.5) as figure:
        axes = figure.subplots(len(panels), 1, height_ratios=heights, squeeze=False)[:, 0]
        for place, (rows, draw) in zip(axes, panels, strict=True):
            _frame(place, rows)
            draw(place, rows, outcomes)
        count = {v: sum(o.verdict == v for o in outcomes.values()) for v in VERDICTS}
        for verdict in VERDICTS:
            label = f"{MEANING[verdict]} ({count[verdict]})"
            axes[0].fill_between([], [], color=COLOURS[verdict], label=label)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4, columnspacing=1.2, handlelength=1.2)


def _spacing(row: Sequence[Cell]) -> float:
    """Return the smallest distance of two decades of a row; 0 if it has none, or more than one cell at zero."""
    decades = sorted(cell.decade for cell in row)
    if any(math.isnan(d) for d in decades):
        return 0.0
    return min((b - a if b > a else 0.0 for a, b in pairwise(decades)), default=0.0)


def _frame(axes: Axes, rows: Rows) -> None:
    axes.set(ylim=(len(rows), 0), yticks=[y + 0.5 for y in range(len(rows))])
    axes.set_yticklabels([name for name, _ in rows], fontsize=7.5)
    axes.tick_params(length=0, axis="y")
    axes.grid(False)
    axes.spines["left"].set_visible(False)


def _decades(axes: Axes, rows: Rows, outcomes: Mapping[str, Outcome]) -> None:
    finite = [cell.decade for _, row in rows for cell in row if math.isfinite(cell.decade)]
    low, high = math.floor(min(finite)), math.ceil(max(finite))
    zero = low - 2
    for y, (_, row) in enumerate(rows):
        width = min(1.0, _spacing(row))
        for cell in row:
            x = cell.decade if math.isfinite(cell.decade) else zero
            _square(axes, x - width / 2, y, width, outcomes[cell.name].verdict)
    ticks = [d for d in range(low, high + 1) if d % 4 == 0]
    axes.set_xticks([zero, *ticks], ["0", *(f"$10^{{{d}}}$" for d in ticks)])
    axes.set(xlim=(zero - 0.6, high + 0.6), xlabel="value of the number swept")
    axes.grid(True, axis="x")
    axes.set_title("a  One number at a time, over its decades")


def _levels(axes: Axes, rows: Rows, outcomes: Mapping[str, Outcome]) -> None:
    width = max(len(row) for _, row in rows)
    for y, (_, row) in enumerate(rows):
        for x, cell in enumerate(row):
            verdict = outcomes[cell.name].verdict
            _square(axes, x, y, 1.0, verdict)
            colour = "white" if verdict in ("right", "barred", "slow", "wrong") else "black"
            axes.text(
                x + 0.5, y + 0.53, _label(cell), ha="center", va="center", fontsize=5, color=colour, linespacing=0.9
            )
    axes.set(xlim=(0, width), xticks=[], xlabel="levels, each named in its cell")
    axes.spines["bottom"].set_visible(False)
    axes.set_title("b  One number at a time, at chosen levels")


def _pairs(axes: Axes, rows: Rows, outcomes: Mapping[str, Outcome]) -> None:
    for y, (_, row) in enumerate(rows):
        for x, cell in enumerate(row):
            _square(axes, x, y, 1.0, outcomes[cell.name].verdict)
    axes.set(xlim=(0, PER_ROW), xticks=[], xlabel="runs, in the order of the table")
    axes.spines["bottom"].set_visible(False)
    axes.set_title("c  All numbers at once: covering arrays and random scenes")


def _square(axes: Axes, x: float, y: float, width: float, verdict: Verdict) -> None:
    from matplotlib.patches import Rectangle  # pictures are optional

    margin = 0.06 * width
    axes.add_patch(Rectangle((x + margin, y + 0.07), width - 2 * margin, 0.86, color=COLOURS[verdict], linewidth=0))


def _label(cell: Cell) -> str:
    """Return the level in few letters: 1e-9 for 1e-09, 1-1e-9 for 0.999999999, names in two lines."""
    try:
        value = float(cell.value)
    except ValueError:
        words = cell.value
        return words.replace(", ", ",\n", 1) if len(words) > 9 else words
    text = f"1{value - 1:+.0e}" if 0 < abs(value - 1) < 1e-6 else cell.value
    return text.replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
