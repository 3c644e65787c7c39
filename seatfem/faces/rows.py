"""The one table of what a run tells: key of summary.json, words, unit, and the group of rows that it stands in."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from seatfem.faces.readings import DEGREES, KILOGRAM, as_number, duration
from seatfem.study.scene.measures import UNITS, all_measures, key_of

Group = Literal["landing", "run", "stopper", "spring", "film", "lip", "seat", "life", "gas", "raw"]

LANDING: Final = "landing_"
"""Prefix of the keys of the judged landing."""
STATIC: Final = "landing_static_load_N"
HEADINGS: Final[Mapping[Group, str]] = {
    "landing": "landing on the seat",
    "run": "whole run",
    "stopper": "at the stopper",
    "spring": "valve springs",
    "film": "film in the gap",
    "lip": "along the lip",
    "seat": "stress in the seat",
    "life": "fatigue",
    "gas": "gas, last cycle",
    "raw": "raw{step}",
}


@dataclass(frozen=True)
class Row:
    """One number of a run.

    Attributes:
        key: in summary.json [SI]; the spring baseline's has the prefix spring_.
        words: before it; {width} is the filter's, {closed} says whether the reed starts closed, {above} whether the
            impulse of a landing is that above a static load, {touch} what comes first: a landing, of a reed that starts
            closed a contact.
        unit: SI, without prefix.
        group: of rows, in the order of `HEADINGS`.
    """

    key: str
    words: str
    unit: str
    group: Group


ROWS: Final = (
    Row("landing_time_s", "time", "s", "landing"),
    Row("landing_closing_speed_m_per_s", "closing speed", "m/s", "landing"),
    Row("landing_filtered_peak_force_N", "peak force, {width} mean", "N", "landing"),
    Row("landing_excess_peak_force_N", "  above the static load", "N", "landing"),
    Row(STATIC, "  static load", "N", "landing"),
    Row("landing_impulse_Ns", "impulse{above}", "N s", "landing"),
    Row("landing_duration_s", "duration", "s", "landing"),
    Row("landing_restitution", "restitution", "", "landing"),
    Row("landing_max_seat_displacement_m", "seat displacement", "m", "landing"),
    Row("landing_peak_reed_stress_Pa", "reed stress after landing", "Pa", "landing"),
    Row("reed_stress_before_landing_Pa", "reed stress before landing", "Pa", "landing"),
    Row("filtered_peak_force_N", "peak force, {width} mean", "N", "run"),
    Row("peak_time_s", "  when", "s", "run"),
    Row("impulse_Ns", "impulse", "N s", "run"),
    Row("first_contact_s", "first contact{closed}", "s", "run"),
    Row("contact_duration_s", "  lasts", "s", "run"),
    Row("restitution", "  restitution", "", "run"),
    Row("contact_count", "contacts", "", "run"),
    Row("max_seat_displacement_m", "seat displacement", "m", "run"),
    Row("peak_reed_stress_after_contact_Pa", "reed stress after 1st {touch}", "Pa", "run"),
    Row("peak_reed_stress_over_rho_c0_v", "  over rho c v (plane wave: 1)", "", "run"),
    Row("initial_reed_stress_Pa", "reed stress before 1st {touch}", "Pa", "run"),
    Row("reed_stress_at_start_Pa", "reed stress at the start", "Pa", "run"),
    Row("peak_reed_stress_Pa", "reed stress, largest", "Pa", "run"),
    Row("stopper_filtered_peak_force_N", "peak force, {width} mean", "N", "stopper"),
    Row("stopper_impulse_Ns", "impulse", "N s", "stopper"),
    Row("stopper_first_contact_s", "first contact", "s", "stopper"),
    Row("stopper_contact_count", "contacts", "", "stopper"),
    Row("valve_spring_force_max_N", "largest force", "N", "spring"),
    Row("valve_spring_force_at_landing_N", "  as the landing begins", "N", "spring"),
    Row("film_force_peak_N", "largest force", "N", "film"),
    Row("stiction_force_peak_N", "largest pull", "N", "film"),
    Row("film_loss_J", "energy lost", "J", "film"),
    Row("without_film_filtered_peak_force_N", "without it: peak, {width} mean", "N", "film"),
    Row("without_film_impulse_Ns", "without it: impulse", "N s", "film"),
    Row("line_force_peak_N_per_m", "force per length", "N/m", "lip"),
    Row("line_force_peak_at_deg", "  where", DEGREES, "lip"),
    Row("line_force_peak_at_m", "  where", "m", "lip"),
    Row("line_impulse_peak_Ns_per_m", "impulse per length", "N s/m", "lip"),
    Row("line_impulse_peak_at_deg", "  where", DEGREES, "lip"),
    Row("line_impulse_peak_at_m", "  where", "m", "lip"),
    Row("first_touch_at_deg", "first touch", DEGREES, "lip"),
    Row("first_touch_at_m", "first touch", "m", "lip"),
    Row("ports", "lip segments", "", "lip"),
    Row("tilt_deg", "tilt", DEGREES, "lip"),
    Row("peak_seat_stress_Pa", "largest, von Mises", "Pa", "seat"),
    Row("peak_seat_stress_time_s", "  when", "s", "seat"),
    Row("peak_seat_stress_over_rho_c0_v", "  over rho c v (plane wave: 1)", "", "seat"),
    Row("peak_seat_principal_stress_Pa", "largest tension", "Pa", "seat"),
    Row("life_margin", "margin on stress", "", "life"),
    Row("life_cycles", "cycles to failure", "", "life"),
    Row("life_damage_per_cycle", "damage per cycle", "", "life"),
    Row("life_multiaxial_margin", "margin, several axes", "", "life"),
    Row("life_contact_margin", "margin, contact", "", "life"),
    Row("life_speed_margin", "margin on speed", "", "life"),
    Row("gas_largest_lift_m", "largest lift", "m", "gas"),
    Row("gas_opening_deg", "opens", DEGREES, "gas"),
    Row("gas_closing_deg", "closes", DEGREES, "gas"),
    Row("gas_seating_velocity_m_per_s", "seating velocity", "m/s", "gas"),
    Row("gas_seat_impacts", "seat impacts", "", "gas"),
    Row("gas_stopper_impacts", "stopper impacts", "", "gas"),
    Row("gas_mass_forward_kg", "mass forward", KILOGRAM, "gas"),
    Row("gas_mass_back_kg", "mass back", KILOGRAM, "gas"),
    Row("peak_force_N", "peak force", "N", "raw"),
    Row("stopper_peak_force_N", "stopper's peak force", "N", "raw"),
)
OF_STATIC: Final = ("landing_excess_peak_force_N", STATIC)
"""Rows that say nothing of a landing without a static load."""
OF_ONE_LANDING: Final[Mapping[str, str]] = {
    "filtered_peak_force_N": "landing_filtered_peak_force_N",
    "peak_time_s": "landing_filtered_peak_force_N",
    "impulse_Ns": "landing_impulse_Ns",
    "first_contact_s": "landing_time_s",
    "contact_duration_s": "landing_duration_s",
    "restitution": "landing_restitution",
    "max_seat_displacement_m": "landing_max_seat_displacement_m",
}
"""Rows of the whole run that repeat those of its only landing."""
NO_LOAD: Final = 1e-3
"""Share of the peak force below which a static load is none: error bars of forces are larger."""


def asked(summary: Mapping[str, object]) -> tuple[str, ...]:
    """Return the keys that the accuracy was asked for, by which a run is judged: of a landing, or of the whole run."""
    if judged := str(summary.get("accuracy_judged_keys") or ""):
        return tuple(judged.split(", "))
    return _keys_asked(summary)


def _keys_asked(summary: Mapping[str, object]) -> tuple[str, ...]:
    names = str(summary.get("accuracy_measures") or "").split(", ")
    return tuple(each.key for name, each in all_measures().items() if name in names)


def rows_of(summary: Mapping[str, object]) -> dict[Group, list[Row]]:
    """Return the rows of a run by group, in the order they are read: the group first by which the run is judged.

    A key that is judged or asked for has a row, whoever defined it, and so has one without a value.
    """
    judged = {*asked(summary), *_keys_asked(summary)}
    known = {row.key for row in ROWS}
    order: list[Group] = [*HEADINGS]
    if asked(summary) and not any(key.startswith(LANDING) for key in asked(summary)):
        order[:2] = ["run", "landing"]
    rows = (*ROWS, *(_row_of(key) for key in sorted(judged - known)))
    groups = {group: [row for row in rows if row.group == group] for group in order}
    return {group: shown for group, of_it in groups.items() if (shown := list(_shown(summary, group, of_it, judged)))}


def _shown(summary: Mapping[str, object], group: Group, rows: list[Row], judged: set[str]) -> Iterator[Row]:
    if group == "landing" and summary.get("landing_time_s") is None:
        return
    if group == "lip" and "ports" not in summary and not judged & {row.key for row in rows}:
        return
    by_length = summary.get("line_force_peak_at_deg") is None
    for row in rows:
        if row.key not in asked(summary) and _repeats(summary, row):
            continue
        value = summary.get(row.key)
        needless = row.key == "peak_reed_stress_Pa" and "peak_reed_stress_after_contact_Pa" in summary
        needless = needless or (row.key in OF_STATIC and not is_loaded(summary, LANDING))
        needless = needless or (row.key == "initial_reed_stress_Pa" and summary.get("first_contact_s") == 0)
        elsewhere = group == "lip" and row.key.endswith("_at_deg" if by_length else "_at_m")
        empty = value is None and (row.unit == "Pa" or group in ("landing", "run"))
        if row.key in judged or (row.key in summary and not (needless or elsewhere or empty)):
            yield row


def _repeats(summary: Mapping[str, object], row: Row) -> bool:
    """Return whether a row of the whole run says again what the only landing says."""
    if summary.get("landing_count") != 1 or summary.get("contact_count") != 1 or is_loaded(summary, LANDING):
        return False
    own, landing = as_number(summary.get(row.key)), as_number(summary.get(OF_ONE_LANDING.get(row.key, "")))
    if row.key == "peak_time_s":
        own = as_number(summary.get("filtered_peak_force_N"))
    return own is not None and landing is not None and math.isclose(own, landing, rel_tol=1e-9, abs_tol=1e-12)


def _row_of(key: str) -> Row:
    """Return the row of a measure that this table does not know; the key stands in it where it tells no unit."""
    unit = next((unit for ending, unit in UNITS.items() if key.endswith(f"_{ending}")), "")
    words = _measures_words(key.removeprefix(LANDING)) or key
    shown = words if unit or words == key else f"{words} ({key})"
    return Row(key, shown, unit, "landing" if key.startswith(LANDING) else "run")


def _measures_words(key: str) -> str:
    return {each.key: each.words for each in all_measures().values()}.get(key, "")


def unit_of(key: str) -> str:
    """Return the unit of a measure's key."""
    return next((row.unit for row in ROWS if row.key == key), _row_of(key).unit)


def words_of(row: Row, summary: Mapping[str, object]) -> str:
    """Return what stands before the number of a row."""
    replaced = {
        "{width}": duration(summary.get("filter_width_s")),
        "{closed}": ", reed starts closed" if summary.get("first_contact_s") == 0 else "",
        "{touch}": "contact" if summary.get("first_contact_s") == 0 else "landing",
        "{above}": " above static load" if is_loaded(summary, LANDING) else "",
    }
    words = row.words
    for name, text in replaced.items():
        words = words.replace(name, text)
    return words


def is_loaded(numbers: Mapping[str, object], prefix: str = "") -> bool:
    """Return whether a static load presses during a landing: a record, or the keys of a summary with their prefix."""
    static, peak = (as_number(numbers.get(f"{prefix}{key}")) for key in ("static_load_N", "filtered_peak_force_N"))
    return static is not None and abs(static) > NO_LOAD * (peak or 0.0)


def name_of(key: str, summary: Mapping[str, object]) -> str:
    """Return a measure in words, the same of a landing as of a whole run."""
    if key in (peak := key_of("filtered_peak"), f"{LANDING}{peak}"):
        return f"peak force (mean over {duration(summary.get('filter_width_s'))})"
    if words := _measures_words(key) or _measures_words(key.removeprefix(LANDING)):
        return words
    return next((words_of(row, summary).strip() for row in ROWS if row.key == key), key)
