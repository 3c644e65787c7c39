"""The table of a run: the seat's value with its error bar, the spring's, their difference, the target."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import in_digits, in_units, percent
from seatfem import results
from seatfem.faces.verdict import count, difference, is_static, which_landing
from seatfem.readings import (
    SPRING,
    Summary,
    as_number,
    bar_of,
    duration,
    in_text,
    is_known,
    places_of,
    prefix_of,
    rounded,
    with_unit,
)
from seatfem.results import CONTACTS, LIFE_CYCLES, Group, Result, asked, name_of, rows_of, words_of
from seatfem.study.accuracy.source_words import in_words

ANGLES: Final = (
    "angles: 0 deg is the x axis, along the reed to its tip; anticlockwise, seen from the reed onto the seat"
)
LENGTHS: Final = "places: along the lip, a ring from its own x axis anticlockwise, a strip from its end at the lesser x"


def result_table(summary: Summary) -> Table:
    """Return the measures of a run beside those of the spring baseline (the summary's keys with the prefix spring_).

    What the run is judged by stands first: the landing, unless the whole run was asked for. What depends on the step
    stands last, and says so. Every number of which the summary states an error bar shows it.
    """
    target = as_number(summary.get("accuracy_target"))
    aim = "uncertainty" if target is None else f"uncertainty\n(asked {percent(target, 3)})"
    heads = ("", "seat (static)" if is_static(summary) else "seat", "spring\nbaseline", "spring\nagainst\nseat")
    table = Table(*heads, "difference /\nuncertainty", aim, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    table.columns[0].no_wrap = True
    for column in table.columns[1:5]:
        column.justify = "right"
    for number, (group, rows) in enumerate(rows_of(summary).items()):
        style = "dim" if group == "raw" else None
        if number:
            table.add_section()
        table.add_row(_heading(group, summary), style=style or "bold")
        for row in rows:
            table.add_row(f" {words_of(row, summary)}", *_cells(_last_cycle(summary, row), row), style=style)
    if (residual := as_number(summary.get("energy_residual"))) is not None:
        table.add_row(" energy balance error", percent(residual), style="dim")
    table.caption = "\n".join(_notes(summary)) or None
    return table


def _heading(group: Group, summary: Summary) -> str:
    if group == "landing":
        return which_landing(summary)
    step = f", step {duration(summary['time_step_s'])}" if "time_step_s" in summary else ""
    return results.HEADINGS[group].replace("{step}", step)


def _last_cycle(summary: Summary, row: Result) -> Summary:
    """Return the summary with the last of a list of numbers, one for each cycle of a gas, in its place."""
    if row.group != "gas":
        return summary
    values = {name: summary[name] for name in (row.key, f"error_bar_{row.key}") if name in summary}
    return {name: value[-1] if isinstance(value, list) and value else value for name, value in values.items()}


def _notes(summary: Summary) -> Iterator[str]:
    """Yield what stands below the table: over what is averaged, what no bar knows, what has no value."""
    width, part = summary.get("line_force_width_s"), as_number(summary.get("line_force_arc_m"))
    shown = [row for rows in rows_of(summary).values() for row in rows]
    if part is not None:
        yield f"per length: mean over {in_units(part, 'm')} of the lip, the force over {duration(width)}, too"
    if any(row.group == "lip" and row.key.endswith("_at_deg") and summary.get(row.key) is not None for row in shown):
        yield ANGLES
    if any(row.key == f"{results.LINE_PEAK}_at_m" for row in shown):
        yield LENGTHS
    if place := _most_stressed(summary):
        yield place
    if any(row.of_each_step and row.key in summary and SPRING + row.key in summary for row in results.RESULTS):
        yield "raw: of single steps, not averaged; the spring's depends on the step"
    if any("± ?" in in_text(row.key, as_number(summary.get(row.key)), bar_of(summary, row.key), "") for row in shown):
        yield "± ?: uncertainty not known"
    if unknown := str(summary.get("error_unknown") or ""):
        yield f"not included in the uncertainty: {', '.join(in_words(source) for source in unknown.split(', '))}"
    landed = any(row.group == "landing" for row in shown)
    for key in asked(summary):
        if summary.get(key) is None and (landed or not key.startswith(results.LANDING)):
            yield f"{name_of(key, summary)}: asked for, but this run gives no value"


def _most_stressed(summary: Summary) -> str:
    """Return where the largest reed stress lies, and when; "" where none is known."""
    spots = summary.get("reed_stress_hot_spots")
    if not isinstance(spots, list) or not spots or not isinstance(spots[0], dict):
        return ""
    part, time = spots[0].get("part"), as_number(spots[0].get("time_s"))
    return f"largest reed stress: {part}, at {duration(time)}" if isinstance(part, str) and time is not None else ""


def _cells(summary: Summary, row: Result) -> tuple[str, ...]:
    """Return value and bar, the spring's value, their difference in per cent and bars, and what the target became."""
    if row.key == CONTACTS:
        return (_contacts(summary, ""), _contacts(summary, SPRING) if SPRING + CONTACTS in summary else "")
    value, bar = as_number(summary.get(row.key)), bar_of(summary, row.key)
    first = in_text(row.key, value, bar, row.unit)
    if row.key == LIFE_CYCLES and value is not None and (design := as_number(summary.get("life_design_cycles"))):
        first = f"{in_digits(value, 2)} (asked {in_digits(design, 2)})"
    if SPRING + row.key not in summary:
        return (first, "", "", "", _target(summary, row.key, value, bar))
    baseline, off = as_number(summary.get(SPRING + row.key)), difference(summary, row.key)
    return (
        first,
        _beside(baseline, value, bar, row, bar_of(summary, SPRING + row.key)),
        "" if off is None else percent(off.relative, sign=True),
        "" if off is None else count(off.bars),
        _target(summary, row.key, value, bar),
    )


def _contacts(summary: Summary, prefix: str) -> str:
    """Return how many contacts, landings and touches there were: "2 (landings 1), touches 7"; of a baseline without
    these words."""
    contacts, landings, touches = (
        as_number(summary.get(f"{prefix}{key}")) for key in (CONTACTS, "landing_count", f"{CONTACTS}_raw")
    )
    of_landings, of_touches = ("", "") if prefix else ("landings ", "touches ")
    several = "" if landings is None else f" ({of_landings}{landings:.0f})"
    closed = "" if touches is None else f", {of_touches}{touches:.0f}"
    return "-" if contacts is None else f"{contacts:.0f}{several}{closed}"


def _beside(baseline: float | None, value: float | None, bar: float | None, row: Result, own: float | None) -> str:
    """Return the baseline's value with its ``own`` bar, or with the seat's unit and decimals if they are near."""
    if baseline is None:
        return "-"
    if own is not None and not row.of_each_step:
        return in_text(row.key, baseline, own, row.unit)
    far = value and baseline and not 0.1 < abs(baseline / value) < 1000
    factor, unit = prefix_of(row.unit, *([] if value is None or far else [value]), baseline)
    places = None if value is None or bar is None or far else places_of(factor * value, factor * bar)
    mark = ", raw" if row.of_each_step else ""
    return with_unit(rounded(factor * baseline, places), unit) + mark


def _target(summary: Summary, key: str, value: float | None, bar: float | None) -> str:
    """Return the bar's share of a judged value and whether that meets the target; "" where nothing is judged."""
    target = as_number(summary.get("accuracy_target"))
    judged = key in asked(summary) and summary.get("accuracy_met", True) is not None
    if target is None or bar is None or not value or not judged:
        return ""
    if not is_known(key, value, bar):
        return "not known, missed"
    share = bar / abs(value)
    return f"{percent(share)}, {'reached' if share <= target else 'missed'}"
