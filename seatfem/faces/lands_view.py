"""The lands of a seat with several, as a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import plain
from seatfem import readings, results
from seatfem.study.answers.verdict import lands_of
from seatfem.study.scene.wings import drives

NOTE: Final = (
    "lands in the hardest landing: the hardest landing on each alone; share: of the impulse on all of them; all round: "
    "every segment has touched; line force: largest mean over time and a part of the land"
)


def lands_table(summary: readings.Summary) -> Table | None:
    """Return the table of the lands in the hardest landing, with error bars; ``None`` for a seat with a single land, or
    without a landing."""
    lands = lands_of(summary)
    if not any(each.get("order") for each in lands):
        return None
    table = Table("land", "touched\nas", "at", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify, table.caption = "left", NOTE
    columns = [[str(each.get("land")) for each in lands], [_number(each.get("order")) for each in lands]]
    columns.append([readings.with_unit(_number(each.get("land_deg")), readings.DEGREES) for each in lands])
    for key, head in _heads(lands):
        values = [readings.as_number(each.get(key)) for each in lands]
        stated = [readings.bar_of(each, key) for each in lands]
        largest = (max((abs(each) for each in column if each), default=0.0) for column in (values, stated))
        factor, unit = readings.prefix_of(readings.unit_of(key), *largest)
        table.add_column(f"{head}\n[{plain(unit)}]" if unit else head, justify="right")
        columns.append([readings.in_text(key, *each, "", factor) for each in zip(values, stated, strict=True)])
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    return table


def drive_tables(summary: readings.Summary) -> Iterator[Table]:
    """Yield a table of what each wing says of each land of a seat with several, as of the gas over it."""
    for drive in drives():
        names = summary.get(f"{drive.table}_lands")
        if not isinstance(names, list) or not drive.land_rows:
            continue
        table = Table(f"{drive.table} over", *drive.land_rows.values(), box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
        for number, name in enumerate(names, start=1):
            keys = [f"{drive.table}_land_{number}_{end}" for end in drive.land_rows]
            table.add_row(str(name), *(readings.reading(summary, key, readings.unit_of(key)) for key in keys))
        yield table


def _heads(lands: list[readings.Summary]) -> Iterator[tuple[str, str]]:
    """Yield the keys of the columns and their heads, the static load only where there is one."""
    loaded = any(results.is_loaded(each) for each in lands)
    return (pair for pair in results.OF_LANDS.items() if loaded or pair[0] not in (results.STATIC, results.EXCESS))


def _number(value: object) -> str:
    number = readings.as_number(value)
    return "-" if number is None else f"{number:.4g}"
