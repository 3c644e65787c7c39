"""Hot spots and life of a run, as tables of its page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from impact.quantities import text
from seatfem.faces.report.html_tables import html_rows
from seatfem.readings import BAR, as_number, bar_of, reading
from seatfem.results import SEAT_STRESS


def hot_spots(summary: Mapping[str, Any]) -> str:
    """Return stress, time, place and distance to the nearest sharp edge of each hot spot, largest first, or ""."""
    spots = summary.get("seat_stress_hot_spots")
    if not isinstance(spots, list) or not spots:
        return ""
    rows = [
        (_in(spot, "von_mises_Pa", "Pa"), _in(spot, "time_s", "s"), _place(spot), _in(spot, "edge_distance_m", "m"))
        for spot in spots
        if isinstance(spot, dict)
    ]
    words = "Largest von Mises stress at its places on the surface; places of a half section are r, z."
    largest = reading(summary, SEAT_STRESS, "Pa")
    if BAR + SEAT_STRESS in summary:
        words += f" The largest with its uncertainty: {largest}; that of the others is no smaller a share."
    return html_rows(("von Mises", "time", "place [mm]", "from a sharp edge"), rows) + f'<p class="soft">{words}</p>'


def life_table(summary: Mapping[str, Any]) -> str:
    """Return all that is known of fatigue, each number with its error bar; "" without any."""
    results = [(key, value) for key, value in summary.items() if key.startswith("life_") and value is not None]
    if not results:
        return ""
    rows = [(key.removeprefix("life_").replace("_", " "), _plain(summary, key)) for key, _ in results]
    return html_rows(("", "value"), rows)


def _in(spot: Mapping[str, Any], key: str, unit: str) -> str:
    return "" if (value := as_number(spot.get(key))) is None else text(value, unit)


def _place(spot: Mapping[str, Any]) -> str:
    place = spot.get("at_m")
    numbers = [as_number(x) for x in place] if isinstance(place, list) else []
    return ", ".join("?" if x is None else f"{1e3 * x:.4g}" for x in numbers)


def _plain(summary: Mapping[str, Any], key: str) -> str:
    value = summary[key]
    if bar_of(summary, key) is not None:
        return reading(summary, key, "")
    return f"{value:.4g}" if isinstance(value, float) else str(value)
