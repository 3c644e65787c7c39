"""Columns of CSV files in SI, and values between scattered points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from impact.files import csv_table, safe_files
from impact.greens.base import Array
from impact.notices import SeatfemError
from seatfem.units import UnitError, parse_quantity

if TYPE_CHECKING:
    from scipy.spatial import Delaunay

LARGEST: Final = 50 * safe_files.MB  # largest file


class ColumnsError(SeatfemError, ValueError):
    """A table that cannot be used; the message names file, line and remedy."""


def read_columns(path: Path, known: Mapping[str, str], needed: tuple[str, ...]) -> dict[str, Array]:
    """Return the columns of a CSV file, (n,) each, in SI.

    Args:
        path: CSV file; lines that begin with # are skipped.
        known: name -> dimension (`seatfem.units.DIMENSIONS`) of the permitted columns; "" for pure numbers.
        needed: names of the required columns.

    Raises:
        ColumnsError: an unknown or missing column, a missing unit, a row with other than finite numbers, or points
            x, y that lie on one line.
    """
    table = csv_table.read_csv(path, ColumnsError, most=LARGEST)
    wanted = ",".join(f"{name} [unit]" if dimension else name for name, dimension in known.items())
    if not table.rows:
        raise ColumnsError(f"{path}: no table; a header such as {wanted} and rows of numbers are needed")
    scales: dict[str, float] = {}
    for head in table.heads:
        if head.name not in known or head.name in scales or bool(head.unit) != bool(known[head.name]):
            raise ColumnsError(f"{path}:{table.head_line}: column {head.text[:80]!r}; known are {wanted}, once each")
        try:
            unit = csv_table.normal_unit(head.unit)
            scales[head.name] = parse_quantity(f"1 {unit}", known[head.name]) if unit else 1.0
        except UnitError as error:
            raise ColumnsError(f"{path}:{table.head_line}: column {head.text[:80]!r}: {error}") from error
    if missing := [name for name in needed if name not in scales]:
        raise ColumnsError(f"{path}:{table.head_line}: add a column {missing[0]}; the header is {table.header}")
    values = table.numbers()
    columns = {name: scale * values[:, k] for k, (name, scale) in enumerate(scales.items())}
    if {"x", "y"} <= columns.keys():
        points = np.column_stack([columns["x"], columns["y"], np.ones(len(values))])
        if np.linalg.matrix_rank(points) < 3:
            raise ColumnsError(f"{path}: its points lie on one line; three that do not are needed")
    return columns


def between(table: Mapping[str, Array], name: str, points: Array) -> Array:
    """Return the (n,) values of a column at points (n, 2), interpolated linearly in triangles; nan outside."""
    with threadpool_limits(limits=1, user_api="blas"):  # systems of 2 unknowns: 100 times slower with threads
        triangles = _triangulate(np.column_stack([table["x"], table["y"]]).tobytes())
        return np.asarray(scipy.interpolate.LinearNDInterpolator(triangles, table[name])(points))


@lru_cache(maxsize=2)
def _triangulate(points: bytes) -> Delaunay:
    """Return the triangles between points (n, 2)."""
    return scipy.spatial.Delaunay(np.frombuffer(points).reshape(-1, 2))
