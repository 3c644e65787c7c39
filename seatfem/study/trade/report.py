"""Output of the trade of speed for accuracy: CSV, JSON, text, and a chart of time against error."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.files import csv_table, safe_files
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet
from seatfem.study.impacts.landings import STATUS
from seatfem.study.scene.measures import key_of
from seatfem.study.sweep.charts import grid_of, size_of
from seatfem.study.sweep.runner import Outcome
from seatfem.study.trade.rungs import ABOUT, BY_HAND, COSTS
from seatfem.study.trade.trade import AS_FILED, PLANNED, Trade, processor_of

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
            "start_s": summary.get("start_s", math.nan),
            "memory_MB": summary.get("memory_bytes", math.nan) / 1e6,
            "unknowns": summary.get("seat_dof", 0),
            "poles": summary.get("seat_poles", 0),
            "time_step_s": summary.get("time_step_s", math.nan),
        }
        row |= {key_of(m): summary.get(m, math.nan) for m in trade.measures}
        row |= {f"error_{m}": trade.error(name, m) for m in trade.measures}
        row |= {f"front_{m}": name in fronts[m] for m in trade.measures}
        row |= {"front": name in together, "reason": " ".join(outcome.message.split())}
        rows.append(row)
    return rows


def summary_of(trade: Trade) -> dict[str, object]:
    """Return target, reference, front and the planner's results as a dictionary."""
    exact = trade.outcomes[trade.reference]
    planner = trade.outcomes[PLANNED]
    return {
        "title": trade.title,
        "target": trade.target,
        "measures": list(trade.measures),
        "reference": trade.reference,
        "reference_values": {m: exact.summary[m] for m in trade.measures},
        "reference_processor_s": processor_of(exact),
        "floor": {m: trade.floor[m] for m in trade.measures},
        "front": list(trade.front()),
        "planner_state": planner.state,
        "planner_reason": planner.message,
        "planner_processor_s": processor_of(planner),
        "planner_planning_s": trade.planning,
        "planner_error": {m: trade.error(PLANNED, m) for m in trade.measures},
        "planner_excess": trade.excess(PLANNED),
        "planner_excess_of_measure": {m: trade.excess(PLANNED, m) for m in trade.measures},
        "planner_excess_at_target": trade.excess_at_target(PLANNED),
        "planner_excess_with_guesses": trade.excess(PLANNED, guesses=True),
    }


def write_trade(trade: Trade, csv_path: Path, json_path: Path) -> None:
    """Write the table as CSV; table, settings and summary as JSON. Files are whole or absent."""
    rows = [{key: str(v) if isinstance(v, bool) else v for key, v in row.items()} for row in rows_of(trade)]
    csv_table.write_csv(csv_path, rows[0], (row.values() for row in rows), digits=7)
    points = [asdict(point) | {"outcome": _as_json(trade.outcomes[point.name])} for point in trade.points]
    data = summary_of(trade) | {"reference_outcome": _as_json(trade.outcomes[trade.reference]), "points": points}
    with safe_files.whole_file(json_path) as temporary:
        temporary.write_text(json.dumps(csv_table.without_nan(data), indent=1) + "\n", encoding="utf-8")


def _as_json(outcome: Outcome) -> dict[str, object]:
    """Return an outcome with its costs, its measures, and the data `ABOUT` the point."""
    values = dict(outcome.summary)
    processor, memory, start = (values.pop(key, None) for key in COSTS)
    about: dict[str, object] = {key: values.pop(key) for key in ABOUT if key in values}
    stages = {key: values.pop(key) for key in outcome.summary if key.startswith("stage_")}
    about |= {"stages_s": {key[len("stage_") : -len("_s")]: spent for key, spent in stages.items()}} if stages else {}
    costs = {"wall": outcome.wall, "processor": processor, "memory": memory, "start": start}
    return {"state": outcome.state, "reason": outcome.message, **costs, "values": values, "about": about}


def in_words(trade: Trade) -> str:
    """Return as text the number of points that ended, the front, and the planner's cost and error."""
    ended = len(trade.done())
    floors = ", ".join(f"{m.replace('_', ' ')} {trade.floor[m]:.1e}" for m in trade.measures)
    lines = [f"{ended} of {len(trade.points)} points ended; the reference itself is uncertain by: {floors}"]
    lines += [out] if (out := trade.left_out_in_words()) else []
    lines.append("Pareto front, processor time and worst relative error:")
    lines += [f"  {trade.cost(n):9.3g} s  {trade.trusted_error(n):8.1e}  {n}" for n in trade.front()]
    for name in (PLANNED, AS_FILED):
        if name in trade.outcomes:
            lines.append(_place(trade, name))
    return "\n".join(lines)


def _place(trade: Trade, name: str) -> str:
    outcome = trade.outcomes[name]
    if outcome.state != "done":
        return f"{name}: {outcome.state}, {outcome.message}"
    processor = processor_of(outcome)
    error, excess = trade.trusted_error(name), trade.excess(name)
    if math.isnan(error):
        return f"{name}: {processor:.3g} s, no error: {outcome.summary.get(STATUS, 'a measure has no value')}"
    verdict = "meets" if error <= trade.target else "misses"
    return (
        f"{name}: {processor:.3g} s, error {error:.1e}, {verdict} the target {trade.target:g}; "
        f"{excess:.2f} times the cost of the front"
    )


FAMILIES: Final = {
    "spring": (GREY, "spring"),
    "rod": (ORANGE, "rod"),
    "axisymmetric": (BLUE, "axisymmetric"),
    "harmonics": (BLUE, "Fourier harmonics"),
    "sector": (GREEN, "sector"),
    "3d": (PURPLE, "3-D"),
    "as given": (SKY, "seat as given"),
}
"""Colour and name of each family of points."""
MARKERS: Final[Mapping[str, tuple[Any, str]]] = {
    "diagonal": ("o", "mesh and bandwidth"),
    "by hand": ("s", "chosen by hand, no error bar"),
    "mesh": ("v", "only the mesh"),
    "order": ("D", "order 1"),
    "band": ("^", "only the bandwidth"),
    "tolerance": ("<", "tolerance"),
    "reduction": (">", "reduction"),
    "reed modes": ("P", "reed modes"),
    "time step": ("X", "time step"),
    "history": ("p", "history engine"),
    "rings": ("H", "parts across the contact face"),
    "ports": ("h", "segments of the lip"),
    "one port": ((4, 1, 45), "single contact point"),
    "beam": ((3, 1, 0), "beam"),
    "reed band": ("8", "bandwidth of the reed"),
}
_MARKS: Final = ((PLANNED, "*", 13.0), (AS_FILED, "d", 7.0))


def draw_trade(trade: Trade, path: Path) -> None:
    """Draw one panel for each measure the scene asks for.

    Errors below the reference's own uncertainty (shaded) are drawn at its edge. Line: Pareto front, without the guesses
    (hollow).

    Raises `PictureError`: matplotlib is missing.
    """
    columns, rows = size_of(len(trade.measures))
    with sheet(path, 0.6 + 3.3 * columns, 1.5 + 3.0 * rows) as figure:
        figure.suptitle(f"{trade.title}: speed for accuracy")
        for axes, measure in zip(grid_of(figure, len(trade.measures), sharex=True), trade.measures, strict=True):
            _panel(axes, trade, measure)
        figure.legend(handles=_legend(trade), loc="outside lower center", ncols=2 * columns + 1, columnspacing=1.2,
                      handletextpad=0.3)  # fmt: skip


def _panel(axes: Axes, trade: Trade, measure: str) -> None:
    floor = 100 * trade.floor[measure]
    axes.set(xscale="log", yscale="log", xlabel="processor time [s]", ylabel="error [%]")
    axes.set_title(measure.replace("_", " ").capitalize())
    for point in trade.done():
        if point.varied in MARKERS:
            cost, error = trade.cost(point.name), 100 * trade.trusted_error(point.name, measure)
            marker = MARKERS[point.varied][0]
            guess, colour = point.varied == BY_HAND, FAMILIES[point.family][0]
            axes.plot(
                cost, error, marker=marker, linestyle="", color="none" if guess else colour, markersize=5, alpha=0.85,
                markeredgecolor=colour if guess else "white", markeredgewidth=1.0 if guess else 0.4, zorder=3,
            )  # fmt: skip
    _front(axes, trade, measure)
    axes.axhline(100 * trade.target, color="black", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1.6)
    errors = [100 * trade.trusted_error(point.name, measure) for point in trade.done()]
    shown = [*(error for error in errors if math.isfinite(error) and error > 0), 100 * trade.target]
    low, high = max(min(shown) / 4, 1e-12), 2.5 * max(shown)  # from below the floor to above the largest error
    axes.set_ylim(low, high)
    costs = [trade.cost(point.name) for point in trade.done()]
    _ticks(axes.xaxis, math.log10(max(costs) / min(costs)))
    _ticks(axes.yaxis, math.log10(high / low))
    axes.axhspan(low, floor, color=GREY, alpha=0.22, linewidth=0, zorder=1.4)
    axes.annotate(
        "target", (1.0, 100 * trade.target), (-2, 2), xycoords=("axes fraction", "data"),
        textcoords="offset points", ha="right", va="bottom", fontsize=7.5,
    )  # fmt: skip
    axes.annotate(
        "the reference's own uncertainty", (0.02, low), (0, 3), xycoords=("axes fraction", "data"),
        textcoords="offset points", ha="left", va="bottom", fontsize=7, color="#555555",
    )  # fmt: skip
    for name, marker, size in _MARKS:
        if name in trade.outcomes and trade.outcomes[name].state == "done":
            axes.plot(
                trade.cost(name), 100 * trade.trusted_error(name, measure), marker, markersize=size, zorder=5,
                markerfacecolor="#F0E442", markeredgecolor="black", markeredgewidth=0.9,
            )  # fmt: skip


def _front(axes: Axes, trade: Trade, measure: str) -> None:
    names = trade.front(measure)
    costs = [*map(trade.cost, names), max((trade.cost(point.name) for point in trade.done()), default=1.0)]
    errors = [100 * trade.trusted_error(name, measure) for name in (*names, *names[-1:])]
    axes.plot(costs, errors, drawstyle="steps-post", color="black", linewidth=1.0, zorder=2)


def _ticks(axis: Axis, decades: float) -> None:
    """Set plain numbers as labels, at 1, 2 and 5 if there are few decades, and none on minor ticks."""
    from matplotlib.ticker import LogLocator, NullFormatter  # pictures are optional

    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2 else (1,), numticks=9))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(NullFormatter())


def _legend(trade: Trade) -> Sequence[Any]:
    """Return the legend: families by colour, varied keys by marker, then the lines."""
    from matplotlib.lines import Line2D  # pictures are optional

    def handle(label: str, marker: Any, colour: str, size: float = 5.0) -> Line2D:
        return Line2D([], [], color=colour, marker=marker, linestyle="", markersize=size, label=label)

    shown = trade.done()
    families = {p.family for p in shown if p.varied in MARKERS}
    varied = {p.varied for p in shown}
    handles = [handle(name, "o", colour, 7.0) for f, (colour, name) in FAMILIES.items() if f in families]
    handles += [handle(name, marker, "#333333") for v, (marker, name) in MARKERS.items() if v in varied]
    handles.append(Line2D([], [], color="black", linewidth=1.0, label="Pareto front"))
    for name, marker, size in _MARKS:
        if (outcome := trade.outcomes.get(name)) is not None:
            ended = outcome.state == "done"
            words = name if ended else f"{name}: {outcome.message[:60]}"
            mark = handle(words, marker, "#F0E442" if ended else "white", size - 2)
            mark.set_markeredgecolor("black" if ended else GREY)
            handles.append(mark)
    return handles
