"""The landings of a run as a table, the hardest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import plain
from seatfem.readings import DEGREES, Summary, as_number, bar_of, in_text, prefix_of, with_unit
from seatfem.results import EXCESS, LANDINGS_FILE, OF_LANDINGS, STATIC, is_loaded, unit_of

SHOWN: Final = 10
Records = Sequence[Summary]


def landings_of(summary: Summary) -> Records:
    """Return the records of the landings, the largest force above the static load first; none of runs without them."""
    landings = summary.get("landings")
    records = [each for each in landings if isinstance(each, Mapping)] if isinstance(landings, list) else []
    return sorted(records, key=lambda each: -(as_number(each.get(EXCESS)) or 0.0))


def landings_table(records: Records, most: int | None = SHOWN) -> Table | None:
    """Return the ``most`` first records, each number with its error bar; ``None`` without any. What else there is, the
    caption says; ``None`` for ``most``: all."""
    if not records:
        return None
    shown = records[:most]
    loaded = any(is_loaded(record) for record in shown)
    table = Table("landing", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    cut = (", cut off" if record.get("cut_off") is True else "" for record in shown)
    columns = [[f"{record.get('body')} {record.get('number')}{end}" for record, end in zip(shown, cut, strict=True)]]
    if any(places := [_place(record) for record in shown]):
        table.add_column("place")
        columns.append(places)
    for key, head in OF_LANDINGS.items():
        if loaded or key not in (STATIC, EXCESS):
            values = [as_number(record.get(key)) for record in shown]
            factor, unit = prefix_of(unit_of(key), max((abs(value) for value in values if value), default=0.0))
            table.add_column(f"{head}\n[{plain(unit)}]" if unit else head, justify="right")
            bars = (bar_of(record, key) for record in shown)
            columns.append([in_text(key, *each, "", factor) for each in zip(values, bars, strict=True)])
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    notes = ["landings sorted by their largest force"]
    if loaded:
        notes[0] += " above the static load; impulse of the force above the static load"
    if len(shown) < len(records):
        notes[0] += f"; {len(records) - len(shown)} more in {LANDINGS_FILE}"
    if any("± ?" in str(cell) for column in table.columns for cell in column.cells):
        notes.append("± ?: uncertainty not known")
    table.caption = "\n".join(notes)
    return table


def _place(record: Summary) -> str:
    """Return where the reed touches first: an angle, or a length along the lip; "" where none is known."""
    if (angle := as_number(record.get("place_deg"))) is not None:
        return with_unit(f"{angle:.4g}", DEGREES)
    along = as_number(record.get("place_m"))
    return "" if along is None else in_text("place_m", along, None, "m")
