"""Tables of numbers as CSV files, and data as JSON has it."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from impact.files.atomic import whole_file
from impact.files.csv_table import read_csv

Row = Mapping[str, float]


def write_rows(path: str | os.PathLike[str], rows: Sequence[Mapping[str, object]]) -> None:
    """Write rows of equal keys, at least one, with numbers to 7 digits. The file is whole or absent."""
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows([{k: f"{v:.7g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows])


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
