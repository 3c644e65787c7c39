"""The trade as a table: CSV, JSON, and in words."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from impact.files.atomic import whole_file
from impact.files.table import without_nan, write_rows
from seatfem.study.impacts.landed import STATUS
from seatfem.study.scene.measures import key_of
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.trade.point import ABOUT, COSTS
from seatfem.study.trade.runner import processor_of
from seatfem.study.trade.trade import AS_FILED, PLANNED, Trade


def rows_of(trade: Trade) -> list[dict[str, object]]:
    """Return one row per point, units in the keys; NaN where a point did not end."""
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
    """Return the summary of the trade."""
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
    write_rows(csv_path, rows_of(trade))
    points = [asdict(point) | {"outcome": _as_json(trade.outcomes[point.name])} for point in trade.points]
    data = summary_of(trade) | {"reference_outcome": _as_json(trade.outcomes[trade.reference]), "points": points}
    with whole_file(json_path) as temporary:
        temporary.write_text(json.dumps(without_nan(data), indent=1) + "\n", encoding="utf-8")


def _as_json(outcome: Outcome) -> dict[str, object]:
    """Return an outcome with its costs, its measures, and what else is known about the point."""
    values = dict(outcome.summary)
    processor, memory, start = (values.pop(key, None) for key in COSTS)
    about: dict[str, object] = {key: values.pop(key) for key in ABOUT if key in values}
    stages = {key: values.pop(key) for key in outcome.summary if key.startswith("stage_")}
    about |= {"stages_s": {key[len("stage_") : -len("_s")]: spent for key, spent in stages.items()}} if stages else {}
    costs = {"wall": outcome.wall, "processor": processor, "memory": memory, "start": start}
    return {"state": outcome.state, "reason": outcome.message, **costs, "values": values, "about": about}


def in_words(trade: Trade) -> str:
    """Return the front, the planner's place, and what did not end."""
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
