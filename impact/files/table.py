"""Tables of numbers as CSV files, and data as JSON has it."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from impact.files.atomic import write_whole
from impact.files.csv_table import read_csv

Row = Mapping[str, float]


def csv_text(heads: Iterable[object], rows: Iterable[Iterable[object]], digits: int | None = None) -> str:
    """Return heads and rows as comma-separated values: true and false as in JSON, an empty field for
    what is not known.

    ``digits``: of numbers with a point; ``None``: as many as bring them back as they were.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([_cell(value, digits) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: object, digits: int | None) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, float) and digits is not None:
        return f"{value:.{digits}g}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def write_csv(
    path: str | os.PathLike[str], heads: Iterable[object], rows: Iterable[Iterable[object]], digits: int | None = None
) -> Path:
    """Write what `csv_text` returns, whole or not at all, and return the path."""
    write_whole(path, csv_text(heads, rows, digits).encode("utf-8"))
    return Path(path)


def write_rows(path: str | os.PathLike[str], rows: Sequence[Mapping[str, object]]) -> None:
    """Write rows of equal keys, at least one, with numbers to 7 digits. The file is whole or absent."""
    write_csv(path, rows[0], ([str(v) if isinstance(v, bool) else v for v in row.values()] for row in rows), digits=7)


def read_rows(path: str | os.PathLike[str]) -> list[Row]:
    """Read rows of numbers only. Raises `ValueError` that names file and line."""
    table = read_csv(Path(path), ValueError)
    if table is None:
        return []
    names = [head.text for head in table.heads]
    return [dict(zip(names, map(float, row), strict=True)) for row in table.numbers()]


def without_nan(value: object) -> object:
    """Return mappings, lists and tuples within each other, every number that is not finite as ``None``: JSON has
    none."""
    if isinstance(value, Mapping):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
