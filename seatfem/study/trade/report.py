"""Output of the trade of speed for accuracy: CSV, JSON, text, and a chart of time against error."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.files import csv_table, safe_files
from impact.pictures.drawing import COLOURS, GREY, load_matplotlib, sheet
from seatfem.study.impacts.landings import STATUS
from seatfem.study.method import MODEL
from seatfem.study.scene.measures import key_of
from seatfem.study.sweep.charts import grid_of, size_of
from seatfem.study.trade.trade import AS_FILED, MEMORY, OWN_CHOICE, Trade, processor_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis


def rows_of(trade: Trade) -> list[dict[str, object]]:
    """Return one row per point, with units in the keys; NaN for a point that did not end."""
    front, rows = trade.front(), []
    for point in trade.points:
        outcome, name = trade.outcomes[point.name], point.name
        summary: Mapping[str, Any] = outcome.summary
        row: dict[str, object] = {
            "name": name,
            "model": point.values.get(MODEL, ""),
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
        row |= {"front": name in front, "reason": " ".join(outcome.message.split())}
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


def describe_trade(trade: Trade) -> str:
    """Return as text the number of points that ended, the front, and cost and error of the run's own choice."""
    ended = len(trade.done())
    floors = ", ".join(f"{m.replace('_', ' ')} {trade.floor[m]:.1e}" for m in trade.measures)
    lines = [f"{ended} of {len(trade.points)} points ended; the reference itself is uncertain by: {floors}"]
    lines += [out] if (out := trade.left_out_in_words()) else []
    lines.append("Pareto front, processor time and worst relative error:")
    lines += [f"  {trade.cost(n):9.3g} s  {trade.trusted_error(n):8.1e}  {n}" for n in trade.front()]
    for name in MARKS:
        if (outcome := trade.outcomes.get(name)) is not None:
            verdict = "meets" if trade.trusted_error(name) <= trade.target else "misses"
            words = f"error {trade.trusted_error(name):.1e}, {verdict} the target {trade.target:g}; "
            words += f"{trade.excess(name):.2f} times the cost of the front"
            if math.isnan(trade.trusted_error(name)):
                words = f"no error: {outcome.message or outcome.summary.get(STATUS, 'a measure has no value')}"
            lines.append(f"{name}: {processor_of(outcome):.3g} s, {words}")
    return "\n".join(lines)


MARKS: Final[Mapping[str, dict[str, Any]]] = {
    OWN_CHOICE: {"marker": "*", "markersize": 13, "color": "#F0E442", "markeredgecolor": "black", "zorder": 5},
    AS_FILED: {"marker": "d", "markersize": 7, "color": "#F0E442", "markeredgecolor": "black", "zorder": 5},
}
"""Style of the points of which words tell where they stand."""


def draw_trade(trade: Trade, path: Path) -> None:
    """Draw one panel for each measure the scene asks for.

    Errors below the reference's own uncertainty (shaded) are drawn at its edge. Line: Pareto front.

    Raises `PictureError`: matplotlib is missing.
    """
    columns, rows = size_of(len(trade.measures))
    with sheet(path, 0.6 + 3.3 * columns, 1.5 + 3.0 * rows) as figure:
        figure.suptitle(f"{trade.title}: speed for accuracy")
        panels = grid_of(figure, len(trade.measures), sharex=True)
        for axes, measure in zip(panels, trade.measures, strict=True):
            _panel(axes, trade, measure)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1 + columns)


def _panel(axes: Axes, trade: Trade, measure: str) -> None:
    target, floor, groups = 100 * trade.target, 100 * trade.floor[measure], dict[str, list[str]]()
    for point in trade.done():
        groups.setdefault(point.name if point.name in MARKS else point.varied, []).append(point.name)

    def places(names: Iterable[str]) -> tuple[list[float], list[float]]:
        return [*map(trade.cost, names)], [100 * trade.trusted_error(name, measure) for name in names]

    for (label, names), marker, colour in zip(groups.items(), cycle("ov^<>DXPpHh8s"), cycle(COLOURS), strict=False):
        usual = {"marker": marker, "markersize": 5, "color": colour, "markeredgecolor": "white", "zorder": 3}
        axes.plot(*places(names), linestyle="", markeredgewidth=0.5, label=label, **MARKS.get(label, usual))
    (costs, errors), (on_front, least) = places([point.name for point in trade.done()]), places(trade.front(measure))
    shown = [*(error for error in errors if math.isfinite(error) and error > 0), target]
    low, high = max(min(shown) / 4, 1e-12), 2.5 * max(shown)  # from below the floor to above the largest error
    axes.step(
        [*on_front, max(costs)], [*least, least[-1]], "k", where="post", linewidth=1, label="Pareto front", zorder=2
    )
    axes.axhline(target, color="black", linewidth=0.8, linestyle=(0, (4, 3)), label="target")
    axes.axhspan(low, floor, color=GREY, alpha=0.22, linewidth=0, label="the reference's own uncertainty")
    axes.set(xscale="log", yscale="log", xlabel="processor time [s]", ylabel="error [%]", ylim=(low, high))
    axes.set_title(measure.replace("_", " ").capitalize())
    _ticks(axes.xaxis, math.log10(max(costs) / min(costs)))
    _ticks(axes.yaxis, math.log10(high / low))


def _ticks(axis: Axis, decades: float) -> None:
    """Set plain numbers as labels, at 1, 2 and 5 if there are few decades, and none on minor ticks."""
    ticker = load_matplotlib().ticker
    axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5) if decades < 2 else (1,), numticks=9))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(ticker.NullFormatter())
