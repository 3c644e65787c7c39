"""The lands of a seat with several, as a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import plain
from seatfem import readings, results
from seatfem.study.answers.lands import lands_of

NOTE: Final = (
    "lands in the hardest landing: the hardest landing on each alone; share: of the impulse on all of them; all round: "
    "every segment has touched; line force: largest mean over time and a part of the land"
)


def lands_table(summary: readings.Summary) -> Table | None:
    """Return the table of the lands in the hardest landing, with error bars; ``None`` for a seat with a single land."""
    lands = lands_of(summary)
    if not lands:
        return None
    table = Table("land", "closes\nas", "at", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
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


def _heads(lands: list[readings.Summary]) -> Iterator[tuple[str, str]]:
    """Yield the keys of the columns and their heads, the static load only where there is one."""
    loaded = any(results.is_loaded(each) for each in lands)
    return (pair for pair in results.OF_LANDS.items() if loaded or pair[0] not in (results.STATIC, results.EXCESS))


def _number(value: object) -> str:
    number = readings.as_number(value)
    return "-" if number is None else f"{number:.4g}"
