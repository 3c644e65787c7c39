"""Tables for the terminal and the report, without markup: modes, installation, faces of a part, landings, and the
results of a run beside those of a spring baseline."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from impact.files.csv_table import csv_text
from impact.quantities import in_digits, in_units, percent, plain, text
from seatfem import readings, results
from seatfem.faces.wings import file_kinds
from seatfem.fields import by_group, kind_of
from seatfem.machine.doctor import Check
from seatfem.structures import natural_modes
from seatfem.structures.inspection import cad
from seatfem.structures.kinds import kinds_of
from seatfem.study.answers.verdict import count, difference, is_free, is_static, lands_of, which_landing
from seatfem.study.safety import STAGES, source_in_words
from seatfem.study.scene.wings import drives


def time_line(seconds: Mapping[str, float]) -> str:
    """Return one line with the time of each stage [s], the longest first."""
    longest_first = sorted(seconds.items(), key=lambda item: -item[1])
    return ", ".join(f"{STAGES.get(stage, stage)} {spent:.1f} s" for stage, spent in longest_first if spent >= 0.05)


def modes_table(modes: Sequence[natural_modes.Mode]) -> Table:
    """Return a table of modes: number, frequency, nodal diameters of a body of revolution, share of the compliance."""
    revolved = any(mode.diameters is not None for mode in modes)
    table = Table("mode", "frequency", *(["nodal diameters"] if revolved else []), "share of the contact's compliance")
    for number, mode in enumerate(modes, start=1):
        around = [] if not revolved else [f"{mode.diameters} {mode.family}".strip()]
        share = "rigid" if mode.frequency_hz == 0 else "" if math.isnan(mode.share) else percent(mode.share, 3)
        table.add_row(str(number), text(mode.frequency_hz, "Hz", 5), *around, share)
    return table


def kinds_table() -> Table:
    """Return what `seatfem init` can begin: kinds of bodies by groups, each with the first sentence of its description,
    and kinds of files beside scenes."""
    table = Table("", "kind", "what it is")
    groups: dict[str, dict[str, type]] = {
        group: {kind_of(each): each for each in kinds} for group, kinds in by_group(kinds_of()).items()
    }
    groups["other files"] = {each.name: type(each) for each in file_kinds()}
    for group, members in groups.items():
        for number, (name, each) in enumerate(members.items()):
            words = " ".join((inspect.getdoc(each) or "").replace("`", "").split())
            table.add_row("" if number else group, name, re.split(r"(?<=[a-z)])[.:;] ", words)[0].rstrip("."))
    return table


def doctor_table(checks: Sequence[Check]) -> Table:
    """Return a table of the components of the installation, with the remedy for each that is missing."""
    table = Table("", "", "state", "remedy")
    for check in checks:
        state = Text("ok") if check.ok else Text(*(("missing", "red") if check.required else ("gap", "yellow")))
        table.add_row(check.name, state, check.detail, "" if check.ok else check.remedy)
    return table


SHOWN: Final = 10
Records = Sequence[readings.Summary]


def landings_of(summary: readings.Summary) -> Records:
    """Return the records of the landings, the largest force above the static load first; empty for runs without any."""
    landings = summary.get("landings")
    records = [each for each in landings if isinstance(each, Mapping)] if isinstance(landings, list) else []
    return sorted(records, key=lambda each: -(readings.as_number(each.get(results.EXCESS)) or 0.0))


def landings_tables(records: Records, most: int = SHOWN) -> Iterator[Table]:
    """Yield a table of the first ``most`` records with error bars, and a caption on order and omissions; none without
    records."""
    if not records:
        return
    shown = records[:most]
    table = _records_table("landing")
    cut = (", cut off" if record.get("cut_off") is True else "" for record in shown)
    columns = [[f"{record.get('body')} {record.get('number')}{end}" for record, end in zip(shown, cut, strict=True)]]
    if any(places := [_place(record) for record in shown]):
        table.add_column("place")
        columns.append(places)
    numbers = _add_numbers(table, shown, results.OF_LANDINGS)
    columns += [[text.partition(" (")[0] for text in texts] for texts in numbers]  # landings.csv has the unknown, too
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    notes = ["landings sorted by their largest force"]
    if any(map(results.is_loaded, shown)):
        notes[0] += " above the static load; impulse of the force above the static load"
    if len(shown) < len(records):
        notes[0] += f"; {len(records) - len(shown)} more in {results.LANDINGS_FILE}"
    table.caption = "\n".join([*notes, *_bar_note(table)])
    yield table


def _records_table(*heads: str) -> Table:
    table = Table(*heads, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    return table


def _add_numbers(table: Table, records: Records, heads: Mapping[str, str]) -> Iterator[list[str]]:
    """Add a column in a unit of its own for each key of the ``heads``, those of a static load only where there is one,
    and yield the texts of the records' numbers with error bars."""
    loaded = any(map(results.is_loaded, records))
    for key, head in heads.items():
        if not loaded and key in (results.STATIC, results.EXCESS):
            continue
        values = [readings.as_number(record.get(key)) for record in records]
        stated = [readings.bar_of(record, key) for record in records]
        largest = (max((abs(each) for each in column if each), default=0.0) for column in (values, stated))
        factor, unit = readings.prefix_of(readings.unit_of(key), *largest)
        table.add_column(f"{head}\n[{plain(unit)}]" if unit else head, justify="right")
        yield [readings.write_with_bar(key, *each, "", factor) for each in zip(values, stated, strict=True)]


OF_LANDS: Final = (
    "lands in the hardest landing: the hardest landing on each alone; share: of the impulse on all of them; all round: "
    "every segment has touched; line force: largest mean over time and a part of the land"
)


def lands_tables(summary: readings.Summary) -> Iterator[Table]:
    """Yield a table of the lands of a seat with several in the hardest landing, with error bars, and tables of what
    each wing says of each land, as of the gas over it; none without a landing."""
    lands = lands_of(summary)
    if not any(each.get("order") for each in lands):
        return
    table = _records_table("land", "touched\nas", "at")
    table.caption = OF_LANDS
    order = [readings.as_number(each.get("order")) for each in lands]
    columns = [[str(each.get("land")) for each in lands], ["-" if each is None else f"{each:.4g}" for each in order]]
    angles = [readings.as_number(each.get("land_deg")) for each in lands]
    columns.append([readings.with_unit("-" if each is None else f"{each:.4g}", readings.DEGREES) for each in angles])
    columns += _add_numbers(table, lands, results.OF_LANDS)
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    yield table
    for drive in drives():
        names = summary.get(f"{drive.table}_lands")
        if not isinstance(names, list) or not drive.land_rows:
            continue
        table = _records_table(f"{drive.table} over", *drive.land_rows.values())
        for number, name in enumerate(names, start=1):
            keys = [f"{drive.table}_land_{number}_{end}" for end in drive.land_rows]
            table.add_row(str(name), *(readings.reading(summary, key, readings.unit_of(key)) for key in keys))
        yield table


def _place(record: readings.Summary) -> str:
    """Return the place of first contact: a land and the angle about its centre, an angle, or a length along the lip;
    "" if it is not known."""
    if land := record.get("land"):
        about = readings.as_number(record.get("land_deg"))
        return str(land) + ("" if about is None else f", {readings.with_unit(f'{about:.4g}', readings.DEGREES)}")
    if (angle := readings.as_number(record.get("place_deg"))) is not None:
        return readings.with_unit(f"{angle:.4g}", readings.DEGREES)
    along = readings.as_number(record.get("place_m"))
    return "" if along is None else readings.write_with_bar("place_m", along, None, "m")


ANGLES: Final = (
    "angles: 0 deg is the x axis, along the reed to its tip; anticlockwise, seen from the reed onto the seat"
)
LENGTHS: Final = "places: along the lip, a ring from its own x axis anticlockwise, a strip from its end at the lesser x"


def result_table(summary: readings.Summary, *, short: bool = False) -> Table:
    """Return the measures of a run beside those of the spring baseline (the summary's keys with the prefix spring_).

    The measures by which the run is judged come first: those of the landing, unless the whole run was requested. Values
    that depend on the time step come last, marked as such. Every number with an error bar in the summary shows it.
    Where seat and baseline are the same spring, the columns of the baseline are left out. ``short``: the closing speed,
    what is judged, and the margins alone, without differences and notes.
    """
    target = readings.as_number(summary.get("accuracy_target"))
    aim = "uncertainty" if target is None else f"uncertainty\n(asked {percent(target, 3)})"
    seat = "seat (static)" if is_static(summary) else "seat"
    simple = "rigid" if is_free(summary) else "spring"
    heads = ("", seat, f"{simple}\nbaseline", f"{simple}\nagainst\nseat", "difference /\nuncertainty", aim)
    shown: Sequence[int] = (0, 1, 5) if is_baseline(summary) else (0, 1, 2, 5) if short else range(6)
    table = Table(*(heads[column] for column in shown), box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    table.columns[0].no_wrap = True
    for column in table.columns[1:-1]:
        column.justify = "right"
    for number, (group, rows) in enumerate(_rows(summary, short=short).items()):
        style = "dim" if group == "raw" else None
        if number:
            table.add_section()
        step = f", step {readings.duration(summary['time_step_s'])}" if "time_step_s" in summary else ""
        heading = which_landing(summary) if group == "landing" else results.HEADINGS[group].replace("{step}", step)
        table.add_row(heading, style=style or "bold")
        for row in rows:
            cells = (f" {results.words_of(row, summary)}", *_cells(_last_cycle(summary, row), row))
            table.add_row(*(cells[column] for column in shown), style=style)
    if not short and (residual := readings.as_number(summary.get("energy_residual"))) is not None:
        table.add_row(" energy balance error", percent(residual), style="dim")
    table.caption = None if short else "\n".join(_notes(summary, table)) or None
    return table


def is_baseline(summary: readings.Summary) -> bool:
    """Return whether the seat is the spring of the baseline, so that both have the same results."""
    keys = (results.PEAK, results.IMPULSE, results.CONTACTS)
    return is_static(summary) and all(summary.get(key) == summary.get(readings.SPRING + key) for key in keys)


def _rows(summary: readings.Summary, *, short: bool) -> dict[results.Group, list[results.Result]]:
    """Return the rows of a run by group; ``short``: the closing speed, what is judged, and margins, or without any of
    them those of the whole run."""
    groups, judged = results.rows_of(summary), {*results.asked(summary), "landing_closing_speed_m_per_s"}
    if not short:
        return groups
    chosen = {
        group: [row for row in rows if row.key in judged or row.key.endswith("_margin")]
        for group, rows in groups.items()
    }
    shown = {group: rows for group, rows in chosen.items() if rows}
    return shown or {group: rows for group, rows in groups.items() if group == "run"}


def _last_cycle(summary: readings.Summary, row: results.Result) -> readings.Summary:
    """Return the summary with the last number in place of a list of one per cycle."""
    if row.group != "cycle":
        return summary
    values = {name: summary[name] for name in (row.key, f"error_bar_{row.key}") if name in summary}
    return {name: value[-1] if isinstance(value, list) and value else value for name, value in values.items()}


def _bar_note(table: Table) -> Iterator[str]:
    """Yield what a bar that is a question mark means, if the table has one."""
    if any("± ?" in str(cell) for column in table.columns for cell in column.cells):
        yield "± ?: no uncertainty could be computed"


def _notes(summary: readings.Summary, table: Table) -> Iterator[str]:
    """Yield the notes below the table: averaging times, numbers without a bar, and why values are missing."""
    width, part = summary.get("line_force_width_s"), readings.as_number(summary.get("line_force_arc_m"))
    shown = [row for rows in results.rows_of(summary).values() for row in rows]
    if part is not None:
        yield f"per length: mean over {in_units(part, 'm')} of the lip, the force over {readings.duration(width)}, too"
    if any(row.group == "lip" and _is_angle(summary, row) for row in shown):
        yield ANGLES
    if any(row.key.endswith("_at_m") and not _find_land_places(summary, row) for row in shown if row.group == "lip"):
        yield LENGTHS
    if place := _most_stressed(summary):
        yield place
    if any(row.of_each_step and row.key in summary and readings.SPRING + row.key in summary for row in results.RESULTS):
        yield "raw: of single steps, not averaged" + "; the spring's depends on the step" * (not is_baseline(summary))
    yield from _bar_note(table)
    if unknown := str(summary.get("error_unknown") or ""):
        yield f"not included in the uncertainty: {', '.join(source_in_words(source) for source in unknown.split(', '))}"
    for key in results.list_missing(summary):
        yield f"{results.name_of(key, summary)}: asked for, but this run gives no value"


def _most_stressed(summary: readings.Summary) -> str:
    """Return place and time of the largest reed stress; "" if it is not known."""
    spots = summary.get("reed_stress_hot_spots")
    if not isinstance(spots, list) or not spots or not isinstance(spots[0], dict):
        return ""
    part, time = spots[0].get("part"), readings.as_number(spots[0].get("time_s"))
    return (
        f"largest reed stress: {part}, at {readings.duration(time)}"
        if isinstance(part, str) and time is not None
        else ""
    )


def _cells(summary: readings.Summary, row: results.Result) -> tuple[str, ...]:
    """Return value and bar, the baseline's value, their difference in per cent and bars, and the target's state."""
    if row.key == results.CONTACTS:
        return (
            _contacts(summary, ""),
            _contacts(summary, readings.SPRING) if readings.SPRING + results.CONTACTS in summary else "",
            *("",) * 3,
        )
    if on_lands := _find_land_places(summary, row):
        return (*on_lands, *("",) * 3)
    value, bar = readings.as_number(summary.get(row.key)), readings.bar_of(summary, row.key)
    first = readings.write_with_bar(row.key, value, bar, row.unit)
    if value is not None and (demand := readings.as_number(summary.get(row.demand))):
        first = f"{in_digits(value, 2)} (asked {in_digits(demand, 2)})"
    if readings.SPRING + row.key not in summary:
        return (first, "", "", "", _target(summary, row.key, value, bar))
    baseline, contrast = readings.as_number(summary.get(readings.SPRING + row.key)), difference(summary, row.key)
    return (
        first,
        _beside(baseline, value, bar, row, readings.bar_of(summary, readings.SPRING + row.key)),
        "" if contrast is None else percent(contrast.relative, sign=True),
        "" if contrast is None else count(contrast.bars),
        _target(summary, row.key, value, bar),
    )


def _is_angle(summary: readings.Summary, row: results.Result) -> bool:
    """Return whether a row of a lip shows an angle."""
    return bool(_find_land_places(summary, row)) or (row.key.endswith("_at_deg") and summary.get(row.key) is not None)


def _find_land_places(summary: readings.Summary, row: results.Result) -> tuple[str, ...]:
    """Return a place along the lip of a run and of its baseline as land and angle; none on a single land."""
    stem = row.key.removesuffix("at_m")
    if stem == row.key or not summary.get(f"{stem}land"):
        return ()
    return tuple(
        _place({key: summary.get(f"{run}{stem}{key}") for key in ("land", "land_deg")}) for run in ("", readings.SPRING)
    )


def _contacts(summary: readings.Summary, prefix: str) -> str:
    """Return the counts as "2 (landings 1), touches 7", those of a baseline as "2 (1), 7"."""
    contacts, landings, touches = (
        readings.as_number(summary.get(f"{prefix}{key}"))
        for key in (results.CONTACTS, "landing_count", f"{results.CONTACTS}_raw")
    )
    of_landings, of_touches = ("", "") if prefix else ("landings ", "touches ")
    several = "" if landings is None else f" ({of_landings}{landings:.0f})"
    closed = "" if touches is None else f", {of_touches}{touches:.0f}"
    return "-" if contacts is None else f"{contacts:.0f}{several}{closed}"


def _beside(
    baseline: float | None, value: float | None, bar: float | None, row: results.Result, own_bar: float | None
) -> str:
    """Return the baseline's value with its ``own_bar``, or in unit and decimals of a similar value of the seat."""
    if baseline is None:
        return "-"
    if own_bar is not None and not row.of_each_step:
        return readings.write_with_bar(row.key, baseline, own_bar, row.unit)
    far = value and baseline and not 0.1 < abs(baseline / value) < 1000
    like_the_seat = [] if value is None or far else [value, *([] if bar is None or not math.isfinite(bar) else [bar])]
    factor, unit = readings.prefix_of(row.unit, *like_the_seat, baseline)
    places = None if value is None or bar is None or far else readings.places_of(factor * value, factor * bar)
    mark = ", raw" if row.of_each_step else ""
    return readings.with_unit(readings.rounded(factor * baseline, places), unit) + mark


def _target(summary: readings.Summary, key: str, value: float | None, bar: float | None) -> str:
    """Return the relative bar of a judged value and whether it meets the target; "" for other values."""
    target = readings.as_number(summary.get("accuracy_target"))
    judged = key in results.asked(summary) and summary.get("accuracy_met", True) is not None
    if target is None or bar is None or not value or not judged:
        return ""
    if not readings.is_known(key, value, bar):
        return "not known, missed"
    share = bar / abs(value)
    return f"{percent(share)}, {'reached' if share <= target else 'missed'}"


FACE_COLUMNS = ("number", "surface", "area", "centre", "normal or axis", "radius", "colour", "name", "groups", "solid")
UNITS = ("", "", "mm^2", "mm", "", "mm", "red, green, blue", "", "", "")


def faces_table(part: cad.Part) -> Table:
    """Return a table of the faces, one per row; empty columns are omitted."""
    rows = [_face_cells(face, part) for face in part.faces]
    shown = [column for column in range(len(FACE_COLUMNS)) if any(row[column] for row in rows)]
    table = Table(*(_head(column, "({})") for column in shown))
    for row in rows:
        table.add_row(*(Text(row[column]) for column in shown))
    return table


def faces_csv(part: cad.Part) -> str:
    """Return the faces as comma-separated values, with all columns."""
    return csv_text(
        (_head(column, "[{}]") for column in range(len(FACE_COLUMNS))), (_face_cells(face, part) for face in part.faces)
    )


def solids_table(part: cad.Part) -> Table:
    """Return a table of the solids of a CAD file."""
    table = Table("solid", "name", "region", "volume (mm^3)", "centre (mm)")
    for solid in part.solids:
        centre = _triple([1e3 * c for c in solid.centre], 1e-4)
        table.add_row(str(solid.number), Text(solid.name), Text(solid.region), f"{1e9 * solid.volume:.5g}", centre)
    return table


def _head(column: int, brackets: str) -> str:
    return f"{FACE_COLUMNS[column]} {brackets.format(UNITS[column])}" if UNITS[column] else FACE_COLUMNS[column]


def _face_cells(face: cad.FoundFace, part: cad.Part) -> tuple[str, ...]:
    half_angle = 0.0 if face.axis is None else face.axis.half_angle
    direction = "" if face.axis is None else f"a {_triple(face.axis.direction, 1e-6)}"
    return (
        " = ".join(map(str, face.numbers)),
        f"cone of {math.degrees(half_angle):.4g} deg" if half_angle > 0 else face.kind.lower(),
        f"{1e6 * face.area:.5g}",
        _triple([1e3 * c for c in face.centre], 1e-4),
        direction if face.normal is None else f"n {_triple(face.normal, 1e-6)}",
        " to ".join(dict.fromkeys(f"{1e3 * radius:.5g}" for radius in face.ends)),
        ", ".join(map(str, face.colour[:3])),
        face.name,
        ", ".join(face.groups),
        ", ".join(map(str, face.solids)) if len(part.solids) > 1 else "",
    )


def _triple(values: Sequence[float], zero: float) -> str:
    """Return three values as text, round-off as zero."""
    return ", ".join(f"{value:.4g}" if abs(value) > zero else "0" for value in values)
