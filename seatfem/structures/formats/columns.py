"""Tables in CSV files: a header of names with units, as in "x [mm],height [um]", and rows of numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from impact.files.input_files import MB, read_text
from impact.greens.base import Array
from seatfem.units import UnitError, parse_quantity

LARGEST: Final = 50 * MB
WIDEST: Final = 200  # characters of a column's name and unit
_HEADER: Final = re.compile(r"\s*(\w+)\s*(?:\[\s*([^\]]+?)\s*\]\s*)?")


class ColumnsError(ValueError):
    """A table that cannot be used; the message names file, line and remedy."""


def read_columns(path: Path, known: Mapping[str, str], needed: tuple[str, ...]) -> dict[str, Array]:
    """The columns of a CSV file, (n,) each, in SI.

    Args:
        path: of the file; lines that begin with # are left out.
        known: name -> dimension (`seatfem.units.DIMENSIONS`) of the columns that there may be; "" of pure numbers.
        needed: those that there must be.

    Raises:
        ColumnsError: another column, one that is missing or has no unit, a row that is no row of finite numbers.
    """
    text = read_text(path, LARGEST, ColumnsError)
    try:
        cells = list(enumerate(csv.reader(text.splitlines()), 1))
    except csv.Error as error:
        raise ColumnsError(f"{path}: no table: {error}; write rows of numbers") from None
    rows = [(n, row) for n, row in cells if row and not row[0].startswith("#")]
    wanted = ",".join(f"{name} [unit]" if dimension else name for name, dimension in known.items())
    if len(rows) < 2:
        raise ColumnsError(f"{path}: no table; a header such as {wanted} and rows of numbers are needed")
    scales: dict[str, float] = {}
    for cell in rows[0][1]:
        found = _HEADER.fullmatch(cell) if len(cell) <= WIDEST else None  # blanks take squares of time
        if not found or found[1] not in known or found[1] in scales or bool(found[2]) != bool(known[found[1]]):
            raise ColumnsError(f"{path}:{rows[0][0]}: column {cell[:WIDEST]!r}; known are {wanted}, once each")
        try:
            scales[found[1]] = parse_quantity(f"1 {found[2]}", known[found[1]]) if found[2] else 1.0
        except UnitError as error:
            raise ColumnsError(f"{path}:{rows[0][0]}: column {cell!r}: {error}") from error
    if missing := [name for name in needed if name not in scales]:
        raise ColumnsError(f"{path}:{rows[0][0]}: add a column {missing[0]}; the header is {','.join(rows[0][1])}")
    values = np.empty((len(rows) - 1, len(scales)))
    for k, (line, row) in enumerate(rows[1:]):
        told = repr(",".join(row)[:60])
        try:
            values[k] = np.array([float(cell) for cell in row]).reshape(len(scales))
        except ValueError:
            raise ColumnsError(f"{path}:{line}: {len(scales)} numbers are needed, found {told}") from None
        if not np.isfinite(values[k]).all():
            raise ColumnsError(f"{path}:{line}: {told}: the numbers must be finite")
    return {name: scale * values[:, k] for k, (name, scale) in enumerate(scales.items())}


def check_scattered(path: Path, table: Mapping[str, Array]) -> None:
    """Raise `ColumnsError` where the points x, y of a table lie on one line."""
    if np.linalg.matrix_rank(np.column_stack([table["x"], table["y"], np.ones_like(table["x"])])) < 3:
        raise ColumnsError(f"{path}: its points lie on one line; three that do not are needed")


def between(table: Mapping[str, Array], name: str, points: Array) -> Array:
    """(n,) of a column at points (n, 2), linear between the points x, y of a table; nan where these surround none."""
    from scipy.interpolate import LinearNDInterpolator  # of scattered points only

    return np.asarray(LinearNDInterpolator(np.column_stack([table["x"], table["y"]]), table[name])(points))
