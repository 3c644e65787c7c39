"""The lands of a seat with several: in which order one landing closes them, in a sentence and in a table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import plain
from seatfem import readings, results
from seatfem.study.scene.wings import drives_of_wings

TIME, DELAY, SPEED = "time_s", "after_first_s", "closing_speed_m_per_s"
NOTE: Final = (
    "lands in the hardest landing: the hardest landing on each alone; share: of the impulse on all of them; all round: "
    "every segment has touched; line force: largest mean over time and a part of the land"
)


def lands_of(summary: readings.Summary) -> list[readings.Summary]:
    """Return the records of the lands in the order of the drawing; none for a seat with a single land."""
    lands = summary.get("lands")
    return [each for each in lands if isinstance(each, Mapping)] if isinstance(lands, list) else []


def closing_order(summary: readings.Summary) -> str:
    """Return in which order the hardest landing closes the lands, with the times between and their error bars; "" for a
    seat with a single land, or without a landing."""
    lands = lands_of(summary)
    touched = sorted((each for each in lands if each.get("order")), key=lambda each: int(str(each["order"])))
    if not touched:
        return ""
    words = [f"{_name(touched[0])} closes first, at {_time(touched[0], TIME)}, {_speed(touched[0])}"]
    words += [_later(each) for each in touched[1:]]
    words += [f"{_name(each)} is not touched in this landing" for each in lands if not each.get("order")]
    sentence = "; ".join(words)
    return f"{sentence[:1].upper()}{sentence[1:]}."


def _name(land: readings.Summary) -> str:
    angle = readings.as_number(land.get("land_deg"))
    return str(land.get("land")) + ("" if angle is None else f" (at {angle:.4g} deg)")


def _time(land: readings.Summary, key: str) -> str:
    return readings.reading(land, key, results.unit_of(key))


def _speed(land: readings.Summary) -> str:
    return f"closing speed {_time(land, SPEED)}"


def _later(land: readings.Summary) -> str:
    """Return how much later a land closes; that the order is not known where the error bar is as large."""
    delay, bar = readings.as_number(land.get(DELAY)), readings.bar_of(land, DELAY)
    with_speed = _speed(land)
    if not delay:
        return f"{_name(land)} at the same time, {with_speed}"
    known = bar is not None and math.isfinite(bar)
    if known and bar is not None and bar >= delay:
        most = readings.in_text(DELAY, delay + bar, None, "s")
        return f"{_name(land)} within {most} of it, {with_speed}: which of them is earlier is not known"
    return f"{_name(land)} {_time(land, DELAY)} later, {with_speed}"


def lands_table(summary: readings.Summary) -> Table | None:
    """Return the table of the lands in the hardest landing, with error bars; ``None`` for a seat with a single land, or
    without a landing."""
    lands = lands_of(summary)
    if not any(each.get("order") for each in lands):
        return None
    table = Table("land", "closes\nas", "at", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify, table.caption = "left", NOTE
    columns = [[str(each.get("land")) for each in lands], [_number(each.get("order")) for each in lands]]
    columns.append([readings.with_unit(_number(each.get("land_deg")), readings.DEGREES) for each in lands])
    for key, head in _heads(lands):
        values = [readings.as_number(each.get(key)) for each in lands]
        stated = [readings.bar_of(each, key) for each in lands]
        largest = (max((abs(each) for each in column if each), default=0.0) for column in (values, stated))
        factor, unit = readings.prefix_of(results.unit_of(key), *largest)
        table.add_column(f"{head}\n[{plain(unit)}]" if unit else head, justify="right")
        columns.append([readings.in_text(key, *each, "", factor) for each in zip(values, stated, strict=True)])
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    return table


def drive_tables(summary: readings.Summary) -> Iterator[Table]:
    """Yield a table of what each wing says of each land of a seat with several, as of the gas over it."""
    for drive in drives_of_wings():
        names = summary.get(f"{drive.table}_lands")
        if not isinstance(names, list) or not drive.land_rows:
            continue
        table = Table(f"{drive.table} over", *drive.land_rows.values(), box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
        for number, name in enumerate(names, start=1):
            keys = [f"{drive.table}_land_{number}_{end}" for end in drive.land_rows]
            table.add_row(str(name), *(readings.reading(summary, key, results.unit_of(key)) for key in keys))
        yield table


def _heads(lands: list[readings.Summary]) -> Iterator[tuple[str, str]]:
    """Yield the keys of the columns and their heads, the static load only where there is one."""
    loaded = any(results.is_loaded(each) for each in lands)
    return (pair for pair in results.OF_LANDS.items() if loaded or pair[0] not in (results.STATIC, results.EXCESS))


def _number(value: object) -> str:
    number = readings.as_number(value)
    return "-" if number is None else f"{number:.4g}"
