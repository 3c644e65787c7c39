"""The landings of a run as a table, the hardest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.table import Table

from impact.quantities import plain, scaled
from seatfem.readings import DEGREES, Summary, as_number, bar_of, in_text, with_unit
from seatfem.results import EXCESS, OF_LANDINGS, STATIC, is_loaded, unit_of
from seatfem.study.runs.pipeline import LANDINGS_FILE

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
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    columns = [[_name(record) for record in shown]]
    table.add_column("landing")
    if any(places := [_place(record) for record in shown]):
        table.add_column("place")
        columns.append(places)
    for key, head in OF_LANDINGS.items():
        if loaded or key not in (STATIC, EXCESS):
            unit = unit_of(key)
            factor, prefixed = _prefix(shown, key, unit)
            table.add_column(f"{head}\n[{plain(prefixed)}]" if unit else head, justify="right")
            columns.append([_cell(record, key, factor) for record in shown])
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


def _name(record: Summary) -> str:
    """Return what is met, which landing on it, and whether the run ends in it."""
    return f"{record.get('body')} {record.get('number')}{', cut off' if record.get('cut_off') is True else ''}"


def _prefix(records: Records, key: str, unit: str) -> tuple[float, str]:
    values = [value for each in records if (value := as_number(each.get(key))) is not None]
    return scaled(values, unit) if unit else (1.0, "")


def _cell(record: Summary, key: str, factor: float) -> str:
    """Return a number in the unit of its column."""
    value, bar = as_number(record.get(key)), bar_of(record, key)
    if value is None:
        return "-"
    return in_text(key, value, bar, "", factor)


def _place(record: Summary) -> str:
    """Return where the reed touches first: an angle, or a length along the lip; "" where none is known."""
    for key, unit in (("place_deg", DEGREES), ("place_m", "m")):
        if (value := as_number(record.get(key))) is not None:
            return with_unit(f"{value:.4g}", unit) if unit == DEGREES else in_text(key, value, None, unit)
    return ""
