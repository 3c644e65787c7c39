"""Reports of a study: tables as CSV and pictures, as far as they are meaningful for its design."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, SKY, sheet, try_draw
from impact.quantities import in_digits
from seatfem.readings import BAR
from seatfem.study.sweep import effects
from seatfem.study.sweep.answers import Axis, axis_of, name_ticks
from seatfem.study.sweep.effects import CONFIDENCE, PERCENTILES, Band, Effect, Indices, drawn_rows, front, objectives
from seatfem.study.sweep.maps import NAMES, draw_limits, draw_map, mark_foot
from seatfem.study.sweep.study import Optimise
from seatfem.study.sweep.table import Columns, StudyTable, in_stated_units, write_columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST: Final = 6  # largest number of rows or columns of panels: the first ones are shown
LABELS: Final = 8  # largest number of scenes on a front that are labelled
PER_ROW: Final = 3
PER_INCH: Final = 17  # characters of small print
LINE: Final = 24  # characters in a line of a label beside a panel
FEW: Final = 60  # largest number of scenes that are drawn with error bars


def _titled(figure: Figure, table: StudyTable, what: str, words: str = "", *, marked: bool = False) -> None:
    """Write the title, and below it ``words`` and the number of omitted scenes; ``marked``: whether these are drawn."""
    figure.suptitle(f"{table.study.heading}: {what}")
    marks = ", ".join(f"{name}: {each}" for each, name in NAMES.items() if marked and each in table.standings)
    lines = [words, table.left_out_in_words(), marks]
    if any(lines):
        width = int(PER_INCH * figure.get_figwidth())
        figure.supxlabel("\n".join(part for line in lines for part in textwrap.wrap(line, width)), fontsize=7)


def grid_of(figure: Figure, count: int, **sharing: Any) -> list[Axes]:
    """Return ``count`` panels in rows of `PER_ROW`; the rest of the last row stays empty."""
    columns = min(count, PER_ROW)
    panels = list(figure.subplots(math.ceil(count / columns), columns, squeeze=False, **sharing).flat)
    for axes in panels[count:]:
        axes.set_axis_off()
    return panels[:count]


def size_of(count: int) -> tuple[int, int]:
    """Return the numbers of columns and rows of ``count`` panels."""
    return min(count, PER_ROW), math.ceil(count / PER_ROW)


def draw_effects(table: StudyTable, effects: Sequence[Effect], path: Path) -> None:
    """Draw a panel for each parameter (columns) and measure (rows): every scene, and the mean with its uncertainty,
    standard error over the other keys and error bar together.

    Raises `PictureError` if matplotlib is missing, as do all functions of this module.
    """
    parameters = [axis_of(table, name) for name in list(dict.fromkeys(each.parameter for each in effects))[:MOST]]
    measures = [axis_of(table, name) for name in list(dict.fromkeys(each.measure for each in effects))[:MOST]]
    shown = {(each.measure, each.parameter): each for each in effects}
    with sheet(path, 0.8 + 2.7 * len(parameters), 0.9 + 2.1 * len(measures)) as figure:
        words = "blue: mean and its uncertainty (standard error over the other keys plus error bar); grey: scenes"
        _titled(figure, table, "main effects", words, marked=True)
        panels = figure.subplots(len(measures), len(parameters), squeeze=False, sharex="col", sharey="row")
        for row, measure in enumerate(measures):
            panels[row, 0].set_ylabel(_wrapped(measure.label))
            for column, parameter in enumerate(parameters):
                _effect(panels[row, column], table, shown[measure.name, parameter.name], measure)
        for axes, parameter in zip(panels[-1], parameters, strict=True):
            axes.set_xlabel(parameter.label)


def _wrapped(label: str) -> str:
    """Return a label in lines that fit beside a panel."""
    words, bracket, unit = label.partition("[")
    return "\n".join(textwrap.wrap(words + bracket + unit.replace(" ", "\N{NO-BREAK SPACE}"), LINE))


def _effect(axes: Axes, table: StudyTable, effect: Effect, measure: Axis) -> None:
    names = [value for value in effect.at if isinstance(value, str)]
    if names:
        x = np.array([names.index(str(value)) for value in table.columns[effect.parameter]], dtype=float)
        axes.set_xticks(range(len(names)), name_ticks(names))
        at = np.arange(len(names), dtype=float)
    else:
        x, at = table.numbers(effect.parameter), np.array(effect.at, dtype=float)
        axes.locator_params(axis="x", nbins=5)
    _scenes(axes, table, x, measure)
    mean = measure.factor * effect.mean
    if len(table) > len(at):  # otherwise every mean is of one scene
        error = measure.factor * (np.nan_to_num(effect.error) + np.nan_to_num(effect.bar))
        axes.errorbar(at, mean, error, color=BLUE, marker="o", markersize=3.5, capsize=2, zorder=3)
    elif not names:
        axes.plot(at, mean, color=BLUE, linewidth=0.8, zorder=2)


def _scenes(axes: Axes, table: StudyTable, x: np.ndarray, measure: Axis) -> None:
    """Draw every scene, with its error bar if there are few; scenes that do not count are hollow, at the bottom."""
    y, bars = (measure.factor * table.values(name) for name in (measure.name, BAR + measure.name))
    size = 3.0 if len(table) <= FEW else 1.8
    if len(table) <= FEW and np.isfinite(bars).any():
        axes.errorbar(x, y, np.nan_to_num(bars), linestyle="", color=GREY, elinewidth=0.7, capsize=1.5, zorder=1.8)
    axes.plot(x, y, "o", color=GREY, markersize=size, markeredgewidth=0, alpha=0.7, zorder=1.9)
    _left_out(axes, table, x, measure.name)


def _left_out(axes: Axes, table: StudyTable, x: np.ndarray, measure: str) -> None:
    """Mark scenes that do not count for a measure at their abscissae, by what they lack."""
    standings, counted = np.array(table.standings), table.counted(measure)
    for standing in NAMES:
        mark_foot(axes, x[(standings == standing) & ~counted], standing, 4)


def draw_indices(table: StudyTable, found: Sequence[Indices], path: Path) -> None:
    """Draw the first-order and total index of each key with its confidence interval, one panel per measure."""
    shown = found[:MOST]
    places = np.arange(len(table.parameters), dtype=float)
    columns, rows = size_of(len(shown))
    with sheet(path, 1.6 + 2.6 * columns, 0.9 + rows * (0.7 + 0.42 * len(places))) as figure:
        _titled(figure, table, f"Sobol indices, {100 * CONFIDENCE:g} % confidence")
        panels = grid_of(figure, len(shown), sharex=True, sharey=True)
        for axes, each in zip(panels, shown, strict=True):
            for shift, colour, label, value, interval in (
                (-0.19, BLUE, "first order", each.first, each.first_interval),
                (0.19, ORANGE, "total", each.total, each.total_interval),
            ):
                axes.barh(places + shift, value, 0.36, color=colour, label=label, zorder=2)
                axes.errorbar(value, places + shift, xerr=np.abs(interval - value), linestyle="", color="black",
                              capsize=2, elinewidth=0.8, zorder=3)  # fmt: skip
            axes.set_title(axis_of(table, each.measure).words)
            axes.set_yticks(places, [axis_of(table, name).words for name in table.parameters])
            axes.axvline(0.0, color="black", linewidth=0.7)
            axes.set_xlabel("share of the variance")
        panels[0].invert_yaxis()
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center")


def draw_bands(table: StudyTable, bands: Sequence[Band], path: Path) -> None:
    """Draw the cumulative distribution of the scenes, with the percentiles, one panel per measure."""
    shown = bands[:MOST]
    columns, rows = size_of(len(shown))
    with sheet(path, 0.7 + 2.9 * columns, 0.7 + 2.5 * rows) as figure:
        _titled(figure, table, "tolerance bands")
        panels = grid_of(figure, len(shown), sharey=True)
        for axes, band in zip(panels, shown, strict=True):
            count, measure = len(band.sample), axis_of(table, band.measure)
            places, (lows, highs) = measure.factor * band.at, measure.factor * band.interval
            axes.axvspan(places[0], places[-1], color=SKY, alpha=0.25, linewidth=0)
            axes.step(measure.factor * band.sample, 100 * (np.arange(count) + 1) / count, where="post", color=BLUE)
            for share, at, low, high in zip(PERCENTILES, places, lows, highs, strict=True):
                axes.plot([at], [share], "D", color=ORANGE, markersize=4, zorder=3)
                if math.isfinite(low) and math.isfinite(high):
                    axes.plot([low, high], [share, share], color=ORANGE, linewidth=1.6, zorder=2.5)
                side = 1 if share < 60 else -1
                axes.annotate(f"{share:g} %: {at:.4g}", (at, share), (7 * side, 0), textcoords="offset points",
                              fontsize=7.5, ha="left" if side > 0 else "right", va="center", zorder=4,
                              bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1})  # fmt: skip
            bar = f"{in_digits(measure.factor * band.bar, 2)} {measure.unit}".rstrip()
            axes.set_title(f"{count} scenes" + f", error bars up to {bar}" * math.isfinite(band.bar))
            axes.set_xlabel(measure.label)
            axes.set_ylim(-3, 103)
            axes.locator_params(axis="x", nbins=5)
        for axes in panels[::columns]:
            axes.set_ylabel("scenes below [%]")


def draw_scatter(table: StudyTable, names: Sequence[str], path: Path) -> None:
    """Draw every column against every other, with histograms in the diagonal."""
    rows = (drawn_rows(table) | (not table.study.is_drawn)) & table.has_numbers & ~table.left_out
    columns, n = {name: axis_of(table, name) for name in names}, len(names)
    data = {name: axis.factor * table.numbers(name)[rows] for name, axis in columns.items()}
    with sheet(path, 0.8 + 1.6 * n, 0.8 + 1.5 * n) as figure:
        _titled(figure, table, f"{len(data[names[0]])} scenes")
        panels = figure.subplots(n, n, squeeze=False, sharex="col")
        for i, below in enumerate(names):
            for j, right in enumerate(names):
                axes = panels[i, j]
                if i == j:
                    finite = data[right][np.isfinite(data[right])]
                    axes.hist(finite, bins=12, color=SKY, edgecolor="white", linewidth=0.5)
                    axes.set_yticks([])
                else:
                    measured = below in table.measures or right in table.measures
                    axes.plot(data[right], data[below], "o", color=BLUE if measured else GREY, markersize=2.2,
                              markeredgewidth=0, alpha=0.7)  # fmt: skip
                    axes.margins(0.08)
                if j > 0:
                    axes.set_yticklabels([])
                if i == n - 1:
                    axes.set_xlabel(_wrapped(columns[right].label), fontsize=7)
                if j == 0:
                    axes.set_ylabel(_wrapped(columns[below].label), fontsize=7)
                axes.tick_params(labelsize=6.5)


def draw_front(table: StudyTable, path: Path) -> None:
    """Draw every scene by the two measures; those on the Pareto front are joined by a line and numbered."""
    (across, more_across), (up, more_up) = objectives(table)
    first, second = axis_of(table, across), axis_of(table, up)
    x, y, best = first.factor * table.values(across), second.factor * table.values(up), front(table)
    with sheet(path, 5.2, 4.0) as figure:
        _titled(figure, table, "Pareto front")
        axes = figure.add_subplot()
        _scenes(axes, table, x, second)
        axes.plot(x[best], y[best], color=GREEN, marker="o", markersize=4.5, zorder=3, label="beaten by none")
        for place in best[:: math.ceil(len(best) / LABELS)]:
            words = f"scene {table.columns['scene'][place]}"
            axes.annotate(words, (x[place], y[place]), (7, -4), textcoords="offset points", fontsize=7, va="top")
        axes.set_xlabel(f"{first.label} ({'more' if more_across else 'less'} is better)")
        axes.set_ylabel(f"{second.label} ({'more' if more_up else 'less'} is better)")
        axes.legend()


def draw_history(
    table: StudyTable, goal: Optimise, within: Sequence[bool], confirmed: Sequence[tuple[int, float, float]], path: Path
) -> None:
    """Draw the measure of every scene of a search, the best so far, and the confirmed: number, value, error bar."""
    measure, number, inside = axis_of(table, goal.measure), table.numbers("scene"), np.array(within)
    value = measure.factor * table.values(goal.measure)
    best = goal.sign * np.fmin.accumulate(np.where(inside, goal.sign * value, np.nan))
    with sheet(path, 5.6, 3.6) as figure:
        _titled(figure, table, f"{'least' if goal.minimise else 'greatest'} {measure.words}", marked=True)
        axes = figure.add_subplot()
        axes.plot(number[inside], value[inside], "o", color=GREY, markersize=3.5, label="within the limits")
        if not inside.all():
            axes.plot(number[~inside], value[~inside], "x", color=ORANGE, markersize=4.5, label="outside")
        axes.step(number, best, where="post", color=BLUE, label="best so far")
        _left_out(axes, table, number, goal.measure)
        at, *points = np.array(confirmed, dtype=float).T
        measured, bars = measure.factor * np.array(points)
        axes.errorbar(at, measured, np.nan_to_num(bars), linestyle="", color=GREEN, marker="D", markersize=4.5,
                      capsize=3, zorder=3, label="at the target of accuracy")  # fmt: skip
        axes.set_xlabel("scene of the search")
        axes.set_ylabel(measure.label)
        axes.legend()


SCATTERED: Final = 8  # largest number of columns of a scatter matrix
LEAST: Final = 5  # fewest scenes of a scatter matrix

Report = tuple[str, Columns | None, Callable[[Path], None]]
"""Name of a chart, its table or ``None``, and the function that draws it."""


def reports_of(table: StudyTable) -> Iterator[Report]:
    """Yield all reports that are meaningful."""
    if table.study.limits and (varied := len(effects.varying(table))) in (1, 2):
        yield ("limits", None, partial(draw_limits, table)) if varied == 1 else ("map", None, partial(draw_map, table))
    if main := effects.main_effects(table):
        yield "main_effects", effects.effects_columns(table, main), partial(draw_effects, table, main)
    if indices := effects.sobol_indices(table):
        columns = effects.indices_columns(table, indices)
        yield "sobol_indices", columns, partial(draw_indices, table, indices)
    if bands := effects.tolerance_bands(table):
        yield "percentiles", effects.bands_columns(table, bands), partial(draw_bands, table, bands)
    numeric = [name for name in effects.varying(table) if not table.is_text(name)] + effects.varying_measures(table)
    if len(numeric) > 2 and table.has_numbers.sum() >= LEAST:
        yield "scatter", None, partial(draw_scatter, table, numeric[:SCATTERED])
    if best := effects.front(table):
        rows = {name: [column[place] for place in best] for name, column in table.columns.items()}
        yield "pareto", rows, partial(draw_front, table)


def write_reports(table: StudyTable, folder: Path, *, pictures: bool = True) -> tuple[list[Path], list[str]]:
    """Write the reports; return the files, and why pictures were not drawn. Raises `OSError` if a CSV fails."""
    files, gaps = [], []
    for name, columns, draw in reports_of(table):
        if columns is not None:
            write_columns(folder / f"{name}.csv", in_stated_units(table.study, columns))
            files.append(folder / f"{name}.csv")
        if not pictures:
            continue
        if gap := try_draw(draw, folder / f"{name}.png"):
            gaps.append(gap)
        else:
            files.append(folder / f"{name}.png")
    return files, gaps
