"""The table of a run: the seat's value with its error bar, the spring's, their difference, the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.pictures.drawing import scaled
from seatfem.faces.verdict import OF_EACH_STEP, as_number, asked, count, difference, duration, plain

DEGREES: Final = "deg"
STRESS_UNIT: Final = "Pa"
ALONG: Final = "m"  # of places along a lip: told where angles do not tell them
KILOGRAM: Final = "kg"
ROWS: Final = (
    ("peak, {width} mean", "filtered_peak_force_N", "N"),
    ("  when", "peak_time_s", "s"),
    ("  in blow number", "hardest_blow", ""),
    ("impulse", "impulse_Ns", "N s"),
    ("first contact{closed}", "first_contact_s", "s"),
    ("contact duration{first}", "contact_duration_s", "s"),
    ("  hardest blow", "hardest_blow_duration_s", "s"),
    ("contacts", "contact_count", ""),
    ("restitution{first}", "restitution", ""),
    ("  hardest blow", "hardest_blow_restitution", ""),
    ("seat displacement", "max_seat_displacement_m", "m"),
    ("reed stress, struck", "peak_reed_stress_after_contact_Pa", "Pa"),
    ("  over rho c0 v", "peak_reed_stress_over_rho_c0_v", ""),
    ("reed stress, before", "initial_reed_stress_Pa", "Pa"),
    ("reed stress, largest", "peak_reed_stress_Pa", "Pa"),
)
STOPPER: Final = (
    ("peak, {width} mean", "stopper_filtered_peak_force_N", "N"),
    ("impulse", "stopper_impulse_Ns", "N s"),
    ("first contact", "stopper_first_contact_s", "s"),
    ("contacts", "stopper_contact_count", ""),
)
LIP: Final = (
    ("force per length", "line_force_peak_N_per_m", "N/m"),
    ("  where", "line_force_peak_at_deg", DEGREES),
    ("  where", "line_force_peak_at_m", ALONG),
    ("impulse per length", "line_impulse_peak_Ns_per_m", "N s/m"),
    ("  where", "line_impulse_peak_at_deg", DEGREES),
    ("  where", "line_impulse_peak_at_m", ALONG),
    ("first touch", "first_touch_at_deg", DEGREES),
    ("first touch", "first_touch_at_m", ALONG),
    ("arcs", "ports", ""),
    ("tilt", "tilt_deg", DEGREES),
)
FILM: Final = (
    ("largest force", "film_force_peak_N", "N"),
    ("largest pull", "stiction_force_peak_N", "N"),
    ("energy lost", "film_loss_J", "J"),
    ("without it: peak, {width} mean", "without_film_filtered_peak_force_N", "N"),
    ("without it: impulse", "without_film_impulse_Ns", "N s"),
)
LIFE: Final = (
    ("margin on stress", "life_margin", ""),
    ("cycles to failure", "life_cycles", ""),
    ("damage per cycle", "life_damage_per_cycle", ""),
    ("margin, several axes", "life_multiaxial_margin", ""),
    ("margin, contact", "life_contact_margin", ""),
    ("margin on speed", "life_speed_margin", ""),
)
GAS: Final = (
    ("largest lift", "gas_largest_lift_m", "m"),
    ("opens", "gas_opening_deg", DEGREES),
    ("closes", "gas_closing_deg", DEGREES),
    ("seating velocity", "gas_seating_velocity_m_per_s", "m/s"),
    ("seat impacts", "gas_seat_impacts", ""),
    ("stopper impacts", "gas_stopper_impacts", ""),
    ("mass forward", "gas_mass_forward_kg", KILOGRAM),
    ("mass back", "gas_mass_back_kg", KILOGRAM),
)
STRESS: Final = (
    ("largest, von Mises", "peak_seat_stress_Pa", "Pa"),
    ("  when", "peak_seat_stress_time_s", "s"),
    ("  over rho c0 v", "peak_seat_stress_over_rho_c0_v", ""),
    ("largest tension", "peak_seat_principal_stress_Pa", "Pa"),
)
BY_STEP: Final = (
    ("peak", "peak_force_N", "N"),
    ("contacts", "contact_count_raw", ""),
    ("stopper peak", "stopper_peak_force_N", "N"),
)
OF_SEVERAL: Final = ("hardest_blow", "hardest_blow_duration_s", "hardest_blow_restitution")
"""Rows of runs with several blows, groups of contacts less than 30 us apart."""
INSTEAD: Final = {"peak_reed_stress_Pa": "peak_reed_stress_after_contact_Pa"}
"""Rows that another one makes needless."""
ANGLES: Final = (
    "angles: 0 deg is the x axis, along the reed to its tip; anticlockwise, seen from the reed onto the seat"
)
LENGTHS: Final = "places: along the lip, a ring from its own x axis anticlockwise, a strip from its end at the lesser x"
UNKNOWN: Final = {"time_step": "the time step (time_step)", "patch": "the patch that moves as its mean (patch)"}
"""Sources of error in words, but for those that are one."""
DIGITS: Final = 6  # of a value, however small its bar


def result_table(summary: Mapping[str, object]) -> Table:
    """Measures of a run beside those of the spring baseline (the summary's keys with the prefix spring_).

    What depends on the step stands last, and says so. Bars stand where the summary has them; where the plan took a
    spring for the seat, they speak of the measures asked for alone.
    """
    target = as_number(summary.get("accuracy_target"))
    aim = "bar" if target is None else f"bar, target\n{100 * target:.3g} %"
    heads = ("", "seat", "spring\nbaseline", "spring\n- seat", "in\nbars", aim)
    table = Table(*heads, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    table.columns[0].no_wrap = True
    for column in table.columns[1:5]:
        column.justify = "right"
    several = (as_number(summary.get("contact_count")) or 0.0) > 1
    words = {
        "width": duration(summary.get("filter_width_s")),
        "first": ", first blow" if several else "",
        "closed": ", closed at the start" if summary.get("first_contact_s") == 0 else "",
    }
    for label, key, unit in ROWS:
        known = key in summary and (unit != STRESS_UNIT or summary[key] is not None)
        known = known and (key not in OF_SEVERAL or (several and (key == OF_SEVERAL[0] or summary[OF_SEVERAL[0]] != 1)))
        if known and (key not in INSTEAD or INSTEAD[key] not in summary):
            table.add_row(label.format_map(words), *_cells(summary, key, unit))
    groups = (
        ("at the stopper", STOPPER),
        ("of the film", FILM),
        ("along the lip", LIP),
        ("in the seat", STRESS),
        ("of fatigue", LIFE),
    )
    for heading, rows in groups:
        there = [row for row in rows if row[1] in summary]
        if rows is LIP:
            by_length = summary.get("line_force_peak_at_deg") is None
            there = [row for row in there if not row[1].endswith("_at_deg" if by_length else "_at_m")]
        if there and (rows is not LIP or "ports" in summary):
            table.add_section()
            table.add_row(heading)
            for label, key, unit in there:
                cells = _cells(summary, key, unit)
                table.add_row(f" {label.format_map(words)}", *(cells if f"spring_{key}" in summary else cells[:1]))
    if GAS[0][1] in summary:
        table.add_section()
        table.add_row("gas, last cycle")
        for label, key, unit in GAS:
            told = {name: summary.get(name) for name in (key, f"error_bar_{key}")}
            last = {name: value[-1] if isinstance(value, list) else value for name, value in told.items()}
            if unit == KILOGRAM:  # prefixes are those of the gram
                last, unit = {name: 1e3 * mass for name, value in last.items() if (mass := as_number(value))}, "g"
            table.add_row(f" {label}", _cells(last, key, unit)[0])
    table.add_section()
    step = f", step {duration(summary['time_step_s'])}" if "time_step_s" in summary else ""
    table.add_row(f"raw{step}", style="dim")
    for label, key, unit in BY_STEP:
        if key in summary:
            table.add_row(f" {label}", *_cells(summary, key, unit), style="dim")
    if (left := as_number(summary.get("energy_residual"))) is not None:
        table.add_row("energy left over", f"{left:.1e}", style="dim")
    table.caption = "\n".join(_notes(summary)) or None
    return table


def _notes(summary: Mapping[str, object]) -> list[str]:
    """Below the table: over what a contact along a lip is averaged, and what no bar knows."""
    notes, width, part = [], summary.get("line_force_width_s"), as_number(summary.get("line_force_arc_m"))
    if part is not None:
        factor, unit = scaled(part, "m")
        part_of_it = f"{factor * part:.3g} {plain(unit)} of the lip"
        notes.append(f"per length: mean over {part_of_it}, the force over {duration(width)}, too")
    if any(summary.get(key) is not None for _, key, unit in LIP if unit == DEGREES and key.endswith("_at_deg")):
        notes.append(ANGLES)
    if any(key in summary for _, key, unit in LIP if unit == ALONG) and summary.get("line_force_peak_at_deg") is None:
        notes.append(LENGTHS)
    if unknown := str(summary.get("error_unknown") or ""):
        words = ", ".join(UNKNOWN.get(source, source) for source in unknown.split(", "))
        notes.append(f"error bars leave out what is unknown: {words}")
    return notes


def _cells(summary: Mapping[str, object], key: str, unit: str) -> tuple[str, ...]:
    """Value and bar, the spring's value, their difference in per cent and bars, and what became of the target."""
    seat, spring = summary.get(key), summary.get(f"spring_{key}")
    ours, baseline, bar = as_number(seat), as_number(spring), _bar(summary, key)
    values = [value for value in (ours, baseline) if value is not None]
    factor, prefixed = (1.0, unit) if unit in ("", DEGREES) else scaled([value for value in values if value][:1], unit)
    after = f" {plain(prefixed)}" if unit else ""
    mark = ", raw" if key in OF_EACH_STEP and baseline is not None else ""
    found = None if bar is None else difference(summary, key)
    return (
        _with_bar(ours, bar, factor) + (after if ours is not None else ""),
        "-" if baseline is None else _number(factor * baseline, _places(ours, bar, factor)) + after + mark,
        "" if found is None else f"{100 * found.relative:+.2g} %",
        "" if found is None else count(found.bars),
        _target(summary, key, ours, bar),
    )


def _bar(summary: Mapping[str, object], key: str) -> float | None:
    if summary.get("plan_seat_level") == "spring" and key not in (*asked(summary), LIFE[0][1]):
        return None
    return as_number(summary.get(f"error_bar_{key}"))


def _target(summary: Mapping[str, object], key: str, value: float | None, bar: float | None) -> str:
    target = as_number(summary.get("accuracy_target"))
    if target is None or bar is None or value is None or key not in asked(summary):
        return ""
    share = bar / abs(value) if value else (math.inf if bar else 0.0)
    return f"{100 * share:.2g} %, {'met' if share <= target else 'missed'}"


def _with_bar(value: float | None, bar: float | None, factor: float) -> str:
    if value is None:
        return "-"
    known = _places(value, bar, factor)
    if bar is None or not math.isfinite(bar):
        return _number(factor * value, known)
    fine = bar == 0 or (known is not None and factor * bar < 10.0**-known)
    return f"{_number(factor * value, known)} ± {f'{factor * bar:.2g}' if fine else _number(factor * bar, known)}"


def _places(value: float | None, bar: float | None, factor: float) -> int | None:
    """Decimals that the bar leaves known, and one more; at most `DIGITS` in all. ``None``: no bar tells."""
    if value is None or not bar or not math.isfinite(bar):
        return None
    known = 1 - math.floor(math.log10(factor * bar))
    return min(max(known, 0), max(DIGITS - 1 - math.floor(math.log10(abs(factor * value) or 1.0)), 0))


def _number(value: float, places: int | None) -> str:
    return f"{value:.4g}" if places is None else f"{value:.{places}f}"
