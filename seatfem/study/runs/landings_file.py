"""landings.csv: the landings of a run, one a line, as summary.json lists them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Final

LANDINGS_FILE: Final = "landings.csv"
HEADS: Final = ("body", "number", "time_s")
"""Columns of a run without any landing: the table is empty, and can be read."""


def landing_rows(landings: Sequence[Mapping[str, object]]) -> bytes:
    """Return the records of landings as CSV, a column for each of their keys, in the order in which they come.

    Numbers are written with all their digits, true and false as in JSON; a field is empty where nothing is known.
    """
    heads = list(dict.fromkeys(key for record in landings for key in record)) or HEADS
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([_field(record.get(key)) for key in heads] for record in landings)
    return text.getvalue().encode("utf-8")


def _field(value: object) -> str:
    """Return a value as text that is read back as it was."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)
