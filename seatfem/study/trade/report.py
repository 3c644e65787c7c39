"""Output of the trade of speed for accuracy: CSV, JSON, text, and a chart of time against error."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.files import csv_table, safe_files
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet
from seatfem.study.impacts.landings import STATUS
from seatfem.study.scene.measures import key_of
from seatfem.study.sweep.charts import grid_of, size_of
from seatfem.study.trade.rungs import AS_FILED, MEMORY, OWN_CHOICE, Point
from seatfem.study.trade.trade import Trade, processor_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


def rows_of(trade: Trade) -> list[dict[str, object]]:
    """Return one row per point, with units in the keys; NaN for a point that did not end."""
    fronts = {name: trade.front(name) for name in trade.measures}
    together = trade.front()
    rows = []
    for point in trade.points:
        outcome, name = trade.outcomes[point.name], point.name
        summary: Mapping[str, Any] = outcome.summary
        row: dict[str, object] = {
            "name": name,
            "family": point.family,
            "varied": point.varied,
            "state": outcome.state,
            STATUS: summary.get(STATUS, ""),
            "processor_s": processor_of(outcome),
            "wall_s": outcome.wall,
            "memory_MB": summary.get(MEMORY, math.nan) / 1e6,
            "unknowns": summary.get("seat_dof", 0),
            "time_step_s": summary.get("time_step_s", math.nan),
        }
        row |= {key_of(m): summary.get(m, math.nan) for m in trade.measures}
        row |= {f"error_{m}": trade.error(name, m) for m in trade.measures}
        row |= {f"front_{m}": name in fronts[m] for m in trade.measures}
        row |= {"front": name in together, "reason": " ".join(outcome.message.split())}
        rows.append(row)
    return rows


def summary_of(trade: Trade) -> dict[str, object]:
    """Return target, reference, front, and where the run's own choice stands, as a dictionary."""
    return {
        "title": trade.title,
        "target": trade.target,
        "measures": list(trade.measures),
        "reference": trade.reference,
        "floor": {m: trade.floor[m] for m in trade.measures},
        "front": list(trade.front()),
        "choice_s": trade.choosing,
        "choice_error": {m: trade.error(OWN_CHOICE, m) for m in trade.measures},
        "choice_excess": trade.excess(OWN_CHOICE),
        "choice_excess_of_measure": {m: trade.excess(OWN_CHOICE, m) for m in trade.measures},
        "choice_excess_at_target": trade.excess(OWN_CHOICE, error=trade.target),
    }


def write_trade(trade: Trade, csv_path: Path, json_path: Path) -> None:
    """Write the table as CSV; summary, table and values of each point as JSON. Files are whole or absent."""
    rows = rows_of(trade)
    words = [{key: str(v) if isinstance(v, bool) else v for key, v in row.items()} for row in rows]
    csv_table.write_csv(csv_path, rows[0], (row.values() for row in words), digits=7)
    points = [row | {"values": dict(point.values)} for row, point in zip(rows, trade.points, strict=True)]
    data = csv_table.without_nan(summary_of(trade) | {"points": points})
    safe_files.write_whole(json_path, (json.dumps(data, indent=1) + "\n").encode())


def in_words(trade: Trade) -> str:
    """Return as text the number of points that ended, the front, and cost and error of the run's own choice."""
    ended = len(trade.done())
    floors = ", ".join(f"{m.replace('_', ' ')} {trade.floor[m]:.1e}" for m in trade.measures)
    lines = [f"{ended} of {len(trade.points)} points ended; the reference itself is uncertain by: {floors}"]
    lines += [out] if (out := trade.left_out_in_words()) else []
    lines.append("Pareto front, processor time and worst relative error:")
    lines += [f"  {trade.cost(n):9.3g} s  {trade.trusted_error(n):8.1e}  {n}" for n in trade.front()]
    lines += [_place(trade, name) for name in MARKS if name in trade.outcomes]
    return "\n".join(lines)


def _place(trade: Trade, name: str) -> str:
    outcome, error = trade.outcomes[name], trade.trusted_error(name)
    if outcome.state != "done":
        return f"{name}: {outcome.state}, {outcome.message}"
    cost = f"{name}: {trade.cost(name):.3g} s"
    if math.isnan(error):
        return f"{cost}, no error: {outcome.summary.get(STATUS, 'a measure has no value')}"
    verdict = "meets" if error <= trade.target else "misses"
    return (
        f"{cost}, error {error:.1e}, {verdict} the target {trade.target:g}; "
        f"{trade.excess(name):.2f} times the cost of the front"
    )


COLOURS: Final = {
    "spring": GREY,
    "rod": ORANGE,
    "axisymmetric": BLUE,
    "harmonics": BLUE,
    "sector": GREEN,
    "3d": PURPLE,
    "closed form": SKY,
}
"""Colour of each level of the seat's model."""
SYMBOLS: Final = "ov^<>DXPpHh8s"
"""Markers of what is varied, in the order in which it first appears."""
MARKS: Final = {OWN_CHOICE: ("*", 13.0), AS_FILED: ("d", 7.0)}


def draw_trade(trade: Trade, path: Path) -> None:
    """Draw one panel for each measure the scene asks for.

    Errors below the reference's own uncertainty (shaded) are drawn at its edge. Line: Pareto front.

    Raises `PictureError`: matplotlib is missing.
    """
    columns, rows = size_of(len(trade.measures))
    with sheet(path, 0.6 + 3.3 * columns, 1.5 + 3.0 * rows) as figure:
        figure.suptitle(f"{trade.title}: speed for accuracy")
        for axes, measure in zip(grid_of(figure, len(trade.measures), sharex=True), trade.measures, strict=True):
            _panel(axes, trade, measure)
        figure.legend(handles=_legend(trade), loc="outside lower center", ncols=2 * columns + 1, columnspacing=1.2,
                      handletextpad=0.3)  # fmt: skip


def _symbols(trade: Trade) -> Mapping[str, str]:
    """Return the marker of each quantity that is varied."""
    varied = dict.fromkeys(point.varied for point in _others(trade))
    return {name: SYMBOLS[number % len(SYMBOLS)] for number, name in enumerate(varied)}


def _others(trade: Trade) -> Sequence[Point]:
    """Return the points that ended and have no mark of their own."""
    return [point for point in trade.done() if point.name not in MARKS]


def _panel(axes: Axes, trade: Trade, measure: str) -> None:
    target, floor, symbols = 100 * trade.target, 100 * trade.floor[measure], _symbols(trade)
    places = {p.name: (trade.cost(p.name), 100 * trade.trusted_error(p.name, measure)) for p in trade.done()}
    axes.set(xscale="log", yscale="log", xlabel="processor time [s]", ylabel="error [%]")
    axes.set_title(measure.replace("_", " ").capitalize())
    for point in _others(trade):
        axes.plot(
            *places[point.name], marker=symbols[point.varied], linestyle="", color=COLOURS[point.family],
            markersize=5, alpha=0.85, markeredgecolor="white", markeredgewidth=0.4, zorder=3,
        )  # fmt: skip
    for name in MARKS.keys() & places.keys():
        axes.plot(*places[name], **_mark(name), zorder=5)
    costs, errors = zip(*places.values(), strict=True)
    shown = [*(error for error in errors if math.isfinite(error) and error > 0), target]
    low, high = max(min(shown) / 4, 1e-12), 2.5 * max(shown)  # from below the floor to above the largest error
    steps = [places[name] for name in trade.front(measure)]
    steps.append((max(costs), steps[-1][1]))
    axes.plot(*zip(*steps, strict=True), drawstyle="steps-post", color="black", linewidth=1.0, zorder=2)
    axes.axhline(target, color="black", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1.6)
    axes.set_ylim(low, high)
    _ticks(axes.xaxis, math.log10(max(costs) / min(costs)))
    _ticks(axes.yaxis, math.log10(high / low))
    axes.axhspan(low, floor, color=GREY, alpha=0.22, linewidth=0, zorder=1.4)
    axes.annotate(
        "target", (1.0, target), (-2, 2), xycoords=("axes fraction", "data"),
        textcoords="offset points", ha="right", va="bottom", fontsize=7.5,
    )  # fmt: skip
    axes.annotate(
        "the reference's own uncertainty", (0.02, low), (0, 3), xycoords=("axes fraction", "data"),
        textcoords="offset points", ha="left", va="bottom", fontsize=7, color="#555555",
    )  # fmt: skip


def _mark(name: str) -> dict[str, Any]:
    marker, size = MARKS[name]
    style = {"markerfacecolor": "#F0E442", "markeredgecolor": "black", "markeredgewidth": 0.9}
    return {"marker": marker, "markersize": size, "linestyle": "", **style}


def _ticks(axis: Axis, decades: float) -> None:
    """Set plain numbers as labels, at 1, 2 and 5 if there are few decades, and none on minor ticks."""
    from matplotlib.ticker import LogLocator, NullFormatter  # pictures are optional

    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2 else (1,), numticks=9))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(NullFormatter())


def _legend(trade: Trade) -> Sequence[Any]:
    """Return the legend: levels by colour, varied keys by marker, then the lines."""
    from matplotlib.lines import Line2D  # pictures are optional

    families = dict.fromkeys(point.family for point in _others(trade))
    handles = [Line2D([], [], color=COLOURS[f], marker="o", linestyle="", markersize=7, label=f) for f in families]
    handles += [
        Line2D([], [], color="#333333", marker=marker, linestyle="", markersize=5, label=varied)
        for varied, marker in _symbols(trade).items()
    ]
    handles.append(Line2D([], [], color="black", linewidth=1.0, label="Pareto front"))
    return handles + [Line2D([], [], label=name, **_mark(name)) for name in MARKS if name in trade.outcomes]
