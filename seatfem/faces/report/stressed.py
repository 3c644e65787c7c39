"""Hot spots and life of a run, as tables of its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from impact.pictures.drawing import text
from seatfem.faces.report.html_tables import html_rows
from seatfem.faces.readings import as_number


def hot_spots(summary: Mapping[str, Any]) -> str:
    """Stress, time, place and distance to the nearest sharp edge of each, the largest first; "" without any."""
    found = summary.get("seat_stress_hot_spots")
    if not isinstance(found, list) or not found:
        return ""
    rows = [
        (_in(spot, "von_mises_Pa", "Pa"), _in(spot, "time_s", "s"), _place(spot), _in(spot, "edge_distance_m", "m"))
        for spot in found
        if isinstance(spot, dict)
    ]
    words = "Largest von Mises stress at its places on the surface; places of a half section are r, z."
    return html_rows(("von Mises", "time", "place [mm]", "from a sharp edge"), rows) + f'<p class="soft">{words}</p>'


def life_table(summary: Mapping[str, Any]) -> str:
    """All that is known of fatigue, with its error bars; "" without any."""
    told = [(key, value) for key, value in summary.items() if key.startswith("life_") and value is not None]
    if not told:
        return ""
    rows = [(key.removeprefix("life_").replace("_", " "), _plain(value), _bar(summary, key)) for key, value in told]
    return html_rows(("", "value", "error bar"), rows)


def _in(spot: Mapping[str, Any], key: str, unit: str) -> str:
    return "" if (value := as_number(spot.get(key))) is None else text(value, unit)


def _place(spot: Mapping[str, Any]) -> str:
    place = spot.get("at_m")
    numbers = [as_number(x) for x in place] if isinstance(place, list) else []
    return ", ".join("?" if x is None else f"{1e3 * x:.4g}" for x in numbers)


def _plain(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _bar(summary: Mapping[str, Any], key: str) -> str:
    return "" if (bar := as_number(summary.get(f"error_bar_{key}"))) is None else f"{bar:.2g}"
